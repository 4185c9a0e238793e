# SPDX-License-Identifier: Apache-2.0
"""Tcl for Vivado that packages the components of a scene."""

from collections.abc import Mapping, Sequence

from plenofir.plan.ip.components import (
    LIBRARY,
    REGISTERS,
    REGISTERS_BYTES,
    VENDOR,
    Component,
    registers,
)
from plenofir.plan.ip.ipxact import BUS_VENDOR, BUS_VERSION, BUSES

NEVER_RUN = (
    "# Written by plenofir project without Vivado, and never run in it. Checked with stubs of its\n"
    "# commands: syntax, commands and their options, every name of the cores' ports.\n"
)
_HEAD = """
set here [file dirname [file normalize [info script]]]

proc interface {core name bus mode ports parameters} {
  set found [ipx::add_bus_interface $name $core]
  set_property bus_type_vlnv $bus:%(version)s $found
  set_property abstraction_type_vlnv ${bus}_rtl:%(version)s $found
  set_property interface_mode $mode $found
  foreach {logical physical} $ports {
    set_property physical_name $physical [ipx::add_port_map $logical $found]
  }
  foreach {parameter value} $parameters {
    set_property value $value [ipx::add_bus_parameter $parameter $found]
  }
}

proc register {core memory name address description} {
  set map [ipx::get_memory_maps $memory -of_objects $core]
  set found [ipx::add_register $name [ipx::get_address_blocks %(block)s -of_objects $map]]
  set_property address_offset $address $found
  set_property size 32 $found
  set_property description $description $found
}

proc memory {core name} {
  set map [ipx::add_memory_map $name $core]
  set_property slave_memory_map_ref $name [ipx::get_bus_interfaces $name -of_objects $core]
  set block [ipx::add_address_block %(block)s $map]
  set_property usage register $block
  set_property base_address 0 $block
  set_property range %(range)s $block
  set_property width 32 $block
}

proc begin {name entity title version files} {
  global here
  create_project -force $name $here/build/$name -part %(part)s
  foreach file $files {
    add_files -norecurse $here/$file
  }
  set_property top $entity [current_fileset]
  ipx::package_project -root_dir $here/%(out)s/$name -vendor %(vendor)s -library %(library)s \\
    -taxonomy /UserIP -import_files -force
  set core [ipx::current_core]
  set_property name $name $core
  set_property version $version $core
  set_property display_name $title $core
  set_property description $title $core
  # What Vivado made of the names by itself; it is said below.
  foreach found [ipx::get_bus_interfaces -of_objects $core] {
    ipx::remove_bus_interface [get_property name $found] $core
  }
  foreach found [ipx::get_memory_maps -of_objects $core] {
    ipx::remove_memory_map [get_property name $found] $core
  }
  return $core
}

proc finish {core} {
  ipx::create_xgui_files $core
  ipx::update_checksums $core
  ipx::check_integrity $core
  ipx::save_core $core
  close_project
}
"""
CATALOG = "ip"
"""Folder of the packaged components, beside the script."""


def word(text: object) -> str:
    """A word of Tcl, whatever is in it."""
    escaped = "".join(f"\\{c}" if c in '\\"$[]{}' else c for c in str(text))
    return f'"{escaped}"'


def package_script(
    components: Sequence[Component], files: Mapping[str, Sequence[str]], part: str, version: str
) -> str:
    """Script that packages components; `files` are the VHDL of each, in order of analysis."""
    values = {
        "version": BUS_VERSION,
        "block": REGISTERS,
        "range": REGISTERS_BYTES,
        "part": part,
        "out": CATALOG,
        "vendor": VENDOR,
        "library": LIBRARY,
    }
    lines = [
        f"{NEVER_RUN}#\n# vivado -mode batch -source package_ip.tcl packages the components into "
        f"the folder {CATALOG}.\n{_HEAD % values}"
    ]
    # Vivado's versions have two numbers, and a revision.
    short = ".".join(version.split(".")[:2])
    for component in components:
        listed = " \\\n  ".join(files[component.name])
        lines += [
            f"set core [begin {component.name} {component.entity} {word(component.title)} {short} "
            f"[list \\\n  {listed}]]"
        ]
        for interface in component.interfaces:
            library, name = BUSES[interface.bus]
            ports = " ".join(f"{logical} {port.name}" for logical, port in interface.ports.items())
            parameters = " ".join(f"{k} {v}" for k, v in interface.parameters.items())
            lines.append(
                f"interface $core {interface.name} {BUS_VENDOR}:{library}:{name} {interface.mode} "
                f"{{{ports}}} {{{parameters}}}"
            )
            if interface.bus == "aximm":
                lines.append(f"memory $core {interface.name}")
                lines += [
                    f"register $core {interface.name} {r.name} {r.address} {word(r.description)}"
                    for r in registers()
                ]
        lines += ["finish $core", ""]
    return "\n".join(lines)
