# SPDX-License-Identifier: Apache-2.0
"""Projects of a scene's core for vendors' tools, which edalize writes."""

import importlib.util
import logging
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, get_args

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.ise_project import project_tcl
from plenofir.fpga.bitstream.top_level import board_generics, top_with_generics
from plenofir.fpga.constraints import Constraints, Language, crossings_of
from plenofir.fpga.devices import DEVICES, Device
from plenofir.fpga.families import FAMILIES, Family
from plenofir.fpga.synthesis.ecp5 import NAMES
from plenofir.fpga.tools.synthesis import write_verilog
from plenofir.ground.errors import InputError
from plenofir.ground.extras import missing
from plenofir.ground.files import publish_files
from plenofir.plan.configure import configure, needed_sources, refuse_board, top_of
from plenofir.plan.core_alone import (
    OUT_OF_CONTEXT,
    PINS_TOP,
    Way,
    pins_of,
    pins_text,
    virtual_pins,
)
from plenofir.plan.plan import Plan
from plenofir.plan.scene_top import TOP

ToolName = Literal["vivado", "quartus", "radiant", "diamond", "gowin", "ise", "gatemate", "trellis"]


PARALLEL = "parallel_top"
"""Top level with a camera's parallel output in and parallel video out."""
PARALLEL_BITS = range(8, 13)


@dataclass(frozen=True)
class Tool:
    """A vendor's tool."""

    title: str
    families: tuple[Family, ...]
    flow: bool  # whether edalize has it as a flow, or as one of its older tools
    # Suffix of the constraints file, its language, and edalize's type of it.
    constraints: tuple[str, Language, str]
    options: Callable[[Device], dict[str, Any]]
    run: str  # command that builds it, for the readme
    alone: Way = "pins"  # how it builds a core alone
    verilog: bool = False  # does not accept VHDL: GHDL converts it to Verilog


TOOLS: dict[str, Tool] = {
    "vivado": Tool(
        "AMD Vivado", ("series7", "usplus"), True, ("xdc", "xdc", "xdc"),
        lambda device: {"part": device.part}, "make", "context",
    ),
    "quartus": Tool(
        "Intel Quartus Prime", ("cyclonev",), False, ("sdc", "quartus-sdc", "SDC"),
        lambda device: {"family": FAMILIES[device.family].title, "device": device.part}, "make",
        "virtual",
    ),
    "radiant": Tool(
        "Lattice Radiant", ("nexus",), False, ("pdc", "radiant-pdc", "PDC"),
        lambda device: {"part": device.part}, "radiantc NAME.tcl, radiantc NAME_run.tcl",
    ),
    "diamond": Tool(
        "Lattice Diamond", ("ecp5",), False, ("lpf", "lpf", "LPF"),
        lambda device: {"part": device.part}, "diamondc NAME.tcl, diamondc NAME_run.tcl",
    ),
    "gowin": Tool(
        "Gowin EDA", ("gw1n", "gw2a", "gw5a"), True, ("sdc", "gowin-sdc", "SDC"),
        lambda device: {"part": device.part}, "make",
    ),
    "ise": Tool(
        "Xilinx ISE", ("spartan6",), False, ("ucf", "ucf", "UCF"),
        lambda device: {
            "family": "spartan6", "device": device.name, "package": device.package,
            "speed": f"-{device.grade}",
        }, "make",
    ),
    "gatemate": Tool(
        "Cologne Chip's toolchain (Yosys, p_r)", ("gatemate",), False, ("ccf", "ccf", "CCF"),
        lambda device: {"device": device.part}, "make", verilog=True,
    ),
    "trellis": Tool(
        "Yosys, nextpnr and Project Trellis", ("ecp5",), False, ("lpf", "lpf", "LPF"),
        lambda device: {"nextpnr_options": [
            f"--{NAMES[device.name]}", "--package", device.package.upper(), "--speed", device.grade,
            "--lpf-allow-unconstrained",
        ]}, "make", verilog=True,
    ),
}  # fmt: skip
"""Tools by the name that users type."""
assert set(TOOLS) == set(get_args(ToolName))


