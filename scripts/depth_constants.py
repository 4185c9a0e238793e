# SPDX-License-Identifier: Apache-2.0
"""Measure depth with each constant of the search at half and at double.

Usage: python scripts/depth_constants.py

Writes the table of docs/measured/studies.md between its marks, in two minutes of processor time.
"""

import numpy as np

from marks import between_marks
from plenofir.camera.lightfield import matching
from plenofir.camera.lightfield.disparity import search_disparity
from plenofir.ground import project
from plenofir_studies.depth_scenes import Truth
from plenofir_studies.depth_trials import trial

SCENES = ("planes", 0.01), ("ramp", 0.02), ("twigs", 0.02), ("tiles", 0.05)
# Name, meaning and unit, where the value comes from.
CONSTANTS = (
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


def main() -> None:
    """Measure all constants."""
    truths = [trial(name, noise) for name, noise in SCENES]
    head = " | ".join(f"{name}, {noise:.0%}" for name, noise in SCENES)
    lines = [
        f"| constant of `camera/lightfield/matching.py` | origin | value | {head} |",
        "| --- " * 7 + "|",
        f"| | | as they are | {cells(truths)} |",
    ]
    for name, meaning, origin in CONSTANTS:
        kept = getattr(matching, name)
        for factor in (0.5, 2):
            if isinstance(kept, tuple):
                value: object = tuple(factor * one for one in kept)
            else:
                value = type(kept)(factor * kept)
            setattr(matching, name, value)
            words = f"`{name}`: {meaning} | {origin}" if factor < 1 else "|"
            lines.append(f"| {words} | {value} | {cells(truths)} |")
        setattr(matching, name, kept)
    page = project.root() / "docs" / "measured" / "studies.md"
    page.write_text(between_marks(page.read_text(), "depth constants", "\n".join(lines)))


if __name__ == "__main__":
    main()
