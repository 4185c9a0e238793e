# SPDX-License-Identifier: Apache-2.0
"""What a core takes of a Spartan-6, estimated from its structure without any tool.

Block RAM and multipliers follow the rules of Yosys (`synth_xilinx -family xc6s`) and are equal to
its results. Look-up tables and flip-flops are sums over the parts of the structure, with weights
that were fitted to synthesised cores (scripts/resources.py fit); tests hold them to its results.
What depends on the engine stands with the engine (`plenofir.fpga.core`).
"""

from collections.abc import Mapping, Sequence

from plenofir.fpga.core.border import border_usage
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import SliceEngine
from plenofir.fpga.core.memory import Memory
from plenofir.fpga.core.sharpener import sharpener_usage
from plenofir.fpga.devices import Family, Usage
from plenofir.refocus.arithmetic import ExactArithmetic

# Unsigned bits that a side of a DSP48A1 takes.
_DSP_BITS = 17
_DSP_LEAST_PRODUCT = 9

# LUTs of four inputs for one of six, and flip-flops on an ECP5 for those on a Spartan-6, which has
# shift registers in LUTs: from the scenes of data/ecp5.json.
LUT4 = 2.1
_ECP5_FLIP_FLOPS = {"moving_sum": 1.4, "fir": 0.9}

VIDEO_USAGES: dict[Family, Usage] = {
    "spartan6": Usage(lut=4100, flip_flops=3885, dsp=5),
    "ecp5": Usage(lut=7600, flip_flops=4200, dsp=5),
}
"""A board without its core, synthesised: receiver, transmitter, timing, control; no block RAM."""


def slice_engine(core: CoreConfiguration) -> SliceEngine:
    """The engine of a core that is set to one slice at a time, which alone can be estimated."""
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


def multipliers(core: CoreConfiguration) -> int:
    """DSP48A1 of a raster core; none for stored products and for M of a power of two."""
    if not isinstance(core.arithmetic, ExactArithmetic) or core.normalises:
        # Those of a normalised border are in `border_usage`.
        return 0
    divisor = core.micro_image_size ** (2 * core.order + 2)
    if divisor & (divisor - 1) == 0:
        return 0
    largest = core.arithmetic.largest_sum(core.micro_image_size, core.pixel_bits, core.order)
    factors = reciprocal_bits(largest, divisor)
    widths = [dsp_parts(bits) for bits in factors]
    # Products of less than nine bits become logic.
    each = sum(a + b >= _DSP_LEAST_PRODUCT for a in widths[0] for b in widths[1])
    return each * core.channels * core.parallel_rows * core.pixels_per_clock


def dsp_parts(bits: int) -> list[int]:
    """Widths with sign that Yosys splits an unsigned factor into."""
    parts = []
    left = bits + 1
    while left > _DSP_BITS + 1:
        parts.append(_DSP_BITS + 1)
        left -= _DSP_BITS
    return [*parts, left]


def structure(core: CoreConfiguration) -> dict[str, int]:
    """Bits of each part of a raster core that look-up tables and flip-flops go to."""
    return slice_engine(core).structure(core)


def estimate(core: CoreConfiguration, family: Family = "spartan6") -> Usage:
    """Estimate what a raster core takes of a device.

    Block RAM and multipliers as Yosys maps them. LUTs and flip-flops within some percent for one
    pixel a clock and a Spartan-6; within a third for several, or an ECP5.
    """
    engine = slice_engine(core)
    return usage_of_parts(
        structure(core),
        (engine.LUT_WEIGHTS, engine.FLIP_FLOP_WEIGHTS),
        memories(core),
        multipliers(core),
        family,
        (LUT4, _ECP5_FLIP_FLOPS[engine.kind]),
        sharpener_usage(core, core.pixels_per_clock) + border_usage(core, core.pixels_per_clock),
    )


def usage_of_parts(
    parts: Mapping[str, int],
    weights: tuple[Mapping[str, float], Mapping[str, float]],
    memories: Sequence[Memory],
    multipliers: int,
    family: Family,
    on_ecp5: tuple[float, float],
    more: Usage = Usage(),  # noqa: B008 (frozen)
) -> Usage:
    """What a design takes: its memories, and its parts, each with its weight.

    `weights` are LUTs and flip-flops of each part on a Spartan-6, `on_ecp5` those of an ECP5 for
    one of these; `more` comes on top.
    """
    in_memories = sum((memory.usage for memory in memories), Usage())
    lut, flip_flops = (
        round(sum(weight * parts[name] for name, weight in table.items())) for table in weights
    )
    usage = in_memories + more + Usage(lut=lut, flip_flops=flip_flops, dsp=multipliers)
    if family == "spartan6":
        return usage
    return Usage(
        lut=round(on_ecp5[0] * usage.lut),
        flip_flops=round(on_ecp5[1] * usage.flip_flops),
        ramb16=usage.block_rams - in_memories.block_rams + sum(m.ecp5_blocks for m in memories),
        dsp=usage.dsp,
    )
