# SPDX-License-Identifier: Apache-2.0
"""The options of ``scripts/ise/xst.opt`` as properties of an ISE project, in its Tcl.

A project runs XST with the properties that it holds, so that its Tcl has to set each option that
``xst.opt`` has. The names are those of the Tcl that ISE 14 writes of its projects; the last of
them takes the options that have no property of their own, such as the limit of turns of a loop.
"""

from collections.abc import Mapping

from plenofir.fpga.bitstream.ise import xst_options
from plenofir.ground.errors import InputError

OTHER_OPTIONS = "Other XST Command Line Options"
PROCESS = "Synthesize - XST"
_PROPERTIES = {
    "-opt_mode": "Optimization Goal",
    "-opt_level": "Optimization Effort",
    "-keep_hierarchy": "Keep Hierarchy",
    "-netlist_hierarchy": "Netlist Hierarchy",
    "-hierarchy_separator": "Hierarchy Separator",
    "-bus_delimiter": "Bus Delimiter",
    "-case": "Case",
    "-iobuf": "Add I/O Buffers",
    "-bufg": "Number of Clock Buffers",
    "-fsm_extract": "FSM Encoding Algorithm",
    "-ram_extract": "RAM Extraction",
    "-ram_style": "RAM Style",
    "-rom_extract": "ROM Extraction",
    "-rom_style": "ROM Style",
    "-shreg_extract": "Shift Register Extraction",
    "-resource_sharing": "Resource Sharing",
    "-use_dsp48": "Use DSP Block",
    "-register_balancing": "Register Balancing",
    "-register_duplication": "Register Duplication",
    "-equivalent_register_removal": "Equivalent Register Removal",
    "-max_fanout": "Max Fanout",
    "-iuc": "Use Synthesis Constraints File",
    "-write_timing_constraints": "Write Timing Constraints",
    "-read_cores": "Read Cores",
}
_SWITCHES = (
    *("-iobuf", "-ram_extract", "-rom_extract", "-shreg_extract", "-resource_sharing", "-iuc"),
    *("-register_duplication", "-equivalent_register_removal", "-write_timing_constraints"),
    "-read_cores",
)
_TRUTHS = {"yes": "true", "no": "false"}
# Values that a property spells in another way than the option.
_SPELLED: Mapping[str, Mapping[str, str]] = {
    "-opt_level": {"1": "Normal", "2": "High"},
    "-netlist_hierarchy": {"as_optimized": "As Optimized", "rebuilt": "Rebuilt"},
    "-fsm_extract": {"no": "None", "yes": "Auto"},
    **dict.fromkeys(_SWITCHES, _TRUTHS),
}


def project_properties() -> dict[str, str]:
    """Properties of the process `PROCESS`: name to value, one for each option of ``xst.opt``.

    InputError for a value that the property does not take.
    """
    properties, others = dict[str, str](), list[str]()
    for option in xst_options():
        name, _, value = option.partition(" ")
        if name not in _PROPERTIES:
            others.append(option)
            continue
        spelled = _SPELLED.get(name, {value.lower(): value})
        if value.lower() not in spelled:
            raise InputError(
                f"{option!r}: a project takes {', '.join(spelled)} for it", where="xst.opt"
            )
        properties[_PROPERTIES[name]] = spelled[value.lower()]
    return properties | ({OTHER_OPTIONS: " ".join(others)} if others else {})


def project_tcl() -> str:
    """Tcl that sets the options in an open project."""
    return "".join(
        f'project set "{name}" "{value}" -process "{PROCESS}"\n'
        for name, value in project_properties().items()
    )
