# SPDX-License-Identifier: Apache-2.0
"""Cases of the sharpener, for its tests and for those that plant faults."""

from math import gcd

from plenofir_tb.runner import Case


def sharpener_case(
    m: int,
    weights: tuple[int, ...],
    *,
    pixels: int = 1,
    channels: int = 1,
    divisor: int | None = None,
    white: int = 255,
    columns: int = 30,
    turns: int = 4,
) -> Case:
    """A case of ``sharpen.sharpener_bench``."""
    divisor = m * m if divisor is None else divisor
    generics = {
        "MICRO_IMAGE_SIZE": m,
        "SHARPENING": " ".join(map(str, weights)),
        "PIXELS_PER_CLOCK": pixels,
        "TOKENS": max(-(-columns // pixels), 1),
        "CHANNELS": channels,
        "SUM_MAX": white * divisor,
        "DIVISOR": divisor,
    }
    case = {
        "m": m,
        "weights": weights,
        "scale_units": gcd(*weights, 16),
        "pixels": pixels,
        "channels": channels,
        "sum_max": white * divisor,
        "divisor": divisor,
        "columns": columns,
        "turns": turns,
    }
    return Case("lens_sharpener", "sharpen.sharpener_bench", generics, case)
