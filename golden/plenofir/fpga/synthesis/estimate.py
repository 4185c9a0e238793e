# SPDX-License-Identifier: Apache-2.0
"""Resources of a core, estimated from its structure without any tool.

Block RAM and multipliers follow the rules of Yosys (`plenofir.fpga.families`) and are equal to its
results. Look-up tables and flip-flops are weighted sums over the parts of the structure
(`plenofir.fpga.core.weights`); tests compare them with its results. Each engine has its own part
of the estimate (`plenofir.fpga.core`).
"""

from plenofir.fpga.core.border import border_usage
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import SliceEngine
from plenofir.fpga.core.memory import Memory
from plenofir.fpga.core.sharpener import sharpener_usage
from plenofir.fpga.core.weights import multiplier_units, usage_of_parts
from plenofir.fpga.devices import Usage
from plenofir.fpga.families import FAMILIES, Family
from plenofir.refocus.arithmetic import ExactArithmetic

VIDEO_USAGES: dict[Family, Usage] = {
    "spartan6": Usage(lut=4100, flip_flops=3885, dsp=5),
    "ecp5": Usage(lut=8640, flip_flops=4450, dsp=5),
    # For boards without an HDMI receiver and its control; block RAM of the black borders.
    "gw2a": Usage(lut=2830, flip_flops=1320, ramb16=1),
}
"""A board without its core, synthesised: receiver, transmitter, timing, control; no block RAM."""


_SLICES_THAT_WAIT = Usage(lut=20, flip_flops=12)
"""The FIFO of slices beside the input FIFO, of cores with several."""


def slice_engine(core: CoreConfiguration) -> SliceEngine:
    """The engine of a core for one slice at a time; others cannot be estimated here."""
    assert isinstance(core.engine, SliceEngine), core.engine.kind
    return core.engine


def memories(core: CoreConfiguration) -> tuple[Memory, ...]:
    """Memories of a raster core: those of its engine, FIFOs, row buffers."""
    found = list(slice_engine(core).memories(core))
    data_bits = core.pixels_per_clock * core.channels * core.pixel_bits
    n = core.parallel_rows
    input_words = core.line_tokens(core.max_columns) + 2 * n
    found.append(Memory("input FIFO", (input_words - 1).bit_length(), data_bits + 2, 1))
    under_way = 2 + 2 * (n > 1) + core.array_clocks
    output_words = (2 * core.max_columns + n if n > 1 else 0) + 2 * (under_way + 1)
    width = data_bits + 2 + core.slice_bits + 1
    found.append(Memory("output FIFO", (output_words - 1).bit_length(), width, n))
    if n > 1:
        found.append(Memory("row buffers", core.column_bits, data_bits, n - 1))
    return tuple(found)


def reciprocal_bits(value_max: int, divisor: int) -> tuple[int, int]:
    """Bits of both factors of divide_round: value + half the divisor, and the reciprocal."""
    largest = value_max + divisor // 2
    exponent = next(t for t in range(64) if (-(1 << t)) % divisor * largest < 1 << t)
    return largest.bit_length(), (-(-(1 << exponent) // divisor)).bit_length()


def _products(core: CoreConfiguration) -> tuple[int, tuple[int, int]]:
    """Number of products of a raster core, and the bits of both factors.

    None for stored products and for M of a power of two; those of a normalised border are in
    `border_usage`.
    """
    divisor = core.micro_image_size ** (2 * core.order + 2)
    shifted = divisor & (divisor - 1) == 0
    if not isinstance(core.arithmetic, ExactArithmetic) or core.normalises or shifted:
        return 0, (0, 0)
    largest = core.arithmetic.largest_sum(core.micro_image_size, core.pixel_bits, core.order)
    number = core.channels * core.parallel_rows * core.pixels_per_clock
    return number, reciprocal_bits(largest, divisor)


def multipliers(core: CoreConfiguration, family: Family = "spartan6") -> int:
    number, factors = _products(core)
    return number * multiplier_units(*factors, family) if number else 0


def structure(core: CoreConfiguration, family: Family = "spartan6") -> dict[str, int]:
    """Bits of each part of a raster core that takes look-up tables and flip-flops."""
    number, (a, b) = _products(core)
    in_logic = 0 if FAMILIES[family].multipliers else number * a * b
    return {**slice_engine(core).structure(core), "product bits": in_logic}


def estimate(core: CoreConfiguration, family: Family = "spartan6") -> Usage:
    """Estimate the resources of a raster core on a device.

    Block RAM and multipliers are those of Yosys, LUTs and flip-flops within 15 % of them (for an
    ECP5, of nextpnr's).
    """
    engine = slice_engine(core)
    parts, found = structure(core, family), memories(core)
    usage = usage_of_parts(engine.kind, parts, found, family, multipliers(core, family))
    if len(core.shifts) > 1:
        usage += _SLICES_THAT_WAIT
    usage += sharpener_usage(core, core.pixels_per_clock, family)
    return usage + border_usage(core, core.pixels_per_clock, family)
