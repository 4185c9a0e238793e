# SPDX-License-Identifier: Apache-2.0
"""The whole board, from serial bits to serial bits: one list of cases for all boards."""

from pathlib import Path

import numpy as np
import pytest

from plenofir.fpga.screen.chip_light_field import (
    STORED_PACKAGE,
    StoredLightField,
    store,
    stored_package,
)
from plenofir_tb.drawn import bench_filter
from plenofir_tb.runner import run_case
from plenofir_tb.video import MODE_720

M, SHIFTS = 3, (2, 0, -1)
# In units of 10 ns: whole clocks of either control, of bits as few as the serial port takes.
METER_WINDOW, BIT_TIME = 960, 8
PARTS = [f"{d}_{part}" for d in "hv" for part in ("active", "front", "sync", "back")]

# Differences of the boards: generics of the build; windows of the meter in place of the time-out
# of 100 ms; a fast and a slow accepted pixel clock, and one that is not accepted; time to lock, and
# for a delay line to find its setting again; last taps of delay lines; preferred mode of the
# board's EDID.
BOARDS: dict[str, dict] = {
    "atlys": {
        "board": "atlys",
        "generics": {},
        "data_patience": 30,
        "fast_khz": 74_250,
        "slow_khz": 25_175,
        "refused_khz": 20_000,
        "lock_us": 100,
        "delay_recovery_us": 2 * 1023 / 148.5,
        "taps": (-9, 9),
        "own_mode": (640, 480, 599),
    },
    # The recorded builds, for 20.5 to 39.5 MHz, at the clocks of their modes: a bit is as long as
    # the delay line, or longer by a quarter.
    "ulx3s": {
        "board": "ulx3s",
        "generics": {"CLOCK_RANGE": 4, "OWN_DIVIDE": 24},
        "data_patience": 150,
        "fast_khz": 37_125,
        "slow_khz": 25_175,
        "refused_khz": 16_000,
        "lock_us": 700,
        "delay_recovery_us": 700,
        "taps": (1, 126),
        "own_mode": (640, 480, 599),
    },
    # For 41 to 74.3 MHz, beyond the data sheet.
    "ulx3s-fast": {
        "board": "ulx3s",
        "generics": {},
        "data_patience": 100,
        "fast_khz": 74_250,
        "slow_khz": 42_000,
        "refused_khz": 25_175,
        "lock_us": 320,
        "delay_recovery_us": 320,
        "taps": (1, 126),
        "own_mode": (1024, 768, 600),
    },
    "pynqz2": {
        "board": "pynqz2",
        "generics": {},
        "data_patience": 100,
        "fast_khz": 74_250,
        "slow_khz": 42_000,
        "refused_khz": 25_175,
        "lock_us": 320,
        "delay_recovery_us": 320,
        "taps": (1, 30),
        "own_mode": None,
    },
    "pynqz2-slow": {
        "board": "pynqz2",
        "generics": {"CLOCK_RANGE": 4, "OWN_DIVIDE": 24},
        "data_patience": 150,
        "fast_khz": 37_125,
        "slow_khz": 25_175,
        "refused_khz": 16_000,
        "lock_us": 700,
        "delay_recovery_us": 700,
        "taps": (0, 31),
        "own_mode": None,
    },
}


def run_chain(
    phases: list[int],
    *,
    board: str = "atlys",
    shifts: tuple[int, ...] = SHIFTS,
    long: bool = True,
    thorough: bool = False,
    stored: StoredLightField | None = None,
) -> None:
    of_board = dict(BOARDS[board])
    board, generics = of_board.pop("board"), of_board.pop("generics")
    run_case(
        "hdmi_bench",
        "hdmi.chain_bench",
        generics={
            "MICRO_IMAGE_SIZE": M,
            "SHIFTS": " ".join(map(str, shifts)),
            "MAX_COLUMNS": 64,
            "METER_WINDOW": METER_WINDOW,
            "DATA_PATIENCE": of_board["data_patience"],
            "BIT_TIME": BIT_TIME,
            **generics,
            **{f"PATTERN_{name.upper()}": getattr(MODE_720, name) for name in PARTS},
        },
        case={
            "m": M,
            "shifts": shifts,
            "phases": phases,
            "meter_window": METER_WINDOW,
            "bit_clocks": BIT_TIME,
            "thorough": thorough,
            "stored": None if stored is None else stored.raster().tolist(),
            "patience_us": of_board["data_patience"] * METER_WINDOW / 100,
            "board": board,
            **of_board,
        },
        packages={} if stored is None else {STORED_PACKAGE: stored_package(stored)},
        board=board,
        long=long,
    )


def test_chain(monkeypatch: pytest.MonkeyPatch) -> None:
    folder = Path(__file__).parent
    benches = (folder / "chain_bench.py", folder / "panel_bench.py")
    monkeypatch.setenv("COCOTB_TEST_FILTER", bench_filter(2, *benches))
    run_chain([0, 4])


@pytest.mark.slow
@pytest.mark.parametrize(
    "board",
    [
        pytest.param("ulx3s", marks=pytest.mark.counted),
        "ulx3s-fast",
        pytest.param("pynqz2", marks=pytest.mark.counted),
        "pynqz2-slow",
    ],
)
def test_other_boards(board: str) -> None:
    run_chain([0, 4], board=board)


def test_pattern_of_two_slices(monkeypatch: pytest.MonkeyPatch) -> None:
    # In between, what is in focus at a = 0.
    monkeypatch.setenv("COCOTB_TEST_FILTER", "test_pattern")
    run_chain([], shifts=(2, -1), long=False)


@pytest.mark.slow
@pytest.mark.parametrize("board", BOARDS)
def test_stored_light_field(monkeypatch: pytest.MonkeyPatch, board: str) -> None:
    # Instead of the pattern, a little smaller than the frame.
    monkeypatch.setenv("COCOTB_TEST_FILTER", "test_pattern")
    size = ((MODE_720.v_active - 4) // M * M, (MODE_720.h_active - 9) // M * M, 3)
    raw = np.random.default_rng(1).integers(0, 256, size, np.uint8)
    run_chain([], board=board, stored=store(raw, M))


@pytest.mark.slow
@pytest.mark.parametrize("board", BOARDS)
def test_all_phases(board: str) -> None:
    run_chain([*range(10), *range(10)], shifts=(-2,), board=board)


@pytest.mark.slow
@pytest.mark.parametrize("board", BOARDS)
def test_hdmi_sources(monkeypatch: pytest.MonkeyPatch, board: str) -> None:
    monkeypatch.setenv("COCOTB_TEST_FILTER", "hdmi_(modes|bit)")
    run_chain([], thorough=True, board=board)
