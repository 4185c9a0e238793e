# SPDX-License-Identifier: Apache-2.0
# Packages the components of a scene (scene.tcl) for Vivado's catalog, into the folder ip beside this script:
#
#   vivado -mode batch -source package_ip.tcl
#
# This script was never run in Vivado. It is checked with stubs of Vivado's commands: syntax, commands and their
# options, every name of the cores' ports.

set here [file dirname [file normalize [info script]]]
source $here/scene.tcl

# An interface of a core, made of its ports: {logical physical ...}.
proc interface {core name mode bus ports parameters} {
  set made [ipx::add_bus_interface $name $core]
  set_property bus_type_vlnv $bus:1.0 $made
  set_property abstraction_type_vlnv ${bus}_rtl:1.0 $made
  set_property interface_mode $mode $made
  foreach {logical physical} $ports {
    set_property physical_name $physical [ipx::add_port_map $logical $made]
  }
  foreach {parameter value} $parameters {
    set_property value $value [ipx::add_bus_parameter $parameter $made]
  }
}

# The register map behind an interface of AXI4-Lite.
proc memory {core name registers bytes} {
  set map [ipx::add_memory_map $name $core]
  set_property slave_memory_map_ref $name [ipx::get_bus_interfaces $name -of_objects $core]
  set block [ipx::add_address_block registers $map]
  set_property usage register $block
  set_property base_address 0 $block
  set_property range $bytes $block
  set_property width 32 $block
  foreach {register about} $registers {
    lassign $about address description
    set made [ipx::add_register $register $block]
    set_property address_offset $address $made
    set_property size 32 $made
    set_property description $description $made
  }
}

foreach {name component} $components {
  create_project -force $name $here/build/$name -part $part
  foreach file [dict get $component files] {
    add_files -norecurse $here/$file
  }
  set_property top [dict get $component entity] [current_fileset]
  ipx::package_project -root_dir $here/ip/$name -vendor plenofir -library ip \
    -taxonomy /UserIP -import_files -force
  set core [ipx::current_core]
  set_property name $name $core
  set_property version $version $core
  set_property display_name [dict get $component title] $core
  set_property description [dict get $component title] $core
  # Plain VHDL: it fits every family that Vivado builds for.
  set_property supported_families {
    zynq Production artix7 Production kintex7 Production spartan7 Production virtex7 Production
    kintexu Production virtexu Production kintexuplus Production virtexuplus Production
    zynquplus Production artixuplus Production
  } $core

  # Vivado guesses interfaces from the names of ports; the scene's own replace them.
  foreach guessed [ipx::get_bus_interfaces -of_objects $core] {
    ipx::remove_bus_interface [get_property name $guessed] $core
  }
  foreach guessed [ipx::get_memory_maps -of_objects $core] {
    ipx::remove_memory_map [get_property name $guessed] $core
  }
  foreach {interface about} [dict get $component interfaces] {
    interface $core $interface {*}$about
    if {[string match *:aximm [lindex $about 1]]} {
      memory $core $interface $registers $registers_bytes
    }
  }

  ipx::create_xgui_files $core
  ipx::update_checksums $core
  ipx::check_integrity $core
  ipx::save_core $core
  close_project
}
