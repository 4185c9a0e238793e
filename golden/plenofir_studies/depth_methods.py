# SPDX-License-Identifier: Apache-2.0
"""Depth from focus against depth from disparity: a dense benchmark, and a real light field.

Strips of texture stand side by side at distances that are no slices' own, a wall behind them. Where
each micro lens of the central view looks is known: the same scene is rendered once more, each plane
evenly coloured. Depth is counted as the focus setting a, which is the disparity between
neighbouring views in micro lenses.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from plenofir.camera.lightfield import FocalStack, light_field_disparity, sub_aperture
from plenofir.camera.lightfield.disparity import Method
from plenofir.camera.rays import RayModel
from plenofir.camera.synthetic.render import Capture, TexturedPlane, field_of_view, render
from plenofir.ground import project
from plenofir.ground.images import read_image
from plenofir.refocus.operator import Image
from plenofir.refocus.sharpness import depth_index
from plenofir_studies.experiments import textures
from plenofir_studies.resolution import aligned_model

Floats = npt.NDArray[np.float64]

M = 9
"""Micro image size of the synthetic scene."""
BAD = (0.07, 0.2)
"""Errors of a above which a pixel counts as bad: the usual bound of light field benchmarks, and
two slices of M = 9."""
SEED = 6
_SETTINGS = (0.13, 0.86, 0.42, 1.21, 0.61, 0.27, 1.03)
_WALL = 0.05
_STRIP = 16
_ROWS = 60
_NOISE = 0.01
_BORDER = 6
_PURE = 0.002
# Slices beyond the nearest and farthest object.
_SPARE = 3


@dataclass(frozen=True)
class Truth:
    """A light field and its true depth."""

    raw: Image  # aligned raw image
    view: Image  # its central view
    a: Floats  # focus setting of each micro lens, nan where two planes meet; (t, s)
    model: RayModel  # the camera


def _planes(model: RayModel, coloured: bool) -> list[TexturedPlane]:
    pictures = textures()
    columns = _STRIP * len(_SETTINGS)
    settings = [_WALL, *_SETTINGS]
    planes = []
    for number, a in enumerate(settings):
        distance = float(model.distance(a).mm)
        lens = field_of_view(model, distance, 1)
        # The wall is seen above and below the strips and between them.
        side = 2.5 * columns if number == 0 else _STRIP - 2
        middle = 0.0 if number == 0 else (number - 0.5) * _STRIP - columns / 2
        picture = pictures[number % len(pictures)]
        if number:
            picture = np.tile(picture[:160, :160], (3, 1))
        # The number and its square: where planes mix, their means do not fit each other.
        label = number / len(_SETTINGS)
        texture = np.broadcast_to([label, label**2, 0.0], (*picture.shape[:2], 3))
        planes.append(
            TexturedPlane(
                texture if coloured else picture, distance, side * lens, (0.0, middle * lens)
            )
        )
    return planes


def synthetic_scene(noise: float = _NOISE) -> Truth:
    """Render the strips, and what the central view sees of which; noise as a share of white."""
    model = aligned_model(M)
    lenses = _ROWS + 1, _STRIP * len(_SETTINGS) + 13

    def shot(coloured: bool) -> Capture:
        return render(
            model,
            _planes(model, coloured),
            lenses,
            form="square",
            radius=1.0,
            noise=0.0 if coloured else noise,
            bits=16 if coloured else 8,
            seed=SEED,
        )

    raw, labels = shot(False).raw, shot(True)
    # Slopes and cos^4 darken the borders.
    coloured, white = (sub_aperture(x, M, M // 2, M // 2) for x in (labels.raw, labels.white))
    middle = coloured / white[..., np.newaxis].astype(np.float64)
    number = np.rint(middle[..., 0] * len(_SETTINGS)).astype(int)
    a = np.array([_WALL, *_SETTINGS])[np.clip(number, 0, len(_SETTINGS))]
    a[np.abs(middle[..., 1] - (number / len(_SETTINGS)) ** 2) > _PURE] = np.nan
    a[np.abs(middle[..., 0] - number / len(_SETTINGS)) > _PURE] = np.nan
    return Truth(raw, sub_aperture(raw, M, M // 2, M // 2), a, model)


def flower() -> Image:
    """Green channel of the light field of a flower that the package ships, M = 5."""
    picture = read_image(project.DATA / "flower_5x5.png")
    return np.ascontiguousarray(picture[..., 1])


Way = Callable[[Image, int, tuple[float, float]], Floats]
"""Takes a raw image, M and the range of a, and gives a for each micro lens."""


def _slices(m: int, search: tuple[float, float]) -> list[Fraction]:
    low, high = int(np.floor(search[0] * m)), int(np.ceil(search[1] * m))
    return [Fraction(k, m) for k in range(low, high + 1)]


def by_depth_index(raw: Image, m: int, search: tuple[float, float]) -> Floats:
    """Depth from focus as the VHDL has it: sharpest of whole slices, windows of 5 x 5 lenses."""
    settings = _slices(m, search)
    index = depth_index(FocalStack(raw, m, settings), m, radius=2).index
    return np.array([float(a) for a in settings])[index]


def by_disparity(method: Method) -> Way:
    """Depth from disparity: differences between views, or slopes; windows of 7 x 7 lenses."""
    return lambda raw, m, search: (
        light_field_disparity(raw, m, search=search, method=method).pixels_per_view
    )


WAYS: dict[str, Way] = {
    "focus, depth index": by_depth_index,
    "disparity, guided": by_disparity("guided"),
    "disparity, windows": by_disparity("windows"),
    "disparity, structure tensor": by_disparity("structure-tensor"),
}


@dataclass(frozen=True)
class Score:
    """How well a way does on the synthetic scene."""

    name: str
    a: Floats  # depth found, (t, s)
    bad: tuple[float, ...]  # share of pixels with an error above each of `BAD`
    mean: float  # mean error of a
    median: float
    mm: float  # mean relative error of the strips' distances
    seconds: float  # of processor time


def _search(settings: Floats, m: int) -> tuple[float, float]:
    return (
        float(np.nanmin(settings)) - _SPARE / m,
        float(np.nanmax(settings)) + _SPARE / m,
    )


def score_all(truth: Truth) -> list[Score]:
    """Find the synthetic scene's depth in every way (in the order of `WAYS`), borders left out."""
    search = _search(truth.a, M)
    part = (slice(_BORDER, -_BORDER), slice(_BORDER, -_BORDER))
    want = truth.a[part]
    known = ~np.isnan(want)
    distance = truth.model.distance(want[known]).mm
    scores = []
    for name, way in WAYS.items():
        way(truth.raw[: 9 * M, : 9 * M], M, search)  # compiles what is not yet
        start = time.process_time()
        found = way(truth.raw, M, search)
        seconds = time.process_time() - start
        error = np.abs(found[part] - want)[known]
        found_mm = truth.model.distance(found[part][known]).mm
        # The wall is so far away that distances say little; settings of 0 and below have none.
        here = (want[known] > _WALL) & np.isfinite(found_mm)
        scores.append(
            Score(
                name=name,
                a=found,
                bad=tuple(float((error > bound).mean()) for bound in BAD),
                mean=float(error.mean()),
                median=float(np.median(error)),
                mm=float(np.mean(np.abs(found_mm[here] / distance[here] - 1))),
                seconds=seconds,
            )
        )
    return scores


@dataclass(frozen=True)
class Agreement:
    """Two ways on a light field whose depth is not known."""

    first: str
    second: str
    mean: float  # mean difference of a
    apart: tuple[float, ...]  # share of pixels that differ by more than each of `BAD`


def on_flower() -> tuple[dict[str, Floats], dict[str, float], list[Agreement]]:
    """Depth (t, s) of the flower and seconds of processor time by way, and each pair of ways."""
    raw, found, seconds = flower(), dict[str, Floats](), dict[str, float]()
    for name, way in WAYS.items():
        start = time.process_time()
        found[name] = way(raw, 5, (-1.2, 0.2))
        seconds[name] = time.process_time() - start
    names, pairs = list(found), []
    for k, first in enumerate(names):
        for second in names[k + 1 :]:
            apart = np.abs(found[first] - found[second])[_BORDER:-_BORDER, _BORDER:-_BORDER]
            shares = tuple(float((apart > bound).mean()) for bound in BAD)
            pairs.append(Agreement(first, second, float(apart.mean()), shares))
    return found, seconds, pairs
