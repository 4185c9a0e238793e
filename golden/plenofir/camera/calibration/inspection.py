# SPDX-License-Identifier: Apache-2.0
"""The fill factor from a white image: micro images with gaps, touching or overlapping.

It is measured on the mean micro image (section 4.1.2, Fig. 4.4).
"""

from dataclasses import dataclass
from math import log2
from typing import Literal

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.calibrate import calibrate, unit_vectors
from plenofir.camera.calibration.centroids import Image32, core_brightness, reach
from plenofir.camera.calibration.frames import white_signal
from plenofir.camera.calibration.grid import Flags, Floats, Indices, Layout
from plenofir.camera.calibration.record import Calibration
from plenofir.camera.calibration.shading import extents
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

Verdict = Literal["gaps", "touching", "overlapping"]

_REACH = 0.75
"""Half width of a mean micro image in pitches: beyond the corners of its cell."""
_LARGEST_STEP_PX = 0.5
_SAMPLES = 61
_MOST_SAMPLES = 241
_MEAN_LENSES = 400
# Micro images touch if half way to the neighbours they are brighter than this share of the middle.
_TOUCHING = 0.5
# Micro images overlap if half way is brighter than the middle by the first factor, or nowhere
# darker than a share of it. Gaps between touching discs are smaller in hexagonal arrays and for few
# pixels.
_BRIGHTER = 1.15
_NOWHERE_DARK = {"rectangular": 0.22, "hexagonal-rows": 0.5, "hexagonal-columns": 0.5}
_FEW_PIXELS, _NOWHERE_DARK_OF_FEW = 7.0, 0.6
# Lenses of a white image scatter around the smooth light by less than this share (robust).
LARGEST_UNEVENNESS = 0.04


@dataclass(frozen=True, eq=False)
class MeanMicroImage:
    """Mean of many micro images."""

    values: Floats  # Grey levels, shape (n, n).
    # Where they are along each axis, in pitches from the centre, shape (n,). The axes are those of
    # the grid.
    places: Floats
    cell: Flags  # Whether a place is nearer to this lens than to any other, shape (n, n).
    layout: Layout

    def at(self, points: Floats) -> Floats:
        """Grey levels at points (y, x) in pitches, shape (..., 2)."""
        step = self.places[1] - self.places[0]
        index = np.moveaxis((points - self.places[0]) / step, -1, 0)
        return np.asarray(ndimage.map_coordinates(self.values, index, order=1, mode="nearest"))


def neighbours(layout: Layout) -> Floats:
    """Neighbouring lenses, (y, x) in pitches, shape (4 or 6, 2)."""
    if layout == "rectangular":
        return np.array([[0, 1], [0, -1], [1, 0], [-1, 0]], dtype=np.float64)
    angles = np.radians(np.arange(6) * 60 + (30 if layout == "hexagonal-columns" else 0))
    return np.stack([np.sin(angles), np.cos(angles)], axis=-1)


def _whole_lenses(calibration: Calibration, part: Flags | None) -> Indices:
    """Lenses whose surroundings lie in the image, (row, column) of each."""
    centres = calibration.centres
    margin = _REACH * np.sqrt(2) * calibration.grid.lens_pitch + 1
    end = np.array(calibration.image_shape) - 1
    whole = ((centres > margin) & (centres < end - margin)).all(axis=-1)
    return np.argwhere(whole if part is None else whole & part)


def mean_micro_image(
    signal: Image32, calibration: Calibration, part: Flags | None = None, *, where: str = "image"
) -> MeanMicroImage:
    """Take the mean (median) of the micro images of a white or spot image.

    `calibration`: where the micro images are. `part`: lenses that count, shape
    `Calibration.lenses`; None for all. Result: of up to 400 of them, drawn at random (always the
    same). Raises `InputError` if none of them is in the image as a whole.
    """
    pitch = calibration.grid.lens_pitch
    centres, levels = calibration.centres, calibration.lens_brightness
    chosen = _whole_lenses(calibration, part)
    if not len(chosen):
        raise InputError("shows no whole micro image; use a larger image", where=where)
    few = np.random.default_rng(5).permutation(len(chosen))[:_MEAN_LENSES]
    rows, columns = chosen[few].T
    samples = int(np.ceil(2 * _REACH * pitch / _LARGEST_STEP_PX)) | 1
    places = np.linspace(-_REACH, _REACH, min(max(samples, _SAMPLES), _MOST_SAMPLES))
    down, right = unit_vectors(calibration.grid.vectors)
    moves = pitch * (places[:, np.newaxis, np.newaxis] * down + places[:, np.newaxis] * right)
    points = centres[rows, columns][:, np.newaxis, np.newaxis] + moves
    values = ndimage.map_coordinates(signal, np.moveaxis(points, -1, 0), order=1, mode="nearest")
    light = levels[rows, columns][:, np.newaxis, np.newaxis]
    y, x = np.meshgrid(places, places, indexing="ij")
    grid = np.stack([y, x], axis=-1)
    layout = calibration.grid.layout
    own = np.asarray(((grid @ neighbours(layout).T) <= 0.5 + 1e-9).all(axis=-1))
    return MeanMicroImage(np.median(values / light, axis=0), places, own, layout)


