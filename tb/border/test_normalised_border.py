# SPDX-License-Identifier: Apache-2.0
"""The cores with a normalised border, against the bit-true model: every pixel of every frame."""

import random

import pytest

from plenofir.fpga.core.configuration import CoreConfiguration as Core
from plenofir.fpga.core.engine import PIXELS_PER_CLOCK
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir_tb.runner import Case, draw_seed, run_cases


def border_core(m: int, shifts: tuple[int, ...], spare: int = 4, **fields: object) -> Core:
    """A core with the longest lines without a pause; frames have shorter ones, too."""
    core = Core.model_validate(
        {"micro_image_size": m, "shifts": shifts, "max_columns": 64, "border": "normalise"} | fields
    )
    pixels = core.pixels_per_clock
    tokens = max(core.band_steps(1), -(-2 * m // pixels))
    core = core.model_copy(update={"max_columns": (tokens - 1) * pixels + 1 + spare})
    core.check_limits()
    return core


def border_case(core: Core) -> Case:
    """Frames of many sizes, stalls, gaps, faults and resets through a core."""
    entity = core.engine.ENTITY
    case = {"core": core.model_dump(mode="json"), "thorough": True, "kind": entity}
    return Case(entity, "core.raster_bench", core.generics(), case)


def sums(pixels: int = 1, *, any_rows: bool = False) -> MovingSumEngine:
    return MovingSumEngine.model_validate({"pixels_per_clock": pixels, "any_rows": any_rows})


# Cases share simulations, whose start-up takes most of the time.
SMALL = [
    border_core(3, (2,)),
    border_core(3, (-1, 4), engine=sums(), channels=3),
    border_core(2, (3,), engine=sums(2)),
    border_core(2, (-1, 2), engine=StackEngine(input_lines=2)),
]
# Each covers something else: orders, alignments, widths, several slices, hold, lines that do not
# fill their last token, outputs without any view.
MORE = [
    border_core(1, (2,)),
    border_core(5, (-3, 2), channels=3, engine=FirEngine(broadcast_taps=4)),
    border_core(4, (0,), pixel_bits=16),
    border_core(3, (-3, 0, 3), engine=FirEngine(hold=True)),
    border_core(3, (-2, 1, 3), order=1),
    border_core(2, (3,), order=3),
    border_core(3, (-4, 5), align="causal"),
    border_core(4, (1,), pixel_bits=1, engine=sums(any_rows=True)),
    border_core(3, (-1, 2), order=1, engine=sums(any_rows=True)),
    border_core(5, (-2, 0, 4), channels=3, engine=sums()),
    border_core(2, (2, -3), order=2, engine=sums()),
    border_core(3, (2, 4), engine=sums(4)),
    border_core(5, (0, -1), engine=sums(8)),
    border_core(3, (1, -2), order=1, channels=3, engine=sums(2)),
    border_core(2, (1,), align="causal", engine=sums(16)),
    border_core(5, (-3, 0, 3), channels=3, engine=StackEngine(input_lines=5)),
    border_core(4, (2, -2, 1), pixel_bits=16, engine=StackEngine(input_lines=4)),
    border_core(3, (5,), align="causal", engine=StackEngine(input_lines=3)),
]


def test_stalls_gaps_faults() -> None:
    run_cases([border_case(core) for core in SMALL])


@pytest.mark.drawn(1)
@pytest.mark.parametrize("part", range(12))
def test_more_cores(part: int) -> None:
    run_cases([border_case(core) for core in MORE[part::12]], long=True)


def random_core(rng: random.Random) -> Core:
    """Draw a core of any kind."""
    m = rng.choice([1, 2, 3, 4, 5, 6, 7, 9, 11, 16])
    most = max(12 // m, 2) * m
    shifts = tuple(rng.sample(range(-most, most + 1), rng.choice([1, 1, 2, 4])))
    order, bits = rng.choice([0, 0, 1, 2, 3]), rng.choice([8, 8, 16, rng.randint(1, 16)])
    engine: FirEngine | MovingSumEngine | StackEngine = StackEngine(input_lines=m)
    kind = rng.choice(["fir", "moving_sum", "moving_sum", "stack"])
    if kind == "fir":
        hold = rng.random() < 0.2
        if hold:
            shifts = tuple({2 * m * (shift // m) for shift in shifts})
        engine = FirEngine(hold=hold, broadcast_taps=rng.choice([0, 0, 5]))
    elif kind == "moving_sum":
        engine = sums(rng.choice([1, *PIXELS_PER_CLOCK]), any_rows=rng.random() < 0.4)
    else:
        order = 0
    while m ** (2 * order + 2) >= 1 << 24:
        order -= 1
    bits = min(bits, 30 - (m ** (2 * order + 2)).bit_length())
    return border_core(
        m,
        shifts,
        rng.choice([0, 3, 9]),
        channels=rng.choice([1, 1, 3]),
        pixel_bits=bits,
        align=rng.choice(["centred", "centred", "causal"]),
        order=order,
        engine=engine,
    )


def short_core(rng: random.Random) -> Core:
    """The same, with frames that do not take long."""
    while True:
        core = random_core(rng)
        lines = core.frame_lines(1) + 2 * core.micro_image_size
        if core.line_tokens(core.max_columns) * lines * len(core.shifts) < 6000:
            print(core)
            return core


@pytest.mark.slow
@pytest.mark.parametrize("number", range(8))
def test_random_configurations(number: int) -> None:
    seed = draw_seed()
    print(f"configurations drawn with SEED={seed}")
    rng = random.Random(seed + number)
    run_cases([border_case(short_core(rng)) for _ in range(6)])
