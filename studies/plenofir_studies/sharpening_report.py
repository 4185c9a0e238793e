# SPDX-License-Identifier: Apache-2.0
"""The report on sharpening: weights, nearness to the object, noise, harm, pictures; Markdown."""

from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np

from plenofir.ground import project
from plenofir.ground.images import Image, read_image
from plenofir.refocus import automatic_units, refocus
from plenofir.refocus.sharpening import WEIGHT_UNITS
from plenofir_studies import sharpening as study
from plenofir_studies.report_parts import Progress, Report, table

SETTINGS = ((5, 3), (11, 4), (7, 2), (3, 1), (9, 3), (4, 2), (5, 5))
"""M and a' of the tables."""
_NOISES = (0, 2, 5, 10, 20, 40)
_AWAY = (Fraction(0), Fraction(1, 20), Fraction(1, 10), Fraction(1, 5), Fraction(2, 5), Fraction(1))
_CONTRASTS = (45, 80, 120)


def _nearness(nearness: study.Nearness) -> str:
    return f"{nearness.lens:.1f} / {nearness.pixel:.1f}"


def _row(field: study.Plane, order: int = 0) -> list[str]:
    return [_nearness(study.measure(field, b, order)) for b in study.WEIGHTS]


def _heads(first: Sequence[str]) -> list[str]:
    return [*first, *("as it is" if not b else f"b = {b}" for b in study.WEIGHTS)]


def _weights() -> list[str]:
    rows = []
    for order in range(4):
        for m, n, moment, narrow, wide, auto in study.weight_rows(SETTINGS, order):
            values = [f"{64 * float(value):.1f}" for value in (moment, narrow, wide, auto)]
            rows.append([str(order), str(m), str(n), *values])
    heads = ["order", "M", "M/g", "second moment", "best to 1/4", "best to 1/2", "auto"]
    return table(heads, rows)


def _planes() -> list[str]:
    rows = []
    for m, shift in SETTINGS:
        field = study.plane(m, shift, study.TEXTURES[1])
        auto = Fraction(automatic_units(m, shift), WEIGHT_UNITS)
        values = _nearness(study.measure(field, auto))
        rows.append([f"{m}, {shift}", *_row(field), f"{auto}: {values}"])
    return table([*_heads(["M, a'"]), "auto"], rows)


def _orders() -> list[str]:
    field = study.plane(5, 3, study.TEXTURES[1])
    rows = []
    for order in range(4):
        auto = Fraction(automatic_units(5, 3, order), WEIGHT_UNITS)
        values = _nearness(study.measure(field, auto, order))
        rows.append([str(order), *_row(field, order), f"{auto}: {values}"])
    return table([*_heads(["order"]), "auto"], rows)


def _textures() -> list[str]:
    rows = [[texture.name, *_row(study.plane(5, 3, texture))] for texture in study.TEXTURES]
    return table(_heads(["texture"]), rows)


def _noises() -> list[str]:
    rows = [
        [str(noise), *_row(study.plane(5, 3, study.TEXTURES[3], noise=noise))] for noise in _NOISES
    ]
    return table(_heads(["noise / grey levels"]), rows)


def _depths() -> list[str]:
    rows = []
    for away in _AWAY:
        field = study.plane(5, 3, study.TEXTURES[3], away=away)
        measured = [study.measure(field, b) for b in study.WEIGHTS]
        rows.append([str(away), *(f"{one.pixel:.1f} / {one.ideal:.1f}" for one in measured)])
    return table(_heads(["away by a ="]), rows)


def _clipping() -> list[str]:
    rows = []
    for contrast in _CONTRASTS:
        field = study.plane(5, 3, study.TEXTURES[1], contrast=contrast)
        plain, sharp = (study.refocused(field, b) for b in (Fraction(0), Fraction(1, 16)))
        limited = ((sharp == 0) | (sharp == 255)) & (plain > 0) & (plain < 255)
        rows.append([str(contrast), *_row(field), f"{100 * limited.mean():.2f} %"])
    return table([*_heads(["contrast"]), "limited by 1/16"], rows)


