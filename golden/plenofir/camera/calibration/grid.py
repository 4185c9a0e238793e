# SPDX-License-Identifier: Apache-2.0
"""The grid of micro image centres: lens indices to pixel positions.

Lens (t, s), row and column, has the lattice coordinates

    rectangular          (t, s)
    hexagonal-rows       (t, s + ((t + stagger) mod 2) / 2)
    hexagonal-columns    (t + ((s + stagger) mod 2) / 2, s)

and its centre is a polynomial of low order in them. Order 1 is pitch, rotation and offset (with
different pitches and shear allowed for); higher orders take up tilt and distortion.
"""

from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, model_validator

Layout = Literal["rectangular", "hexagonal-rows", "hexagonal-columns"]
Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

MAX_ORDER = 5
_LARGEST_NUMBER = 1e9


def lattice_coordinates(layout: Layout, stagger: int, t: Indices, s: Indices) -> Floats:
    """Lattice coordinates of lenses."""
    rows, columns = np.asarray(t, dtype=np.float64), np.asarray(s, dtype=np.float64)
    if layout == "hexagonal-rows":
        # Every second row is half a lens further right; stagger tells which.
        columns = columns + 0.5 * ((np.asarray(t) + stagger) % 2)
    elif layout == "hexagonal-columns":
        rows = rows + 0.5 * ((np.asarray(s) + stagger) % 2)
    return np.stack(np.broadcast_arrays(rows, columns), axis=-1)


def exponents(order: int) -> list[tuple[int, int]]:
    """Exponents of the polynomial's terms."""
    return [(total - n, n) for total in range(order + 1) for n in range(total + 1)]


def polynomial_terms(points: Floats, order: int) -> Floats:
    """Terms of a polynomial in two variables."""
    powers = [np.ones_like(points)]
    for _ in range(order):
        powers.append(powers[-1] * points)
    return np.stack([powers[m][..., 0] * powers[n][..., 1] for m, n in exponents(order)], axis=-1)


