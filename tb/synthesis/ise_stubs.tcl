# SPDX-License-Identifier: Apache-2.0
# Stubs of the commands of ISE's xtclsh (its reference is in the ISE help, "Tcl commands"): each prints itself with its
# arguments, a tab between, and refuses a command, property, value or file that is not there.

proc say {args} { puts "CALL\t[join $args \t]" }

# Properties of synthesis in the Tcl that ISE 14 writes of its projects, and their values: some words, or a pattern.
set truth {^(true|false)$}
array set properties [list \
  "Optimization Goal" {^(Speed|Area)$} "Optimization Effort" {^(Normal|High|Fast)$} "Keep Hierarchy" {^(No|Yes|Soft)$} \
  "Netlist Hierarchy" {^(As Optimized|Rebuilt)$} "Hierarchy Separator" {^[/_]$} "Bus Delimiter" {^(<>|\[\]|\{\}|\(\))$} \
  "Case" {^(Maintain|Lower|Upper)$} "Number of Clock Buffers" {^\d+$} "Max Fanout" {^\d+$} \
  "FSM Encoding Algorithm" {^(Auto|One-Hot|Compact|Sequential|Gray|Johnson|User|Speed1|None)$} \
  "RAM Style" {^(Auto|Distributed|Block)$} "ROM Style" {^(Auto|Distributed|Block)$} \
  "Use DSP Block" {^(Auto|Automax|Yes|No)$} "Register Balancing" {^(No|Yes|Forward|Backward)$} \
  "Other XST Command Line Options" {^(-[a-z_]+ \S+ ?)*$} \
]
foreach name {
  "Add I/O Buffers" "RAM Extraction" "ROM Extraction" "Shift Register Extraction" "Resource Sharing"
  "Register Duplication" "Equivalent Register Removal" "Use Synthesis Constraints File" "Write Timing Constraints"
  "Read Cores"
} {
  set properties($name) $truth
}
array set basic {
  family {^Spartan6$} device {^xc6slx\d+t?$} package {^(csg|fgg|ftg|tqg|cpg)\d+$} speed {^-(2|3|3N|1L)$} top {^\w+$}
  "Generate Detailed MAP Report" {^true$}
}
set opened 0

proc project {command args} {
  if {$command eq "new" && [llength $args] == 1} {
    set ::opened 1
  } elseif {$command ne "set"} {
    error "project has no command $command $args"
  } else {
    if {!$::opened} { error "no project is open" }
    lassign $args name value option process
    if {[llength $args] == 4 && $option eq "-process" && $process eq "Synthesize - XST"} {
      upvar #0 properties known
    } elseif {[llength $args] == 2} {
      upvar #0 basic known
    } else {
      error "project set takes a name, a value, and the process of a property: $args"
    }
    if {![info exists known($name)]} { error "no property $name" }
    if {![regexp -nocase $known($name) $value]} { error "the property $name takes no $value" }
  }
  say project $command {*}$args
}

proc xfile {command file args} {
  if {$command eq "get"} { error "not in the project: $file" }
  if {$command ne "add" || ([llength $args] != 0 && [lindex $args 0] ne "-lib_vhdl")} {
    error "xfile has no command $command $args"
  }
  if {![file exists $file]} { error "no file $file" }
  say xfile add $file {*}$args
}

proc lib_vhdl {command library} {
  if {$command ne "new"} { error "lib_vhdl has no command $command" }
  say lib_vhdl new $library
}

lassign $argv script
cd [file dirname $script]
source [file tail $script]