def _gains() -> list[str]:
    rows = []
    for m, shift in ((5, 3), (11, 4), (4, 2)):
        units = automatic_units(m, shift)
        derived, measured = study.noise_gain(m, shift, units)
        b = Fraction(units, WEIGHT_UNITS)
        rows.append([f"{m}, {shift}", str(b), f"{derived:.3f}", f"{measured:.3f}"])
    for order in (1, 2, 3):
        units = automatic_units(5, 3, order)
        b = Fraction(units, WEIGHT_UNITS)
        rows.append(
            [f"5, 3, order {order}", str(b), f"at most {study.derived_noise_gain(units):.3f}", "-"]
        )
    return table(["M, a'", "b", "derived", "measured"], rows)


def _beside(*pictures: Image, scale: int) -> Image:
    """Pictures side by side, each pixel a square."""
    enlarged = [picture.repeat(scale, 0).repeat(scale, 1) for picture in pictures]
    gap = np.full((enlarged[0].shape[0], 6, *enlarged[0].shape[2:]), 255, np.uint8)
    parts = [part for picture in enlarged for part in (gap, picture)][1:]
    return np.concatenate(parts, axis=1)


def flower_pictures() -> Image:
    """The flower at a = -3/5, as it is and sharpened, side by side."""
    raw = read_image(project.DATA / "flower_5x5.png")
    a = Fraction(-3, 5)
    rows, columns = raw.shape[:2]
    part = slice(rows // 4, rows // 4 + 260), slice(columns // 3, columns // 3 + 380)
    both = [refocus(raw, 5, a, sharpen=how)[part] for how in ("off", "auto")]
    return _beside(*both, scale=1)


def plane_pictures() -> Image:
    """A plane: the object, refocused, sharpened; and ten times what they are off."""
    field = study.plane(5, 3, study.TEXTURES[2])
    part = slice(40, 160), slice(40, 160)
    want = field.pixels[part]
    pictures = [np.clip(np.rint(want), 0, 255).astype(np.uint8)]
    off = [np.full_like(pictures[0], 128)]
    for b in (Fraction(0), Fraction(1, 16)):
        image = study.refocused(field, b)[part]
        pictures.append(image)
        off.append(np.clip(128 + np.rint(10 * (image - want)), 0, 255).astype(np.uint8))
    upper, lower = _beside(*pictures, scale=2), _beside(*off, scale=2)
    return np.concatenate([upper, np.full((6, upper.shape[1]), 255, np.uint8), lower])


def write_report(folder: Path, progress: Progress | None = None) -> Path:
    sections: tuple[tuple[str, str, Callable[[], list[str]]], ...] = (
        (
            "Weights",
            "In 64ths, at full resolution: b of the second moment, the best b over natural "
            "pictures (power 1/f^2 behind square lenses) with nothing above 1/4 and 1/2 cycle a "
            "lens, and what `auto` takes. For an integer a `auto` is 0: with orders 0 and 1 the "
            "pixel in the middle of a lens has the object's own value.",
            _weights,
        ),
        (
            "Planes",
            "A textured plane in focus; PSNR in dB against the object, for each lens / for each "
            "pixel (the object rendered there).",
            _planes,
        ),
        ("Interpolation", "The same for M = 5, a' = 3 with B-splines of each order.", _orders),
        ("Textures", "M = 5, a' = 3; from smooth to fine.", _textures),
        ("Noise", "Natural texture, M = 5, a' = 3, noise in the raw image.", _noises),
        (
            "Out of focus",
            "The plane lies away from the refocused one (M = 5, a' = 3, natural texture); PSNR of "
            "each pixel against the object / against what an ideal refocuser gives, the mean of "
            "all views.",
            _depths,
        ),
        (
            "Clipping",
            "Contrast is the object's standard deviation in grey levels; the last column has the "
            "pixels that sharpening limits to black or white.",
            _clipping,
        ),
        (
            "Gain of noise",
            "Noise behind sharpening over noise without, as standard deviations: "
            "(1 + 2b)^2 + 2b^2.",
            _gains,
        ),
    )
    report = Report(folder, "sharpening.md", len(sections), progress)
    report.say("# Sharpening at the distance of a lens", "`plenofir report sharpening`.")
    for title, text, make in sections:
        report.say(f"## {title}", text)
        report.add(make())
        report.step()
    report.say("## Pictures", "The flower at a = -3/5, as it is and with b = 1/16:")
    report.picture("sharpening_flower", flower_pictures())
    report.say(
        "A fine texture at M = 5, a' = 3: the object, refocused, sharpened; below, ten times what "
        "they are off:"
    )
    report.picture("sharpening_plane", plane_pictures())
    return report.write()
