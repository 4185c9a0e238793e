# SPDX-License-Identifier: Apache-2.0
"""What speaks against a grid: a second spot in its cells, dark rows, rows that look different."""

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.grid import (
    Floats,
    Grid,
    Indices,
)
from plenofir.camera.calibration.growing import GrowingFit
from plenofir.camera.calibration.lattice import no_grid, primitive_vectors, reduced_lengths

# The mean cell is smoothed by 0.7 samples: two spots half a cell apart, 6 samples, stay two.
_CELL_SAMPLES = 12
_CELL_LENSES = 600
# If the lenses of every second or third row are mostly darker than this share of the usual
# brightness, the grid is too fine.
_EVEN_CLASSES = 0.4
# If micro images of every second row or column differ from the mean one by this share of its
# contrast (root mean square, noise subtracted), they are overlaps of larger micro images.
_UNLIKE = 0.06
_ALIKE_SAMPLES, _ALIKE_LENSES, _FEWEST_ALIKE = 25, 60, 4
# Outliers belong together if they are at most this far apart (in pitches), their offsets have the
# same direction (cosine) and size (ratio), their brightness is usual (relative deviation), and the
# offset matters (in pitches). `_MOST_ALIKE` is the largest accepted share of such lenses.
_NEIGHBOUR, _ALONG, _OF_A_SIZE, _USUAL, _MATTERS = 1.3, 0.9, 2.0, 0.1, 0.01
_MOST_ALIKE = 0.04
# Micro images with a pitch of fewer pixels are too coarse to compare their shapes.
_FORMLESS = 4.0
# A second spot is at least this many pitches from the first.
_SECOND_SPOT = 0.47
# Micro images touch where the gaps around so many neighbouring lenses are less dark, in the median,
# than this share of the usual. Nothing locates them there: their places follow any grid, and were
# 2.8 pixels off at a claim of 0.12 with a quarter of the lenses so. Right grids of drawn images
# have a seventh so at most; two of 976 images, 0.05 and 0.17 pixels off, have a fifth and are
# refused.
_AROUND, _LEAST_GAP, _MOST_TOUCHING = 9, 0.2, 0.15


def primitive_indices(grid: Grid, t: Indices, s: Indices) -> tuple[Indices, Indices]:
    """Indices of lenses in terms of `primitive_vectors`."""
    lattice = grid.lattice(t, s)
    down, right = lattice[..., 0], lattice[..., 1]
    if grid.layout == "hexagonal-rows":
        right = right - down / 2
    elif grid.layout == "hexagonal-columns":
        down = down - right / 2
    return np.floor(down).astype(np.int64), np.floor(right).astype(np.int64)


def cell_margin(fitter: GrowingFit, centres: Floats) -> float:
    """1 minus the brightness of a second spot in the mean cell of the grid."""
    few = np.random.default_rng(3).permutation(len(centres))[:_CELL_LENSES]
    vectors = primitive_vectors(fitter.grid)
    steps = np.arange(_CELL_SAMPLES) / _CELL_SAMPLES
    steps = steps - np.round(steps)
    moves = steps[:, np.newaxis, np.newaxis] * vectors[0] + steps[:, np.newaxis] * vectors[1]
    places = centres[few][:, np.newaxis, np.newaxis] + moves + fitter.margin
    values = ndimage.map_coordinates(
        fitter.padded, np.moveaxis(places, -1, 0), order=1, mode="nearest"
    )
    cell = ndimage.gaussian_filter(np.median(values, axis=0), 0.7, mode="wrap")
    cell = (cell - cell.min()) / max(float(cell[0, 0] - cell.min()), 1e-9)
    peaks = cell == ndimage.maximum_filter(cell, 5, mode="wrap")
    corners = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, -1], [-1, 1]]) @ vectors
    distance = np.linalg.norm(moves[:, :, np.newaxis] - corners, axis=-1).min(axis=-1)
    away = distance > _SECOND_SPOT * min(reduced_lengths(fitter.grid))
    return 1 - float(np.max(cell, where=peaks & away, initial=0.0))


def check_classes(grid: Grid, t: Indices, s: Indices, level: Floats) -> None:
    """Refuse a grid in which every second or third row is dark: it is too fine."""
    m, n = primitive_indices(grid, t, s)
    usual = float(np.percentile(level, 75))
    for divisor in (2, 3):
        for index in (m, n, m + n, m - n):
            parts = [level[index % divisor == k] for k in range(divisor)]
            if any(len(p) >= 4 and np.percentile(p, 70) < _EVEN_CLASSES * usual for p in parts):
                raise no_grid(
                    "micro images of half the distance or darker ones in every second row"
                )


