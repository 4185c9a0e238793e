# SPDX-License-Identifier: Apache-2.0
"""A run through the whole board: serial TMDS bits in, refocused, serial TMDS bits out."""

import itertools
from math import gcd
from pathlib import Path

import numpy as np
import pytest
from in_process import plenofir

from plenofir.fpga.boards import BOARDS
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.hdmi.modes import HD720, VGA
from plenofir.fpga.screen.board_screen import SHADES, Screen
from plenofir.fpga.screen.first_light import FLOWER
from plenofir.fpga.simulate.chain import check_chain, mode_for, range_of, run_chain
from plenofir.fpga.simulate.report import ScreenReport, report_summary
from plenofir.fpga.simulate.request import Run, core_for_image
from plenofir.fpga.simulate.run import run
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.ground.errors import InputError
from plenofir.ground.images import read_image, write_png
from plenofir.plan.scene_screen import scene_overlay, slice_colours
from plenofir.refocus import ExactArithmetic, StoredProductArithmetic
from plenofir.refocus.arithmetic import Arithmetic
from plenofir_tb.runner import simulator_name


def flower(rows: int, columns: int) -> np.ndarray:
    """A part of the real light field, beginning with a whole micro image."""
    return read_image(FLOWER)[200 : 200 + rows, 100 : 100 + columns]


@pytest.mark.drawn(1, "chain runs")
@pytest.mark.parametrize("grey", [False, True])
def test_sweep_through_serial_bits(tmp_path: Path, grey: bool) -> None:
    raw = flower(25, 40)
    if grey:
        raw = raw[:, :, 1]
    write_png(tmp_path / "raw.png", raw)
    path = tmp_path / "raw.png"
    boxes = () if grey else (2, 5)
    what = Run(
        raw=path,
        core=core_for_image(path, "hdmi", micro_image_size=5, shifts=(-3, 0), boxes=boxes),
        out=tmp_path / "out",
        simulator=simulator_name(),
        chain="hdmi",
        waves="1" if grey and simulator_name() == "ghdl" else "0",
    )
    report = run(what)
    assert report.mismatches == 0
    assert report.pixels_compared == 2 * 25 * 40
    for a, shift, box in (("-3_5", -3, 5 if grey else 2), ("0", 0, 5)):
        shown = read_image(what.out / f"refocused_{a}.png")
        want = ExactArithmetic().refocus(raw, 5, shift=shift, box=box)
        if grey:
            want = np.repeat(want[:, :, np.newaxis], 3, axis=2)
        assert np.array_equal(shown, want)
    # D lines, D pixels, and the link's latency.
    line = mode_for(40, 25).h_total
    assert report.latency_clocks is not None
    assert 0 < report.latency_clocks - (10 if grey else 9) * (line + 1) < 100
    assert (what.out / "refocused.gtkw").exists() == (what.waves == "1")


@pytest.mark.drawn(1, "chain runs")
def test_sweep_through_the_ulx3s(tmp_path: Path) -> None:
    # In short; the list of cases of the Atlys is the ULX3S's too (tb/hdmi, slow).
    raw = flower(25, 40)
    path = tmp_path / "raw.png"
    write_png(path, raw)
    core = core_for_image(path, "hdmi", micro_image_size=5, shifts=(-3, 0))
    what = Run(raw=path, core=core, out=tmp_path / "out", chain="hdmi", board="ulx3s")
    report = run(what)
    assert (report.mismatches, report.board) == (0, "ulx3s")


def run_screen(
    folder: Path, screen: dict, size: tuple[int, int], m: int, shifts: tuple[int, ...], board: str
) -> ScreenReport:
    """Show all outputs of a screen through serial bits, selected over the serial port."""
    raw = flower(*size)
    path = folder / "raw.png"
    write_png(path, raw)
    engine = StackEngine(input_lines=m)
    # The smallest boxes; with a box in focus beside those of M samples.
    boxes = () if "sharp_box" in screen else tuple(gcd(shift, m) for shift in shifts)
    core = core_for_image(
        path, "hdmi", micro_image_size=m, shifts=shifts, boxes=boxes, engine=engine
    )
    shades = SHADES if screen.get("between") else 1
    colours = slice_colours(shifts, shades)
    shown = Screen(
        **{"outputs": "rad", "colours": colours, **screen},
        overlay=scene_overlay(shifts, m, None, colours),
    )
    what = Run(
        raw=path,
        core=shown.in_pairs(core),
        out=folder / "out",
        simulator=simulator_name(),
        chain="hdmi",
        board=board,
        screen=shown,
    )
    report = run(what)
    assert isinstance(report, ScreenReport)
    assert report.mismatches == 0
    # A board may show no slice alone.
    lines = dict(report_summary(what.core, report))
    assert ("a = " in lines["focus"], "error" in lines) == (bool(report.slices),) * 2
    # Text and depth are there, and pictures differ.
    pictures = [read_image(what.out / part.picture) for part in report.shown]
    assert all((a != b).any() for a, b in itertools.combinations(pictures, 2))
    return report


