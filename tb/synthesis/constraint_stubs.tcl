# SPDX-License-Identifier: Apache-2.0
# Stubs of the commands of timing constraints: XDC (Vivado), SDC (Quartus, Gowin EDA), PDC (Radiant). Arguments are the
# language, a file of constraints, and a file of the design's objects, a line each: "port NAME", "register NAME". Each
# command refuses an option that the tool has not, and a pattern that matches nothing unless it says that it may.

lassign $argv language constraints objects
set names(port) {}
set names(register) {}
set file [open $objects]
foreach line [split [string trim [read $file]] \n] {
  lassign $line kind name
  # Vivado's registers end with _reg.
  lappend names($kind) [expr {$kind eq "register" && $language eq "xdc" ? "${name}_reg" : $name}]
}

proc matching {kind pattern may} {
  set found [lsearch -all -inline -glob $::names($kind) $pattern]
  if {$found eq "" && !$may} { error "no $kind matches $pattern" }
  return $found
}

proc get_ports {name} { return [matching port $name 0] }

proc found {command allowed arguments} {
  set may 0
  set rest {}
  while {$arguments ne ""} {
    set arguments [lassign $arguments word]
    if {![regexp {^-[a-z]} $word]} { lappend rest $word; continue }
    if {$word ni $allowed} { error "$command of $::language has no option $word" }
    if {$word in {-quiet -nowarn}} { set may 1 }
    if {$word eq "-filter"} {
      set arguments [lassign $arguments filter]
      if {![regexp {^NAME =~ (\S+)$} $filter -> pattern]} { error "a filter is NAME =~ pattern: $filter" }
      lappend rest $pattern
    }
  }
  if {[llength $rest] != 1} { error "$command takes one pattern: $rest" }
  lassign $rest pattern
  # A pin of a register: PRE, clrn, aclr.
  if {$command eq "get_pins"} { regsub {(\*?)[/|](PRE|clrn|aclr)$} $pattern {\1} pattern }
  return [matching register [string map {\[ \\\[ \] \\\]} $pattern] $may]
}

array set queries {
  xdc {get_cells {-hierarchical -filter -quiet} get_pins {-hierarchical -filter -quiet}}
  quartus-sdc {get_registers {-nowarn} get_keepers {-nowarn} get_pins {-compatibility_mode -nowarn}}
  gowin-sdc {get_regs {}}
  radiant-pdc {get_cells {-hierarchical}}
}
foreach {name allowed} $queries($language) {
  proc $name args [list apply {{name allowed} { upvar args args; found $name $allowed $args }} $name $allowed]
}

set between {-from -to}
array set commands {
  xdc {set_false_path {-from -to} set_max_delay {-from -to -datapath_only -quiet} set_bus_skew {-from -to}}
  gowin-sdc {set_false_path {-from -to} set_max_delay {-from -to}}
  radiant-pdc {set_false_path {-from -to} set_max_delay {-from -to -datapath_only}}
}
set commands(quartus-sdc) {
  set_false_path {-from -to} set_max_delay {-from -to} set_min_delay {-from -to}
  set_max_skew {-from -to -get_skew_value_from_clock_period -skew_value_multiplier}
  set_net_delay {-from -to -max -get_value_from_clock_period -value_multiplier}
}
foreach {name allowed} $commands($language) {
  proc $name args [list apply {{name allowed} {
    upvar args args
    foreach word $args {
      if {[regexp {^-[a-z]} $word] && $word ni $allowed} { error "$name of $::language has no option $word" }
    }
    puts "CALL\t$name"
  }} $name $allowed]
}

proc create_clock args {
  if {[llength $args] != 5 || [lindex $args 0] ne "-name" || [lindex $args 2] ne "-period"} { error "create_clock $args" }
  if {![string is double -strict [lindex $args 3]]} { error "a period in ns: $args" }
  puts "CALL\tcreate_clock"
}

source $constraints
