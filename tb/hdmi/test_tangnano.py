# SPDX-License-Identifier: Apache-2.0
"""The Tang Nano 20K, stored light field to serial bits: every frame equals the golden model."""

import itertools
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from plenofir.fpga import hdl
from plenofir.fpga.bitstream.top_level import board_generics, default_generics
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.hdmi.link import ReceivedFrame, decode_frames
from plenofir.fpga.hdmi.modes import VGA, VGA_MIDDLE, VideoMode
from plenofir.fpga.screen.board_screen import SCREEN_PACKAGE, Screen, screen_package
from plenofir.fpga.screen.chip_light_field import STORED_PACKAGE, store, stored_package
from plenofir.ground import project
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import board_packages
from plenofir.plan.scene_screen import scene_overlay
from plenofir_tb.runner import draw_seed, vhdl_simulator
from plenofir_tb.video import in_the_middle, light_field

BOARD = BOARDS["tangnano20k"]
BENCH = "tangnano20k_bench"
PARTS = [f"{d}_{part}" for d in "hv" for part in ("active", "front", "sync", "back")]
SIDE = 4
SMALL = VideoMode(
    name="small",
    pixel_clock=25_200,
    **dict(zip(PARTS, (60, 10, 20, 30, 42, 1, 2, 5), strict=True)),
    h_positive=False,
    v_positive=False,
)


def simulate(
    core: CoreConfiguration,
    mode: VideoMode,
    side: int,
    frames: int,
    packages: Mapping[str, str],
    folder: Path,
    *,
    brief: bool = True,
    **generics: int,
) -> list[ReceivedFrame]:
    """Whole frames that the board's pins send within the time of some frames."""
    folder.mkdir(exist_ok=True)
    benches = [project.root() / "tb" / "file_bench" / f"{n}.vhd" for n in ("tmds_monitor", BENCH)]
    sources = hdl.with_packages(hdl.board_sources(BOARD.name), packages, folder)
    vhdl_simulator(brief=brief).simulate(
        [*sources, *benches],
        BENCH,
        {
            **board_generics(core, BOARD.top),
            **{f"PATTERN_{part.upper()}": getattr(mode, part) for part in PARTS},
            "SIDE_COLUMNS": side,
            "WORDS": frames * mode.h_total * mode.v_total + 1000,
            **generics,
        },
        folder,
        models=hdl.model_sources(BOARD.library),
    )
    return decode_frames(np.fromfile(folder / "output.bin", "<u4"))


def golden_frames(
    core: CoreConfiguration, raw: np.ndarray, screen: Screen, side: int
) -> list[np.ndarray]:
    """Expected frame of each slice at the monitor."""
    slices = list(core.golden(raw))
    if screen.overlay is not None:
        slices = [
            screen.overlay.draw(picture, "refocused", number, bottom=True)
            for number, picture in enumerate(slices)
        ]
    return [np.pad(picture, ((0, 0), (side, side), (0, 0))) for picture in slices]


def shown_slices(got: list[ReceivedFrame], wanted: list[np.ndarray]) -> list[int]:
    """Slice of each frame after the initial black ones; all must be among the given slices."""
    numbers = []
    for number, frame in enumerate(got):
        found = [s for s, want in enumerate(wanted) if np.array_equal(frame.pixels, want)]
        if not found:
            assert not numbers, f"frame {number} is no slice"
            assert not frame.pixels.any(), f"frame {number} is neither black nor a slice"
            continue
        numbers.append(found[0])
    return numbers


def small_core(shifts: tuple[int, ...], m: int) -> CoreConfiguration:
    return CoreConfiguration(micro_image_size=m, shifts=shifts, max_columns=60, channels=3)


def test_stored_light_field_to_serial_bits(tmp_path: Path) -> None:
    seed = draw_seed()
    print(f"seed {seed}")
    m, shifts = 5, (-1, 0, 2)
    raw = np.random.default_rng(seed).integers(0, 256, (7 * m, 10 * m, 3), np.uint8)
    stored, core = store(raw, m), small_core(shifts, m)
    screen = Screen(overlay=scene_overlay(shifts, m))
    packages = {STORED_PACKAGE: stored_package(stored), SCREEN_PACKAGE: screen_package(screen)}
    # The key is pressed in the eighth frame; from then on the slice stays.
    words = SMALL.h_total * SMALL.v_total
    got = simulate(core, SMALL, SIDE, 12, packages, tmp_path, STEP_WORDS=8 * words)
    wanted = golden_frames(core, in_the_middle(stored.raster(), m, SMALL), screen, SIDE)
    numbers = shown_slices(got, wanted)
    to_and_fro = [0, 1, 2, 1] * 3
    assert len(numbers) >= 6
    # Slices have also advanced in the frames before the first shown one.
    moving = len([a for a, b in itertools.pairwise(numbers) if a != b]) + 1
    assert moving >= 3
    assert any(numbers[:moving] == to_and_fro[k : k + moving] for k in range(4))
    assert len(set(numbers[moving - 1 :])) == 1
    sides = {"h_active": SMALL.h_active + 2 * SIDE, "h_front": SMALL.h_front - SIDE}
    wide = SMALL.model_copy(update={**sides, "h_back": SMALL.h_back - SIDE}).as_measured()
    assert {frame.mode for frame in got} == {wide}


@pytest.mark.slow
def test_pattern_to_serial_bits(tmp_path: Path) -> None:
    # Without a stored light field the test pattern.
    core = small_core((2, 0, -1), 3)
    got = simulate(core, SMALL, SIDE, 8, {}, tmp_path)
    pattern = light_field(SMALL, 3, (2, 0, -1), (20, 40))
    assert len(shown_slices(got, golden_frames(core, pattern, Screen(), SIDE))) >= 3


@pytest.mark.slow
def test_shipped_scene_to_serial_bits(tmp_path: Path) -> None:
    # Eight whole frames of 640x480p60 with the flower take some minutes; the first ones are black.
    plan = make_plan(load_scene(BOARD.scene))
    assert plan.stored is not None
    got = simulate(plan.core, VGA_MIDDLE, 80, 8, board_packages(plan), tmp_path, brief=False)
    wanted = golden_frames(
        plan.core, in_the_middle(plan.stored.raster(), 5, VGA_MIDDLE), plan.screen, 80
    )
    assert len(shown_slices(got, wanted)) >= 2
    assert {frame.mode for frame in got} == {VGA.as_measured()}


def test_defaults_are_the_board_s_mode() -> None:
    known = default_generics(BOARD.top)
    assert {part: known[f"PATTERN_{part.upper()}"] for part in PARTS} == {
        part: getattr(VGA_MIDDLE, part) for part in PARTS
    }
    assert 2 * known["SIDE_COLUMNS"] + VGA_MIDDLE.h_active == VGA.h_active
    assert (VGA_MIDDLE.h_total, VGA_MIDDLE.v_total) == (VGA.h_total, VGA.v_total)
