# SPDX-License-Identifier: Apache-2.0
"""What a focused camera sees sharply: virtual depth, blur of its micro lenses, ranges, covering.

A micro lens of focal length f_s at b_s from the sensor sees the image of the main lens, which lies
v b_s behind it: v is its virtual depth (C. Perwass and L. Wietzke, Single lens 3D-camera with
extended depth-of-field, Proc. SPIE 8291, 829108, 2012: v = a / b; C. Heinze et al., Automated
robust metric calibration algorithm for 3D camera systems, IEEE Trans. Instrum. Meas. 65(5), 2016:
v = D / (D - (i_1 - i_2)) for places i in neighbouring micro images). Here v has a sign: it is
negative for images in front of the micro lenses, where published distances are positive too.
The focus setting a of that plane follows from

    1 / v = p_p / (a p_M) - b_s / d_A'.

The thin lens equation, with an image behind the lens, is 1 / f_s = 1 / b_s - 1 / (v b_s), so an
open micro lens blurs a point at v by

    s = p_M |1 - 1 / v - b_s / f_s|

on the sensor, which limits what a picture resolves, as a share of the sensor's pixels, to
p_p / max(s, p_p) / |v| (effective resolution ratio: Perwass and Wietzke; M. Damghanian et al.,
Spatial resolution in a multi-focus plenoptic camera, ICIP 2014).
In micro lenses on plane a the blur is |a c - 1| wide, a pixel |a|, a box of B samples of p_M / M
(B / M) |a g - 1|, with

    g = (p_M / p_p) b_s / d_A',    c = g + (p_M / p_p) (1 - b_s / f_s).

In a standard camera c = g: the box of M samples is as wide as the light of a micro lens everywhere.
"""

from dataclasses import dataclass
from math import inf, isnan, sqrt
from typing import Protocol

import numpy as np
import numpy.typing as npt

from plenofir.camera.rays.camera import Camera, MicroLensArray
from plenofir.camera.rays.distances import Distances
from plenofir.camera.rays.precise import Values

# A blur that is wider than a pixel or the box by so little is as sharp: that of a camera that is
# standard but for rounding.
_AS_SHARP = 1e-3
# Stands for an infinite focus setting; products with a camera's lengths do not overflow.
_FARTHEST = 1e60
# From which |v| on round micro images cover all of a picture, for each type of micro lens: the
# distance from the farthest point to the nearest lens of a type, in halves of p_M, by layout and
# number of types in the usual order (a chessboard, and three types on a hexagonal grid, whose
# lenses of one type stand sqrt(3) p_M apart).
_COVERING = {
    ("rectangular", 1): sqrt(2.0),
    ("rectangular", 2): 2.0,
    ("hexagonal", 1): 2 / sqrt(3.0),
    ("hexagonal", 3): 2.0,
}


class Refocusing(Protocol):
    """The parts of `plenofir.camera.rays.model.RayModel`, which needs this module, used here."""

    @property
    def camera(self) -> Camera:
        """Its camera."""

    @property
    def micro_image_size(self) -> int:
        """M in pixels."""

    @property
    def box(self) -> int | None:
        """Samples of the box; None for those of the kind of camera."""

    @property
    def exit_pupil_mm(self) -> float:
        """d_A' in mm."""

    def box_at(self, a: npt.ArrayLike) -> Values:
        """Samples of the box at focus settings."""

    def distance(self, a: npt.ArrayLike) -> Distances:
        """Distances of planes from the micro lenses."""


@dataclass(frozen=True)
class Sharpness:
    """How sharp planes are under the type of micro lens that is sharpest there."""

    # Index of that type in `MicroLensArray.focal_lengths_mm`, shape of the focus settings.
    lens_type: npt.NDArray[np.intp]
    # Diameter of that type's blur on the sensor in pixels; inf for a plane in the micro lenses.
    blur_px: Values
    sharp: npt.NDArray[np.bool_]  # whether the blur is at most a pixel, or the box


@dataclass(frozen=True)
class UsableRange:
    """Planes that a type of micro lens sees sharply: to a pixel or the box of the slices."""

    focal_length_mm: float  # f_s of the type
    focus: float  # virtual depth at which the type is sharpest; inf in a standard camera
    # First and last virtual depth: from far objects to near ones. From a positive to a negative one
    # the range goes over infinity.
    depths: tuple[float, float]
    # Focus settings a of both ends; infinite ones where the rays behind the micro lenses converge
    # nowhere.
    settings: tuple[float, float]
    # Distances of both ends from the micro lenses: far is inf where the range reaches infinity,
    # near is nan where all of it lies beyond.
    far_mm: float
    near_mm: float


def virtual_depth(model: Refocusing, a: npt.ArrayLike) -> Values:
    """Virtual depths v of refocused planes; `a`: focus settings, any shape. Result: same shape."""
    array = model.camera.micro_lenses
    shift = np.asarray(a, dtype=np.float64) * array.pitch_mm
    with np.errstate(divide="ignore"):
        share = model.camera.sensor.pixel_pitch_mm - shift * (
            array.spacing_mm / model.exit_pupil_mm
        )
        return np.asarray(shift / share)