def tool_of(plan: Plan, name: str | None) -> tuple[str, Tool]:
    """The tool for a plan's device; InputError if there is none, or it is another device's."""
    if name is not None and name not in TOOLS:
        choices = ", ".join(TOOLS)
        raise InputError(f"{name!r} is not a tool; choose from {choices}, ipxact", where="tool")
    device = plan.chip
    fitting = [tool for tool, other in TOOLS.items() if device.family in other.families]
    title = FAMILIES[device.family].title
    chosen = name or fitting[0]
    if chosen not in fitting:
        fits = next(d.name for d in DEVICES.values() if d.family in TOOLS[chosen].families)
        raise InputError(
            f"{TOOLS[chosen].title} does not build for {title}; take another device, such as "
            f"--device {fits}, or --tool {fitting[0]}",
            where="tool",
        )
    if chosen == "trellis" and device.name not in NAMES:
        raise InputError(
            f"Project Trellis does not know the {device.title}; take --tool diamond", where="tool"
        )
    return chosen, TOOLS[chosen]


def _with_parallel_camera(plan: Plan, out: Path) -> list[Path]:
    """Sources of `PARALLEL` with a scene's core, in order of analysis; the top is in a folder."""
    core = plan.core
    grey = core.channels == 1 and core.pixels_per_clock == 1 and core.pixel_bits in PARALLEL_BITS
    if not grey or plan.sensor is not None:
        raise InputError(
            f"{PARALLEL} takes grey micro images of {min(PARALLEL_BITS)} to {max(PARALLEL_BITS)} "
            f"bits, one pixel a clock, unlike {plan.scene}",
            where="top",
        )
    generics = {**board_generics(core, PARALLEL), "ROWS": plan.rows}
    own = out / f"{PARALLEL}.vhd"
    own.write_text(top_with_generics(generics, PARALLEL), encoding="utf-8")
    return [*needed_sources(own.read_text(encoding="utf-8"), PARALLEL, hdl.all_sources()), own]


def write_project(plan: Plan, name: str, out: Path, *, parallel: bool = False) -> list[str]:
    """Write a project: VHDL, constraints, and the tool's files; all of it or nothing.

    `name`: a key of `TOOLS`. `parallel`: the top is `PARALLEL`, a whole design except for its pins.
    Returns the names of the files, the VHDL left out. InputError if edalize is not installed.
    """
    if importlib.util.find_spec("edalize") is None:
        raise missing("edalize")
    refuse_board(plan, vivado=True)
    from edalize.edatool import get_edatool
    from edalize.flows.gowin import Gowin
    from edalize.flows.vivado import Vivado

    # edalize warns that the tool is not installed, which is not needed here.
    logging.getLogger("edalize").setLevel(logging.CRITICAL)
    tool, device = TOOLS[name], plan.chip
    top = PARALLEL if parallel else PINS_TOP if tool.alone == "pins" else top_of(plan)
    with TemporaryDirectory(prefix="plenofir-") as work, TemporaryDirectory() as configured:
        folder = Path(work)
        files: list[dict[str, str]] = []
        sources = (_with_parallel_camera if parallel else configure)(plan, Path(configured))
        if top == PINS_TOP:
            sources = [*sources, Path(configured) / f"{PINS_TOP}.vhd"]
            sources[-1].write_text(pins_text(plan), encoding="utf-8")
        kind = "vhdlSource"
        constraints = Constraints({"clk": plan.built_mhz}, crossings_of(sources))
        if tool.verilog:
            kind = "verilogSource"
            sources = [write_verilog(sources, top, {}, Path(configured))]
        for source in sources:
            shutil.copy(source, folder / source.name)
            files.append({"name": source.name, "file_type": kind})
        ending, language, kind = tool.constraints
        text = constraints.text(language)
        if plan.path != "core":
            text = (Path(configured) / f"{top}.{ending}").read_text(encoding="utf-8")
        (folder / f"{top}.{ending}").write_text(text, encoding="utf-8")
        files.append({"name": f"{top}.{ending}", "file_type": kind})
        for script, text in _scripts(plan, name, top).items():
            (folder / script).write_text(text, encoding="utf-8")
            files.append({"name": script, "file_type": "tclSource"})
        edam: dict[str, Any] = {"name": top, "toplevel": top, "files": files}
        if tool.flow:
            flow = {"gowin": Gowin, "vivado": Vivado}[name]
            project = flow({**edam, "flow_options": tool.options(device)}, work)
            if tool.alone == "context" and top == TOP:
                # Out of context there is no bitstream to make.
                project.commands.set_default_target("synth")
            project.configure()
        else:
            edam["tool_options"] = {name: tool.options(device)}
            get_edatool(name)(edam, work).configure()
        names = [file["name"] for file in files]
        (folder / "README").write_text(
            _readme(plan, tool, top, names, constraints), encoding="utf-8"
        )
        publish_files(folder, out)
        sources_end = {".vhd", ".v"}
        return sorted(p.name for p in folder.iterdir() if p.suffix not in sources_end)


