# SPDX-License-Identifier: Apache-2.0
"""What commands say while they work, and of results that are no good."""

import re
import time
from pathlib import Path

import numpy as np
import pytest

from plenofir.commands.app import run
from plenofir.commands.console import steps_bar
from plenofir.ground.images import write_png


def test_a_line_for_each_step_without_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    with steps_bar("reading", 0.0) as show:
        for step, done in (("reading", 0), ("matching", 0), ("matching", 1), ("animating", 2)):
            show(step, done, 3)
    lines = capsys.readouterr().err.splitlines()
    assert [re.sub(r"^ *\d+ s  ", "", line) for line in lines][-3:] == [
        "reading (1 of 3)",
        "matching (1 of 3)",
        "animating (3 of 3)",
    ]


def test_a_step_without_progress_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with steps_bar("calibrating", 0.05):
        time.sleep(0.5)
    assert capsys.readouterr().err == "    0 s  calibrating\n"
    with steps_bar("calibrating", 60.0) as show:
        show("decoding", 0, 2)
    assert capsys.readouterr().err == ""


def test_a_step_that_lasts_says_how_far_it_is(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A batch is one step."""
    clock = iter(range(0, 1000, 4))
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    with steps_bar("developing", 1.0) as show:
        for done in range(9):
            show("developing", done, 9)
            show("developing", done, 9)
    lines = [line.partition("  developing")[2] for line in capsys.readouterr().err.splitlines()]
    assert lines[0] == " (1 of 9)"
    assert 3 < len(lines) == len(set(lines)) < 9


def test_depth_that_is_known_of_little(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Noise of each pixel's own: no depth, and a line that says so."""
    noise = np.random.default_rng(9).normal(128, 30, (150, 150))
    write_png(tmp_path / "noise.png", np.clip(noise, 0, 255).astype(np.uint8))
    words = [str(tmp_path / "noise.png"), "-M", "5", "--out", str(tmp_path / "out")]
    assert run(["depth-map", *words]) == 0
    said = capsys.readouterr().out
    assert "warning: depth is known of " in said
    assert "neighbouring views do not show one scene that moves" in said
