# SPDX-License-Identifier: Apache-2.0
"""The report on boxes of fewer samples than M: nearness to the object, noise, resolution; Markdown.

Beside them are the other ways to a sharper picture: sharpening with taps a lens apart, and views
enlarged and moved by cubic splines.
"""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from plenofir.camera.lightfield import all_in_focus
from plenofir.camera.lightfield.stack import FocalStack
from plenofir.refocus import best_picture, refocus
from plenofir.refocus.sharpness import TEXTURE, confidence_level, depth_index
from plenofir_studies import resolution
from plenofir_studies import sharpening as study
from plenofir_studies.methods import shifted_by_interpolation
from plenofir_studies.report_parts import Progress, Report, table

SETTINGS = ((5, 3), (7, 3), (9, 4))
"""M and a' of the planes."""
EDGES = ((5, 5), (5, 6), (5, 4), (7, 3), (9, 4))
_NOISES = (0, 2, 5)
_AWAY = (Fraction(0), Fraction(1, 20), Fraction(1, 10), Fraction(1, 5), Fraction(2, 5))
# Slices on both sides of the one in focus.
_BESIDE = 2

Way = Callable[[Any, int, int], Any]


def _nearest(box: int | None, sharpen: str = "off") -> Way:
    return lambda raw, m, shift: refocus(raw, m, Fraction(shift, m), box=box, sharpen=sharpen)


def _best(box: int | None) -> Way:
    return lambda raw, m, shift: best_picture(raw, m, Fraction(shift, m), box=box)


def _everywhere(box: int | None) -> Way:
    return lambda raw, m, _: all_in_focus(raw, m, box=box)


def _splines(raw: Any, m: int, shift: int) -> Any:
    """Views moved by cubic splines, and their mean enlarged by them."""
    views = shifted_by_interpolation(raw, m, shift, 3)
    return resolution.enlarged(views.astype(np.float64), m, 3)


def by_place(raw: Any, m: int, shift: int, box: int = 3) -> Any:
    """What the depth index of five slices has in focus with a small box, and the rest with M."""
    shifts = range(shift - _BESIDE, shift + _BESIDE + 1)
    settings = [Fraction(k, m) for k in shifts]
    stacks = [FocalStack(raw, m, settings, border="normalise", box=b) for b in (None, box)]
    level = confidence_level(TEXTURE, m, 1, pixel_bits=8 * raw.itemsize)
    return depth_index(stacks[0], m, confidence=level, shifts=shifts, sharp=stacks[1]).image


WAYS: tuple[tuple[str, Way], ...] = (
    ("B = 1", _nearest(1)),
    ("B = 2", _nearest(2)),
    ("B = 3", _nearest(3)),
    ("B = M", _nearest(None)),
    ("M, sharpened", _nearest(None, "auto")),
    ("splines", _splines),
    ("by place, 3", by_place),
    ("best, 2", _best(2)),
    ("best, 3", _best(3)),
    ("best, M", _best(None)),
    ("all in focus, 3", _everywhere(3)),
    ("all in focus, M", _everywhere(None)),
)
"""Heads of the tables, with the ways to a picture in focus."""


def decibels(field: study.Plane, picture: Any, want: Any = None) -> float:
    """PSNR of a picture of a plane against the object, where all views reach it."""
    inside = slice(field.border, -field.border)
    want = field.pixels if want is None else want
    return study.decibels(picture[inside, inside], want[inside, inside])


def _planes() -> list[str]:
    rows = []
    for m, shift in SETTINGS:
        for noise in _NOISES:
            field = study.plane(m, shift, study.TEXTURES[1], noise=noise)
            values = [decibels(field, way(field.raw, m, shift)) for _, way in WAYS]
            rows.append([f"{m}, {shift}", str(noise), *(f"{value:.1f}" for value in values)])
    return table(["M, a'", "noise", *(name for name, _ in WAYS)], rows)


def _depths() -> list[str]:
    ways = (("B = 2", _best(2)), ("B = 3", _best(3)), ("B = M", _best(None)))
    rows = []
    for away in _AWAY:
        field = study.plane(7, 3, study.TEXTURES[1], away=away, noise=2)
        pictures = [way(field.raw, 7, 3) for _, way in ways]
        cells = [
            f"{decibels(field, picture):.1f} / {decibels(field, picture, field.blurred):.1f}"
            for picture in pictures
        ]
        rows.append([str(away), *cells])
    return table(["away by a =", *(name for name, _ in ways)], rows)


def half_contrast(m: int, shift: int, way: Way) -> float:
    """Frequency, in cycles a lens, at which a slanted edge in focus has half of its contrast."""
    raw = resolution.capture(m, Fraction(shift, m), resolution.slanted_edge())
    border = m * (abs(shift) * (m - 1) // (2 * m) + 4)
    return resolution.transfer(resolution.inside(way(raw, m, shift), border), m).half


def _fits(name: str, m: int, shift: int) -> bool:
    """Whether a slice can have the box of a way: `refocus` takes multiples of gcd(a', M)."""
    return shift % m > 0 or not name.startswith("B = ") or name == "B = M"


def _edges() -> list[str]:
    rows = []
    for m, shift in EDGES:
        cells = [
            f"{half_contrast(m, shift, way):.3f}" if _fits(name, m, shift) else "-"
            for name, way in WAYS
        ]
        rows.append([f"{shift}/{m}", *cells])
    return table(["a", *(name for name, _ in WAYS)], rows)


def write_report(folder: Path, progress: Progress | None = None) -> Path:
    sections: tuple[tuple[str, str, Callable[[], list[str]]], ...] = (
        (
            "Planes in focus",
            "PSNR in dB of each pixel against the object. Noise is that of the raw image, in grey "
            "levels. By place: five slices and their depth index. All in focus searches depth.",
            _planes,
        ),
        (
            "Planes out of focus",
            "M = 7, a' = 3, 2 grey levels of noise, `best_picture`: PSNR against the object / "
            "against what an ideal refocuser gives, the mean of all views.",
            _depths,
        ),
        (
            "Slanted edge",
            "Frequency in cycles a micro lens at which half of the contrast is left. An edge at a "
            "is also blurred by the lens's area and by the pixel's, which is a lenses wide there.",
            _edges,
        ),
    )
    report = Report(folder, "boxes.md", len(sections), progress)
    report.say("# Boxes", "`plenofir report boxes`.")
    for title, text, make in sections:
        report.say(f"## {title}", text)
        report.add(make())
        report.step()
    return report.write()
