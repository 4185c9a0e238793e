# SPDX-License-Identifier: Apache-2.0
"""Where refocused planes lie, how deep they are, and where the virtual cameras stand.

The camera with its focus and micro image size M is one `RayModel`; the planes' functions take
arrays of focus settings a. Symbols are those of the thesis: kappa = p_p / b_s is the slope between
neighbouring pixels of a micro image (b_s is f_s in a standard camera), e = b_U - f_U the extension
of the main lens.

Chief rays have the slopes m = -s / d_A' - i kappa (Eqs. 3.21-3.24). The pair that meets on plane
a comes from pixels -c and c of micro lenses a (M-1) apart (section 3.3.1); the borders of the depth
of field come from the pixels' borders and the micro lenses' edges (section 3.3.2). With
n = a (M-1) + k, k = 1 for the near border, 0 for the plane, -1 for the far border, they meet at

    d' = -n p_M / ((M-1-k) kappa - a (M-1) p_M / d_A')

behind the micro lenses, and the thin lens equation takes that to the distance

    d = b_U + H1H2 + f_U (b_U - d') / (e - d')

from the micro lenses. As a function of a this is a quotient of two linear functions,
d = D(a) / V(a), without any intermediate infinity. V, the vergence, vanishes at infinity.

In a focused camera only b_s is another: d' is the distance of the plane that a micro lens sees at
the virtual depth v = -d' / b_s (`plenofir.camera.rays.lens_types`), with v = a' = a M where the
pupil is far and M = p_M / p_p. For a > 0 it lies behind the micro lenses (Galilean cameras), for
a < 0 between them and the main lens (Keplerian).

The borders of the depth of field are edges of light: k is the edge of the micro lens, p_M wide as
the box of M samples that a slice averages, and the edge of the pixel. With another box, of B
samples, the light of a sample is B / M as wide: `Edges`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal, localcontext
from functools import cached_property
from math import inf
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from plenofir.camera.rays.distances import (
    BEYOND,
    BLURRED,
    INFINITY,
    INSIDE,
    REAL,
    Distances,
    Planes,
)
from plenofir.camera.rays.lens_types import sharpest_type
from plenofir.camera.rays.precise import CONTEXT, Line, Values, exact, split
from plenofir.camera.rays.virtual import VirtualCameras
from plenofir.ground.errors import InputError

Border = Literal["centre", "near", "far"]
"""The plane itself, or a border of its depth of field."""
# The borders' k.
_BORDERS: Mapping[Border, int] = {"centre": 0, "near": 1, "far": -1}
# Beyond this the products with the coefficients would overflow.
_LARGEST = 1e100
# Relative error that an end of a range of focus settings may have.
_ROUNDING = 1e-12
# Planes are evaluated in blocks that stay in the processor's cache.
_BLOCK = 8192


Coefficients = tuple[Decimal, Decimal]
"""c0 and c1 of c0 + c1 a."""


class Edges(NamedTuple):
    """The edges of light that meet at the near border; those of the far border lie opposite."""

    # In halves of p_M a sample's edge is lens + lens_per_a a; a pixel's is `pixel` halves of it.
    lens: Decimal
    lens_per_a: int
    pixel: int


LENS_WIDE = Edges(Decimal(1), 0, 1)
"""Edges as the thesis has them: of a box of M samples, one micro lens wide."""


def plane_coefficients(
    lengths: Mapping[str, Decimal], micro_image_size: int, border: Border, edges: Edges = LENS_WIDE
) -> tuple[Coefficients, Coefficients]:
    """D and V, whose quotient is the distance of plane a, as linear functions of a.

    `lengths`: f_U, e, H1H2, b_s, p_M and p_p in mm, and 1/d_A' (0 where the pupil is at infinity).
    Computed in the decimal context in force.
    """
    # With w = a (M-1), k and l the edges of pixel and sample, multiplied by b_s:
    #
    #     V = e ((M-1-k) p_p - w p_M b_s / d_A') + (w + l) p_M b_s
    #     D = (b_U + H1H2) V + f_U (V + f_U ((M-1-k) p_p - w p_M b_s / d_A'))
    span, k = micro_image_size - 1, _BORDERS[border]
    f, e, pitch = lengths["f_U"], lengths["e"], lengths["p_M"] * lengths["b_s"]
    offset = f + e + lengths["H1H2"]
    # Terms without a, then those with it.
    shift = k * edges.lens * pitch, (span + k * edges.lens_per_a) * pitch
    divergence = (span - k * edges.pixel) * lengths["p_p"], -span * pitch * lengths["1/d_A'"]
    pairs = zip(shift, divergence, strict=True)
    vergence, distance = zip(
        *((e * d + s, offset * (e * d + s) + f * (e * d + s + f * d)) for s, d in pairs),
        strict=True,
    )
    return distance, vergence


@dataclass(frozen=True)
class _Part:
    """D and V of a plane or border for a from `first` to `last`, both included."""

    first: float
    last: float
    top: Line
    bottom: Line


@dataclass(frozen=True)
class RayModel(VirtualCameras):
    """A camera, focused, with micro images of M pixels.

    `RayModel.focused` makes one from a focus distance.

    `extension`: e = b_U - f_U in mm, 0 for infinity focus. `micro_image_size`: M, 2 or more. `box`:
    B, samples of a slice that are averaged, from 1 to M; None for M in a standard camera, and for
    |a M|, the width of a pixel on the plane, in a focused one (M where that is more). Raises
    `InputError` if M or the box is not possible.
    """

    @property
    def lengths(self) -> dict[str, Decimal]:
        """The camera's lengths in mm as `plane_coefficients` takes them."""
        camera = self.camera
        named = {
            "f_U": camera.main_lens.focal_length_mm,
            "H1H2": camera.main_lens.principal_plane_separation_mm,
            "b_s": camera.micro_lenses.spacing_mm,
            "p_M": camera.micro_lenses.pitch_mm,
            "p_p": camera.sensor.pixel_pitch_mm,
        }
        exacts = {name: exact(value) for name, value in named.items()}
        with localcontext(CONTEXT):
            pupil = 1 / (exact(camera.main_lens.exit_pupil_mm) + self.extension)
        return {**exacts, "e": self.extension, "1/d_A'": pupil}

    def edges(self, border: Border) -> list[tuple[float, float, Edges]]:
        """What meets at a border, by ranges of a.

        Light widens on both sides of the micro lenses, so the edges of pixels are the outer ones on
        both. The box of M samples has the edges of the thesis on both sides: its tables, at a < 0,
        are of the inner ones there.
        """
        m, k = self.micro_image_size, _BORDERS[border]
        if not k or self.box == m or (self.box is None and self.camera.micro_lenses.standard):
            return [(-inf, inf, LENS_WIDE)]
        if self.box is None:
            inner = [(-1.0, 0.0, Edges(Decimal(0), -1, -1)), (0.0, 1.0, Edges(Decimal(0), 1, 1))]
            outer = [(-inf, -1.0, Edges(Decimal(1), 0, -1)), (1.0, inf, LENS_WIDE)]
            return [outer[0], *inner, outer[1]]
        width = Decimal(self.box) / m
        # Where the border lies in the micro lenses.
        turn = -k * self.box / (m * (m - 1))
        return [(-inf, turn, Edges(width, 0, -1)), (turn, inf, Edges(width, 0, 1))]

    @cached_property
    def _lines(self) -> dict[Border, list[_Part]]:
        """D and V of the plane and of the borders of its depth of field."""
        # For far planes nearly equal lengths are subtracted: decimals, once for each model.
        lines: dict[Border, list[_Part]] = {border: [] for border in _BORDERS}
        with localcontext(CONTEXT):
            for border, parts in lines.items():
                for first, last, edges in self.edges(border):
                    top, bottom = plane_coefficients(
                        self.lengths, self.micro_image_size, border, edges
                    )
                    parts.append(_Part(first, last, Line.of(*top), Line.of(*bottom)))
        return lines

    def box_at(self, a: npt.ArrayLike) -> Values:
        """B, samples that a slice averages; `a`: focus settings, any shape. Result: same shape."""
        values, m = np.asarray(a, dtype=np.float64), self.micro_image_size
        if self.box is None and not self.camera.micro_lenses.standard:
            return np.asarray(np.minimum(np.abs(values) * m, m))
        return np.full(values.shape, float(self.box or m))

    def _distances(self, a: npt.ArrayLike, border: Border) -> Distances:
        values = np.asarray(a, dtype=np.float64)
        if not (np.abs(values) <= _LARGEST).all():
            raise InputError(f"a must be a finite number up to {_LARGEST:g}")
        lens = self.camera.main_lens
        # Nothing can be placed nearer than the front vertex or, if that is not known, than the
        # object-side principal plane.
        front = self.image_distance_mm + lens.principal_plane_separation_mm
        front += lens.front_vertex_mm or 0.0
        flat = values.ravel()
        mm = np.empty(flat.shape)
        states = np.full(flat.shape, REAL, dtype=np.int8)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for start in range(0, flat.size, _BLOCK):
                part = slice(start, start + _BLOCK)
                vergence, distance = self._evaluate(border, flat[part])
                state = states[part]
                hidden = distance <= front
                state[hidden] = INSIDE
                diverging = hidden & (vergence < 0)
                state[diverging] = BEYOND
                # Distances that overflow a double count as infinity.
                parallel = ~np.isfinite(distance)
                state[parallel] = INFINITY
                distance[diverging | parallel] = np.nan
                mm[part] = distance
        if border != "centre" and not self.camera.micro_lenses.standard:
            blurred = ~sharpest_type(self, flat).sharp
            states[blurred], mm[blurred] = BLURRED, np.nan
        return Distances(mm.reshape(values.shape), states.reshape(values.shape))

    def _evaluate(self, border: Border, x: Values) -> tuple[Values, Values]:
        """V and D / V for focus settings x, shape (settings,)."""
        vergence, distance = np.empty(x.shape), np.empty(x.shape)
        parts = self._lines[border]
        for line in parts:
            # One part is all of it.
            chosen = (line.first <= x) & (x <= line.last) if len(parts) > 1 else slice(None)
            halves = split(x[chosen])
            vergence[chosen] = line.bottom.at(x[chosen], halves)
            distance[chosen] = line.top.at(x[chosen], halves) / vergence[chosen]
        return vergence, distance

    def distance(self, a: npt.ArrayLike) -> Distances:
        """Distances of refocused planes from the micro lenses (Eqs. 3.29-3.34).

        `a`: focus settings, any shape. Result: same shape.
        """
        return self._distances(a, "centre")

    def near_border(self, a: npt.ArrayLike) -> Distances:
        """Near borders of the depths of field (Eqs. 3.36-3.43, inner rays), as `distance`."""
        return self._distances(a, "near")

    def far_border(self, a: npt.ArrayLike) -> Distances:
        """Far borders of the depths of field (Eqs. 3.36-3.43, outer rays), as `distance`."""
        return self._distances(a, "far")

    def planes(self, a: npt.ArrayLike) -> Planes:
        """Refocused planes with their depths of field.

        `a`: focus settings, any shape. Result: same shape.
        """
        values = np.asarray(a, dtype=np.float64)
        return Planes(values, *(self._distances(values, border) for border in _BORDERS))

    def focus_setting(self, distance_mm: npt.ArrayLike, border: Border = "centre") -> Values:
        """Focus setting a of the plane at a distance: the inverse of `distance`.

        `distance_mm`: distances from the micro lenses, any shape; inf is allowed. `border`: which
        of a plane's distances is meant: its own, or a border of its depth of field. Result: a, same
        shape. Raises `InputError` if a distance is nan, -inf or too large, or no plane is there.
        """
        distance = np.asarray(distance_mm, dtype=np.float64)
        if not ((np.abs(distance) <= _LARGEST) | np.isposinf(distance)).all():
            raise InputError(f"a distance is a number of mm up to {_LARGEST:g}, or inf")
        parts = self._lines[border]
        if len(parts) == 1:
            settings, slope = _settings(parts[0], distance)
            if not slope.all():
                raise InputError("no plane that can be refocused lies at this distance")
            return settings
        settings = np.full(distance.shape, np.nan)
        for part in parts:
            here, _ = _settings(part, distance)
            # Rounding may put a setting just beyond the end of its part.
            reach = _ROUNDING * np.abs(here)
            inside = (part.first - reach <= here) & (here <= part.last + reach)
            settings = np.where(inside & np.isnan(settings), here, settings)
        if np.isnan(settings).any():
            raise InputError("no plane that can be refocused lies at this distance")
        return settings

    def alpha(self, a: npt.ArrayLike) -> Values:
        """Refocusing parameter alpha of Ng (Eqs. 2.10 to 2.17): image distance b_U' over b_U.

        `a`: focus settings, any shape. Result: alpha, same shape: 1 for a = 0, below 1 for planes
        beyond the focused one; inf where the rays behind the micro lenses are parallel.
        """
        shift = np.asarray(a, dtype=np.float64) * self.camera.micro_lenses.pitch_mm
        with np.errstate(divide="ignore", over="ignore"):
            # b_U' = b_U - d' (Eq. 3.33), with d' as at the top.
            behind = shift / (self.pixel_slope - shift / self.exit_pupil_mm)
        return np.asarray(1 + behind / self.image_distance_mm)

    def focus_setting_of_alpha(self, alpha: npt.ArrayLike) -> Values:
        """Focus setting a of Ng's parameter: the inverse of `alpha`.

        `alpha`: image distance over b_U, any shape; inf is allowed. Result: a, same shape. Raises
        `InputError` if an alpha is not a number, or its image plane lies in the exit pupil.
        """
        behind = (np.asarray(alpha, dtype=np.float64) - 1) * self.image_distance_mm
        with np.errstate(divide="ignore", over="ignore"):
            share = 1 / behind + 1 / self.exit_pupil_mm
        if np.isnan(behind).any() or not share.all():
            raise InputError("no plane lies at this alpha")
        return np.asarray(self.pixel_slope / self.camera.micro_lenses.pitch_mm / share)


def _settings(part: _Part, distance: Values) -> tuple[Values, Values]:
    """Focus settings of distances in mm, and the slopes they were divided by: 0 for no plane."""
    top, bottom = part.top, part.bottom
    # D(a) = d V(a) is as linear in d as in a.
    numerator = Line(-top.constant, -top.constant_low, bottom.constant, bottom.constant_low)
    denominator = Line(top.factor, top.factor_low, -bottom.factor, -bottom.factor_low)
    far = np.isposinf(distance)
    with np.errstate(invalid="ignore", divide="ignore"):
        halves = split(distance)
        slope = np.where(far, -bottom.factor, denominator.at(distance, halves))
        level = np.where(far, bottom.constant, numerator.at(distance, halves))
        return np.asarray(level / slope), slope
