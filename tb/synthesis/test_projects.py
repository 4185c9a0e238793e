# SPDX-License-Identifier: Apache-2.0
"""Projects for vendors' tools: their sources analyse in the order that the tool reads them."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from plenofir.fpga import devices, hdl
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.hdl_text import declarations
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.fpga.tools.synthesis import run_yosys
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import configure
from plenofir.plan.core_alone import PINS_TOP, core_ports, pins_of
from plenofir.plan.project_files import PARALLEL, TOOLS, pins_note, tool_of, write_project

DEVICES = {
    "vivado": "xc7z020",
    "quartus": "5cseba6",
    "radiant": "lifcl-40",
    "gowin": "gw2ar-18",
    "diamond": "lfe5u-25f",
    "ise": "xc6slx45",
    "gatemate": "ccgm1a1",
    "trellis": "lfe5u-12f",
}
STUBS = Path(__file__).with_name("project_stubs.tcl")
STUBBED = ("vivado", "quartus", "radiant", "diamond", "gowin")
IN_VHDL = [name for name, tool in TOOLS.items() if not tool.verilog]
IN_VERILOG = [name for name, tool in TOOLS.items() if tool.verilog]


def run_scripts(tool: str, *scripts: Path) -> list[list[str]]:
    """Commands of a project's scripts to a tool."""
    tclsh = shutil.which("tclsh")
    if tclsh is None:
        pytest.skip("tclsh is not installed (scripts/setup.sh tests)")
    done = subprocess.run(
        [tclsh, str(STUBS), tool, *map(str, scripts)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return [line.split("\t")[1:] for line in done.stdout.splitlines() if line.startswith("CALL")]


def check_scripts(name: str, folder: Path, top: str) -> None:
    """The scripts that the project's Makefile or README runs, in their order."""
    endings = {"vivado": ("", "_synth", "_netlist"), "quartus": ("",), "gowin": ()}
    scripts = [folder / f"{top}{ending}.tcl" for ending in endings.get(name, ("", "_run"))]
    found = run_scripts(name, *(scripts or [folder / "edalize_gowin_template.tcl"]))
    words = [" ".join(call) for call in found]
    assert any(top in line for line in words)
    if name == "vivado":
        assert any("MORE OPTIONS" in line and "-mode out_of_context" in line for line in words)
        makefile = (folder / "Makefile").read_text()
        assert re.search(r"^all: synth$", makefile, re.M)
    if name == "quartus":
        virtual = {call[-1] for call in found if call[0] == "set_instance_assignment"}
        plan = make_plan(load_scene("grey-microscope", DEVICES[name]))
        assert len(virtual) == pins_of(plan) - 1
        assert "clk" not in virtual


@pytest.mark.parametrize(
    ("tool", "line", "message"),
    [
        ("vivado", "set_property STEPS.SYNTH.MORE x [get_runs synth_1]", "no property"),
        ("vivado", "read_vhdl missing.vhd", "no file missing.vhd"),
        ("quartus", "set_global_assignment -name VERILOG_TOP x", "no assignment VERILOG_TOP"),
        ("radiant", "prj_project new", "invalid command"),
        ("diamond", "prj_project make", "no command make"),
        ("gowin", "set_option -top scene_top", "no option -top"),
    ],
)
def test_the_stubs_refuse(tool: str, line: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "script.tcl").write_text(f"{line}\n")
    with pytest.raises(AssertionError, match=message):
        run_scripts(tool, tmp_path / "script.tcl")


def test_ports_beyond_the_package_are_noticed(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(STACK.replace("OUTPUT", "slices"))
    plan = make_plan(load_scene(file))
    assert pins_of(plan) == sum(max(bits, 1) for _, _, bits in core_ports(plan))
    note = pins_note(plan)
    assert note.startswith(
        f"the core has {pins_of(plan)} ports, the package of the XC7Z020 has 125"
    )
    write_project(plan, "vivado", tmp_path / "out")
    assert note in (tmp_path / "out" / "README").read_text()
    assert pins_note(make_plan(load_scene("grey-microscope", "xc7z020"))) == ""


def _ghdl(options: list[str], folder: Path, work: Path) -> None:
    simulator = find_simulator("ghdl", brief=True)
    done = subprocess.run(
        ["ghdl", options[0], "--std=93", f"--workdir={work}", f"-P{work}", *options[1:]],
        cwd=folder,
        env={**os.environ, **simulator.environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def _analysed(folder: Path, top: str, work: Path) -> str:
    """The text of the tool's own project file, in whose order the sources analyse."""
    texts = [p.read_text() for p in sorted(folder.iterdir()) if p.suffix == ".tcl"]
    project = next(text for text in texts if "math_pkg.vhd" in text)
    order = re.findall(r"([\w/]+\.vhd)", project)
    assert sorted(order) == sorted(path.name for path in folder.glob("*.vhd"))
    assert order[-1] == f"{top}.vhd"
    _ghdl(["-a", *order], folder, work)
    return project


@pytest.mark.parametrize(
    ("name", "parallel"), [*((name, False) for name in IN_VHDL), ("gowin", True), ("ise", True)]
)
def test_a_project_analyses(name: str, parallel: bool, tmp_path: Path) -> None:
    plan = make_plan(load_scene("grey-microscope", DEVICES[name]))
    assert tool_of(plan, name)[0] == name
    folder = tmp_path / "project"
    top = PARALLEL if parallel else PINS_TOP if TOOLS[name].alone == "pins" else "scene_top"
    files = write_project(plan, name, folder, parallel=parallel)
    assert all((folder / file).is_file() for file in files)
    project = _analysed(folder, top, tmp_path)
    ending = TOOLS[name].constraints[0]
    # The ports of the wrapper and of the scene fit.
    if top == PINS_TOP:
        _ghdl(["--elab-run", top, "--no-run"], folder, tmp_path)
    if name in STUBBED:
        check_scripts(name, folder, top)
    constraint = (folder / f"{top}.{ending}").read_text()
    assert "clk" in constraint
    assert re.search(r"\bclk +: in\b", (folder / f"{top}.vhd").read_text())
    # The reset of the camera's top comes from no clock.
    assert ("crossing_reset" in constraint) == parallel
    assert f"{top}.{ending}" in project
    readme = (folder / "README").read_text()
    assert "never built" in readme
    assert ("crossing_reset" if parallel else "none; there is one clock") in readme


STACK = """
name = "test"
[camera]
micro_image_size = 3
[frame]
columns = 48
rows = 33
colour = "rgb"
[depth]
slices = ["-1/3", "0", "2/3"]
[stack]
output = "OUTPUT"
[build]
pixels_per_clock = 2
device = "xc7z020"
"""


@pytest.mark.parametrize(
    "output", ["slices", 'all-in-focus"\nbetween_slices = true #', pytest.param("depth")]
)
def test_a_stack_elaborates(output: str, tmp_path: Path) -> None:
    """Widths of the streams between its entities, and of those that come out."""
    file = tmp_path / "scene.toml"
    file.write_text(STACK.replace("OUTPUT", output))
    sources = configure(make_plan(load_scene(file)), tmp_path / "out")
    _ghdl(["-a", *map(str, sources)], tmp_path, tmp_path)
    _ghdl(["--elab-run", "scene_top", "--no-run"], tmp_path, tmp_path)


def test_a_board_s_project_elaborates(tmp_path: Path) -> None:
    """With models in the place of the vendor's library, whose components have equal ports."""
    plan = make_plan(load_scene("pynqz2-720p"))
    folder, board = tmp_path / "project", BOARDS["pynqz2"]
    write_project(plan, "vivado", folder)
    _ghdl(["-a", "--work=unisim", *map(str, hdl.model_sources())], tmp_path, tmp_path)
    assert f"{board.top}.xdc" in _analysed(folder, board.top, tmp_path)
    _ghdl(["--elab-run", board.top, "--no-run"], tmp_path, tmp_path)
    constraints = (folder / f"{board.top}.xdc").read_text()
    assert "create_clock -name in_clk_p -period 13.4" in constraints
    assert "crossing_reset_reg" in constraints
    # The pin that chooses the timed clock has the names of its instances.
    place = re.search(r"get_pins (\w+)/(\w+)/CLKINSEL", constraints)
    assert place
    assert f"{place[1]} : entity work.link_clocks" in (folder / f"{board.top}.vhd").read_text()
    assert f"{place[2]} : component mmcme2_adv" in (folder / "link_clocks.vhd").read_text()


def test_a_device_of_many_boards_means_the_core() -> None:
    assert make_plan(load_scene("rgb-720p", "xc7z020")).path == "core"
    assert make_plan(load_scene("pynqz2-720p", "xc7z020")).path == "video"
    with pytest.raises(InputError, match="make bitstream builds it"):
        write_project(make_plan(load_scene("rgb-720p")), "ise", Path("none"))


def test_a_parallel_camera_has_its_scene(tmp_path: Path) -> None:
    plan = make_plan(load_scene("grey-microscope", "gw2ar-18"))
    write_project(plan, "gowin", tmp_path / "project", parallel=True)
    text = (tmp_path / "project" / "parallel_top.vhd").read_text()
    values = {d.name: d.default for d in declarations(text, "generic")}
    assert values["MICRO_IMAGE_SIZE"] == str(plan.core.micro_image_size)
    assert values["MAX_COLUMNS"] == str(plan.columns)
    assert (values["ROWS"], values["PIXEL_BITS"]) == (str(plan.rows), str(plan.core.pixel_bits))
    colour = make_plan(load_scene("rgb-720p", "xc7a35t"))
    with pytest.raises(InputError, match="grey micro images of 8 to 12 bits"):
        write_project(colour, "vivado", tmp_path / "out", parallel=True)
    assert not (tmp_path / "out").exists()


def test_a_tool_of_another_family_is_refused() -> None:
    plan = make_plan(load_scene("grey-microscope", "xc7a35t"))
    with pytest.raises(InputError, match="Quartus Prime does not build for 7 series"):
        tool_of(plan, "quartus")
    with pytest.raises(InputError, match="'xst' is not a tool; choose from vivado"):
        tool_of(plan, "xst")


def test_every_device_has_a_tool() -> None:
    first = {family: name for name, tool in reversed(TOOLS.items()) for family in tool.families}
    for device in devices.DEVICES.values():
        assert first[device.family] in TOOLS
    plan = make_plan(load_scene("thesis-m3", "ccgm1a1"))
    assert tool_of(plan, None)[0] == "gatemate"
    assert tool_of(make_plan(load_scene("thesis-m3", "lfe5u-85f")), None)[0] == "diamond"


@pytest.mark.parametrize("name", IN_VERILOG)
def test_a_project_in_verilog(name: str, tmp_path: Path) -> None:
    """Yosys reads what the project's scripts read, and finds the top and its clock."""
    plan = make_plan(load_scene("thesis-m3", DEVICES[name]))
    write_project(plan, name, tmp_path)
    text = "".join(p.read_text() for p in tmp_path.iterdir() if p.suffix in (".tcl", ".ys", ""))
    assert "scene_pins.v" in text
    assert f"scene_pins.{TOOLS[name].constraints[0]}" in text
    assert ("--12k" if name == "trellis" else "-A 1") in text
    run_yosys(
        [
            "read_verilog scene_pins.v",
            "hierarchy -check -top scene_pins",
            "select -assert-count 1 scene_pins/i:clk",
            "select -assert-count 3 scene_pins/x:*",
        ],
        tmp_path / "read.log",
    )


@pytest.mark.parametrize("scene", ["rgb-720p", "ulx3s-csi", "grey-microscope"])
def test_the_core_alone_of_any_scene(scene: str, tmp_path: Path) -> None:
    """`plenofir project` takes the core of a board's scene, on the board's device."""
    plan = make_plan(load_scene(scene, core=True))
    assert plan.path == "core"
    assert plan.device == load_scene(scene).scene.build.device
    name, tool = tool_of(plan, None)
    files = write_project(plan, name, tmp_path)
    assert f"scene_pins.{tool.constraints[0]}" in files


def test_a_board_is_no_project(tmp_path: Path) -> None:
    plan = make_plan(load_scene("rgb-720p"))
    with pytest.raises(InputError, match="make bitstream builds it"):
        write_project(plan, "ise", tmp_path / "out")
    assert not (tmp_path / "out").exists()
