# SPDX-License-Identifier: Apache-2.0
"""FuseSoC's core files of the VHDL, from ``hdl/sources*.txt``: each holds what its tops need."""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.ise import option_folder
from plenofir.fpga.bitstream.ise_project import project_tcl
from plenofir.fpga.constraints import Constraints, Language, crossings_of
from plenofir.fpga.devices import DEVICES
from plenofir.ground import project
from plenofir.plan.configure import needed_sources

ROOT = project.root()

HEAD = """\
CAPI=2:
# Built by scripts/build_hdl.py from hdl/sources*.txt and scripts/core_files.py.
"""

# Synthesis of an example by vendors' tools, a device for each. Edalize's flow for Gowin ignores
# files of type VHDL-93: with the flag "plain" filesets have type VHDL, which is VHDL-93 there.
# Not a core with generics: a SHIFTS with blanks does not reach Vivado and Quartus intact.
SYNTH = """\
  synth:
    <<: *default
    description: {built}, by --tool ise, vivado, quartus, radiant or diamond
    filesets_append: [example]
    default_tool: ise
    tools:
      ise:
        family: Spartan6
        device: xc6slx45
        package: csg324
        speed: "-3"
      vivado:
        part: {vivado}
        pnr: none
      quartus:
        family: Cyclone V
        device: {quartus}
        pnr: none
      radiant:
        part: {radiant}
      diamond:
        part: {diamond}
    toplevel: {top}

  gowin:
    <<: *default
    description: {built}, a project for Gowin EDA
    filesets_append: [plain_example]
    flow: gowin
    flow_options:
      part: {gowin}
    flags: {{plain: true}}
    toplevel: {top}
"""

# Replacement of both for the target "gowin", and how a core selects it.
PLAIN = """\
  plain_rtl:
    <<: *rtl
    file_type: vhdlSource
  plain_example:
    <<: *example
    file_type: vhdlSource
"""
CHOICE = '["!plain? (rtl)", "plain? (plain_rtl)"{more}]'

# ISE's options for the refocuser, and so for every core that depends on it.
XST_OPTIONS = option_folder() / "xst.tcl"
ISE = """\
  ise:
    files:
      - {path}: {{file_type: tclSource}}
"""

# Constraints of the video path's crossings, for designs that contain the whole of it: the example
# has one clock, and ISE refuses patterns that match nothing.
CROSSINGS = """\
  crossings:
    files:
{files}
"""
# By the flag that stands for the tool.
_CONSTRAINTS: Mapping[Language, tuple[str, str]] = {
    "xdc": ("tool_vivado", "xdc"),
    "quartus-sdc": ("tool_quartus", "SDC"),
    "radiant-pdc": ("tool_radiant", "PDC"),
    "lpf": ("tool_diamond", "LPF"),
    "ucf": ("tool_ise", "UCF"),
    "gowin-sdc": ("plain", "SDC"),
}
_FASTEST_MHZ = 148.5

# Sources with an example design: the refocuser, the video path.
EXAMPLE = """\
name: plenofir:ip:{name}:{version}
description: {description}

filesets:
  rtl: &rtl
    file_type: vhdlSource-93
{depend}    files:
{rtl}
  example: &example
    file_type: vhdlSource-93
    files:
      - examples/vhdl/{top}.vhd
{plain}{crossings}  bench:
    file_type: vhdlSource-93
    files:
      - examples/vhdl/definition_pkg.vhd
      - examples/vhdl/tb_{top}.vhd

targets:
  default: &default
    filesets: {choice}

  sim:
    <<: *default
    description: {what}, each pixel against the definition, in GHDL
    filesets_append: [example, bench]
    flow: sim
    flow_options:
      tool: ghdl
      sim_options: [--ieee-asserts=disable-at-0]
    toplevel: tb_{top}

{synth}"""

