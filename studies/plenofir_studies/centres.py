# SPDX-License-Identifier: Apache-2.0
"""Rounded against fractional micro image centres in decoding (Fig. 4.12 of the thesis).

Rounding moves what a view sees of a plane in focus at a by up to a/2 micro lenses in each
dimension: 1 / sqrt(12) of a pixel in the root mean square, times a, times sqrt(1 + slope^2) across
a line. Straight lines become stairs. Bilinear interpolation of independent noise keeps
(1 - f)^2 + f^2 of its variance in each dimension, 2/3 on average over the fractions f.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import inf, sqrt
from typing import get_args

import numpy as np
import numpy.typing as npt

from plenofir.camera.calibration import calibrate, decode
from plenofir.camera.calibration.resample import Interpolation
from plenofir.camera.lightfield import sub_aperture
from plenofir.camera.rays import RayModel, load_camera
from plenofir.refocus import refocus
from plenofir.refocus.operator import Image
from plenofir_studies.experiments import CAMERA
from plenofir_studies.resolution import edge_jaggedness, edge_places, inside, slanted_edge, transfer
from plenofir_studies.synthetic.render import TexturedPlane, field_of_view, render

Floats = npt.NDArray[np.float64]

M = 11
"""Micro images are cropped to M pixels of 14.27."""
FOCUS = Fraction(1)
"""Setting a in which the edge is in focus."""
WAYS: tuple[Interpolation, ...] = get_args(Interpolation)
_LENSES = 41
_SPARE = 30
_ROTATION = 0.3
_NOISE = 0.01


@dataclass(frozen=True)
class Decoded:
    """Result of one interpolation for the same capture."""

    way: Interpolation
    view: Image  # central view of the edge, without noise
    jaggedness: float  # of the edge in it, micro lenses, root mean square
    refocused: float  # the same of the picture refocused to the edge
    half: float  # frequency at which the view has half of the contrast, cycles a micro lens
    noise: float  # variance of an even capture's noise after decoding, over that before it


def rounded_jaggedness(slope: float) -> float:
    """Jaggedness of an edge whose micro image centres are rounded, in micro lenses along lines.

    Root mean square; `slope` is the columns that the edge moves from a line to the next.
    """
    return float(FOCUS) * sqrt((1 + slope**2) / 12)


def _capture(model: RayModel, texture: Floats, noise: float) -> tuple[Image, Image]:
    distance = float(model.distance(float(FOCUS)).mm)
    plane = TexturedPlane(texture, distance, field_of_view(model, distance, _LENSES + 2 * _SPARE))
    rendered = render(
        model, [plane], (_LENSES, _LENSES), rotation_degrees=_ROTATION, noise=noise, level=0.7
    )
    return rendered.raw, rendered.white


def compare() -> tuple[list[Decoded], float]:
    """Decode a slanted edge, and an even surface with noise, in every way.

    In the order of `WAYS`; and the jaggedness that rounding should cause (`rounded_jaggedness`).
    """
    model = RayModel.focused(load_camera(CAMERA), inf, M)
    raw, white = _capture(model, slanted_edge(), 0.0)
    calibration = calibrate(white)
    noisy = np.random.default_rng(0).normal(30000, 65535 * _NOISE, raw.shape)
    even = np.rint(noisy).astype(np.uint16)
    results = []
    slope = 0.0
    for way in WAYS:
        raster = decode(raw, calibration, M, interpolation=way)
        view = inside(sub_aperture(raster, M, M // 2, M // 2), 3)
        slope = float(np.polyfit(np.arange(len(view)), edge_places(view), 1)[0])
        picture = inside(refocus(raster, M, FOCUS), 8 * M)
        flat = decode(even, calibration, M, interpolation=way, devignette=False)
        results.append(
            Decoded(
                way=way,
                view=view,
                jaggedness=edge_jaggedness(view, 1),
                refocused=edge_jaggedness(picture, M),
                half=transfer(view, 1).half,
                noise=float(flat.astype(np.float64).var() / even.astype(np.float64).var()),
            )
        )
    return results, rounded_jaggedness(slope)
