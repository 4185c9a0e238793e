# SPDX-License-Identifier: Apache-2.0
"""The thesis's experiments with a real camera (section 5.3), done with the synthetic one.

Objects stand at known distances; the raw captures are calibrated, decoded, and refocused or matched
as real ones would be. Predictions come from the ray model, with which the pictures were rendered,
so differences are due to capture and processing: sampling, noise, calibration, search.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf

import numpy as np
import numpy.typing as npt
from skimage import data

from plenofir.camera.calibration import calibrate, decode, raster_window
from plenofir.camera.lightfield import depth_map, focal_stack, peak, sharpness_curve, views
from plenofir.camera.rays import RayModel, load_camera
from plenofir.refocus.operator import Image
from plenofir_studies.absolute_differences import sad_disparity
from plenofir_studies.synthetic.render import Capture, TexturedPlane, field_of_view, render
from plenofir_studies.thesis_tables import load_table

Floats = npt.NDArray[np.float64]

CAMERA = "f197-mla2"
"""The camera of the thesis's experiments."""
FOCUS_MM = {"a": inf, "b": inf, "c": 4000.0}
"""Focus of the parts of Table 5.10; Table 5.11 has that of (b), Table 5.12 that of (c)."""
OBJECT_LENSES = 26
"""Width of an object in micro lenses: enough for refocusing and for small windows."""
# Objects are this many micro lenses apart, and measured away from their borders, where the blur of
# others reaches.
_APART = 4
_MARGIN = 5
_NOISE = 0.01
_ROTATION = 0.3
_FAR_MM = 1e6


@dataclass(frozen=True)
class Scene:
    """Objects side by side in front of the camera, captured and decoded."""

    capture: Capture
    raster: Image  # its aligned raster
    # rows and columns of each object's inside, in micro lenses of the raster
    regions: list[tuple[slice, slice]]


def textures() -> list[Image]:
    """Grey pictures with detail everywhere (public domain, from scikit-image)."""
    gravel: Image = data.gravel()  # type: ignore[no-untyped-call]
    grass: Image = data.grass()  # type: ignore[no-untyped-call]
    return [gravel, grass, gravel[::-1, ::-1], grass[::-1, ::-1]]


def take(
    model: RayModel,
    distances_mm: Sequence[float],
    *,
    seed: int = 0,
    object_lenses: int = OBJECT_LENSES,
    margin: float = 0,
) -> Scene:
    """Capture and decode objects side by side, a plain wall behind them.

    Objects are squares of some micro lenses; the measured region lies `margin` micro lenses farther
    inside than other objects' blur reaches.
    """
    count = len(distances_mm)
    columns = count * (object_lenses + _APART) + _APART + 2
    planes = [
        TexturedPlane(np.full((2, 2), 0.4), _FAR_MM, field_of_view(model, _FAR_MM, 3.0 * columns))
    ]
    pictures = textures()
    middles = [(k - (count - 1) / 2) * (object_lenses + _APART) for k in range(count)]
    for k, (distance, middle) in enumerate(zip(distances_mm, middles, strict=True)):
        lens = field_of_view(model, distance, 1)
        planes.append(
            TexturedPlane(
                pictures[k % len(pictures)], distance, object_lenses * lens, (0.0, middle * lens)
            )
        )
    capture = render(
        model,
        planes,
        (object_lenses + 10, columns),
        rotation_degrees=_ROTATION,
        noise=_NOISE,
        shading=0.2,
        seed=seed,
    )
    calibration = calibrate(capture.white)
    raster = decode(capture.raw, calibration, model.micro_image_size)
    rows, lens_columns = raster_window(calibration)
    # Lattice coordinates of the image's middle, counted in the raster.
    middle_px = (np.array(capture.raw.shape[:2]) - 1) / 2
    centre = calibration.grid.inverse(middle_px) - (rows.start, lens_columns.start)
    half = object_lenses / 2 - _MARGIN - margin
    regions = []
    for middle in middles:
        place = centre + np.array([0.0, middle])
        low, high = np.ceil(place - half).astype(int), np.floor(place + half).astype(int)
        regions.append((slice(low[0], high[0] + 1), slice(low[1], high[1] + 1)))
    return Scene(capture, raster, regions)


