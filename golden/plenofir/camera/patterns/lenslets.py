# SPDX-License-Identifier: Apache-2.0
"""Micro lenses in a capture of a scene, found without a white image.

Micro images are darker at their borders, so the picture resembles itself shifted by whole lenses.
The shifts are guessed from the autocorrelation of its middle (as for white images). Scenes have
repetitions of their own, so a guess is accepted only if the lowest frequencies of its lattice are
present in phase all over the picture (`plenofir.camera.patterns.match.match_capture`).
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.grid import Grid, Layout
from plenofir.camera.calibration.lattice import Lattice, guess, lattices
from plenofir.camera.calibration.shading import lens_indices, within
from plenofir.camera.patterns.match import Match, match_capture
from plenofir.ground.errors import InputError

# Texture may repeat more clearly than the lenses do, so the first guess alone is not enough.
_CANDIDATES = 4
_LEAST_AGREEMENT, SURE = 0.7, 0.9
# 2 sqrt(2) pixels: below, a period has fewer than two samples along the diagonals.
_SMALLEST_PITCH = 2.8
_FEWEST_LENSES = 5
# Size of the parts whose pitch of repetition is compared (share of the picture, limit in pixels).
_PART, _SMALLEST_PART, _LARGEST_PART, _PERIODS = 0.5, 256, 768, 24
_PLACES = ((0.0, 0.0), (0.0, 1.0), (0.5, 0.5), (1.0, 0.0), (1.0, 1.0))
_REPEATS, _MOST_PARTS, _ENOUGH = 0.25, 4, 3
_SAME_PITCH = 0.04


@dataclass(frozen=True)
class Lenslets:
    """Micro lenses found in a capture."""

    match: Match  # grid, fitted to the whole picture, and how well the picture agrees with it
    score: float  # how much higher the autocorrelation is on the lattice than between

    @property
    def evidence(self) -> float:
        """Agreement of the picture's parts, 0 to 1; of neighbouring ones if the grid is bent."""
        return max(self.match.agreement, self.match.smoothness)

    @property
    def grid(self) -> Grid:
        """Where the micro images are."""
        return self.match.grid

    @property
    def layout(self) -> Layout:
        """Arrangement of the lenses."""
        return self.grid.layout

    @property
    def pitch(self) -> float:
        """Distance of neighbouring micro images in pixels."""
        return self.grid.lens_pitch

    @property
    def rotation_degrees(self) -> float:
        """Rotation of their rows."""
        return self.grid.rotation_degrees


def find_lenslets(grey: Image32, guesses: list[Lattice] | None = None) -> Lenslets | None:
    """Find micro lenses in a capture: the lattice that agrees with most of it.

    None if no lattice is found all over the picture; `guesses` are its `lattices`, if known.
    """
    candidates: list[Lenslets] = []
    for lattice in (lattices(grey) if guesses is None else guesses)[:_CANDIDATES]:
        try:
            start = guess(grey, lattice.vectors)
        except (InputError, np.linalg.LinAlgError):
            continue
        pitch = start.lens_pitch
        if pitch < _SMALLEST_PITCH or min(grey.shape) < _FEWEST_LENSES * pitch:
            continue
        match = match_capture(grey, start)
        if match.fits and max(match.agreement, match.smoothness) >= _LEAST_AGREEMENT:
            candidates.append(Lenslets(match, lattice.score))
            if match.agreement > SURE:
                break
    return max(candidates, key=lambda one: one.evidence * one.match.strength, default=None)


@dataclass(frozen=True)
class Repetition:
    """At which pitches the parts of a picture repeat."""

    # Pitch in pixels, as the next two: side of a square as large as the lattice's cell.
    smallest: float
    middle: float  # median
    largest: float
    parts: int  # of the picture that repeat, of 5
    score: float  # median of the lattices' scores there

    @property
    def all_over(self) -> bool:
        """Whether nearly all parts repeat."""
        return self.parts >= _MOST_PARTS

    @property
    def even(self) -> bool:
        """Whether all parts repeat at the same pitch, as the gaps of micro images do.

        Content repeats at the pitch less its parallax between lenses, which changes with depth.
        """
        return (self.largest - self.smallest) / self.largest < _SAME_PITCH

    def of_lenses(self, grid: Grid) -> bool:
        """Whether the median pitch is the grid's; content with parallax repeats at another."""
        return _like_lenses(self.middle, grid)