def setting_of_virtual_depth(model: Refocusing, depth: npt.ArrayLike) -> Values:
    """Focus settings a of planes at virtual depths v: the inverse of `virtual_depth`.

    `depth`: v, any shape; inf is allowed. Result: a, same shape; infinite where no a is there.
    """
    array, v = model.camera.micro_lenses, np.asarray(depth, dtype=np.float64)
    with np.errstate(divide="ignore"):
        share = array.pitch_mm * (1 / v + array.spacing_mm / model.exit_pupil_mm)
        return np.asarray(model.camera.sensor.pixel_pitch_mm / share)


def _turns(model: Refocusing) -> tuple[Values, float]:
    """For each type of micro lens c, shape (types,), and g."""
    array = model.camera.micro_lenses
    pixels = array.pitch_mm / model.camera.sensor.pixel_pitch_mm
    g = pixels * array.spacing_mm / model.exit_pupil_mm
    return g + pixels * (1 - array.spacing_mm / np.array(array.focal_lengths_mm)), g


def blur_px(model: Refocusing, a: npt.ArrayLike) -> Values:
    """Diameters of the blur of each type of micro lens on the sensor.

    `a`: focus settings, any shape. Result: pixels, shape (types, *a.shape).
    """
    values = np.asarray(a, dtype=np.float64)
    with np.errstate(divide="ignore", over="ignore"):
        return np.asarray(np.abs(np.multiply.outer(_turns(model)[0], values) - 1) / np.abs(values))


def sharpest_inverse(model: Refocusing) -> Values:
    """For each type of micro lens 1 / a of the plane at which it is sharpest, shape (types,)."""
    return _turns(model)[0]


def pupil_blur_px(model: Refocusing) -> Values:
    """Diameters of the blur of each type of micro lens for a point of the exit pupil, in pixels.

    Micro images are wider by so much than the pupil's image, with a soft rim. Result: (types,).
    """
    return np.abs(sharpest_inverse(model))


def sharpest_type(model: Refocusing, a: npt.ArrayLike) -> Sharpness:
    """Which type of micro lens is sharpest at focus settings `a` (any shape), and how sharp."""
    values = np.asarray(a, dtype=np.float64)
    turns, g = _turns(model)
    widths = np.abs(np.multiply.outer(turns, values) - 1)
    best = widths.argmin(axis=0)
    width = widths.min(axis=0)
    box = np.zeros(values.shape)
    if model.box is not None or model.camera.micro_lenses.standard:
        box = model.box_at(values) / model.micro_image_size * np.abs(values * g - 1)
    bound = np.maximum(np.abs(values), box)
    with np.errstate(divide="ignore", over="ignore"):
        return Sharpness(best, width / np.abs(values), width <= bound * (1 + _AS_SHARP))


def resolution_ratio(model: Refocusing, a: npt.ArrayLike) -> Values:
    """Effective resolution ratio of planes: pixels of a picture over those of the sensor.

    Along one dimension, under the sharpest type of micro lens. `a`: focus settings, any shape.
    Result: same shape.
    """
    blur = np.maximum(sharpest_type(model, a).blur_px, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = 1 / (blur * np.abs(virtual_depth(model, a)))
    return np.where(np.isfinite(blur), ratio, 0.0)


def usable_ranges(model: Refocusing) -> tuple[UsableRange, ...]:
    """Ranges in which each type of micro lens is sharp."""
    array = model.camera.micro_lenses
    m = model.micro_image_size
    # In x = 1 / a: |c - x| is at most 1, a pixel, or share |x - g|, the box.
    share = (m if model.box is None else model.box) / m
    if model.box is None and not array.standard:
        share = 0.0
    turns, g = _turns(model)
    ranges = []
    for f, c in zip(array.focal_lengths_mm, turns.tolist(), strict=True):
        of_box = [(c + share * g) / (1 + share), c]
        if share < 1:
            of_box.append((c - share * g) / (1 - share))
        else:
            of_box += [inf] * (c >= g) + [-inf] * (c <= g)
        low, high = min(c - 1, *of_box), max(c + 1, *of_box)
        with np.errstate(divide="ignore"):
            ends = np.divide(1.0, [high, low])
        planes = np.clip(ends, -_FARTHEST, _FARTHEST)
        far, near = model.distance(planes).mm.tolist()
        first, last = virtual_depth(model, planes).tolist()
        conjugate = 1 - array.spacing_mm / f
        ranges.append(
            UsableRange(
                focal_length_mm=f,
                focus=1 / conjugate if conjugate else inf,
                depths=(first, last),
                settings=(float(ends[0]), float(ends[1])),
                far_mm=inf if isnan(far) else far,
                near_mm=near,
            )
        )
    return tuple(ranges)


def covering_depth(array: MicroLensArray) -> float | None:
    """|v| of the total covering plane: from it on each type of micro lens alone covers a picture.

    Round micro images that touch are |v| p_M wide on a plane at v. Three types on a hexagonal grid
    cover from |v| = 2 on (Perwass and Wietzke). Result: None for a layout with another number of
    types than usual.
    """
    return _COVERING.get((array.layout, len(array.focal_lengths_mm)))