@dataclass(frozen=True)
class Focused:
    """An object and where it was found sharpest."""

    predicted: float  # focus setting at which the ray model says it is sharp
    distance_mm: float  # its distance
    # focus settings of the stack and the object's sharpness there
    settings: Floats
    curve: Floats
    found: float  # position of the curve's maximum, between slices too
    found_mm: float  # distance of that setting by the ray model

    @property
    def best(self) -> float:
        """Slice in which it is sharpest."""
        return float(self.settings[int(np.argmax(self.curve))])

    @property
    def error_percent(self) -> float:
        return 100 * (self.found_mm / self.distance_mm - 1)


def model_of(m: int, focus_mm: float = inf) -> RayModel:
    """The thesis's camera."""
    return RayModel.focused(load_camera(CAMERA), focus_mm, m)


def focus_experiment(
    model: RayModel,
    distances_mm: Sequence[float],
    *,
    seed: int = 0,
) -> list[Focused]:
    """Sweep the focus over objects at known distances (Fig. 5.16)."""
    m = model.micro_image_size
    scene = take(model, distances_mm, seed=seed)
    predicted = model.focus_setting(distances_mm)
    first, last = np.floor(predicted.min() * m) - 3, np.ceil(predicted.max() * m) + 3
    shifts = np.arange(int(first), int(last) + 1)
    stack = focal_stack(scene.raster, m, [Fraction(int(k), m) for k in shifts])
    results = []
    for a, distance, region in zip(predicted, distances_mm, scene.regions, strict=True):
        rows, columns = (slice(part.start * m, part.stop * m) for part in region)
        curve = sharpness_curve(stack, (rows, columns), m)
        sharpest = peak(shifts / m, curve)
        found_mm = float(model.distance(sharpest).mm)
        results.append(Focused(float(a), distance, shifts / m, curve, sharpest, found_mm))
    return results


def placed(part: str) -> list[float]:
    """Focus settings at which the thesis placed objects and markers (parts of Table 5.10)."""
    return [row["a"] for row in load_table("5.10").part(part).rows if "object" in row.labels]


@dataclass(frozen=True)
class ViewPair:
    """Two views, and parameters of their disparity search."""

    first: int  # the first view, counted from the central one
    gap: int  # G, views between the two
    window: int  # side of the window of the sum of absolute differences, in pixels
    largest_px: float  # largest disparity between the two views

    @property
    def name(self) -> str:
        """Which views, with which window."""
        return f"views {self.first} and {self.first + self.gap}, window {self.window}"


# The thesis does not say which views it took; here the pairs of gap 4 share one view.
FIGURES = {
    "5.17": (ViewPair(-4, 4, 29, 5), ViewPair(-4, 8, 39, 9), ViewPair(0, 4, 29, 5)),
    "5.18": (ViewPair(-4, 4, 33, 5), ViewPair(-4, 8, 39, 9), ViewPair(0, 4, 33, 5)),
}
"""Views and windows of the disparity maps (b), (c), (d) of Figs. 5.17 and 5.18."""
FIGURE_OBJECT_LENSES = 60
"""Width of the objects for these windows: the views are then about as wide as the thesis's."""
SMALL_PAIRS = (ViewPair(-2, 4, 15, 8), ViewPair(-4, 8, 15, 16))
"""Views and windows for objects of usual width."""


@dataclass(frozen=True)
class Measured:
    """An object's disparity between two views, and what follows from it."""

    pair: ViewPair
    depth_mm: float  # Z, distance of the object from the entrance pupil
    # disparity that the ray model predicts, and that was measured
    predicted_px: float
    found_px: float
    baseline_mm: float  # baseline from depth and measured disparity (Eq. 5.24)
    tilt_degrees: float  # tilt from depth and measured disparity (Eq. 5.25), sign as in the thesis