def _like_lenses(pitch: float, grid: Grid) -> bool:
    """Whether a pitch of repetition is a grid's."""
    side = float(np.sqrt(abs(np.linalg.det(np.array(grid.vectors)))))
    return abs(pitch / side - 1) < _SAME_PITCH


def repetition(
    grey: Image32, raster: Lattice | None = None, grid: Grid | None = None
) -> Repetition | None:
    """Look for repetitions in five parts of a picture.

    `raster`: a lattice of the picture; parts need not have many more than its periods. `grid`:
    lenses that are sure; three parts that repeat like them are enough, as the median is theirs
    then.
    """
    largest, smallest_pitch = _LARGEST_PART, 0.0
    if raster is not None:
        pitch = float(np.sqrt(abs(np.linalg.det(raster.vectors))))
        largest = int(np.clip(_PERIODS * pitch, _SMALLEST_PART, _LARGEST_PART))
        smallest_pitch = pitch / 2
    side = [min(int(n * _PART), largest) for n in grey.shape]
    parts = []
    for down, right in _PLACES:
        top = int((grey.shape[0] - side[0]) * down)
        left = int((grey.shape[1] - side[1]) * right)
        part = grey[top : top + side[0], left : left + side[1]]
        best = lattices(part, smallest_pitch=smallest_pitch)[:1]
        # A lens array has several lenses along each side.
        for lattice in best:
            pitch = float(np.sqrt(abs(np.linalg.det(lattice.vectors))))
            if lattice.score > _REPEATS and pitch * _FEWEST_LENSES < min(side):
                parts.append((pitch, lattice.score))
        if grid is not None and sum(_like_lenses(pitch, grid) for pitch, _ in parts) >= _ENOUGH:
            break
    if not parts:
        return None
    pitches = [pitch for pitch, _ in parts]
    # Parts in which a multiple of the pitch was found are left out.
    middle = float(np.median(pitches))
    near = [pitch for pitch in pitches if 0.75 * middle < pitch < 1.33 * middle]
    score = float(np.median([score for _, score in parts]))
    return Repetition(min(near), float(np.median(near)), max(near), len(near), score)


def unevenness_of_neighbours(grey: Image32, grid: Grid) -> float:
    """Relative difference of the middles of micro images from their neighbours.

    Small in a white image, whatever the light; large where a picture has content.
    """
    levels = _lens_levels(grey, grid)
    bend = np.abs(levels[:, 2:] - 2 * levels[:, 1:-1] + levels[:, :-2]) / 2
    share = bend / np.maximum(levels[:, 1:-1], 1e-9)
    return float(np.nanmedian(share)) if np.isfinite(share).any() else 0.0


def unevenness_of_light(grey: Image32, grid: Grid) -> float:
    """Relative difference of the middles of micro images from a smooth fall-off of light.

    The fall-off is a polynomial of the fourth order, as vignetting is well described by it. A
    blurred scene leaves more of it, even where neighbouring lenses hardly differ.
    """
    levels = _lens_levels(grey, grid)
    t, s = np.nonzero(np.isfinite(levels))
    values = levels[t, s]
    y, x = (2.0 * n / max(size - 1, 1) - 1.0 for n, size in zip((t, s), levels.shape, strict=True))
    powers = [y**i * x**j for i in range(5) for j in range(5 - i)]
    if len(values) < 2 * len(powers):
        return 0.0
    matrix = np.stack(powers, axis=1)
    smooth = matrix @ np.linalg.lstsq(matrix, values, rcond=None)[0]
    return float(1.4826 * np.median(np.abs(values - smooth) / np.maximum(smooth, 1e-9)))


def _lens_levels(grey: Image32, grid: Grid) -> Image32:
    """Brightness of the middles of micro images, shape (t, s); nan outside of the picture."""
    t, s = lens_indices(grid, grey.shape)
    centres = grid.centres(t, s)
    smooth = ndimage.gaussian_filter(grey, grid.lens_pitch / 6)
    levels = ndimage.map_coordinates(smooth, np.moveaxis(centres, -1, 0), order=1)
    return np.asarray(np.where(within(centres, grey.shape), levels, np.nan), np.float32)
