# SPDX-License-Identifier: Apache-2.0
"""The whole board, from serial bits to serial bits."""

import pytest

from plenofir_tb.runner import run_case
from plenofir_tb.video import MODE_720

M, SHIFTS = 3, (2, 0, -1)
METER_WINDOW, BIT_CLOCKS = 800, 10
# 240 us in place of 100 ms.
DATA_PATIENCE = 30
PARTS = [f"{d}_{part}" for d in "hv" for part in ("active", "front", "sync", "back")]


def run_chain(
    phases: list[int],
    *,
    shifts: tuple[int, ...] = SHIFTS,
    long: bool = True,
    thorough: bool = False,
) -> None:
    run_case(
        "hdmi_bench",
        "hdmi.chain_bench",
        generics={
            "MICRO_IMAGE_SIZE": M,
            "SHIFTS": " ".join(map(str, shifts)),
            "MAX_COLUMNS": 64,
            "METER_WINDOW": METER_WINDOW,
            "DATA_PATIENCE": DATA_PATIENCE,
            "BIT_CLOCKS": BIT_CLOCKS,
            **{f"PATTERN_{name.upper()}": getattr(MODE_720, name) for name in PARTS},
        },
        case={
            "m": M,
            "shifts": shifts,
            "phases": phases,
            "meter_window": METER_WINDOW,
            "bit_clocks": BIT_CLOCKS,
            "thorough": thorough,
            "patience_us": DATA_PATIENCE * METER_WINDOW / 100,
        },
        board=True,
        long=long,
    )


def test_chain() -> None:
    run_chain([0, 4])


def test_pattern_of_two_slices(monkeypatch: pytest.MonkeyPatch) -> None:
    # Between both, what is in focus at a = 0.
    monkeypatch.setenv("COCOTB_TEST_FILTER", "test_pattern")
    run_chain([], shifts=(2, -1), long=False)


@pytest.mark.slow
def test_all_phases() -> None:
    run_chain([*range(10), *range(10)], shifts=(-2,))


@pytest.mark.slow
def test_hdmi_sources(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COCOTB_TEST_FILTER", "hdmi_(modes|bit)")
    run_chain([], thorough=True)
