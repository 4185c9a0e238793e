# SPDX-License-Identifier: Apache-2.0
"""A calibration for captures whose pixels lie elsewhere than the white image's.

A part of the sensor, pixels that were added up, a turned or mirrored sensor, micro lenses that were
remounted: each is a map of pixel positions, p' = A p + b, and what a calibration holds follows it.
"""

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.grid import Floats, Grid, Layout, exponents, polynomial_terms
from plenofir.camera.calibration.record import Calibration
from plenofir.camera.calibration.shading import (
    lens_indices,
    order_of,
    shading_at,
    unit_positions,
    within,
)
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

# Points along each side at which the light of the white image is taken over.
_SAMPLES = 24


class PixelMap(NamedTuple):
    """Where pixel positions (y, x) of a white image are in a capture.

    `matrix`, shape (2, 2), times them, plus `shift`; `shape`: rows and columns of the capture.
    """

    matrix: Floats
    shift: Floats
    shape: tuple[int, int]

    def then(self, after: "PixelMap") -> "PixelMap":
        """Return this map and another one after it, as one."""
        matrix, shift, shape = after
        return PixelMap(matrix @ self.matrix, matrix @ self.shift + shift, shape)

    def image(self, image: Image) -> Image:
        """What a white image or a dark frame is in the capture's pixels, bilinear."""
        inverse = np.linalg.inv(self.matrix)

        def channel(part: Image) -> Image:
            result = ndimage.affine_transform(
                part.astype(np.float32),
                inverse,
                -inverse @ self.shift,
                self.shape,
                order=1,
                mode="nearest",
            )
            return np.asarray(np.rint(result).astype(part.dtype))

        if image.ndim == 2:
            return channel(image)
        return np.stack([channel(image[..., k]) for k in range(image.shape[2])], axis=-1)


def turning(shape: tuple[int, int], orientation: int) -> PixelMap:
    """The map of a capture that is a white image turned by an orientation, as EXIF counts."""
    matrix = np.eye(2)
    end = np.array(shape) - 1.0
    if orientation in (5, 6, 7, 8):
        matrix, end, shape = matrix[::-1], end[::-1], shape[::-1]
    sign = np.array(
        [-1.0 if orientation in of_axis else 1.0 for of_axis in ((3, 4, 7, 8), (2, 3, 6, 7))]
    )
    return PixelMap(sign[:, np.newaxis] * matrix, np.where(sign < 0, end, 0.0), shape)


def same_pixels(shape: tuple[int, int]) -> PixelMap:
    """The map of a capture whose pixels are the white image's."""
    return PixelMap(np.eye(2), np.zeros(2), shape)


def _transposed(grid: Grid) -> Grid:
    """The same lenses with rows counted as columns."""
    layouts: dict[Layout, Layout] = {
        "rectangular": "rectangular",
        "hexagonal-rows": "hexagonal-columns",
        "hexagonal-columns": "hexagonal-rows",
    }
    of_powers = dict(zip(exponents(grid.order), grid.coefficients, strict=True))
    return grid.model_copy(
        update={
            "layout": layouts[grid.layout],
            "middle": grid.middle[::-1],
            "coefficients": tuple(of_powers[n, m] for m, n in exponents(grid.order)),
        }
    )


def _reversed(grid: Grid, axis: int) -> Grid:
    """The same lenses with indices that count the other way along an axis."""
    staggered = {"hexagonal-rows": 1, "hexagonal-columns": 0}.get(grid.layout) == axis
    middle = list(grid.middle)
    middle[axis] = 0.5 * staggered - middle[axis]
    pairs = tuple(
        (y, x) if powers[axis] % 2 == 0 else (-y, -x)
        for (y, x), powers in zip(grid.coefficients, exponents(grid.order), strict=True)
    )
    return grid.model_copy(
        update={
            "stagger": 1 - grid.stagger if staggered else grid.stagger,
            "middle": (middle[0], middle[1]),
            "coefficients": pairs,
        }
    )


def mapped(calibration: Calibration, place: PixelMap) -> Calibration:
    """The calibration of captures whose pixels lie elsewhere.

    `place`: turns by 90 degrees, mirrors, scales, small rotations and shifts. Result: lenses
    counted anew from the capture's upper left one. Raises `InputError` if the capture holds none.
    """
    matrix, shift, shape = place
    grid = calibration.grid.mapped(matrix, shift)
    sign = [1, 1]
    profile = np.array(calibration.profile)
    is_transposed = abs(matrix[0, 0]) < abs(matrix[0, 1])
    if is_transposed:
        grid, profile = _transposed(grid), profile.T
    for axis in (0, 1):
        if grid.vectors[axis][axis] < 0:
            sign[axis] = -1
            grid = _reversed(grid, axis)
            profile = np.flip(profile, axis)
    t, s = lens_indices(grid, shape)
    inside = within(grid.centres(t, s), shape)
    if not inside.any():
        raise InputError("the capture holds no micro lens of the calibration")
    rows, columns = np.nonzero(inside.any(axis=1))[0], np.nonzero(inside.any(axis=0))[0]
    first = int(t[rows[0], 0]), int(s[0, columns[0]])
    lenses = int(rows[-1] - rows[0] + 1), int(columns[-1] - columns[0] + 1)

    def counted(row: int, column: int) -> tuple[int, int] | None:
        if is_transposed:
            row, column = column, row
        new = sign[0] * row - first[0], sign[1] * column - first[1]
        return new if 0 <= new[0] < lenses[0] and 0 <= new[1] < lenses[1] else None

    missing = [counted(row, column) for row, column in calibration.missing]
    uneven = [(counted(row, column), share) for row, column, share in calibration.uneven]
    types, grid = calibration.lens_types, grid.moved(*first)
    if types is not None:
        types = types.carried(calibration.grid, grid, matrix, shift)
    return calibration.model_copy(
        update={
            "image_shape": shape,
            "lenses": lenses,
            "grid": grid,
            "lens_types": types,
            "missing": tuple(new for new in missing if new is not None),
            "uneven": tuple((*new, share) for new, share in uneven if new is not None),
            "shading": _shading(calibration, place),
            "profile": tuple(tuple(line) for line in profile.tolist()),
            "residual_px": calibration.residual_px * float(np.sqrt(abs(np.linalg.det(matrix)))),
        }
    )


def _shading(calibration: Calibration, place: PixelMap) -> tuple[float, ...]:
    """The light's polynomial in the capture's own coordinates."""
    sides = [np.linspace(0, n - 1, _SAMPLES) for n in place.shape]
    points = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)
    before = (points - place.shift) @ np.linalg.inv(place.matrix).T
    inside = within(before, calibration.image_shape)
    coefficients = np.array(calibration.shading)
    logs = np.log(shading_at(coefficients, before[inside], calibration.image_shape))
    terms = polynomial_terms(unit_positions(points[inside], place.shape), order_of(coefficients))
    return tuple(float(c) for c in np.linalg.lstsq(terms, logs, rcond=None)[0])
