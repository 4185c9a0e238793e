# SPDX-License-Identifier: Apache-2.0
"""Cores of drawn scenes, whose counts the estimates are fitted to and, with another seed, checked.

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

FITTED, CHECKED = ("fitted", 10), ("checked", 10)
"""Seed and number of the cores that the weights are fitted to, and of those that check them."""
DRAWN_FAMILIES: tuple[Family, ...] = ("series7", "ecp5", "cyclonev", "nexus", "gw2a", "gatemate")
MOST_TAP_BITS = 400  # of a switched filter: taps, channels and bits of a pixel
MOST_PIXEL_BITS = 144  # of a token: pixels, channels and bits of a pixel
MOST_LINE_BITS = 3 << 19  # of line buffers
_ENGINES = (
    *(MovingSumEngine(pixels_per_clock=2), FirEngine(), MovingSumEngine(pixels_per_clock=8)),
    *(MovingSumEngine(), MovingSumEngine(pixels_per_clock=4)),
)


def drawn_cores(seed: str, number: int) -> Iterator[tuple[str, CoreConfiguration]]:
    """So many cores by name, always the same of a seed: M 3 to 15, 1 to 9 slices, 8 to 12 bits."""
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
                yield f"{seed} {place}", core
                break


def _is_small(core: CoreConfiguration) -> bool:
    bits = core.channels * core.pixel_bits
    if isinstance(core.engine, FirEngine):
        fits = core.taps * bits <= MOST_TAP_BITS
    else:
        fits = core.pixels_per_clock * bits <= MOST_PIXEL_BITS
    return fits and core.line_buffer_bits <= MOST_LINE_BITS
