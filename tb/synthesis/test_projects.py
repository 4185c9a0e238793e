# SPDX-License-Identifier: Apache-2.0
"""Projects for vendors' tools: their sources analyse in the order that the tool reads them."""

import os
import re
import subprocess
from pathlib import Path

import pytest

from plenofir.fpga.tools.simulators import find_simulator
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.project_files import TOOLS, tool_of, write_project

DEVICES = {
    "vivado": "xc7z020",
    "quartus": "5cseba6",
    "radiant": "lifcl-40",
    "gowin": "gw2ar-18",
    "ise": "xc6slx45",
}


@pytest.mark.parametrize("name", list(TOOLS))
def test_a_project_analyses(name: str, tmp_path: Path) -> None:
    plan = make_plan(load_scene("grey-microscope", DEVICES[name]))
    assert tool_of(plan, None)[0] == name
    folder = tmp_path / "project"
    files = write_project(plan, name, folder)
    assert all((folder / file).is_file() for file in files)
    # The order in the tool's own project file.
    texts = [p.read_text() for p in sorted(folder.iterdir()) if p.suffix == ".tcl"]
    project = next(text for text in texts if "math_pkg.vhd" in text)
    order = re.findall(r"([\w/]+\.vhd)", project)
    assert sorted(order) == sorted(path.name for path in folder.glob("*.vhd"))
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
    constraint = (folder / f"scene_top.{ending}").read_text()
    top = (folder / "scene_top.vhd").read_text()
    assert "clk" in constraint
    assert re.search(r"\bclk\s*: in\b", top)
    assert f"scene_top.{ending}" in project
    assert "never built" in (folder / "README").read_text()


def test_a_tool_of_another_family_is_refused() -> None:
    plan = make_plan(load_scene("grey-microscope", "xc7a35t"))
    with pytest.raises(InputError, match="Quartus Prime does not build for 7 series"):
        tool_of(plan, "quartus")
    with pytest.raises(InputError, match="'xst' is no tool; choose from vivado"):
        tool_of(plan, "xst")
    with pytest.raises(InputError, match="no vendor's tool"):
        tool_of(make_plan(load_scene("thesis-m3", "ccgm1a1")), None)


def test_a_board_is_no_project(tmp_path: Path) -> None:
    plan = make_plan(load_scene("rgb-720p"))
    with pytest.raises(InputError, match="make bitstream builds it"):
        write_project(plan, "ise", tmp_path / "out")
    assert not (tmp_path / "out").exists()