# Cores with registers, and a design with one on a Wishbone bus.
AXI = """\
name: plenofir:ip:axi:{version}
description: The cores with registers behind AXI4-Lite or Wishbone

filesets:
  rtl: &rtl
    file_type: vhdlSource-93
    depend: ["plenofir:ip:refocuser:{version}"]
    files:
{rtl}

  example: &example
    file_type: vhdlSource-93
    files:
      - examples/vhdl/refocuser_wishbone.vhd
{plain}
targets:
  default: &default
    filesets: {choice}

  elaborate:
    <<: *default
    description: Elaborates refocuser_axi in GHDL
    flow: sim
    flow_options:
      tool: ghdl
      sim_options: [-gMICRO_IMAGE_SIZE=5, -gSHIFTS=2, --no-run]
    toplevel: refocuser_axi

{synth}"""

ATLYS = """\
name: plenofir:board:atlys:{version}
description: Digilent Atlys - HDMI in, refocused HDMI out

filesets:
  rtl:
    file_type: vhdlSource-93
    depend: ["plenofir:ip:video:{version}"]
    files:
{rtl}
  components:
    file_type: vhdlSource-93
    logical_name: unisim
    files:
{components}
  pins:
    files:
      - constraints/atlys.ucf: {{file_type: UCF}}

targets:
  default: &default
    filesets: [rtl]

  elaborate:
    <<: *default
    description: Elaborates the board in GHDL, without models of its primitives
    filesets_append: [components]
    flow: sim
    flow_options:
      tool: ghdl
      run_options: [-Wno-binding]
      sim_options: [--no-run]
    toplevel: atlys_top

  synth:
    <<: *default
    description: A bitstream with ISE 14.7; make bitstream also checks timing and warnings
    filesets_append: [pins]
    default_tool: ise
    tools:
      ise:
        family: Spartan6
        device: xc6slx45
        package: csg324
        speed: "-3"
    toplevel: atlys_top
"""

ULX3S = """\
name: plenofir:board:ulx3s_self_test:{version}
description: Radiona ULX3S - the refocuser tests itself, LEDs tell

filesets:
  rtl:
    file_type: vhdlSource-93
    depend: ["plenofir:ip:refocuser:{version}"]
    files:
{rtl}
  bench:
    file_type: vhdlSource-93
    files:
      - examples/vhdl/tb_self_test.vhd
  pins:
    files:
      - constraints/ulx3s_self_test.lpf: {{file_type: LPF}}

parameters:
{parameters}
targets:
  default: &default
    filesets: [rtl]

  sim:
    <<: *default
    description: The right signature passes and a wrong one does not, in GHDL
    filesets_append: [bench]
    flow: sim
    flow_options:
      tool: ghdl
      sim_options: [--ieee-asserts=disable-at-0]
    toplevel: tb_self_test

  synth:
    <<: *default
    description: A bitstream with Lattice Diamond; make pnr builds one with open tools
    filesets_append: [pins]
    default_tool: diamond
    tools:
      diamond:
        part: LFE5U-45F-6BG381C
    parameters: [{names}]
    toplevel: self_test
"""

# The design of `make pnr`: its size, and so its signature, are in the bitstream.
SELF_TEST_ROWS = 48


def _needed(*tops: str) -> list[Path]:
    """Sources of tops in order of analysis, their own included."""
    sources = hdl.all_sources()
    needed = {source for source in sources if source.stem in tops}
    for top in tuple(needed):
        needed |= set(needed_sources(top.read_text(), top.stem, sources))
    return [source for source in sources if source in needed]


def _listed(paths: Iterable[Path], without: Sequence[Path] = ()) -> str:
    return "\n".join(f"      - {p.relative_to(ROOT)}" for p in paths if p not in without)


def _synth(built: str, top: str) -> str:
    """Targets that synthesise an example design."""
    names = {
        "vivado": "xc7a35t",
        "quartus": "5ceba4",
        "radiant": "lifcl-40",
        "diamond": "lfe5u-45f",
        "gowin": "gw2ar-18",
    }
    parts = {tool: DEVICES[name].part for tool, name in names.items()}
    return SYNTH.format(built=built, top=top, **parts)


