# SPDX-License-Identifier: Apache-2.0
"""The receiver of CSI-2: every format, every wrong bit of a header."""

import pytest

from plenofir.fpga.sensors import IMX219_MODES, PAUSE, WideEntry, registers_text
from plenofir_tb.runner import Case, run_cases


def receiver(lanes: int, bits: int, pixels: int, widths: int = 11) -> Case:
    case = {"lanes": lanes, "bits": bits, "pixels": pixels, "widths": widths}
    generics = {"LANES": lanes, "PIXEL_BITS": bits, "PIXELS_PER_CLOCK": pixels}
    return Case("csi_receiver", "csi.receiver_bench", generics, case)


def test_csi_receiver() -> None:
    run_cases([receiver(1, 12, 1, 4), receiver(2, 10, 2, 4), receiver(4, 8, 8, 9)])


@pytest.mark.slow
def test_every_format() -> None:
    run_cases(
        [receiver(n, b, p) for n in (1, 2, 4) for b in (8, 10, 12) for p in (1, 2, 4, 8)], long=True
    )


def test_lines_faster_than_the_core() -> None:
    mode = IMX219_MODES[0]
    bits, pixels = mode.buffer_bits(100e6), mode.pixels_per_clock(100e6)
    case = {"lanes": 2, "bits": 10, "pixels": pixels, "columns": mode.columns}
    case |= {"byte_ps": round(16e12 / mode.pixel_rate / 10) // 2 * 2}
    generics = {"LANES": 2, "PIXEL_BITS": 10, "PIXELS_PER_CLOCK": pixels}
    run_cases(
        [
            Case(
                "csi_receiver",
                "csi.rate_bench",
                {**generics, "BUFFER_BITS": bits - less},
                {**case, "whole": not less},
            )
            for less in (0, 1)
        ]
    )


def test_dphy_lane() -> None:
    run_cases(
        [Case("dphy_lane", "csi.lane_bench", {"SETTLE": n}, {"settle": n}) for n in (0, 2, 3)]
    )


def test_sensor_setup() -> None:
    entries = [
        *((PAUSE, 2), (0x0100, 0x00), WideEntry(0x301A, 0x00D9), (PAUSE, 3)),
        *((0x30EB, 0x05), WideEntry(0xA55A, 0xFF07), (0x0100, 0x01)),
    ]
    case = {
        "entries": [(*entry, 1 + isinstance(entry, WideEntry)) for entry in entries],
        **{"quarter": 4, "retries": 3, "pause": 60, "retry_pause": 4 * 20},
    }
    generics = {
        **{"REGISTERS": registers_text(entries), "QUARTER": 4, "RETRIES": 3},
        **{"STRETCH": 200, "MILLISECOND": 20, "RETRY_PAUSE": 5},
    }
    run_cases([Case("sensor_setup", "csi.setup_bench", generics, case)])
