# SPDX-License-Identifier: Apache-2.0
"""Drawn generics: VHDL and Python refuse the same cores, and each refusal names a generic."""

import math
import random
import re

import pytest

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.engine import PIXELS_PER_CLOCK
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.ground.errors import InputError
from plenofir.refocus import ExactArithmetic, StoredProductArithmetic
from plenofir_tb.refusals import Elaborator, declared, draw_integer, may_be, seeded

SETS = ("-3", "0", "1", "2 5", "-1 0 1", "10 -10 5", "300", "4096", "-4096", "2 x")
CHOICES: dict[str, tuple[int | str | bool, ...]] = {
    "SHIFTS": SETS,
    "SHARPENING": (" ", " ", "4", "0 4", "4 4 4", "x", "17"),
    "BOX": (" ", " ", "1", "3", "1 2", "2 2 2", "0", "x"),
    "ENGINE": ("fir", "moving_sum", "moving_sum"),
    "OUTPUTS": ("r", "r", "rm", "rad", "x"),
    "COLOURS": (" ", "00ff00", "00ff00" * 2, "00ff00" * 3),
    "FONT": ("0" * 3040, "f" * 3040, "0"),
    "TEXTS": tuple("a" * n * m for n in (4, 5, 8) for m in (1, 2, 8)),
    "LABELS": tuple("a" * n * m for n in (1, 2, 5) for m in (2, 3, 16)),
    "STATUS": ("#", "a # b #", "x"),
    "DESCRIPTION": ("x", "resampler 5"),
    # Rarely, as these are mostly refused.
    "PARALLEL_ROWS": (1, 1, 1, 1, 2, 5, 64),
    "PIXELS_PER_CLOCK": (1, 1, 1, 1, 2, 8, 32, 31),
    "ANY_ROWS": (False, False, False, True),
    "CHANNELS": (1, 3, 3, 2),
    "EXACT": (True, True, False),
    "INTERPOLATION_ORDER": (0, 0, 0, 1, 3),
    "PIXEL_BITS": (8, 8, 10, 16, 1),
    "HOLD": (False, False, True),
    "GUARD_BITS": (0, 0, 1, 2, 12),
}
HUNTED = [
    *("raster_refocuser", "focal_stack"),
    "depth_index",
    *("picture_ports", "video_ports", "sensor_front", "sensor_raster", "resampler"),
    *("colour_mosaic", "parallel_to_stream", "stream_to_parallel", "parallel_top", "self_test"),
    "csi_receiver",
    *("text_overlay", "load_port", "command_line", "board_control"),
    *("video_to_stream", "stream_to_video", "light_field_pattern", "hdmi_control"),
]


