# SPDX-License-Identifier: Apache-2.0
"""Parallel video in and out: the evaluation target without pins."""

from plenofir_tb.runner import Case, run_cases


def parallel_top(bits: int) -> Case:
    m, shifts, columns, rows = 3, (2, -1), 24, 12
    case = {
        **{"m": m, "shifts": shifts, "columns": columns, "rows": rows, "pixel_bits": bits},
        **{"blank_pixels": 40, "blank_lines": 8},
    }
    generics = {
        **{"MICRO_IMAGE_SIZE": m, "SHIFTS": " ".join(map(str, shifts)), "MAX_COLUMNS": columns},
        **{"ROWS": rows, "PIXEL_BITS": bits, "ENGINE": "moving_sum"},
    }
    return Case("parallel_top", "video.parallel_bench", generics, case)


def test_parallel_video() -> None:
    case = {"rows": 4, "columns": 9, "stall": 100}
    generics = {"WIDTH": 8, "MAX_COLUMNS": 9, "ROWS": 4, "STALL": 100}
    sender = Case("stream_to_parallel", "video.sender_bench", generics, case)
    run_cases([parallel_top(8), parallel_top(12), sender])
