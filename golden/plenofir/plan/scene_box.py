# SPDX-License-Identifier: Apache-2.0
"""Boxes of a scene's slices: what each resolves, the noise that it leaves, and which is chosen.

The operator's weights along a dimension are one kernel, in steps of 1/M of a micro lens: the box of
B samples, once more for each order of interpolation, and the sharpening's taps. Its transform C(f),
at f cycles a lens, and the micro lens's and the pixel's own areas, w and |a| lenses wide on the
plane in focus, leave the contrast

    C(f) sinc(w f) sinc(a f),

and the sum of its squared weights is the share of the variance that each dimension leaves, for any
a: the g = gcd(a', M) views that meet in one place are averaged over g outputs. So noise falls to
that sum in a picture, by 1 / B for nearest neighbour.
"""

from fractions import Fraction
from math import inf
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from plenofir.camera.rays import RayModel, sharpest_type
from plenofir.ground.errors import InputError, validation_error
from plenofir.plan.loaded_scene import LoadedScene
from plenofir.plan.scene import SceneBuild
from plenofir.refocus import interpolation_order, sharpening_units
from plenofir.refocus.operator import least_box
from plenofir.refocus.sharpening import taps

# Frequencies for each cycle a lens, between which contrast is a line.
_STEPS = 64
# 1 / B is rounded.
_AS_QUIET = 1 + 1e-9
_WISHES = "box", "resolution", "noise"


class Quality(NamedTuple):
    """What a slice's box is good for."""

    # Frequency in cycles a micro lens at which half of the contrast is left; M / 2 if nowhere.
    half_contrast: float
    noise: float  # standard deviation of the picture's noise over that of the raw image


def lens_width(model: RayModel | None, a: Fraction) -> float:
    """Width of a micro lens's area on a plane in focus, in micro lenses; 1 if no camera is known.

    Of a focused camera under the type that is sharpest there.
    """
    if model is None or not a:
        return 1.0
    return float(abs(a)) * float(sharpest_type(model, float(a)).blur_px)


def kernel(m: int, box: int, order: int, units: int) -> npt.NDArray[np.float64]:
    """Weights of the operator along a dimension, in steps of 1/M; `units`: 64 b."""
    weights = np.ones(1)
    for _ in range(1 + order):
        weights = np.convolve(weights, np.full(box, 1 / box))
    filter_, sharp = taps(units), np.zeros(2 * m + 1)
    sharp[[0, m, 2 * m]] = -filter_.side, filter_.centre, -filter_.side
    return np.convolve(weights, sharp / filter_.scale)


def quality(
    m: int, shift: int, box: int, order: int, units: int, model: RayModel | None
) -> Quality:
    """Quality of a slice with a box of B samples; `units`: 64 b of its sharpening."""
    a = Fraction(shift, m)
    weights = kernel(m, box, order, units)
    frequency = np.linspace(0, m / 2, m * _STEPS // 2 + 1)
    turns = np.exp(-2j * np.pi / m * np.outer(frequency, np.arange(weights.size)))
    areas = np.sinc(lens_width(model, a) * frequency) * np.sinc(float(a) * frequency)
    contrast = np.abs(turns @ weights) * areas
    half = m / 2
    if (below := np.flatnonzero(contrast < 0.5)).size:
        after = int(below[0])
        ends = slice(after, after - 2 if after > 1 else None, -1)
        half = float(np.interp(0.5, contrast[ends], frequency[ends]))
    return Quality(half, float((weights**2).sum()))


def chosen_boxes(loaded: LoadedScene, shifts: tuple[int, ...]) -> tuple[int, ...]:
    """Box of each slice of a scene; empty if all are M.

    Of the boxes that resolve what the scene wants the largest, which leaves the least noise; where
    it only limits noise, the smallest one. A slice that cannot resolve so much has its smallest
    box. InputError if no slice can, or if all boxes that do leave too much noise.
    """
    build, m = loaded.scene.build, loaded.scene.camera.micro_image_size
    if build.resolution is None and build.noise is None:
        return build.boxes(shifts, m)
    # Stored products and sharpening have one box for all slices.
    alone = build.arithmetic != "stored" and build.sharpen == "off"
    groups = [(shift,) for shift in shifts] if alone else [shifts]
    possible = [_possible(group, loaded) for group in groups]
    if build.resolution is not None:
        most = max(each.half_contrast for group in possible for each in group.values())
        if most < build.resolution:
            raise InputError(
                f"no box resolves {build.resolution:g} cycles a micro lens: half contrast is at "
                f"{most:.3f} at most; want less",
                where=f"{loaded.path}: build.resolution",
            )
    boxes = tuple(
        _best(group, build, str(loaded.path))
        for group, slices in zip(possible, groups, strict=True)
        for _ in slices
    )
    return boxes if min(boxes) < m else ()


def _possible(shifts: tuple[int, ...], loaded: LoadedScene) -> dict[int, Quality]:
    """All boxes that some slices can have, with the worst quality of these slices."""
    build, m, model = loaded.scene.build, loaded.scene.camera.micro_image_size, loaded.model()
    order, possible = interpolation_order(build.interpolation), {}
    for box in range(1, m + 1):
        if any(least_box(m, shift, box) != box for shift in shifts):
            continue
        units = (sharpening_units(build.sharpen, m, shift, order, box=box) for shift in shifts)
        each = [
            quality(m, shift, box, order, u, model) for shift, u in zip(shifts, units, strict=True)
        ]
        possible[box] = Quality(min(q.half_contrast for q in each), max(q.noise for q in each))
    return possible


def _best(possible: dict[int, Quality], build: SceneBuild, path: str) -> int:
    """The box that suits a scene's wishes best."""
    resolution, most_noise = build.resolution or 0.0, build.noise or inf
    resolved = [b for b, q in possible.items() if q.half_contrast >= resolution] or [min(possible)]
    quiet = [b for b, q in possible.items() if q.noise <= most_noise * _AS_QUIET]
    if not quiet:
        raise InputError(
            f"no box leaves {most_noise:g} of the noise: all {max(possible)} samples leave "
            f"{possible[max(possible)].noise:.3f}; allow more",
            where=f"{path}: build.noise",
        )
    if max(resolved) < min(quiet):
        box, other = max(resolved), min(quiet)
        raise InputError(
            f"{resolution:g} cycles a micro lens need {box} samples or fewer, which leave "
            f"{possible[box].noise:.3f} of the noise; {most_noise:g} needs {other} or more, with "
            f"half contrast at {possible[other].half_contrast:.3f}; want less of one",
            where=f"{path}: build.resolution",
        )
    return max(resolved) if build.resolution is not None else min(quiet)


def with_wishes(loaded: LoadedScene, **wishes: object) -> LoadedScene:
    """A scene with other wishes for its boxes: `box`, or `resolution` and `noise`."""
    build = {**loaded.scene.build.model_dump(exclude_unset=True), **dict.fromkeys(_WISHES)}
    try:
        boxed = SceneBuild.model_validate({**build, **wishes})
    except ValidationError as error:
        raise validation_error(error, where=f"{loaded.path}: build") from None
    return loaded.model_copy(update={"scene": loaded.scene.model_copy(update={"build": boxed})})
