# SPDX-License-Identifier: Apache-2.0
"""Measurements on pictures by real rays (`lens_camera`), beside the ray model's closed forms.

Textured planes stand at known distances. Their pictures are calibrated, decoded and refocused as
any captures are; views are registered with the texture, whose size and position are known. So

- the distance of the sharpest slice by the closed form is compared with the plane's distance;
- the position of the texture in a view, over several distances, is a line: the view's axis. These
  axes meet in the entrance pupil, which gives baselines and tilts;
- disparities between views give distances by triangulation.

Each camera takes its pictures twice: by real rays, and with surfaces that refract in proportion
(`paraxial`). The latter have only errors of the measurement; the difference is due to aberrations.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from decimal import Decimal
from fractions import Fraction
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage, optimize

from plenofir.camera.calibration import Calibration, calibrate, decode, raster_window
from plenofir.camera.lightfield import focal_stack, peak, sharpness_curve, views
from plenofir.camera.rays import RayModel
from plenofir.camera.rays.camera import MicroLensArray
from plenofir.refocus.operator import Image
from plenofir_studies import DATA
from plenofir_studies.experiments import textures
from plenofir_studies.lens_camera import (
    PITCH_MM,
    Floats,
    Light,
    Texture,
    capture,
    lens_camera,
)
from plenofir_studies.real_rays import real_camera
from plenofir_studies.records import records_text
from plenofir_studies.report_parts import Progress, Report, table

FILE = DATA / "lens_pictures.json"
M = 9
"""Middle pixels of the micro images, which are 14 pixels apart, that are decoded."""
FILL = 0.95
"""Diameter of the micro images as a share of their pitch."""
LENSES = 36, 48
GAP = 6
_VIEWS = range(-3, 4)
# Pixels of the texture for what neighbouring lenses see.
_FINE = 4
# Standard deviation of the texture's blur, in distances of neighbouring lenses: for sharpness, and
# for registration, where views are sampled too coarsely for a finer texture.
_DETAIL, _SOFT = 0.6, 2.0
_MARGIN = 9


@dataclass(frozen=True)
class Case:
    """A camera, and distances of textures in front of it."""

    lens: str
    mla: str
    focus_mm: float
    distances_mm: tuple[float, ...]

    @property
    def name(self) -> str:
        """Lens, micro lenses, focus."""
        focus = "inf" if self.focus_mm == inf else f"{self.focus_mm:g} mm"
        return f"{self.lens}, MLA ({self.mla}), focus {focus}"


CASES = (
    Case("f100", "II", inf, (450.0, 600.0, 900.0, 1800.0)),
    Case("f100", "II", 1500.0, (400.0, 500.0, 700.0, 1000.0)),
    Case("f100", "I", inf, (600.0, 900.0, 1500.0, 3000.0)),
    Case("brendel", "I", inf, (600.0, 900.0, 1500.0, 3000.0)),
    Case("metrogon", "I", inf, (600.0, 900.0, 1500.0, 3000.0)),
)
"""Cameras: f/22 (micro lenses II) and f/10 (I), by the micro images that the stop leaves room."""


@dataclass(frozen=True)
class Geometry:
    """Results of one kind of rays, or of the closed form."""

    # For each distance: by the sharpest slice, and by triangulation, from the micro lenses.
    by_focus_mm: tuple[float, ...]
    by_disparity_mm: tuple[float, ...]
    disparities_px: tuple[float, ...]
    pupil_mm: float  # entrance pupil, from the micro lenses
    baseline_mm: float
    tilt_degrees: float


@dataclass(frozen=True)
class Result:
    """A case, measured."""

    case: Case
    closed: Geometry
    paraxial: Geometry
    real: Geometry


def model_of(case: Case) -> RayModel:
    """The closed forms' camera: paraxial data of the prescription, and the micro lenses' data."""
    focal = lens_camera(case.lens, case.mla).micro_focal_length
    camera = real_camera(case.lens).camera.model_copy(
        update={"micro_lenses": MicroLensArray(focal_length_mm=focal, pitch_mm=PITCH_MM)}
    )
    if case.focus_mm == inf:
        return RayModel(camera, Decimal(0), M)
    return RayModel.focused(camera, case.focus_mm, M)


def closed_form(case: Case) -> Geometry:
    model = model_of(case)
    depths = np.array(case.distances_mm) - model.entrance_pupil_mm
    pixels = model.disparity(depths, GAP, view=_VIEWS[0])
    return Geometry(
        by_focus_mm=case.distances_mm,
        by_disparity_mm=case.distances_mm,
        disparities_px=tuple(float(v) for v in pixels),
        pupil_mm=model.entrance_pupil_mm,
        baseline_mm=float(model.baseline(GAP)),
        tilt_degrees=float(model.tilt(GAP, _VIEWS[0])),
    )


@dataclass(frozen=True)
class _Capture:
    """A picture of a plane, decoded."""

    raster: Image
    centre: Floats  # (y, x) of the axis in the raster, in micro lenses
    texture: Texture
    distance: float


def _take(
    light: Light, calibration: Calibration, spacing: float, distance: float, blur: float
) -> _Capture:
    soft = ndimage.gaussian_filter(textures()[0] / 255, blur * _FINE)
    texture = Texture((soft - soft.min()) / np.ptp(soft), spacing / _FINE)
    raster = decode(light.picture(texture, distance), calibration, M)
    rows, columns = raster_window(calibration)
    middle = (np.array(light.shape) - 1) / 2
    centre = calibration.grid.inverse(middle) - (rows.start, columns.start)
    return _Capture(raster, np.asarray(centre, dtype=np.float64), texture, distance)


def _focus(capture: _Capture, model: RayModel) -> float:
    """Distance of the sharpest setting, by the closed form."""
    predicted = float(model.focus_setting(capture.distance))
    shifts = np.arange(round(predicted * M) - 4, round(predicted * M) + 5)
    stack = focal_stack(capture.raster, M, [Fraction(int(k), M) for k in shifts])
    inside = tuple(slice(_MARGIN * M, n - _MARGIN * M) for n in capture.raster.shape)
    sharpest = peak(shifts / M, sharpness_curve(stack, (inside[0], inside[1]), M))
    return float(model.distance(sharpest).mm)


def _register(view: Floats, capture: _Capture, spacing: float) -> Floats:
    """Pitch of a view's pixels on the texture in mm, and (x, y) of the texture on the axis."""
    sides = (np.arange(n) - c for n, c in zip(view.shape, capture.centre, strict=True))
    y, x = np.meshgrid(*sides, indexing="ij")
    soft = Texture(ndimage.uniform_filter(capture.texture.pixels, _FINE), capture.texture.step)

    def residual(guess: Floats) -> Floats:
        scale, *offset = guess
        model = soft.at(np.stack([scale * x + offset[0], scale * y + offset[1]]))
        basis = np.stack([model.ravel(), np.ones(model.size)], axis=1)
        weights = np.linalg.lstsq(basis, view.ravel(), rcond=None)[0]
        return np.asarray(basis @ weights - view.ravel())

    # The lens inverts the picture.
    tries = [np.array([-spacing, dx * spacing, 0.0]) for dx in range(-6, 7)]
    best = min(tries, key=lambda guess: float((residual(guess) ** 2).sum()))
    fit = optimize.least_squares(residual, best, x_scale=[spacing / 50, spacing, spacing])
    return np.asarray(fit.x)