class Grid(BaseModel):
    """Model of a grid of micro image centres.

    Attributes
    ----------
    layout, stagger
        See `lattice_coordinates`.
    order
        Order of the polynomial, 1 to 5.
    middle
        Lattice coordinates that the polynomial is centred on.
    scale
        Lattice units that its argument is divided by.
    coefficients
        For each term (`exponents`) its factors for y and x, in pixels.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    layout: Layout
    stagger: Annotated[int, Field(ge=0, le=1)] = 0
    order: Annotated[int, Field(ge=1, le=MAX_ORDER)]
    middle: tuple[float, float]
    scale: Annotated[float, Field(gt=0)]
    coefficients: tuple[tuple[float, float], ...]

    @model_validator(mode="after")
    def _has_all_terms(self) -> "Grid":
        terms = len(exponents(self.order))
        if len(self.coefficients) != terms:
            raise ValueError(f"{len(self.coefficients)} coefficients, {terms} needed")
        # Larger ones, from a damaged file, would overflow in powers of the polynomial.
        numbers = np.array([*self.middle, self.scale, *np.ravel(self.coefficients)])
        if not (np.abs(numbers) <= _LARGEST_NUMBER).all():
            raise ValueError(f"numbers must be finite and within {_LARGEST_NUMBER:g}")
        return self

    def _terms(self, lattice: Floats, order: int) -> Floats:
        return polynomial_terms((lattice - self.middle) / self.scale, order)

    def positions(self, lattice: Floats) -> Floats:
        """Pixel positions of lattice coordinates.

        `lattice`: shape (..., 2). Result: (y, x) in pixels, pixel centres at integers, shape (...,
        2).
        """
        return np.asarray(self._terms(lattice, self.order) @ np.array(self.coefficients))

    def lattice(self, t: npt.ArrayLike, s: npt.ArrayLike) -> Floats:
        """Lattice coordinates of lenses, see `lattice_coordinates`.

        `t`, `s`: rows and columns, broadcast. Result: shape (..., 2).
        """
        return lattice_coordinates(self.layout, self.stagger, np.asarray(t), np.asarray(s))

    def centres(self, t: npt.ArrayLike, s: npt.ArrayLike) -> Floats:
        """Micro image centres of lenses.

        `t`, `s`: rows and columns, broadcast. Result: (y, x) in pixels, shape (..., 2).
        """
        return self.positions(self.lattice(t, s))

    def jacobian(self, lattice: Floats) -> Floats:
        """Pixel vectors of a step of one lattice unit along rows and along columns.

        `lattice`: shape (..., 2). Result: [..., k, :] is the vector (y, x) of lattice coordinate k,
        shape (..., 2, 2).
        """
        # Arguments near 1 keep the powers of high orders, and so the fit, well conditioned.
        p = (np.asarray(lattice, dtype=np.float64) - self.middle) / self.scale
        powers = exponents(self.order)
        zero = np.zeros(p.shape[:-1])
        down = [m * p[..., 0] ** (m - 1) * p[..., 1] ** n if m else zero for m, n in powers]
        right = [n * p[..., 0] ** m * p[..., 1] ** (n - 1) if n else zero for m, n in powers]
        terms = np.stack([np.stack(down, -1), np.stack(right, -1)], axis=-2) / self.scale
        return np.asarray(terms @ np.array(self.coefficients))

    def inverse(self, positions: Floats) -> Floats:
        """Lattice coordinates of pixel positions (Newton's method, if they are not affine).

        `positions`: (y, x), shape (..., 2). Result: shape (..., 2).
        """
        target = np.asarray(positions, dtype=np.float64)
        middle = np.array(self.middle)
        if self.order == 1:
            return np.asarray(
                (target - self.positions(middle)) @ np.linalg.inv(self.vectors) + middle
            )
        lattice = np.broadcast_to(middle, target.shape).astype(np.float64)
        for _ in range(12):
            miss = target - self.positions(lattice)
            (a, b), (c, d) = np.moveaxis(self.jacobian(lattice), (-2, -1), (0, 1))
            step = np.stack(
                [d * miss[..., 0] - c * miss[..., 1], a * miss[..., 1] - b * miss[..., 0]], axis=-1
            )
            determinant = a * d - b * c
            if not determinant.all():
                raise np.linalg.LinAlgError("the grid folds over")
            lattice = lattice + step / determinant[..., np.newaxis]
            if np.abs(step).max(initial=0.0) < 1e-9 * np.abs(determinant).min(initial=1.0):
                break
        return lattice

    def nearest(self, positions: Floats) -> tuple[Indices, Indices, Floats]:
        """Micro images that pixel positions belong to.

        `positions`: (y, x), shape (..., 2). Result: rows, columns, and the positions from the micro
        image's centre in pixels; shapes (...), (...), (..., 2).
        """
        down, right = np.moveaxis(self.inverse(positions), -1, 0)
        if self.layout == "rectangular":
            candidates = [(np.rint(down), np.rint(right))]
        elif self.layout == "hexagonal-rows":
            rows = [np.floor(down), np.floor(down) + 1]
            candidates = [(t, np.rint(right - 0.5 * ((t + self.stagger) % 2))) for t in rows]
        else:
            columns = [np.floor(right), np.floor(right) + 1]
            candidates = [(np.rint(down - 0.5 * ((s + self.stagger) % 2)), s) for s in columns]
        best_t, best_s = (c.astype(np.int64) for c in candidates[0])
        best = positions - self.centres(best_t, best_s)
        for t, s in ((a.astype(np.int64), b.astype(np.int64)) for a, b in candidates[1:]):
            offset = positions - self.centres(t, s)
            nearer = (offset**2).sum(axis=-1) < (best**2).sum(axis=-1)
            best_t, best_s = np.where(nearer, t, best_t), np.where(nearer, s, best_s)
            best = np.where(nearer[..., np.newaxis], offset, best)
        return best_t, best_s, best

    def moved(self, rows: int, columns: int) -> "Grid":
        """The same grid with indices counted from another lens.

        `rows`, `columns`: old index of the lens that becomes (0, 0).
        """
        stagger = self.stagger
        if self.layout == "hexagonal-rows":
            stagger = (stagger + rows) % 2
        elif self.layout == "hexagonal-columns":
            stagger = (stagger + columns) % 2
        middle = np.array(self.middle) - (rows, columns)
        return self.model_copy(
            update={"stagger": stagger, "middle": (float(middle[0]), float(middle[1]))}
        )

    def mapped(self, matrix: Floats, shift: Floats) -> "Grid":
        """The same lenses after a map of the pixel positions (y, x).

        `matrix`: shape (2, 2), what positions are multiplied by; `shift`: what is added, in pixels.
        """
        coefficients = np.array(self.coefficients) @ np.asarray(matrix).T
        coefficients[0] += shift
        pairs = tuple((float(y), float(x)) for y, x in coefficients)
        return self.model_copy(update={"coefficients": pairs})

    @property
    def vectors(self) -> Floats:
        """Pixel vectors (y, x) of a row step and a column step in the middle, shape (2, 2)."""
        return self.jacobian(np.array(self.middle))

    @property
    def pitch(self) -> tuple[float, float]:
        """Distances between rows and between columns of the grid in pixels, in the middle."""
        down, right = np.hypot(*self.vectors.T)
        return float(down), float(right)

    @property
    def lens_pitch(self) -> float:
        """Distance of neighbouring micro images in pixels in the middle: mean of all directions."""
        down, right = self.vectors
        area = abs(float(down[0] * right[1] - down[1] * right[0]))
        return float(np.sqrt(area / (1.0 if self.layout == "rectangular" else np.sqrt(0.75))))

    @property
    def rotation_degrees(self) -> float:
        """Angle of the rows against the image's rows, positive when they fall to the right.

        For staggered columns it is the angle of the columns, positive when they lean to the left.
        """
        down, right = self.vectors
        if self.layout == "hexagonal-columns":
            return float(np.degrees(np.arctan2(-down[1], down[0])))
        return float(np.degrees(np.arctan2(right[0], right[1])))
