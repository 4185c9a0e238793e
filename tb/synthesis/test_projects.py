# SPDX-License-Identifier: Apache-2.0
"""Projects for vendors' tools: their sources analyse in the order that the tool reads them."""

import os
import re
import subprocess
from pathlib import Path

import pytest

from plenofir.fpga import devices
from plenofir.fpga.hdl_text import declarations
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.fpga.tools.synthesis import run_yosys
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import configure
from plenofir.plan.project_files import PARALLEL, TOOLS, tool_of, write_project

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
IN_VHDL = [name for name, tool in TOOLS.items() if not tool.verilog]
IN_VERILOG = [name for name, tool in TOOLS.items() if tool.verilog]


@pytest.mark.parametrize(
    ("name", "parallel"), [*((name, False) for name in IN_VHDL), ("gowin", True), ("ise", True)]
)
def test_a_project_analyses(name: str, parallel: bool, tmp_path: Path) -> None:
    plan = make_plan(load_scene("grey-microscope", DEVICES[name]))
    assert tool_of(plan, name)[0] == name
    folder, top = tmp_path / "project", PARALLEL if parallel else "scene_top"
    files = write_project(plan, name, folder, parallel=parallel)
    assert all((folder / file).is_file() for file in files)
    # The order in the tool's own project file.
    texts = [p.read_text() for p in sorted(folder.iterdir()) if p.suffix == ".tcl"]
    project = next(text for text in texts if "math_pkg.vhd" in text)
    order = re.findall(r"([\w/]+\.vhd)", project)
    assert sorted(order) == sorted(path.name for path in folder.glob("*.vhd"))
    assert order[-1] == f"{top}.vhd"
    simulator = find_simulator("ghdl", brief=True)
    done = subprocess.run(
        ["ghdl", "-a", "--std=93", f"--workdir={tmp_path}", *order],
        cwd=folder,
        env={**os.environ, **simulator.environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    ending = TOOLS[name].constraints[0]
    constraint = (folder / f"{top}.{ending}").read_text()
    assert "clk" in constraint
    assert re.search(r"\bclk\s*: in\b", (folder / f"{top}.vhd").read_text())
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
    simulator = find_simulator("ghdl", brief=True)
    for command in (["-a", *map(str, sources)], ["--elab-run", "scene_top", "--no-run"]):
        done = subprocess.run(
            ["ghdl", command[0], "--std=93", f"--workdir={tmp_path}", *command[1:]],
            cwd=tmp_path,
            env={**os.environ, **simulator.environment},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr


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
    assert "scene_top.v" in text
    assert f"scene_top.{TOOLS[name].constraints[0]}" in text
    assert ("--12k" if name == "trellis" else "-A 1") in text
    run_yosys(
        [
            "read_verilog scene_top.v",
            "hierarchy -check -top scene_top",
            "select -assert-count 1 scene_top/i:clk",
        ],
        tmp_path / "read.log",
    )


def test_a_board_is_no_project(tmp_path: Path) -> None:
    plan = make_plan(load_scene("rgb-720p"))
    with pytest.raises(InputError, match="make bitstream builds it"):
        write_project(plan, "ise", tmp_path / "out")
    assert not (tmp_path / "out").exists()
