# SPDX-License-Identifier: Apache-2.0
"""Estimated resources between a sensor and the core: mosaic and resampler.

Block RAM and multipliers follow the rules of Yosys, as those of the core do. Look-up tables and
flip-flops are sums over the parts, with weights fitted to the synthesised variants that
`plenofir.plan.figures` lists in ``SENSORS``.
"""

from collections.abc import Iterator

from plenofir.fpga.core.memory import Memory, block_sizes
from plenofir.fpga.core.weights import multiplier_units, usage_of_parts
from plenofir.fpga.devices import Usage
from plenofir.fpga.families import Family
from plenofir.plan.sensor.resampler import ResamplerConfiguration

_GAIN_INTEGER_BITS = 4


def sensor_memories(core: ResamplerConfiguration, *, mosaic: bool) -> Iterator[Memory]:
    m, bits = core.micro_image_size, core.channels * core.pixel_bits
    value = core.pixel_bits + core.guard_bits + _GAIN_INTEGER_BITS
    values = core.channels * value
    if mosaic:
        yield Memory(
            "lines of a mosaic",
            (core.max_columns - 1).bit_length(),
            2 * core.pixel_bits,
            1,
            words=core.max_columns,
        )
        yield Memory("output FIFO of the mosaic", 4, 3 * core.pixel_bits + 3, 1)
    yield Memory("input FIFO", 4, bits + 2, 1)
    words = core.lines // 2 * -(-core.max_columns // 2)
    for size in block_sizes(words, bits):
        yield Memory("ring of raw lines", (size - 1).bit_length(), bits, 4, words=size)
    yield Memory("registers", 6, 32, 1)
    width = core.gains * (core.gain_bits + _GAIN_INTEGER_BITS)
    width += core.moves * 2 * (core.weight_bits + 2)
    if width:
        address_bits = (core.lenses - 1).bit_length()
        yield Memory("table of lenses", address_bits, width, 1, words=core.lenses)
    if core.gains:
        profile_bits = max((m * m - 1).bit_length(), 1)
        yield Memory("profile", profile_bits, core.gain_bits + _GAIN_INTEGER_BITS, 1)
    yield Memory("output FIFO", 6, (values if core.hexagonal else bits) + 2, 1)
    if core.hexagonal:
        yield Memory("lenses of a row", max((m - 1).bit_length(), 1) + 1, values, 2)
        yield Memory("FIFO behind them", 4, bits + 2, 1)


def sensor_multipliers(core: ResamplerConfiguration, family: Family = "spartan6") -> int:
    gain = core.gain_bits + _GAIN_INTEGER_BITS
    sample = core.pixel_bits + core.guard_bits
    # Interpolation in two columns and between them; gain; interpolation between two lenses.
    products = [(core.pixel_bits, core.weight_bits)] * 2
    products += [(core.pixel_bits + core.weight_bits, core.weight_bits)]
    products += [(sample, gain)] * core.gains
    products += [(sample + _GAIN_INTEGER_BITS, core.weight_bits)] * core.hexagonal
    each = sum(multiplier_units(*product, family) for product in products)
    return core.channels * each + core.gains * multiplier_units(gain, gain, family)


def sensor_structure(core: ResamplerConfiguration, *, mosaic: bool) -> dict[str, int]:
    """Parts of the entity ``sensor_raster`` that take look-up tables and flip-flops."""
    bits = core.channels * core.pixel_bits
    return {
        "whole": 1,
        "pixel bits": bits,
        "hexagonal bits": core.hexagonal * bits,
        "moves": int(core.moves),
        "gains": int(core.gains),
        "mosaic bits": mosaic * core.pixel_bits,
        "lines": core.lines,
    }


def sensor_usage(
    core: ResamplerConfiguration, *, mosaic: bool, family: Family = "spartan6"
) -> Usage:
    """Estimate the resources of the resampler, and of a mosaic's interpolation if there is one.

    Multipliers are exact, block RAM up to two too many, LUTs and flip-flops within a few percent on
    a Spartan-6, within a third on an ECP5.
    """
    # The size of the raster is M times the numbers of lenses. Yosys takes a multiplier for each,
    # for Nexus only one; if M is a power of two it is a shift.
    m = core.micro_image_size
    sizes = {"spartan6": 2, "series7": 2, "ecp5": 2, "nexus": 1}.get(family, 0) * (m & (m - 1) != 0)
    return usage_of_parts(
        "sensor",
        sensor_structure(core, mosaic=mosaic),
        list(sensor_memories(core, mosaic=mosaic)),
        family,
        sensor_multipliers(core, family) + sizes,
    )