@dataclass(frozen=True)
class DisparityExperiment:
    """Objects at known depths, measured in several pairs of views."""

    central_view: Floats
    maps: dict[ViewPair, Floats]  # disparity between the views in pixels, for the first view
    objects: list[Measured]


def disparity_experiment(
    model: RayModel,
    depths_mm: Sequence[float],
    pairs: Sequence[ViewPair] = SMALL_PAIRS,
    *,
    object_lenses: int = OBJECT_LENSES,
    seed: int = 0,
) -> DisparityExperiment:
    """Measure baselines and tilts from objects at known depths (Tables 5.11, 5.12)."""
    m = model.micro_image_size
    # Windows wider than the margin reach over an object's border.
    margin = max(0.0, max(pair.window for pair in pairs) / 2 - 2 * _MARGIN)
    scene = take(
        model,
        [z + model.entrance_pupil_mm for z in depths_mm],
        seed=seed,
        object_lenses=object_lenses,
        margin=margin,
    )
    images = views(scene.raster, m)
    centre = (m - 1) // 2
    # Virtual pixel pitch over virtual image distance (Eqs. 3.56, 3.57).
    step = model.camera.micro_lenses.pitch_mm
    unit = abs(float(model.object_ray(0, step)[0] - model.object_ray(0, 0.0)[0]))
    maps: dict[ViewPair, Floats] = {}
    objects = []
    for pair in pairs:
        gap = pair.gap
        first, second = (images[centre, centre + pair.first + side] for side in (0, gap))
        disparity = sad_disparity(
            first,
            [(second, (0.0, float(gap)))],
            search=(-1 / gap, pair.largest_px / gap),
            window=pair.window,
        )
        maps[pair] = gap * disparity
        convergence = -np.tan(np.radians(float(model.tilt(gap, pair.first))))
        baseline = float(model.baseline(gap))
        for depth, region in zip(depths_mm, scene.regions, strict=True):
            # If the first view is not the central one, the object is shifted in it.
            aside = -round(float(model.disparity(depth, 1)) * pair.first)
            part = region[0], slice(region[1].start + aside, region[1].stop + aside)
            pixels = float(np.median(maps[pair][part]))
            objects.append(
                Measured(
                    pair=pair,
                    depth_mm=depth,
                    predicted_px=float(model.disparity(depth, gap, view=pair.first)),
                    found_px=pixels,
                    baseline_mm=depth * (pixels * unit + convergence),
                    tilt_degrees=float(np.degrees(np.arctan(baseline / depth - pixels * unit))),
                )
            )
    return DisparityExperiment(images[centre, centre].astype(np.float64), maps, objects)


@dataclass(frozen=True)
class Ranged:
    """An object at some distance, and its distance by two methods."""

    distance_mm: float  # its distance from the micro lenses
    # by the depth map, and by the sharpest slice
    by_disparity_mm: float
    by_focus_mm: float


def random_distances(
    model: RayModel, count: int, seed: int, a: tuple[float, float] = (0.2, 1.3)
) -> list[float]:
    """Distances drawn evenly in focus settings."""
    drawn = np.random.default_rng(seed).uniform(*a, count)
    return [float(d) for d in model.distance(drawn).mm]


def range_experiment(
    model: RayModel,
    distances_mm: Sequence[float],
    *,
    seed: int = 0,
) -> list[Ranged]:
    """Measure the distance of objects that stand anywhere, not on slices."""
    results = []
    groups = [list(distances_mm[k : k + 4]) for k in range(0, len(distances_mm), 4)]
    for count, group in enumerate(groups, 1):
        scene = take(model, group, seed=seed + count)
        depth = depth_map(scene.raster, model)
        focused = focus_experiment(model, group, seed=seed + count)
        for distance, region, focus in zip(group, scene.regions, focused, strict=True):
            distances = depth.distance_mm[region]
            distances = distances[~np.isnan(distances)]
            by_disparity = float(np.median(distances)) if distances.size else float("nan")
            results.append(Ranged(distance, by_disparity, focus.found_mm))
    return results
