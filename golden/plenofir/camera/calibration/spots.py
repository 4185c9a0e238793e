# SPDX-License-Identifier: Apache-2.0
"""How well micro lenses and main lens are focused, from spots of collimated light (section 4.1).

Micro lenses alone image a collimator to a spot each, smallest where the sensor is in their focal
plane (Figs. 4.1, 4.2). The variance of a spot grows with the square of the distance from there, so
a parabola through the variances has its vertex at the best position.

With the main lens focused to infinity a collimator lights one micro lens (Fig. 4.3). Off focus it
lights several, each in another part of its micro image: pixel i of micro lens j with j = -a i + b,
where a is the slice in which the collimator is sharp.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.frames import check_same_size, grey
from plenofir.camera.calibration.grid import Flags, Floats
from plenofir.camera.calibration.inspection import MeanMicroImage, mean_micro_image
from plenofir.camera.calibration.record import Calibration
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

SIDES = ("left", "right", "top", "bottom")
_FEWEST_POSITIONS = 3
# A spot of this radius (in pitches) fills its cell, so its size cannot be measured.
LARGEST_SPOT = 0.25
_BACKGROUND_PERCENTILE = 10
# Light of a point source exceeds the background by this many standard deviations of the picture's
# darker half, and by this share of the brightest pixel.
_STANDS_OUT, _SHARE_OF_BRIGHTEST = 8.0, 0.05
_LARGEST_LIT_SHARE = 0.25


def spot_radius(mean: MeanMicroImage) -> float:
    """Radius of a spot: the root of its mean variance along both axes.

    Result in pitches.
    """
    y, x = np.meshgrid(mean.places, mean.places, indexing="ij")
    inside = mean.cell
    light = mean.values - np.percentile(mean.values[inside], _BACKGROUND_PERCENTILE)
    weights, y, x = light[inside], y[inside], x[inside]
    total = float(weights.sum())
    y, x = y - weights @ y / total, x - weights @ x / total
    return sqrt(max(float(weights @ (y**2 + x**2)) / total / 2, 0.0))


@dataclass(frozen=True)
class Best:
    """Position at which spots are smallest."""

    position: float  # In the units of the positions.
    # Standard error of the place; None for three positions, which a parabola always fits.
    error: float | None
    bracketed: bool  # Whether there are positions on both sides of it.


def best_position(positions: Sequence[float], radii: Sequence[float]) -> Best | None:
    """Vertex of the parabola through the variances of spots.

    `positions`: positions of the micro lens array, three or more different ones. `radii`: radii of
    the spots there. Result: None where the spots do not get larger on both sides. Raises
    `InputError` if there are too few positions.
    """
    z, variances = np.array(positions, dtype=np.float64), np.square(radii)
    if len(np.unique(z)) < _FEWEST_POSITIONS:
        raise InputError(
            f"needs at least {_FEWEST_POSITIONS} different distances, not {len(np.unique(z))}",
            where="position",
        )
    middle, scale = z.mean(), np.ptp(z) / 2
    terms = np.stack([np.ones_like(z), (z - middle) / scale, ((z - middle) / scale) ** 2], axis=-1)
    # The error of a variance is proportional to it.
    weights = 1 / np.maximum(variances, 1e-12)
    weighted = terms * weights[:, np.newaxis]
    covariance = np.linalg.pinv(weighted.T @ weighted)
    _, slope, bend = coefficients = covariance @ weighted.T @ (variances * weights)
    if bend <= 1e-9 * abs(variances).max():
        return None
    vertex = -slope / (2 * bend)
    error = None
    if len(z) > _FEWEST_POSITIONS:
        residuals = (variances - terms @ coefficients) * weights
        covariance = covariance * float(residuals @ residuals) / (len(z) - _FEWEST_POSITIONS)
        gradient = np.array([0.0, -1 / (2 * bend), slope / (2 * bend**2)])
        error = scale * sqrt(max(float(gradient @ covariance @ gradient), 0.0))
    return Best(float(middle + scale * vertex), error, bool(abs(vertex) <= 1))


@dataclass(frozen=True)
class Spots:
    """Sizes of the spots of one picture.

    Attributes
    ----------
    position
        Position of the micro lens array.
    radius_px
        Radius of the mean spot in pixels.
    radius
        The same in pitches.
    sides
        Radii in pitches of the mean spots of the picture's halves, by `SIDES`.
    """

    position: float
    radius_px: float
    radius: float
    sides: dict[str, float]


def _half(calibration: Calibration, side: str) -> Flags:
    centres = calibration.centres
    middle = (np.array(calibration.image_shape) - 1) / 2
    axis, sign = {"left": (1, -1), "right": (1, 1), "top": (0, -1), "bottom": (0, 1)}[side]
    return np.asarray(sign * (centres[..., axis] - middle[axis]) > 0)


def measure_spots(
    signal: Image32, calibration: Calibration, position: float, *, where: str = "image"
) -> Spots:
    """Measure the spots of micro lenses in collimated light.

    `calibration`: where the spots are. `position`: position of the micro lens array. Raises
    `InputError` if a half of the picture has no spot with its surroundings.
    """

    def radius_of(part: Flags | None) -> float:
        return spot_radius(mean_micro_image(signal, calibration, part, where=where))

    radius = radius_of(None)
    sides = {side: radius_of(_half(calibration, side)) for side in SIDES}
    return Spots(position, radius * calibration.grid.lens_pitch, radius, sides)


@dataclass(frozen=True)
class FocusScore:
    """Where micro lenses are in focus.

    `spots`: from the lowest position to the highest. `best`: best position of the whole array, None
    where there is none. `sides`: best positions of its halves, by `SIDES`: where they differ the
    array is tilted.
    """

    spots: tuple[Spots, ...]
    best: Best | None
    sides: dict[str, Best | None]


def focus_score(spots: Sequence[Spots]) -> FocusScore:
    """Find the position of the micro lens array at which its spots are smallest.

    `spots`: of pictures at three or more positions. Raises `InputError` if there are too few
    positions.
    """
    ordered = tuple(sorted(spots, key=lambda one: one.position))
    positions = [one.position for one in ordered]
    return FocusScore(
        spots=ordered,
        best=best_position(positions, [one.radius_px for one in ordered]),
        sides={
            side: best_position(positions, [one.sides[side] for one in ordered]) for side in SIDES
        },
    )


@dataclass(frozen=True)
class InfinityFocus:
    """How well a main lens is focused to infinity.

    Attributes
    ----------
    a
        Slice in which infinity is sharp: 0 in focus, negative where the main lens is focused
        nearer, positive beyond infinity.
    error
        Its standard error.
    resolution
        Below this, all light stays in one micro image, and a is not seen.
    lenses
        Number of micro lenses that share the light (effective).
    """

    a: float
    error: float
    resolution: float
    lenses: float

    @property
    def in_focus(self) -> bool:
        """Whether a cannot be distinguished from 0."""
        return abs(self.a) <= max(self.resolution, 3 * self.error)


def infinity_focus(
    picture: Image,
    calibration: Calibration,
    diameter_px: float,
    dark: Image | None = None,
    *,
    where: str = "picture",
    dark_where: str = "dark frame",
) -> InfinityFocus:
    """Tell from the picture of a collimator (or a star) how the main lens is focused.

    Raises `InputError` if the picture has another size, no light that stands out, or light
    everywhere.

    Parameters
    ----------
    picture
        Through the main lens, with the aperture of the white image.
    calibration
        Of the white image.
    diameter_px
        Diameter of a micro image in pixels.
    dark
        Frame without light, or None.
    """
    check_same_size(picture, calibration.image_shape, where, "the white image")
    signal = grey(picture)
    if dark is not None:
        check_same_size(dark, calibration.image_shape, dark_where, "the white image")
        signal = signal - grey(dark)
    darker = signal[signal <= np.median(signal)]
    base = float(np.median(darker))
    noise = 1.4826 * float(np.median(np.abs(darker - base)))
    top = float(signal.max())
    lit = signal > base + max(_STANDS_OUT * noise, _SHARE_OF_BRIGHTEST * (top - base))
    if not lit.any() or lit.mean() > _LARGEST_LIT_SHARE:
        problem = "light everywhere" if lit.any() else "no light that stands out"
        raise InputError(
            f"{problem}; photograph a collimator or a star on a dark ground", where=where
        )
    places = np.argwhere(lit).astype(np.float64)
    weights = (signal[lit] - base).astype(np.float64)
    t, s, offsets = calibration.grid.nearest(places)
    lenses = (places - offsets) / calibration.grid.lens_pitch
    i, j = (_centred(values, weights) for values in (offsets, lenses))
    spread = float(weights @ (i**2).sum(axis=1))
    a = -float(weights @ (i * j).sum(axis=1)) / spread if spread else 0.0
    _, number = np.unique(np.stack([t, s]), axis=1, return_inverse=True)
    light = np.bincount(number.ravel(), weights=weights)
    count = float(light.sum() ** 2 / (light**2).sum())
    squares = float(weights @ ((j + a * i) ** 2).sum(axis=1))
    return InfinityFocus(
        a=a,
        error=sqrt(squares / spread / count) if spread else 0.0,
        resolution=1 / diameter_px,
        lenses=count,
    )


def _centred(values: Floats, weights: Floats) -> Floats:
    return np.asarray(values - weights @ values / weights.sum())
