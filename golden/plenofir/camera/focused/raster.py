# SPDX-License-Identifier: Apache-2.0
"""Micro images of a focused camera as a raster of M x M samples for the square operator.

The operator is separable: sample i of lens j goes to M j + i a' on each axis, whichever they are.
So the axes of a hexagonal grid are two of its own directions, 60 degrees apart: lens (t, s) stands
at C + t a_1 + s a_2, its sample (i, j) lies (i - c) a_1 / M + (j - c) a_2 / M from its centre, and
refocusing to v is the operator with a' = v and a box of |v|, exactly. No lens is interpolated from
its neighbours, which show a thing elsewhere. The picture is sheared, as the raster is:
`FocusedRaster.straight` puts it upright.
"""

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.axes import along_axes, extent_along, lenses_along
from plenofir.camera.calibration.grid import Floats
from plenofir.camera.calibration.lattice import primitive_vectors
from plenofir.camera.focused.capture import FocusedCapture
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

_BLOCK = 64  # rows of samples


class FocusedRaster(NamedTuple):
    """An aligned raw image of a focused camera."""

    pixels: Image  # (t M, s M[, 3]), without vignetting; 0 where no light reaches
    lenses: Image  # type of the lens that sees each sample, from 1 on; 0 where there is no light
    m: int
    # Lattice of samples in the capture: (y, x) of the first, and steps down and right.
    origin: Floats
    steps: Floats

    def straight(self, picture: Floats, shape: tuple[int, int], step: float) -> Floats:
        """A picture of the raster's size as the capture lies: see `straightened`."""
        return straightened(picture, self.origin, self.steps, shape, step)


def straightened(
    picture: Floats, origin: Floats, steps: Floats, shape: tuple[int, int], step: float
) -> Floats:
    """A picture of a raster's size as the capture lies, `step` of its pixels for one.

    `origin`, `steps`: where the raster's samples lie in the capture, as in `FocusedRaster`. Result:
    shape (*shape[, channels]), 0 beside the raster.
    """
    rows, columns = ((step - 1) / 2 + step * np.arange(n) for n in shape)
    places = np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1)
    at = np.moveaxis((places - origin) @ np.linalg.inv(steps), -1, 0)
    layers = picture[..., np.newaxis] if picture.ndim == 2 else picture
    result = [ndimage.map_coordinates(one, at, order=1) for one in np.moveaxis(layers, 2, 0)]
    return result[0] if picture.ndim == 2 else np.stack(result, axis=-1)


def focused_raster(capture: FocusedCapture, micro_image_size: int | None = None) -> FocusedRaster:
    """Resample a capture to M x M samples for each micro lens, M samples to a pitch.

    `micro_image_size`: M, the pitch in whole pixels if None. Raises `InputError` for an M below 2
    or above four pitches.
    """
    calibration, pitch = capture.calibration, capture.pitch
    m = round(pitch) if micro_image_size is None else micro_image_size
    if not 2 <= m <= 4 * pitch:
        raise InputError(
            f"M = {m} is not possible with micro images {pitch:.2f} pixels apart; use 2 to "
            f"{int(4 * pitch)}",
            where="micro_image",
        )
    grid, types = calibration.grid, calibration.lens_types
    assert types is not None
    first, counts = extent_along(grid, capture.light.shape)
    centre = (m - 1) / 2
    axes = primitive_vectors(grid)
    picture = np.zeros((counts[0] * m, counts[1] * m, capture.pixels.shape[2]), np.float32)
    lenses = np.zeros(picture.shape[:2], np.uint8)
    inner = np.where(capture.light > 0, capture.light, 0)
    across = np.arange(counts[1] * m)
    for top in range(0, len(picture), _BLOCK):
        down = np.arange(top, min(top + _BLOCK, len(picture)))
        i, j = np.meshgrid(down, across, indexing="ij")
        lattice = along_axes(grid, first[0] + i // m, first[1] + j // m)
        away = np.stack([i % m - centre, j % m - centre], axis=-1) / m @ axes
        places = np.moveaxis(grid.positions(lattice) + away, -1, 0)
        near = np.hypot(*np.moveaxis(away, -1, 0)) <= capture.reach
        light = ndimage.map_coordinates(inner, places, order=1, mode="constant")
        whole = ndimage.map_coordinates((inner > 0).astype(np.float32), places, order=1)
        lit = near & (whole > 1 - 1e-4)
        for k in range(picture.shape[2]):
            values = ndimage.map_coordinates(capture.pixels[..., k], places, order=1)
            picture[down, :, k] = np.where(lit, values / np.maximum(light, 1e-6), 0)
        t, s = lenses_along(grid, lattice)
        lenses[down] = np.where(lit, types.at(grid, t, s) + 1, 0)
    dtype = capture.picture.pixels.dtype
    top_level = min(capture.picture.full_scale, int(np.iinfo(dtype).max))
    pixels = np.clip(np.rint(picture), 0, top_level).astype(dtype)
    steps = axes / m
    origin = grid.positions(along_axes(grid, np.array(first[0]), np.array(first[1])))
    return FocusedRaster(
        pixels if pixels.shape[2] > 1 else pixels[..., 0],
        lenses,
        m,
        origin - centre * steps.sum(axis=0),
        steps,
    )
