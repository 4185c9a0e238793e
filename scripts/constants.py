# SPDX-License-Identifier: Apache-2.0
"""Measure depth and calibration with each of their constants at half and at double.

Usage: python scripts/constants.py depth|calibration

Writes a table of docs/measured/studies.md between its marks, in some minutes of processor time.
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np

from marks import between_marks
from plenofir.camera import calibration
from plenofir.camera.lightfield import matching
from plenofir.camera.lightfield.disparity import search_disparity
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir_studies.depth_scenes import Truth
from plenofir_studies.depth_trials import trial

sys.path.insert(0, str(project.root() / "golden" / "tests" / "camera" / "calibration"))
from distorted_white import (  # type: ignore[import-not-found]
    DistortedWhite,
    distorted_white,
    ideal_white,
    spots,
)
from harsh_white import harsh_white  # type: ignore[import-not-found]

SCENES = ("planes", 0.01), ("ramp", 0.02), ("twigs", 0.02), ("tiles", 0.05)
# Name, meaning and unit, where the value comes from.
DEPTH_CONSTANTS = (
    ("_STEP", "pixels between candidates in the farthest views", "a quarter of a sample"),
    ("_MISFIT", "difference of views, as a share of the slope", "`report depth`"),
    ("_FLOOR", "difference of views, as a share of white", "half a step of 8 bits"),
    ("_MOST", "limit of a squared difference, in variances", "2.4 sigma"),
    ("_UNSEEN", "cost of a point that no view sees, in variances", "a difference of 1 sigma"),
    ("_TRUST", "share of independent views, of the root of their number", "`report depth`"),
    ("_CHANGE", "cost of the next candidate", "`report depth`"),
    ("_JUMP", "cost of any other candidate", "`report depth`"),
    ("_EDGE", "difference of brightness at an edge, as a share of white", "`report depth`"),
    ("_STIFFNESS", "weight of an equal neighbour against a pixel's vertex", "`report depth`"),
    ("_TIMES", "iterations of the smoothing", "`report depth`"),
    ("_ASIDE", "candidates from the path to the vertex, at most", "`report depth`"),
    ("_SHARP", "costs to exponents of probability", "the reliability plot"),
    ("_NEAR_SIGMA", "lenses around, whose slopes must agree (sigma)", "real captures"),
    ("_AGREED", "share of slopes that agree, confidence from 0 to all", "noise has 0.1 to 0.25"),
    ("_AMONG_SIGMA", "lenses around, which must be sure (sigma)", "real captures"),
    ("_AMONG_SURE", "their mean confidence, from 0 to all", "real captures"),
)


def cells(truths: list[Truth]) -> str:
    """Percent of pixels off by more than 0.03 and 0.07, and of sure ones, for each scene."""
    results = []
    for truth in truths:
        disparity = search_disparity(truth.raw, truth.m).disparity
        part = slice(8, -8), slice(8, -8)
        error = np.abs(disparity.pixels_per_view - truth.a)[part]
        shares = error > 0.03, error > 0.07, disparity.confidence[part] >= 0.9
        results.append(", ".join(f"{share.mean():.1%}".rstrip("%") for share in shares))
    return " | ".join(results)


def changed(kept: Any, factor: float) -> Any:
    """A constant, or each of several, times a factor."""
    if isinstance(kept, tuple):
        return tuple(factor * one for one in kept)
    return type(kept)(factor * kept)


def depth() -> list[str]:
    """The table of depth."""
    truths = [trial(name, noise) for name, noise in SCENES]
    head = " | ".join(f"{name}, {noise:.0%}" for name, noise in SCENES)
    lines = [
        f"| constant of `camera/lightfield/matching.py` | origin | value | {head} |",
        "| --- " * 7 + "|",
        f"| | | as they are | {cells(truths)} |",
    ]
    for name, meaning, origin in DEPTH_CONSTANTS:
        kept = getattr(matching, name)
        for factor in (0.5, 2):
            value = changed(kept, factor)
            setattr(matching, name, value)
            words = f"`{name}`: {meaning} | {origin}" if factor < 1 else "|"
            lines.append(f"| {words} | {value} | {cells(truths)} |")
        setattr(matching, name, kept)
    return lines


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
    "scattered": scattered,
}
# Module, name, meaning and unit, where the value comes from.
CALIBRATION_CONSTANTS = (
    ("lattice", "_WEAKEST", "least peak of the autocorrelation, of its middle", "chosen"),
    ("lattice", "_SAME", "vectors of equal lattices differ by less, of a pitch", "chosen"),
    ("lattice", "_UNUSUAL_LAYOUT", "deviation from both layouts, pitches", "chosen"),
    ("lattice", "_OF_THE_WHOLE", "score of a finer lattice, of the coarser one's", "chosen"),
    ("fit", "_LIKELY", "least score of a lattice, of the best one's", "chosen"),
    ("fit", "_LARGEST_MISFIT", "deviation of lens vectors, of a pitch", "chosen"),
    ("fit", "_GROWTH", "factor of the radius that is fitted from round to round", "chosen"),
    ("fit", "_MISSING", "brightness of a missing lens, of those around it", "chosen"),
    ("fit", "_LARGEST_SCATTER", "scatter of centroids, pitches", "chosen"),
    ("fit", "_FEWEST_USED", "lenses that must fit, of all", "chosen"),
    ("fit", "_SETTLED", "last movement of a centre, pixels", "chosen"),
    (
        "fit",
        "_LARGEST_CENTRE_ERROR",
        "standard error of a centre, pixels",
        "chosen",
    ),
    ("fit", "_NARROWER", "window of the second measurement, of the first", "drawn images"),
    ("fit", "_REPEATED", "weight of what it moves, in the standard error", "drawn images"),
    ("fit", "_HARMED", "growth of the variance per share of outliers", "drawn images"),
    ("fit", "_SURE", "standard errors of the standard error added", "one sigma"),
    ("centroids", "HALF_WIDTH", "half width of the window, pitches", "a little over a cell"),
    ("centroids", "CORE_HALF_WIDTH", "half width of the window in the middle, pitches", "chosen"),
    ("centroids", "_ALIKE", "correlation of slope and shift, for shifts only", "chosen"),
    ("robust", "_TUKEY", "outliers, robust standard deviations", "usual for the biweight"),
    ("bending", "_TUKEY", "outliers, robust standard deviations", "usual for the biweight"),
    ("bending", "_TOGETHER", "common part of the scatter", "drawn images"),
    ("bending", "_EVEN_ODDS", "logarithm of odds for another model", "e^4 = 55 to 1"),
    ("bending", "_COMMON", "common error: pixels, pitches, pixels^2 per pitch", "drawn images"),
    ("growing", "_SMALL_PITCH", "pitch of small micro images, pixels", "chosen"),
    ("growing", "_ALIKE_PLACES", "mean of exp(2 pi i centre)", "chosen"),
    ("growing", "_UNSURE_LIGHT", "part of shifts by light that remains", "drawn images"),
    ("growing", "_UNSURE_BENT", "part of shifts by a changing pitch that remains", "drawn images"),
    ("growing", "_WORSE", "growth of scatter by an accepted correction", "chosen"),
    ("light", "_DARKEST", "least light divided by, of the brightest", "chosen"),
    ("light", "_HALF_WEIGHT", "brightness with half the weight, of the brightest", "chosen"),
    ("white", "DIMMEST", "dimmest lens that counts, of the usual brightness", "chosen"),
    ("white", "_BRIGHTEST", "brightest lens that counts, of the usual brightness", "chosen"),
    ("white", "_UNLIT", "brightness of an unlit lens, of the usual", "chosen"),
    ("white", "_EVEN_LIGHT", "variation of brightness that tells the dark level", "chosen"),
    ("white", "_WIDER", "darkness of gaps per area of a cell, of the brightest", "chosen"),
    ("white", "_LARGE_PITCH", "pitch from which borders are located, pixels", "drawn images"),
    ("white", "_SPOTS_FROM", "share of a spot's light in its middle", "drawn images, 0.5 to 0.9"),
    ("white", "_BRIGHT_GAP", "gaps of touching micro images, of the clipped level", "chosen"),
    ("white", "_SMALLEST_CELL", "least scale of windows under distortion", "chosen"),
    ("checks", "_EVEN_CLASSES", "brightness of every second row, of the usual", "chosen"),
    ("checks", "_UNLIKE", "difference of every second row, of the contrast", "chosen"),
    ("checks", "_MOST_ALIKE", "share of outliers that belong together", "drawn images"),
    ("pixels", "_USUAL", "prior of the lowest frequency, of the mean brightness", "chosen"),
    ("pixels", "_FINEST", "highest frequency, waves per pixel", "pixels average finer ones"),
)


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
        "| constant of `camera/calibration` | origin | value | at half | at double |",
        "| --- " * 5 + "|",
    ]
    room = calibration.__name__
    modules = [module for name, module in sys.modules.items() if name.startswith(room)]
    for module, name, meaning, origin in CALIBRATION_CONSTANTS:
        kept = getattr(import_module(f"{room}.{module}"), name)
        users = [one for one in modules if getattr(one, name, None) is kept]
        results = []
        for factor in (0.5, 2):
            for user in users:
                setattr(user, name, changed(kept, factor))
            now = {one: worst_and_claimed(white) for one, white in whites.items()}
            texts = [f"{n} {told(now[n])}" for n in whites if differs(usual[n], now[n])]
            results.append("; ".join(texts) or "as it is")
        for user in users:
            setattr(user, name, kept)
        lines.append(
            f"| `{module}.{name}`: {meaning} | {origin} | {kept} | {results[0]} | {results[1]} |"
        )
    return lines


def main(room: str) -> None:
    """Measure all constants of a room."""
    lines = {"depth": depth, "calibration": calibrated}[room]()
    page = project.root() / "docs" / "measured" / "studies.md"
    page.write_text(between_marks(page.read_text(), f"{room} constants", "\n".join(lines)))


if __name__ == "__main__":
    main(sys.argv[1])
