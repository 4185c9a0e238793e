# SPDX-License-Identifier: Apache-2.0
# Stubs of Vivado's commands, as UG835 has them: each prints itself with its arguments, a tab between, and refuses an
# option that the command has not, a file that is not there, and a cell that was not made.

namespace eval ipx {}
set cells {}
set cores 0

proc say {args} { puts "CALL\t[join $args \t]" }

# Checks options and the number of the others; flags take no value.
proc take {name options flags least most arguments} {
  set others {}
  for {set i 0} {$i < [llength $arguments]} {incr i} {
    set word [lindex $arguments $i]
    if {[lsearch -exact $flags $word] >= 0} {
      continue
    } elseif {[lsearch -exact $options $word] >= 0} {
      incr i
    } elseif {[regexp {^-[a-z]} $word]} {
      error "$name has no option $word"
    } else {
      lappend others $word
    }
  }
  if {[llength $others] < $least || [llength $others] > $most} {
    error "$name takes $least to $most arguments, not [llength $others]"
  }
  return $others
}

foreach {name options flags least most} {
  create_project {-part} {-force -in_memory} 0 2
  update_ip_catalog {} {-rebuild} 0 0
  close_project {} {-delete} 0 0
  create_bd_design {} {} 1 1
  assign_bd_address {} {} 0 1
  regenerate_bd_layout {} {} 0 0
  validate_bd_design {} {-force} 0 0
  save_bd_design {} {} 0 1
  connect_bd_net {-net} {} 2 99
  connect_bd_intf_net {-intf_net} {} 2 2
  make_bd_intf_pins_external {-name} {} 1 1
  apply_bd_automation {-rule -config} {} 1 1
  ipx::package_project {-root_dir -vendor -library -taxonomy} {-import_files -force} 0 0
  ipx::create_xgui_files {} {} 1 1
  ipx::update_checksums {} {} 1 1
  ipx::check_integrity {} {} 1 1
  ipx::save_core {} {} 1 1
  ipx::remove_bus_interface {} {} 2 2
  ipx::remove_memory_map {} {} 2 2
} {
  proc $name {args} [list apply {{name options flags least most} {
    upvar args args
    take $name $options $flags $least $most $args
    say $name {*}$args
  }} $name $options $flags $least $most]
}

# Commands that return what they made or found: its kind and its name.
foreach {name kind} {
  ipx::add_bus_interface bus
  ipx::add_memory_map map
  ipx::add_address_block block
  ipx::add_register register
  ipx::add_port_map port
  ipx::add_bus_parameter parameter
} {
  proc $name {made parent} [list apply {{name kind} {
    upvar made made parent parent
    say $name $made $parent
    return $parent/$kind:$made
  }} $name $kind]
}

foreach {name kind} {
  ipx::get_bus_interfaces bus
  ipx::get_memory_maps map
  ipx::get_address_blocks block
} {
  proc $name {args} [list apply {{name kind} {
    upvar args args
    take $name {-of_objects} {} 0 1 $args
    set parent [lindex $args end]
    # What Vivado would infer: one of each.
    set wanted [lindex $args 0]
    return $parent/$kind:[expr {$wanted eq "-of_objects" ? "inferred" : $wanted}]
  }} $name $kind]
}

proc ipx::current_core {} { return core:$::cores }

proc add_files {args} {
  foreach file [take add_files {-fileset} {-norecurse} 1 999 $args] {
    if {[regexp {^wrapper:} $file]} continue
    if {![file exists $file]} { error "no file $file" }
    say add_files [file tail $file]
  }
}

proc set_property {args} {
  if {[lindex $args 0] eq "-dict"} {
    foreach {key value} [lindex $args 1] { say set_property $key $value [lindex $args 2] }
  } else {
    if {[llength $args] != 3} { error "set_property takes a name, a value and an object: $args" }
    if {[lindex $args 0] eq "supported_families" && [llength [lindex $args 1]] % 2} {
      error "supported_families are pairs of family and life cycle"
    }
    say set_property {*}$args
  }
}

proc get_property {name object} { return [lindex [split $object :] end] }
proc current_fileset {} { return fileset }
proc current_project {} { return project }
proc get_files {name} { return $name }
proc make_wrapper {args} {
  take make_wrapper {-files} {-top -force} 0 0 $args
  return wrapper:[lindex $args 1]
}

proc get_ipdefs {name} {
  if {![regexp {^[a-z.]+:ip:[a-z0-9_]+:\*$} $name]} { error "no definition $name" }
  return [list [string range $name 0 end-2]:1.0 [string range $name 0 end-2]:2.0]
}

proc create_bd_cell {args} {
  set name [take create_bd_cell {-type -vlnv} {} 1 1 $args]
  if {[lsearch -exact $::cells $name] >= 0} { error "two cells $name" }
  lappend ::cells $name
  say create_bd_cell $name [lindex $args 3]
  return $name
}

proc get_bd_cells {name} {
  if {[lsearch -exact $::cells $name] < 0} { error "no cell $name" }
  return $name
}

proc get_bd_pins {name} {
  get_bd_cells [lindex [split $name /] 0]
  return $name
}

proc get_bd_intf_pins {name} { return [get_bd_pins $name] }

# The rest are arguments of the script.
set argv [lassign $argv script]
source $script