@dataclass(frozen=True)
class FillFactor:
    """How micro images fill the sensor.

    Attributes
    ----------
    verdict
        "gaps" between them, "touching", or "overlapping" (Fig. 4.4 c, b to a, a).
    diameter
        Diameter of a disc as large as the part of a micro image that is brighter than half of its
        middle, in pitches.
    share
        Share of the sensor that is lit to that level: the fill factor.
    between
        Brightness half way to the neighbours, as a share of the middle's.
    darkest
        Brightness of the darkest place, as a share of the middle's.
    """

    verdict: Verdict
    diameter: float
    share: float
    between: float
    darkest: float

    @property
    def stops_to_touch(self) -> float:
        """Stops by which the aperture can be opened until round micro images touch."""
        return -2 * log2(self.diameter)


def nowhere_dark(layout: Layout, pitch_px: float, darkest: float) -> bool:
    """Whether there is no dark gap between micro images, as if they overlap.

    `layout`: arrangement of the lenses. `pitch_px`: distance of neighbouring micro images in
    pixels. `darkest`: brightness of the darkest place, as a share of the middle's. Result: whether
    that place is brighter than it is between sharp micro images that touch.
    """
    many = pitch_px >= _FEW_PIXELS
    return darkest > (_NOWHERE_DARK[layout] if many else _NOWHERE_DARK_OF_FEW)


def fill_factor(mean: MeanMicroImage, pitch_px: float) -> FillFactor:
    """Whether micro images touch, overlap or leave gaps, from the mean micro image.

    `mean`: of a white image. `pitch_px`: distance of neighbouring micro images in pixels. Result:
    its numbers; the level without light is taken from the darkest place where there are gaps.
    """
    near = neighbours(mean.layout)
    smooth = ndimage.gaussian_filter(mean.values, 0.02 / (mean.places[1] - mean.places[0]))
    shown = MeanMicroImage(smooth, mean.places, mean.cell, mean.layout)
    away = np.hypot(*np.meshgrid(mean.places, mean.places, indexing="ij"))
    middle = float(np.median(smooth[away < 0.15]))
    between = float(np.mean(shown.at(near / 2))) / middle
    darkest = float(smooth[mean.cell].min()) / middle
    verdict: Verdict = "gaps"
    if between > _BRIGHTER or nowhere_dark(mean.layout, pitch_px, darkest):
        verdict = "overlapping"
    elif between - darkest > _TOUCHING * (1 - darkest):
        verdict = "touching"
    # The darkest level is black level and stray light.
    half = (darkest + 1) / 2 * middle
    share = float((smooth > half)[mean.cell].mean())
    area = 1.0 if mean.layout == "rectangular" else np.sqrt(0.75)
    return FillFactor(
        verdict=verdict,
        diameter=float(np.sqrt(4 * area * share / np.pi)),
        share=share,
        between=between,
        darkest=darkest,
    )


def unevenness(signal: Image32, calibration: Calibration) -> float:
    """How much lenses differ from the smooth light around them: robust share.

    `calibration`: where the micro images are. Result: robust standard deviation; small for a white
    image, large where a picture has content.
    """
    inside = ~np.isnan(calibration.centres[..., 0])
    pitch = extents(calibration.grid)
    margin = int(reach(max(pitch)))
    padded = np.pad(signal, margin, mode="edge")
    level = core_brightness(padded, calibration.centres[inside] + margin, pitch)
    share = level / calibration.lens_brightness[inside]
    return float(1.4826 * np.median(np.abs(share / np.median(share) - 1)))


@dataclass(frozen=True, eq=False)
class WhiteInspection:
    """A white image, inspected.

    Attributes
    ----------
    calibration
        Its grid; of overlapping micro images it need not be that of the lenses.
    fill
        Whether micro images touch, overlap or leave gaps.
    unevenness
        Of `unevenness`.
    darkest_lens
        Smooth brightness of the darkest lens, as a share of the brightest.
    """

    calibration: Calibration
    signal: Image32
    mean: MeanMicroImage
    fill: FillFactor
    unevenness: float
    darkest_lens: float


def inspect_white(
    white: Image,
    dark: Image | None = None,
    *,
    full_scale: int | None = None,
    where: str = "white image",
    dark_where: str = "dark frame",
) -> WhiteInspection:
    """Recognise and inspect a white image.

    `white`, `dark`, `full_scale`: as for `plenofir.camera.calibration.calibrate`. Raises
    `InputError` if it is not a white image, or cannot be used.
    """
    found = calibrate(white, dark, full_scale=full_scale, where=where, dark_where=dark_where)
    signal = white_signal(white, dark, full_scale=full_scale, where=where, dark_where=dark_where)
    uneven = unevenness(signal, found)
    if uneven > LARGEST_UNEVENNESS:
        raise InputError(
            "is not evenly lit: lenses differ from their neighbours by "
            f"{100 * uneven:.0f} %, {100 * LARGEST_UNEVENNESS:.0f} % are allowed; "
            "photograph an evenly lit, diffuse surface",
            where=where,
        )
    mean = mean_micro_image(signal, found, where=where)
    smooth = found.lens_brightness[found.inside]
    return WhiteInspection(
        calibration=found,
        signal=signal,
        mean=mean,
        fill=fill_factor(mean, found.grid.lens_pitch),
        unevenness=uneven,
        darkest_lens=float(np.percentile(smooth, 1)),
    )