@pytest.mark.drawn(1, "chain runs")
def test_depth_and_its_text_through_serial_bits(tmp_path: Path) -> None:
    screen = {"outputs": "d", "radius": 0, "between": True}
    report = run_screen(tmp_path, screen, (16, 24), 2, (0, 1, 2), "atlys")
    assert [(part.output, part.text) for part in report.shown] == [
        ("depth", 0),
        ("depth", 1),
        ("depth", 2),
    ]


@pytest.mark.slow
@pytest.mark.parametrize("board", ["atlys", "ulx3s"])
def test_all_outputs_through_serial_bits(tmp_path: Path, board: str) -> None:
    # The Atlys with two boxes of each slice: no picture is one of a slice alone.
    more = {"sharp_box": 1} if board == "atlys" else {"between": True}
    screen = {"confidence": 1944, "vote_radius": 1, **more}
    report = run_screen(tmp_path, screen, (44, 66), 3, (-1, 0, 2), board)
    counts = len(report.slices), len(report.shown)
    assert counts == ((0, 9) if board == "atlys" else (3, 6))


def test_picture_without_room_for_commands(tmp_path: Path) -> None:
    core = CoreConfiguration(
        micro_image_size=5, shifts=(0, 4), max_columns=80, channels=3, engine=StackEngine()
    )
    with pytest.raises(InputError, match="leaves 0 lines beside the 32 of delay") as error:
        check_chain(core, 20, 80, Screen(outputs="rad", vote_radius=1))
    assert error.value.where == "raw"


def test_pixel_clock_that_the_board_cannot_take() -> None:
    mode = VGA.model_copy(update={"name": "too fast", "pixel_clock": 80_000})
    with pytest.raises(InputError, match="no pixel clock of 80 MHz"):
        range_of(BOARDS["ulx3s"], mode)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mode", "arithmetic"),
    [
        (VGA, ExactArithmetic()),
        (HD720, StoredProductArithmetic(fraction_bits=4, guard_bits=2)),
    ],
    ids=["640x480p60", "1280x720p60"],
)
def test_standard_modes(tmp_path: Path, mode, arithmetic: Arithmetic) -> None:
    """A whole frame with the real blanking and clock; 720 lines are made of two pictures."""
    rows, columns = mode.v_active, mode.h_active
    raw = np.tile(read_image(FLOWER), (1, 2, 1))[:rows, :columns]
    assert mode_for(columns, rows) == mode
    core = CoreConfiguration(
        micro_image_size=5, shifts=(-3,), max_columns=columns, channels=3, arithmetic=arithmetic
    )
    result = run_chain(find_simulator(simulator_name()), core, raw, tmp_path)
    assert np.array_equal(result.frames[0], arithmetic.refocus(raw, 5, shift=-3))


@pytest.mark.parametrize(
    ("changes", "rows", "where"),
    [
        ({"pixel_bits": 16}, 40, "raw"),
        ({"engine": FirEngine(parallel_rows=2)}, 40, "parallel_rows"),
        ({"engine": MovingSumEngine(any_rows=True)}, 40, "any_rows"),
        ({"shifts": (12,)}, 8, "shifts"),
    ],
)
def test_what_the_board_cannot_carry_is_refused(changes: dict, rows: int, where: str) -> None:
    core = CoreConfiguration.model_validate(
        {"micro_image_size": 5, "shifts": (-3,), "max_columns": 64, "channels": 3, **changes}
    )
    with pytest.raises(InputError) as error:
        check_chain(core, rows, 64)
    assert error.value.where == where


def test_another_chain_is_refused() -> None:
    done = plenofir("sim", "--chain", "sdi")
    assert done.returncode == 2
    assert done.stderr == "plenofir: --chain: 'sdi' must be one of 'core', 'hdmi', 'csi'\n"
