# SPDX-License-Identifier: Apache-2.0
"""The sharpener after an engine's sums (``hdl/sharpen``): its resources."""

from collections.abc import Iterator

from plenofir.fpga.core.engine import Raster
from plenofir.fpga.families import MULTIPLYING
from plenofir.fpga.names import SLICE_ENGINE_NAMES
from plenofir.fpga.resources.estimate import Block
from plenofir.fpga.resources.memory import Memory, block_sizes
from plenofir.ground.errors import InputError

SHARPENER_CLOCKS = 15
"""Clocks of lens_sharpener (sharpen_pkg.sharpen_latency)."""

# Multipliers of a channel whose weight depends on the slice, or is no sum of two powers of two.
_DSP_OF_PRODUCTS = 3
_PRODUCTS = {11, 13}


def sharpener_bits(raster: Raster, pixels_per_clock: int = 1) -> int:
    """Bits of the lines of sums that all channels keep."""
    return sum(memory.bits for memory in sharpener_memories(raster, pixels_per_clock))


def sharpener_memories(raster: Raster, pixels_per_clock: int = 1) -> Iterator[Memory]:
    """Memory of the sharpener: a word has the last two lines of a phase."""
    if raster.sharpens:
        p = pixels_per_clock
        # As refocus_pkg.line_tokens.
        tokens = raster.max_columns if p == 1 else max(-(-raster.max_columns // p), 2)
        width = 2 * p * raster.channels * _sum_bits(raster)
        for size in block_sizes(raster.micro_image_size * tokens, width):
            yield Memory("lines of sums", (size - 1).bit_length(), width, 1, words=size)


def sharpener_blocks(raster: Raster, pixels_per_clock: int) -> Iterator[Block]:
    """Block of the sharpener, for the estimate; none without one."""
    memories = tuple(sharpener_memories(raster, pixels_per_clock))
    if not memories:
        return
    bits = pixels_per_clock * raster.channels * _sum_bits(raster)
    parts = {"sharpener": 1, "sum bits": bits, "block bits": 2 * bits * len(memories)}
    sides = {weight for weight in raster.weights if weight}
    multiplied = len(sides) > 1 or bool(sides & _PRODUCTS)
    products = _DSP_OF_PRODUCTS * pixels_per_clock * raster.channels * multiplied
    multipliers = dict.fromkeys(MULTIPLYING, products)
    yield Block("sharpener", parts, memories, multipliers=multipliers)


def check_sharpener(raster: Raster, engine: str, parallel_rows: int) -> None:
    """Refuse cores that cannot have a sharpener."""

    def refuse(feature: str, advice: str) -> InputError:
        return InputError(f"cannot be combined with {feature}; use {advice}", where="sharpening")

    if not raster.exact:
        raise refuse("stored products", "exact arithmetic, as products are rounded before")
    if engine == "stack":
        raise refuse("a focal stack", f"engine {' or '.join(SLICE_ENGINE_NAMES)}")
    if parallel_rows > 1:
        raise refuse(f"{parallel_rows} rows at once", "one row at a time")


def _sum_bits(raster: Raster) -> int:
    return raster.words(2 * raster.passes - 1).sum