def _crossing_files(sources: Sequence[Path]) -> dict[Path, str]:
    """Constraints of the crossings in some sources, place to text: a file for each tool."""
    head = (
        "# SPDX-License-" + "Identifier: Apache-2.0\n"  # in two parts: see spdx.py
        f"# Clock crossings of the video path, for clocks of up to {_FASTEST_MHZ:g} MHz: see\n"
        "# docs/clock-crossings.md. Built by scripts/core_files.py.\n"
    )
    return {
        ROOT / "constraints" / f"video.{language.replace('-', '.')}": head
        + Constraints(crossings=crossings_of(sources), limit_mhz=_FASTEST_MHZ).text(language)
        for language in _CONSTRAINTS
    }


def core_files() -> dict[Path, str]:
    """Make the core files, place to text; they lie in the root, which FuseSoC wants.

    With them come the constraints that they name.
    """
    from plenofir.fpga.core.configuration import CoreConfiguration
    from self_test import self_test_generics

    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    core = _needed("raster_refocuser", "focal_stack", "depth_index")
    video = _needed("hdmi_refocuser")
    small = CoreConfiguration(micro_image_size=3, shifts=(1,), max_columns=64)
    generics = self_test_generics(small, SELF_TEST_ROWS)
    both = {"plain": PLAIN, "choice": CHOICE.format(more="")}
    with_ise = {"plain": PLAIN + ISE.format(path=XST_OPTIONS.relative_to(ROOT))}
    crossings = _crossing_files(video)
    of_tools = zip(crossings, _CONSTRAINTS.values(), strict=True)
    chosen = "\n".join(
        f'      - "{flag} ? ({path.relative_to(ROOT)})": {{file_type: {kind}}}'
        for path, (flag, kind) in of_tools
    )
    kinds = {str: "str", bool: "bool", int: "int"}
    parameters = [
        f"  {name}: {{datatype: {kinds[type(value)]}, default: {_yaml(value)}, "
        "paramtype: generic}\n"
        for name, value in generics.items()
    ]
    texts = {
        "refocuser": EXAMPLE.format(
            **with_ise,
            choice=CHOICE.format(more=', "tool_ise? (ise)"'),
            version=version,
            name="refocuser",
            description="Refocuses the raster scan of a light field, AXI4-Stream video on both "
            "sides",
            depend="",
            crossings="",
            rtl=_listed(core),
            top="refocus_button",
            what="The example design",
            synth=_synth("The example design", "refocus_button"),
        ),
        "video": EXAMPLE.format(
            plain=PLAIN,
            choice=CHOICE.format(more=', "crossings? (crossings)"'),
            crossings=CROSSINGS.format(files=chosen),
            version=version,
            name="video",
            description="Video path around the refocuser - TMDS decoding, timing, refocused video, "
            "TMDS encoding",
            depend=f'    depend: ["plenofir:ip:refocuser:{version}"]\n',
            rtl=_listed(video, core),
            top="pattern_video",
            what="A pattern through the video path",
            synth=_synth("The pattern and the video path", "pattern_video"),
        ),
        "axi": AXI.format(
            **both,
            version=version,
            rtl=_listed(
                _needed("refocuser_axi", "stack_axi", "sensor_axi", "wishbone_bridge"), core
            ),
            synth=_synth("The core on a Wishbone bus", "refocuser_wishbone"),
        ),
        "atlys": ATLYS.format(
            version=version,
            rtl=_listed(_needed("atlys_top"), [*core, *video]),
            components=_listed(p for p in hdl.model_sources() if p.stem == "vcomponents"),
        ),
        "ulx3s": ULX3S.format(
            version=version,
            rtl=_listed(_needed("self_test"), core),
            parameters="".join(parameters),
            names=", ".join(generics),
        ),
    }
    files = {ROOT / f"plenofir-{name}.core": HEAD + text for name, text in texts.items()}
    head = (
        "# SPDX-License-" + "Identifier: Apache-2.0\n"  # in two parts: see spdx.py
        "# The options of xst.opt for a project of ISE. Built by scripts/core_files.py.\n"
    )
    return files | crossings | {XST_OPTIONS: head + project_tcl()}


def _yaml(value: int | bool | str) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value).lower()
