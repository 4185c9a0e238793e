# SPDX-License-Identifier: Apache-2.0
"""Sources of the bitstream in the order of ISE's project file, analysed and elaborated."""

from pathlib import Path

import pytest

from bitstream_check.checks import elaborate, source_of_line
from plenofir.commands.bitstream import scene_plan
from plenofir.fpga.bitstream.ise import xst_script
from plenofir.fpga.bitstream.top_level import TOP, project_lines, top_with_generics
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.ground import project
from plenofir.plan.configure import configure
from plenofir_tb.tools import or_skip
from xst_lint import lint, loop_limit


@pytest.fixture
def sources() -> list[Path]:
    with or_skip():
        find_simulator("ghdl")
    return [source_of_line(line) for line in project_lines()]


def test_package_after_its_users(sources: list[Path], tmp_path: Path) -> None:
    problems, counts = elaborate([*sources[1:], sources[0]], tmp_path)
    assert len(problems) == 1
    assert f'unit "{sources[0].stem}" not found' in problems[0]
    assert not counts


def test_source_missing(sources: list[Path], tmp_path: Path) -> None:
    gone = project.root() / "hdl" / "common" / "synchroniser.vhd"
    problems, _ = elaborate([path for path in sources if path != gone], tmp_path)
    assert len(problems) == 1
    assert 'unit "synchroniser" not found' in problems[0]


def test_newer_standard(sources: list[Path], tmp_path: Path) -> None:
    newer = tmp_path / "debouncer.vhd"
    old = next(path for path in sources if path.name == newer.name)
    newer.write_text(old.read_text().replace("process (clk)", "process (all)"))
    problems, _ = elaborate([newer if path == old else path for path in sources], tmp_path)
    assert len(problems) == 1
    assert str(newer) in problems[0]


def test_generics_out_of_range(sources: list[Path], tmp_path: Path) -> None:
    top = tmp_path / f"{TOP}.vhd"
    top.write_text(top_with_generics({"GUARD_BITS": 9}))
    problems, counts = elaborate([*sources[:-1], top], tmp_path)
    assert len(problems) == 1
    assert "GUARD_BITS exceeds FRACTION_BITS" in problems[0]
    assert not counts


def test_board_of_a_scene(sources: list[Path], tmp_path: Path) -> None:
    """The first scene for the board: elaborated as it is built, and within XST's rules."""
    written = configure(scene_plan("flower-480p", "atlys"), tmp_path / "scene")
    assert {f"{TOP}.vhd", "stored_pkg.vhd"} <= {path.name for path in written}
    problems, counts = elaborate(written, tmp_path)
    assert problems == []
    assert (counts["pll_adv"], counts["iserdes2"], counts["oserdes2"]) == (2, 6, 8)
    assert list(lint(written, loop_limit(xst_script()))) == []
