# SPDX-License-Identifier: Apache-2.0
"""Measure depth and calibration with each of their constants at half and at double.

Usage: python scripts/constants.py depth|calibration

Writes a table of docs/measured/studies.md between its marks, in some minutes of processor time.
"""

import sys
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from marks import between_marks
from plenofir import camera
from plenofir.camera import calibration
from plenofir.camera.focused import FocusedCapture, search_depth
from plenofir.camera.lightfield.disparity import search_disparity
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir_studies.depth_scenes import Truth
from plenofir_studies.depth_trials import trial

sys.path.insert(0, str(project.root() / "golden" / "tests"))
sys.path.insert(0, str(project.root() / "golden" / "tests" / "camera" / "calibration"))
sys.path.insert(0, str(project.root() / "golden" / "tests" / "camera" / "focused"))
import test_focused_pictures as focused_pictures  # type: ignore[import-not-found]
from distorted_white import DistortedWhite, distorted_white, ideal_white, spots  # type: ignore[import-not-found]
from focused_scenes import scene as focused_scene  # type: ignore[import-not-found]
from harsh_white import harsh_white  # type: ignore[import-not-found]

DESCRIPTIONS = Path(__file__).with_name("constants.toml")
SCENES = ("planes", 0.01), ("ramp", 0.02), ("twigs", 0.02), ("tiles", 0.05)
FOCUSED_DEPTHS = 2.3, 2.6, 3.1


def cells(truths: list[Truth]) -> str:
    """Percent of pixels off by more than 0.03 and 0.07, and of sure ones, for each scene."""
    results = []
    for truth in truths:
        try:
            disparity = search_disparity(truth.raw, truth.m).disparity
        except InputError:
            results.append("refused")
            continue
        part = slice(8, -8), slice(8, -8)
        error = np.abs(disparity.pixels_per_view - truth.a)[part]
        results.append(percents(error > 0.03, error > 0.07, disparity.confidence[part] >= 0.9))
    return " | ".join(results)


def focused_cells(truth: Any, capture: FocusedCapture) -> str:
    """Percent of places whose virtual depth is off by more than 3 % and 10 %, and of sure ones."""
    try:
        depth = search_depth(capture)
    except AssertionError:
        # Nothing can be seen so near.
        return "refused"
    inverse = depth.at(capture.shape(), 2)
    off = np.abs(inverse * truth.depth - 1)
    part = focused_pictures.inner(truth)
    sure = depth.at(capture.shape(), 2, confidence=True) >= 0.9
    return percents(off[part] > 0.03, off[part] > 0.1, sure[part])


def percents(*shares: Any) -> str:
    """Means of arrays of truth values."""
    return ", ".join(f"{share.mean():.1%}".rstrip("%") for share in shares)


def changed(kept: Any, factor: float) -> Any:
    """A constant, or each of several, times a factor."""
    if isinstance(kept, tuple):
        return tuple(factor * one for one in kept)
    return type(kept)(factor * kept)


@contextmanager
def set_to(module: str, name: str, factor: float) -> Iterator[Any]:
    """Within the block a constant of a module of `camera`, and what imports it, is changed."""
    users = [import_module(f"{camera.__name__}.{module}")]
    as_it_is = getattr(users[0], name)
    if not name.startswith("_"):
        loaded = [one for path, one in sys.modules.items() if path.startswith(camera.__name__)]
        users = [one for one in loaded if getattr(one, name, None) is as_it_is]
    value = changed(as_it_is, factor)
    for user in users:
        setattr(user, name, value)
    try:
        yield value
    finally:
        for user in users:
            setattr(user, name, as_it_is)


def described(part: str) -> list[tuple[str, str, str, str]]:
    """Module of `camera`, name, meaning, unit and origin of each constant."""
    content = tomllib.loads(DESCRIPTIONS.read_text())[part]
    return [
        (module, name, *texts) for module, names in content.items() for name, texts in names.items()
    ]


def halved_and_doubled(part: str, heads: str, measured: Callable[[], str]) -> list[str]:
    """A table: what is measured with each constant as it is, at half and at double."""
    lines = [
        f"| constant of `camera` | origin | value | {heads} |",
        "| --- " * (4 + heads.count("|")) + "|",
        f"| | | as they are | {measured()} |",
    ]
    for module, name, meaning, origin in described(part):
        for factor in (0.5, 2):
            words = f"`{module}.{name}`: {meaning} | {origin}" if factor < 1 else "|"
            with set_to(module, name, factor) as value:
                lines.append(f"| {words} | {value} | {measured()} |")
    return lines


