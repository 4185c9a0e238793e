"""The sharpener behind an engine's sums (``hdl/sharpen``): what it takes."""

from collections.abc import Iterator
from math import gcd

from plenofir.errors import InputError
from plenofir.fpga.core.engine import Raster
from plenofir.fpga.core.memory import Memory, block_sizes
from plenofir.refocus.sharpening import MAX_WEIGHT_UNITS, WEIGHT_UNITS, Taps

SHARPENER_CLOCKS = 15
"""Clocks of lens_sharpener (sharpen_pkg.sharpen_latency)."""


def common_taps(raster: Raster) -> Taps:
    """The largest side weight, and the scale that suits all slices."""
    units = gcd(*raster.weights, MAX_WEIGHT_UNITS)
    return Taps(max(raster.weights) // units, (WEIGHT_UNITS // units).bit_length() - 1)


def sharpener_bits(raster: Raster) -> int:
    """Bits of the lines of sums that all channels keep."""
    if not raster.sharpens:
        return 0
    lines = 2 * raster.micro_image_size
    return lines * raster.max_columns * raster.channels * _sum_bits(raster)


def sharpener_memories(raster: Raster) -> Iterator[Memory]:
    """Its memory: a word has the last two lines of a phase."""
    if raster.sharpens:
        width = 2 * raster.channels * _sum_bits(raster)
        for size in block_sizes(raster.micro_image_size * raster.max_columns, width):
            yield Memory("lines of sums", (size - 1).bit_length(), width, 1, words=size)


def check_sharpener(raster: Raster, engine: str, parallel_rows: int) -> None:
    """Refuse cores that have no sharpener."""

    def refuse(what: str, expected: str) -> InputError:
        return InputError(f"cannot be combined with {what}", where="sharpening", expected=expected)

    if not raster.exact:
        raise refuse("stored products", "exact arithmetic: their rounding comes first")
    if engine == "stack":
        raise refuse("a focal stack", "engine fir or moving_sum")
    if parallel_rows > 1:
        raise refuse(f"{parallel_rows} rows at once", "one row at a time")


def _sum_bits(raster: Raster) -> int:
    return raster.words(2 * raster.passes - 1).sum
