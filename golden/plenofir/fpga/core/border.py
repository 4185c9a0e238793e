# SPDX-License-Identifier: Apache-2.0
"""The weights of a normalised border, beside an engine (``hdl/border``): clocks and resources."""

from collections import Counter
from collections.abc import Iterator

from plenofir.fpga.core.engine import Raster
from plenofir.fpga.families import MULTIPLYING
from plenofir.fpga.resources.estimate import Block
from plenofir.ground.errors import InputError
from plenofir.refocus.sum_lanes import LaneLayout

DIVIDE_CLOCKS = 3
"""Clocks of divide_round."""
# The narrowest product that Yosys gives a multiplier.
_DSP_LEAST_BITS = 9
# A stage of moving sums (moving_sum_pkg.sum_stage_latency).
_STAGE_CLOCKS = 10


def scaler_clocks(raster: Raster) -> int:
    """Clocks of the scaler that makes pixels of exact sums (refocus_pkg.scaler_latency)."""
    return raster.pixel_bits + 1 if raster.weighted else DIVIDE_CLOCKS


def weights_clocks(raster: Raster, pixels_per_clock: int) -> int:
    """Clocks from a token to its weights (border_pkg.border_latency)."""
    clocks = 1
    for number in range(raster.passes):
        clocks += 2 * _STAGE_CLOCKS
        if pixels_per_clock > 1:
            clocks += LaneLayout(raster.sum_layout(number), pixels_per_clock).clocks - _STAGE_CLOCKS
    return clocks


def weight_bits(raster: Raster) -> int:
    return int(raster.largest_box ** (2 * raster.passes)).bit_length()


def border_blocks(raster: Raster, pixels_per_clock: int) -> Iterator[Block]:
    """Block of the counts and the division by weights, for the estimate; none without weights."""
    if not raster.weighted:
        return
    parts = Counter[str]()
    several = pixels_per_clock > 1
    for number in range(raster.passes if raster.normalises else 0):
        layout = raster.sum_layout(number)
        count_bits = int(raster.largest_box**raster.passes).bit_length()
        parts += Counter(
            {
                "stages": 2,
                "age bits": 2 * (layout.reach + 1).bit_length(),
                "delays": 2 * layout.delay,
                "stages of lanes": several,
                "lane bits": (pixels_per_clock - 1) * count_bits,
            }
        )
    # Each digit of the quotient takes an adder as wide as the weight, and registers to pipeline
    # both.
    bits, pixel, channels = weight_bits(raster), raster.pixel_bits, raster.channels
    lut = channels * (pixel * (bits + 1) + bits + pixel) + bits
    flip_flops = channels * (pixel * (bits + 1) + 5) + pixel * bits
    parts["division LUTs"] = pixels_per_clock * lut
    parts["division flip-flops"] = pixels_per_clock * flip_flops
    products = raster.normalises and bits >= _DSP_LEAST_BITS
    multipliers = dict.fromkeys(MULTIPLYING, pixels_per_clock * products)
    yield Block("border", parts, multipliers=multipliers)


def check_border(raster: Raster, parallel_rows: int) -> None:
    """Refuse cores that cannot normalise their border."""

    def refuse(feature: str, advice: str) -> InputError:
        return InputError(f"cannot be combined with {feature}; use {advice}", where="border")

    if not raster.exact:
        raise refuse(
            "stored products", "exact arithmetic, as products are divided before they meet"
        )
    if parallel_rows > 1:
        raise refuse(f"{parallel_rows} rows at once", "one row at a time")
    if raster.sharpens:
        raise refuse("sharpening", "one of them")