def depth() -> list[str]:
    """The tables of depth, of standard cameras and of focused ones."""
    truths = [trial(name, noise) for name, noise in SCENES]
    heads = " | ".join(f"{name}, {noise:.0%}" for name, noise in SCENES)
    lines = halved_and_doubled("depth", heads, lambda: cells(truths))
    truth = focused_scene(FOCUSED_DEPTHS)
    capture = focused_pictures.captured(truth)
    heads = "planes at v = " + ", ".join(map(str, FOCUSED_DEPTHS))
    return [
        *lines,
        "",
        *halved_and_doubled("focused", heads, lambda: focused_cells(truth, capture)),
    ]


def scattered() -> DistortedWhite:
    """Lenses that are off by 13 % of the pitch: no grid, to be refused."""
    white = ideal_white((84, 84), 9.3)
    centres = white.centres + np.random.default_rng(0).normal(0, 1.2, white.centres.shape)
    light = np.clip(spots((84, 84), centres, 2.8, 0.7), 0, 1)
    return replace(white, image=np.rint(50000 * light).astype(np.uint16), centres=centres)


WHITES: dict[str, Callable[[], DistortedWhite]] = {
    "tilted": lambda: ideal_white((90, 100), 8.3, tilt=(0.03, 0.01)),
    "barrel": lambda: ideal_white((99, 240), 14.3, bend=0.01, kind="hexagonal-rows"),
    "small": lambda: ideal_white((84, 90), 4.1, kind="hexagonal-columns"),
    "dusty": lambda: distorted_white(9, 12000),
    "drawn": lambda: distorted_white(16, 12000),
    "harsh 1": lambda: harsh_white(1, 30000),
    "harsh 2": lambda: harsh_white(2, 30000),
    "harsh 3": lambda: harsh_white(3, 30000),
    "touching": lambda: harsh_white(500065, repeat=1),
    "scattered": scattered,
}


def worst_and_claimed(white: DistortedWhite) -> tuple[float, float] | None:
    """Error of the worst centre and its standard error in pixels; None for a refusal."""
    try:
        made = calibration.calibrate(white.image)
    except InputError:
        return None
    assert made.evidence is not None
    return float(white.errors(made.centres).max()), made.evidence.centre_error_px


def told(result: tuple[float, float] | None) -> str:
    """Both errors, or the refusal."""
    return "refused" if result is None else "{:.3f} (claimed {:.3f})".format(*result)


def differs(one: tuple[float, float] | None, other: tuple[float, float] | None) -> bool:
    """Whether an error differs by a fifth and 0.003 pixels."""
    if one is None or other is None:
        return one is not other
    return not np.allclose(one, other, rtol=0.2, atol=0.003)


def calibrated() -> list[str]:
    """The table of calibration: what changes."""
    whites = {name: draw() for name, draw in WHITES.items()}
    usual = {name: worst_and_claimed(white) for name, white in whites.items()}
    lines = [
        "As they are: " + "; ".join(f"{name} {told(one)}" for name, one in usual.items()) + ".",
        "",
        "| constant of `camera` | origin | value | at half | at double |",
        "| --- " * 5 + "|",
    ]
    for module, name, meaning, origin in described("calibration"):
        results = []
        for factor in (0.5, 2):
            with set_to(module, name, factor):
                now = {one: worst_and_claimed(white) for one, white in whites.items()}
            texts = [f"{n} {told(now[n])}" for n in whites if differs(usual[n], now[n])]
            results.append("; ".join(texts) or "as it is")
        value = getattr(import_module(f"{camera.__name__}.{module}"), name)
        lines.append(
            f"| `{module}.{name}`: {meaning} | {origin} | {value} | {results[0]} | {results[1]} |"
        )
    return lines


def main(room: str) -> None:
    """Measure all constants of a room."""
    lines = {"depth": depth, "calibration": calibrated}[room]()
    page = project.root() / "docs" / "measured" / "studies.md"
    page.write_text(between_marks(page.read_text(), f"{room} constants", "\n".join(lines)))


if __name__ == "__main__":
    main(sys.argv[1])
