# SPDX-License-Identifier: Apache-2.0
"""Cores of drawn scenes, whose counts the estimates are fitted to, and checked without each.

Both engines come in turn, moving sums with 1, 2, 4 and 8 pixels a clock; all other settings are
drawn. What would take Yosys more than some minutes for a family is left out (`MOST_TAP_BITS`,
`MOST_PIXEL_BITS`, `MOST_LINE_BITS`).
"""

import random
from collections.abc import Iterator

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.families import Family
from plenofir.ground.errors import InputError

DRAWS = {"fitted": 10, "checked": 10, "fresh-2026-11-29": 60}
"""Seeds, and how many cores are drawn with each."""
DRAWN_FAMILIES: tuple[Family, ...] = ("series7", "ecp5", "cyclonev", "nexus", "gw2a", "gatemate")
MOST_TAP_BITS = 400  # of a switched filter: taps, channels and bits of a pixel
MOST_PIXEL_BITS = 144  # of a token: pixels, channels and bits of a pixel
MOST_LINE_BITS = 3 << 19  # of line buffers
_ENGINES = (
    *(MovingSumEngine(pixels_per_clock=2), FirEngine(), MovingSumEngine(pixels_per_clock=8)),
    *(MovingSumEngine(), MovingSumEngine(pixels_per_clock=4)),
)


def drawn_cores() -> Iterator[tuple[str, CoreConfiguration]]:
    """Cores by name, always the same of a seed: M 3 to 15, 1 to 9 slices, 8 to 12 bits."""
    for seed, number in DRAWS.items():
        for place, core in enumerate(_drawn_with(seed, number)):
            yield f"{seed} {place}", core


def is_drawn(name: str) -> bool:
    """Whether a record's name is that of a drawn core."""
    return name.rpartition(" ")[0] in DRAWS


def counted_for(name: str) -> Family:
    """The family whose turn it is with a drawn core."""
    return DRAWN_FAMILIES[int(name.split()[-1]) % len(DRAWN_FAMILIES)]


def _drawn_with(seed: str, number: int) -> Iterator[CoreConfiguration]:
    draw = random.Random(seed)
    for place in range(number):
        engine = _ENGINES[place % len(_ENGINES)]
        while True:
            m, slices = draw.randint(3, 15), draw.randint(1, 9)
            first, step = draw.randint(-m, m), draw.choice((1, 1, 2, m))
            try:
                core = CoreConfiguration(
                    micro_image_size=m,
                    shifts=tuple(first + step * n for n in range(slices)),
                    max_columns=m * draw.randint(240 // m, 1280 // m),
                    channels=draw.choice((1, 3)),
                    pixel_bits=draw.choice((8, 10, 12)),
                    engine=engine,
                )
            except (InputError, ValueError):
                continue
            if _is_small(core):
                yield core
                break


def _is_small(core: CoreConfiguration) -> bool:
    bits = core.channels * core.pixel_bits
    if isinstance(core.engine, FirEngine):
        fits = core.taps * bits <= MOST_TAP_BITS
    else:
        fits = core.pixels_per_clock * bits <= MOST_PIXEL_BITS
    return fits and core.line_buffer_bits <= MOST_LINE_BITS
