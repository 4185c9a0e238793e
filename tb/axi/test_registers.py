# SPDX-License-Identifier: Apache-2.0
"""The registers behind AXI4-Lite, with another project's master: all parts, any access."""

import random
from importlib import metadata

import pytest

from plenofir_tb.register_map import MAP, PARTS
from plenofir_tb.runner import Case, draw_seed, run_cases

pytest.importorskip("cocotbext.axi", reason="cocotbext-axi is missing: scripts/setup.sh tests")


def drawn_case(parts: tuple[str, ...], rng: random.Random, *, accesses: int) -> Case:
    """Registers for random parts, with a random description of the core."""

    def word(name: str, **fixed: int) -> int:
        drawn = {field: rng.getrandbits(bits) for field, (_, bits) in MAP[name].fields.items()}
        return MAP[name].word_of(**{**drawn, **fixed}) & 0x3FFFFFFF

    slices = rng.choice([1, 2, 5, 12]) if {"refocuser", "stack"} & set(parts) else 0
    shifts = [rng.randint(-4096, 4096) for _ in range(slices)]
    weights = [rng.randint(0, 16) for _ in shifts] if rng.random() < 0.5 else [0] * slices
    # A box for each slice, one for all, or none.
    numbers = rng.choice([0, 1, slices]) if slices else 0
    boxes = [rng.randint(1, 128) for _ in range(numbers)]
    words = {
        "parts": sum(1 << PARTS.index(part) for part in parts),
        "geometry": word("geometry", pixels_per_clock=rng.choice([1, 4])),
        "limits": word("limits", max_columns=rng.randint(2, 8192)),
        **{n: word(n) for n in ("engine", "sharpness", "confidence", "resampler", "lenses")},
    }
    generics = {name.upper(): value for name, value in words.items()}
    generics["SHIFTS"] = " ".join(map(str, shifts))
    generics["SHARPENING"] = " ".join(map(str, weights)) if any(weights) else ""
    generics["BOX"] = " ".join(map(str, boxes))
    words |= {"identification": 0x506C6E66, "version": release_word()}
    case = {
        "words": words,
        "shifts": shifts,
        "weights": weights,
        "boxes": boxes if len(boxes) == slices else (boxes or [0]) * slices,
        "accesses": accesses,
        "resets": accesses // 40,
    }
    return Case("refocuser_registers", "axi.registers_bench", generics, case)


def release_word() -> int:
    """What the register `version` reads as: map 1, and the package's release."""
    major, minor, patch = (int(part) for part in metadata.version("plenofir").split("."))
    return 1 << 24 | major << 16 | minor << 8 | patch


SETS = (
    ("refocuser",),
    ("stack",),
    ("stack", "depth_index"),
    ("resampler",),
    ("resampler", "mosaic"),
    ("refocuser", "resampler"),
)


def test_registers() -> None:
    rng = random.Random(draw_seed())
    run_cases([drawn_case(parts, rng, accesses=400) for parts in SETS])


@pytest.mark.slow
def test_many_accesses() -> None:
    rng = random.Random(draw_seed())
    run_cases([drawn_case(parts, rng, accesses=6000) for parts in SETS])