def draw_core(rng: random.Random) -> CoreConfiguration | None:
    """A random core near the limits; None if single fields are refused, as GUARD_BITS above F."""
    m = min(128, int(2 ** rng.uniform(0, 7.2)))
    reach = rng.choice([3, 8, 40, 600 // m + 2, 4200])
    shifts = tuple(rng.randint(-reach, reach) for _ in range(rng.choice([1, 1, 2, 5])))
    engine = rng.choice(
        [
            FirEngine(hold=rng.random() < 0.3, parallel_rows=rng.choice([1, 1, 2, 63, 64, 65])),
            MovingSumEngine(
                any_rows=rng.random() < 0.5, pixels_per_clock=rng.choice(PIXELS_PER_CLOCK)
            ),
            StackEngine(pixels_per_clock=rng.choice((1, 1, *PIXELS_PER_CLOCK))),
        ]
    )
    stack = isinstance(engine, StackEngine)
    arithmetic = ExactArithmetic()
    if rng.random() < 0.3 and not stack:
        fraction = rng.randint(0, 12)
        arithmetic = StoredProductArithmetic(
            fraction_bits=fraction, guard_bits=rng.randint(0, fraction)
        )
    if isinstance(engine, FirEngine) and engine.hold and rng.random() < 0.7:
        shifts = tuple(m * rng.randint(-2, 2) for _ in shifts)
    sharpening = ()
    if rng.random() < 0.2 and not stack:
        sharpening = tuple(rng.choice([0, 3, 16]) for _ in shifts)
    boxes = ()
    if rng.random() < 0.3:
        steps = [math.gcd(shift, m) for shift in shifts]
        boxes = rng.choice(
            [
                tuple(step * rng.randint(1, m // step) for step in steps),
                (steps[0] * rng.randint(1, m // steps[0]),) * len(shifts),
                (rng.randint(1, m + 1),) * len(shifts),
            ]
        )
    return CoreConfiguration(
        micro_image_size=m,
        shifts=shifts,
        boxes=boxes,
        max_columns=rng.choice([1, 2, 64, 640, 4096, 8192]),
        channels=rng.choice([1, 3]),
        pixel_bits=rng.choice([1, 8, 10, 12, 16]),
        arithmetic=arithmetic,
        align=rng.choice(["centred", "causal"]),
        order=0 if stack else rng.choice([0, 0, 1, 2, 3]),
        sharpening=sharpening,
        border=rng.choice(["zero", "zero", "normalise"]),
        engine=engine,
    )


def draw_index(rng: random.Random) -> DepthIndexConfiguration:
    slices = int(2 ** rng.uniform(0, 8))
    shifts = [rng.randint(-9, 9) for _ in range(rng.randint(1, 3))]
    return DepthIndexConfiguration(
        micro_image_size=rng.randint(2, 128),
        slices=slices,
        shifts=rng.choice([(), (), tuple(range(slices)), tuple(shifts)]),
        radius=rng.randint(0, 8),
        vote_radius=rng.randint(0, 4),
        max_columns=int(2 ** rng.uniform(0, 13)),
        pixels_per_clock=rng.choice((1, 1, *PIXELS_PER_CLOCK)),
        channels=rng.choice([1, 3, 3, 2]),
        pixel_bits=rng.randint(1, 16),
        sharp_too=rng.random() < 0.3,
    )


def is_refused(core: CoreConfiguration | DepthIndexConfiguration) -> bool:
    try:
        core.check_limits()
    except InputError:
        return True
    return False


def agree(elaborator: Elaborator, rng: random.Random, count: int) -> None:
    cores = [draw_core(rng) for _ in range(3 * count)] + [draw_index(rng) for _ in range(count)]
    entities = {"raster_refocuser": "core_verdict", "focal_stack": "stack_verdict"}
    cases = [
        (
            "index_verdict"
            if isinstance(core, DepthIndexConfiguration)
            else entities[core.engine.ENTITY],
            core.generics(),
        )
        for core in cores
    ]
    wrong = [
        f"{core!r}: Python {is_refused(core)}, VHDL {message!r}"
        for core, message in zip(cores, elaborator.refusals(cases), strict=True)
        if is_refused(core) != bool(message)
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("count", [10, pytest.param(150, marks=pytest.mark.slow)])
def test_python_refuses_the_same_cores(elaborator: Elaborator, count: int) -> None:
    agree(elaborator, seeded(), count)


def hunt(elaborator: Elaborator, entity: str, rng: random.Random, count: int) -> None:
    """For values within the declared ranges the entity elaborates, or a message names a generic."""
    kinds = declared(entity)
    cases = []
    for _ in range(count):
        drawn: dict[str, int | bool | str] = {}
        for name, kind in kinds.items():
            choices = [value for value in CHOICES.get(name, ()) if may_be(kind, value)]
            if choices:
                drawn[name] = rng.choice(choices)
            elif kind == "boolean":
                drawn[name] = rng.random() < 0.5
            else:
                drawn[name] = draw_integer(rng, kind)
        cases.append((entity, drawn))
    for (_, values), message in zip(cases, elaborator.refusals(cases), strict=True):
        named = set(re.findall(r"\b[A-Z_]{4,}\b", message))
        assert not message or named, (message, values)


@pytest.mark.drawn(3)
@pytest.mark.parametrize("entity", HUNTED)
def test_drawn_generics_are_built_or_named(elaborator: Elaborator, entity: str) -> None:
    hunt(elaborator, entity, seeded(), 6)


@pytest.mark.slow
@pytest.mark.parametrize("entity", HUNTED)
def test_many_drawn_generics_are_built_or_named(elaborator: Elaborator, entity: str) -> None:
    hunt(elaborator, entity, seeded(), 60)