def _axes(registered: Floats, distances: Sequence[float]) -> tuple[float, float, float]:
    """Entrance pupil, baseline and tilt from scale and place of the texture in views.

    `registered`: shape (distances, views, 3), from `_register`. Positions and scales are linear in
    the distance.
    """
    lines = np.polynomial.polynomial.polyfit(
        np.asarray(distances), registered[..., :2].reshape(len(distances), -1), 1
    ).reshape(2, registered.shape[1], 2)
    # The distance at which the scale is 0 is that of the camera.
    pupil = float(-(lines[0, :, 0].mean() / lines[1, :, 0].mean()))
    first, last = (lines[0, k, 1] + lines[1, k, 1] * pupil for k in (0, -1))
    slopes = lines[1, [0, -1], 1]
    return pupil, float(first - last), float(np.degrees(np.subtract(*np.arctan(slopes))))


def measure(
    case: Case, *, paraxial: bool, lenses: tuple[int, int] = LENSES, rays: int = 8
) -> Geometry:
    """Take a case's pictures and measure them."""
    model = model_of(case)
    camera = lens_camera(case.lens, case.mla, focus_mm=case.focus_mm, paraxial=paraxial)
    camera = camera.stopped(FILL)
    light = capture(camera, lenses, rays=rays)
    calibration = calibrate(light.white)
    by_focus, fits = [], []
    for distance in case.distances_mm:
        spacing = camera.object_spacing(distance)
        detailed, soft = (
            _take(light, calibration, spacing, distance, blur) for blur in (_DETAIL, _SOFT)
        )
        by_focus.append(_focus(detailed, model))
        row = views(soft.raster, M)[M // 2].astype(np.float64)
        fits.append([_register(row[M // 2 + i], soft, spacing) for i in _VIEWS])
    registered = np.array(fits)
    pixels = (registered[:, -1, 1] - registered[:, 0, 1]) / registered[..., 0].mean(axis=1)
    depths = model.depth(pixels, GAP, view=_VIEWS[0]).mm + model.entrance_pupil_mm
    pupil, baseline, tilt = _axes(registered, case.distances_mm)
    return Geometry(
        tuple(by_focus), tuple(map(float, depths)), tuple(map(float, pixels)), pupil, baseline, tilt
    )


def results(cases: Sequence[Case] = CASES, step: Callable[[], None] = lambda: None) -> list[Result]:
    measured = []
    for case in cases:
        pictures = []
        for paraxial in (True, False):
            pictures.append(measure(case, paraxial=paraxial))
            step()
        measured.append(Result(case, closed_form(case), *pictures))
    return measured


@dataclass(frozen=True)
class Deviations:
    """Deviations of pictures from the closed form, and the part of aberrations.

    The largest over several distances, in percent; of the tilt in degrees.
    """

    by_focus: float
    by_disparity: float
    pupil: float
    baseline: float
    tilt: float


def deviations(one: Geometry, other: Geometry) -> Deviations:
    """Deviations of one from the other."""

    def percent(values: Sequence[float], truth: Sequence[float]) -> float:
        shares = 100 * (np.divide(values, truth) - 1)
        return float(shares[np.argmax(np.abs(shares))])

    return Deviations(
        by_focus=percent(one.by_focus_mm, other.by_focus_mm),
        by_disparity=percent(one.by_disparity_mm, other.by_disparity_mm),
        pupil=percent([one.pupil_mm], [other.pupil_mm]),
        baseline=percent([one.baseline_mm], [other.baseline_mm]),
        tilt=one.tilt_degrees - other.tilt_degrees,
    )


def summary(measured: Sequence[Result]) -> list[str]:
    """Lines of a table: deviations by the measurement, and by aberrations."""
    heads = [
        "camera",
        "distance by the sharpest slice",
        "by triangulation",
        "entrance pupil",
        f"baseline, G = {GAP}",
        "tilt",
    ]
    rows = []
    for result in measured:
        both = (
            deviations(result.paraxial, result.closed),
            deviations(result.real, result.paraxial),
        )
        closed = result.closed
        named = {
            "by_focus": "",
            "by_disparity": "",
            "pupil": f"{closed.pupil_mm:.2f} mm: ",
            "baseline": f"{closed.baseline_mm:.4f} mm: ",
        }
        cells = [
            f"{value}{getattr(both[0], name):+.2f} %, {getattr(both[1], name):+.3f} %"
            for name, value in named.items()
        ]
        tilts = f"{closed.tilt_degrees:z.4f}: {both[0].tilt:+z.4f}, {both[1].tilt:+z.4f} degrees"
        rows.append([result.case.name, *cells, tilts])
    return table(heads, rows)[:-1]


def load_recorded() -> list[Result]:
    """What `plenofir report pictures` measured and wrote, copied to `FILE`."""

    def fields(values: dict[str, Any]) -> dict[str, Any]:
        return {name: tuple(v) if isinstance(v, list) else v for name, v in values.items()}

    return [
        Result(
            Case(**{**fields(values["case"]), "focus_mm": values["case"]["focus_mm"] or inf}),
            *(Geometry(**fields(values[kind])) for kind in ("closed", "paraxial", "real")),
        )
        for values in json.loads(FILE.read_text())
    ]


def _record(measured: Sequence[Result]) -> bytes:
    """The results as JSON, infinity as null."""
    content = [asdict(result) for result in measured]
    for values in content:
        if values["case"]["focus_mm"] == inf:
            values["case"]["focus_mm"] = None
    return records_text(content, levels=2).encode()


def write_report(folder: Path, progress: Progress | None = None) -> Path:
    """Write ``report.md`` and what was measured (``lens_pictures.json``), all or none."""
    report = Report(folder, "report.md", 2 * len(CASES), progress)
    measured = results(step=report.step)
    report.say(
        "# Pictures by real rays through a prescription",
        "Each cell: the deviation of pictures by paraxial rays from the closed form, which is the "
        "error of the measurement, and the further deviation by real rays, which is due to "
        "aberrations. It is the largest over several distances.",
    )
    report.add(summary(measured))
    report.say("", "## Each distance")
    rows = []
    for result in measured:
        for k, distance in enumerate(result.case.distances_mm):
            pictures = (result.paraxial, result.real)
            cells = [f"{distance:g}", *(f"{geometry.by_focus_mm[k]:.2f}" for geometry in pictures)]
            cells += [f"{geometry.by_disparity_mm[k]:.2f}" for geometry in pictures]
            cells += [
                f"{geometry.disparities_px[k]:.4f}" for geometry in (result.closed, *pictures)
            ]
            rows.append([result.case.name, *cells])
    of_both = ["paraxial", "real"]
    heads = ["camera", "stands at / mm", *(f"sharpest slice, {kind}" for kind in of_both)]
    heads += [f"triangulated, {kind}" for kind in of_both]
    heads += [f"disparity / pixels, {kind}" for kind in ("closed form", *of_both)]
    report.table(heads, rows)
    report.attach(FILE.name, _record(measured))
    return report.write()