def unlikeness(fitter: GrowingFit, t: Indices, s: Indices, centres: Floats) -> float:
    """How much micro images of every second row, column or diagonal differ from the mean one.

    Root mean square as a share of its contrast, noise subtracted; 0 if it cannot be determined.
    """
    # Round micro images that overlap are brightest between two lenses, at places that repeat at a
    # shorter pitch. Their shapes alternate: each lies across the line between its two lenses.
    vectors = primitive_vectors(fitter.grid)
    if min(reduced_lengths(fitter.grid)) < _FORMLESS:
        return 0.0
    steps = (np.arange(_ALIKE_SAMPLES) + 0.5) / _ALIKE_SAMPLES - 0.5
    cell = steps[:, np.newaxis, np.newaxis] * vectors[0] + steps[:, np.newaxis] * vectors[1]
    # The mean of four pixels cancels a colour filter mosaic.
    pixels = np.array([[0, 0], [0, 1], [1, 0], [1, 1]]) - 0.5
    moves = cell.reshape(-1, 1, 2) + pixels
    m, n = primitive_indices(fitter.grid, t, s)
    draws = np.random.default_rng(7)
    forms = []
    for kind in np.ndindex(2, 2):
        chosen = draws.permutation(np.nonzero((m % 2 == kind[0]) & (n % 2 == kind[1]))[0])
        halves = np.array_split(chosen[: 2 * _ALIKE_LENSES], 2)
        if min(map(len, halves)) < _FEWEST_ALIKE:
            continue
        means = []
        for half in halves:
            places = centres[half][:, np.newaxis, np.newaxis] + moves + fitter.margin
            values = ndimage.map_coordinates(
                fitter.padded, np.moveaxis(places, -1, 0), order=1, mode="nearest"
            )
            means.append(np.median(values.mean(axis=-1), axis=0))
        forms.append(means)
    if len(forms) < 2:
        return 0.0
    values = np.array(forms, dtype=np.float64)
    values -= values.mean(axis=-1, keepdims=True)
    kinds = values.mean(axis=1)
    usual = kinds.mean(axis=0)
    low, high = np.percentile(usual, [2, 98])
    noise = (np.diff(values, axis=1)[:, 0] ** 2).mean(axis=-1) / 4
    excess = float((((kinds - usual) ** 2).mean(axis=-1) - noise).max())
    return float(np.sqrt(max(excess, 0.0)) / max(high - low, 1e-9))


def check_alike(fitter: GrowingFit, t: Indices, s: Indices, centres: Floats) -> None:
    """Refuse a grid of overlaps: they repeat like micro images, but differ in shape."""
    if unlikeness(fitter, t, s, centres) > _UNLIKE:
        raise no_grid("micro images overlap: those of every second row differ")


def touching(fitter: GrowingFit) -> float:
    """Share of the lenses that touch their neighbours: no gaps show where they are."""
    from scipy.spatial import cKDTree

    places = fitter.measured
    near = cKDTree(places).query(places, min(_AROUND, len(places)))[1]
    steps = list(primitive_vectors(fitter.grid))
    if fitter.grid.layout != "rectangular":
        steps.append(steps[0] - steps[1])
    level = fitter.core(places)
    shares = []
    for step in steps:
        sides = [
            fitter.core(np.clip(places + half, 0, fitter.end)) for half in (step / 2, -step / 2)
        ]
        darker = level - np.mean(sides, axis=0)
        around = np.median(darker[near], axis=1)
        shares.append(float((around < _LEAST_GAP * np.median(darker)).mean()))
    return max(shares)


def check_touching(fitter: GrowingFit) -> None:
    """Refuse a grid if micro images touch in a part of the image: it may be any there."""
    share = touching(fitter)
    if share > _MOST_TOUCHING:
        raise no_grid(
            f"no gaps between {100 * share:.0f} % of the micro images (a smaller aperture or a "
            "shorter exposure shows gaps)"
        )


def check_outliers(fitter: GrowingFit) -> None:
    """Refuse a grid if neighbouring lenses deviate from it together: the model is wrong there."""
    away = fitter.measured - fitter.grid.positions(fitter.fitted)
    distance = np.linalg.norm(away, axis=1)
    level = fitter.core(fitter.measured)
    usual = float(np.median(level))
    pitch = max(reduced_lengths(fitter.grid))
    bright = np.abs(level / usual - 1) < _USUAL
    out = np.nonzero((fitter.weights == 0) & (distance > _MATTERS * pitch) & bright)[0]
    if len(out) < _FEWEST_ALIKE:
        return
    from scipy.spatial import cKDTree

    near = cKDTree(fitter.measured[out]).query_pairs(_NEIGHBOUR * pitch, output_type="ndarray")
    unit = away[out] / distance[out, np.newaxis]
    longer = np.max(distance[out][near], axis=1, initial=0.0)
    shorter = np.min(distance[out][near], axis=1, initial=np.inf)
    together = ((unit[near[:, 0]] * unit[near[:, 1]]).sum(axis=1) > _ALONG) & (
        longer < _OF_A_SIZE * shorter
    )
    alike = np.unique(near[together])
    if len(alike) > max(_FEWEST_ALIKE, _MOST_ALIKE * len(fitter.weights)):
        off = float(np.median(distance[out][alike]))
        raise no_grid(
            f"{len(alike)} neighbouring micro images are off the grid by {off:.2f} pixels in the "
            "same direction"
        )
