# SPDX-License-Identifier: Apache-2.0
"""The weights of a normalised border, beside an engine (``hdl/border``): clocks and resources."""

from plenofir.fpga.core.engine import Raster
from plenofir.fpga.core.weights import on_family
from plenofir.fpga.devices import Usage
from plenofir.fpga.families import Family
from plenofir.ground.errors import InputError
from plenofir.refocus.moving_sum import SumLayout
from plenofir.refocus.sum_lanes import LaneLayout

DIVIDE_CLOCKS = 3
"""Clocks of divide_round."""
# LUTs and flip-flops of the counts, fitted to eleven synthesised designs: within 10 % for one pixel
# a clock, within a third for several. Those of the division follow from its structure.
_LUT_WEIGHTS = {"age bits": 26.6, "lane bits": 9.7, "stages": -9.5, "stages of lanes": 175.0}
_FLIP_FLOP_WEIGHTS = {"age bits": 16.0, "lane bits": 11.7, "stages": 48.4, "delays": 0.93}
# The narrowest product that Yosys gives a multiplier.
_DSP_LEAST_BITS = 9
# A stage of moving sums (moving_sum_pkg.sum_stage_latency).
_STAGE_CLOCKS = 10


def scaler_clocks(raster: Raster) -> int:
    """Clocks of the scaler that makes pixels of exact sums (refocus_pkg.scaler_latency)."""
    return raster.pixel_bits + 1 if raster.normalises else DIVIDE_CLOCKS


def weights_clocks(raster: Raster, pixels_per_clock: int) -> int:
    """Clocks from a token to its weights (border_pkg.border_latency)."""
    clocks = 1
    for number in range(raster.passes):
        clocks += 2 * _STAGE_CLOCKS
        if pixels_per_clock > 1:
            layout = SumLayout(raster.micro_image_size, raster.pass_shifts(number), raster.align)
            clocks += LaneLayout(layout, pixels_per_clock).clocks - _STAGE_CLOCKS
    return clocks


def weight_bits(raster: Raster) -> int:
    return int(raster.micro_image_size ** (2 * raster.passes)).bit_length()


def border_usage(raster: Raster, pixels_per_clock: int, family: Family = "spartan6") -> Usage:
    """Resources of counts and division, as `plenofir.fpga.synthesis.estimate` counts them."""
    if not raster.normalises:
        return Usage()
    counts = dict.fromkeys((*_LUT_WEIGHTS, *_FLIP_FLOP_WEIGHTS), 0)
    several = pixels_per_clock > 1
    for number in range(raster.passes):
        layout = SumLayout(raster.micro_image_size, raster.pass_shifts(number), raster.align)
        counts["stages"] += 2
        counts["age bits"] += 2 * (layout.reach + 1).bit_length()
        counts["delays"] += 2 * layout.delay
        counts["stages of lanes"] += several
        count_bits = (raster.micro_image_size**raster.passes).bit_length()
        counts["lane bits"] += (pixels_per_clock - 1) * count_bits
    lut, flip_flops = (
        sum(weight * counts[name] for name, weight in weights.items())
        for weights in (_LUT_WEIGHTS, _FLIP_FLOP_WEIGHTS)
    )
    # Each digit of the quotient takes an adder as wide as the weight, and registers to pipeline
    # both.
    bits, pixel, channels = weight_bits(raster), raster.pixel_bits, raster.channels
    lut += pixels_per_clock * (channels * (pixel * (bits + 1) + bits + pixel) + bits)
    flip_flops += pixels_per_clock * (channels * (pixel * (bits + 1) + 5) + pixel * bits)
    dsp = pixels_per_clock if bits >= _DSP_LEAST_BITS else 0
    return on_family(Usage(lut=round(lut), flip_flops=round(flip_flops), dsp=dsp), family)


def check_border(raster: Raster, parallel_rows: int) -> None:
    """Refuse cores that cannot normalise their border."""

    def refuse(what: str, advice: str) -> InputError:
        return InputError(f"cannot be combined with {what}; use {advice}", where="border")

    if not raster.exact:
        raise refuse(
            "stored products", "exact arithmetic, as products are divided before they meet"
        )
    if parallel_rows > 1:
        raise refuse(f"{parallel_rows} rows at once", "one row at a time")
    if raster.sharpens:
        raise refuse("sharpening", "one of them")