def _scripts(plan: Plan, name: str, top: str) -> dict[str, str]:
    """Tcl that a tool's project reads besides its sources: file name to text."""
    scripts = {"xst_options.tcl": project_tcl()} if name == "ise" else {}
    if top == TOP and TOOLS[name].alone == "context":
        scripts["out_of_context.tcl"] = OUT_OF_CONTEXT
    if top == TOP and TOOLS[name].alone == "virtual":
        scripts["virtual_pins.tcl"] = virtual_pins(plan)
    return scripts


def pins_note(plan: Plan) -> str:
    """A warning if a core alone has more ports than the usual package has pins; else empty."""
    if plan.path != "core":
        return ""
    needed, there = pins_of(plan), plan.chip.pins
    if not there or needed <= there:
        return ""
    return (
        f"the core has {needed} ports, the package of the {plan.chip.title} has {there} pins: "
        "it is for the inside of a design"
    )


_ALONE: dict[Way, str] = {
    "context": "synthesised out of context: make ends with its netlist,\nfor a "
    "design that instantiates it. There is no bitstream.",
    "virtual": "its streams are virtual pins, so that it is\nplaced and timed as a part of a "
    "design. Take virtual_pins.tcl away where ports get pins.",
    "pins": f"{TOP} is the core, and {PINS_TOP} is a\nwrapper that shifts its inputs in and "
    "combines its outputs, so that three pins are enough\nto place and time it. Instantiate "
    f"{TOP} in your own design in its place.",
}


def _readme(plan: Plan, tool: Tool, top: str, files: list[str], constraints: Constraints) -> str:
    crossings = ", ".join(map(str, constraints.crossings)) or "none; there is one clock"
    about = _ALONE[tool.alone]
    if note := pins_note(plan):
        about += f"\nNote: {note}."
    if top == PARALLEL:
        about = (
            "a whole design but for its pins: give its ports\nthose of the board before you "
            "build it; without them some tools write no bitstream."
        )
    if plan.path != "core":
        about = "the whole board, with its pins and clocks in the constraints."
    port = " at the port clk" if plan.path == "core" else " of a pixel"
    checked = (
        "It was written without that tool, and never built by it. Checked: the sources analyse in\n"
        "this order as VHDL-93; the constraints name a port of the top level and registers."
    )
    if tool.verilog:
        checked = (
            "The Verilog is what GHDL makes of the VHDL. The project itself was never built;\n"
            "make pnr of plenofir places the same core with Yosys and nextpnr."
        )
    return (
        f"{plan.scene} on the {plan.chip.title}, a project for {tool.title}.\n\n"
        f"{checked}\n\n"
        f"Build: {tool.run.replace('NAME', top)}\n"
        f"Top level: {top}; {about}\n"
        f"Clock: {plan.built_mhz:g} MHz{port}; part {plan.part}.\n"
        f"Paths between clocks, with limits of their own: {crossings}.\n\n"
        "Sources in order of analysis:\n" + "".join(f"  {name}\n" for name in files)
    )
