# SPDX-License-Identifier: Apache-2.0
"""Frames and signatures of the self test on a board (hdl/selftest/self_test.vhd)."""

import numpy as np

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.refocus.operator import Image

TOP = "self_test"
_POLYNOMIAL = 0x00400007
_SEED = 1
_MASK = (1 << 32) - 1


def _shifted(state: int) -> int:
    """2 * state modulo the polynomial over GF(2)."""
    product = state << 1
    return (product ^ _POLYNOMIAL) & _MASK if product >> 32 else product


def source_frame(core: CoreConfiguration, rows: int) -> Image:
    """Pseudo-random frame, uint8, for the design's core; lines are as long as it allows."""
    pixels = []
    state = _SEED
    for _ in range(rows * core.max_columns):
        pixels.append([state >> 8 * channel & 255 for channel in range(core.channels)])
        state = _shifted(state)
    frame = np.array(pixels, dtype=np.uint8).reshape(rows, core.max_columns, core.channels)
    return frame if core.channels > 1 else frame[..., 0]


def signature(frame: Image) -> int:
    """Signature (32 bits) of a frame (rows, columns[, 3]), uint8."""
    channels = 1 if frame.ndim == 2 else frame.shape[2]
    state = 0
    for pixel in frame.reshape(-1, channels).tolist():
        word = sum(value << 8 * channel for channel, value in enumerate(pixel))
        state = _shifted(state) ^ word
    return state


def self_test_generics(core: CoreConfiguration, rows: int) -> dict[str, int | bool | str]:
    """Generics of the design, with the signature of the golden model's frame.

    The core has one slice, 8 bit, a row at once, nearest neighbour.
    """
    frame = source_frame(core, rows)
    expected = signature(
        core.arithmetic.refocus(
            frame, core.micro_image_size, shift=core.shifts[0], align=core.align
        )
    )
    names = ("MICRO_IMAGE_SIZE", "SHIFTS", "CHANNELS", "EXACT", "FRACTION_BITS", "GUARD_BITS")
    values = core.generics()
    return {
        **{name: values[name] for name in names if name in values},
        "COLUMNS": core.max_columns,
        "ROWS": rows,
        "EXPECTED_HIGH": expected >> 16,
        "EXPECTED_LOW": expected & 0xFFFF,
    }
