# SPDX-License-Identifier: Apache-2.0
"""The figures of a camera, computed by the ray model."""

from dataclasses import asdict, dataclass
from fractions import Fraction
from math import atan, ceil, degrees, hypot, inf, isfinite

import numpy as np

from plenofir.camera.rays import (
    RayModel,
    State,
    covering_depth,
    covering_slices,
    diffraction_note,
    pupil_blur_px,
    rayleigh_limit,
    setting_of_virtual_depth,
    sharpest_type,
    usable_ranges,
    virtual_depth,
)
from plenofir.ground.errors import InputError

# Micro images may miss each other by so much, or overlap, and are called matched.
_MATCHED = 0.05
_FEWEST_PIXELS = 3
# Where the range begins if it is not given.
_NEAR = 2.0
# A step in a that counts as none.
_NOT_RESOLVED = Fraction(4)


@dataclass(frozen=True)
class Figure:
    """One derived figure."""

    name: str  # as in JSON
    value: float | int | None  # None where the camera's data do not tell it, or it is infinite
    unit: str
    text: str  # what it is


@dataclass(frozen=True)
class FocusedFigures:
    """What a plane has in a focused camera beside what it has in any."""

    virtual_depth: float
    box: float  # B, samples that its slice averages
    lens_type: int  # the sharpest, counted from 1
    blur_px: float  # of that type on the sensor
    resolution_mm: float  # width on the object of the widest of pixel, blur and box


@dataclass(frozen=True)
class PlaneFigures:
    """A refocused plane and what the camera makes of it; lengths in mm.

    inf stands for what reaches infinity, None for what there is not.
    """

    a: Fraction
    distance_mm: float
    near_mm: float
    far_mm: float
    depth_of_field_mm: float
    # of the object, a micro lens and a pixel of a view's finest interpolation (1/M of it) wide
    lens_sample_mm: float
    pixel_sample_mm: float
    disparity_px: float  # between the outermost views that are not vignetted
    depth_error_mm: float  # what an error of that disparity makes of the distance
    focused: FocusedFigures | None = None

    def row(self) -> dict[str, object]:
        """Values for JSON and CSV: a as text, infinite values as None."""
        values = asdict(self)
        values |= values.pop("focused") or {}
        finite = {
            name: None if isinstance(value, float) and not isfinite(value) else value
            for name, value in values.items()
        }
        return {**finite, "a": str(self.a)}


@dataclass(frozen=True)
class Design:
    """Figures of a camera, its planes in a range, and what to look at."""

    model: RayModel
    near_mm: float
    far_mm: float
    disparity_error_px: float
    gap: int  # G, views between the outermost ones that are not vignetted
    figures: tuple[Figure, ...]
    planes: tuple[PlaneFigures, ...]  # the slices that cover the range, from near to far
    gaps_mm: tuple[tuple[float, float], ...]  # what no slice covers
    warnings: tuple[str, ...]

    def content(self) -> dict[str, object]:
        """All of it for JSON."""
        return {
            "camera": _without_infinity(self.model.camera.model_dump(exclude_none=True)),
            "micro_image_px": self.model.micro_image_size,
            "disparity_error_px": self.disparity_error_px,
            "gap": self.gap,
            "figures": {figure.name: figure.value for figure in self.figures},
            "planes": [plane.row() for plane in self.planes],
            "gaps_mm": [[near, None if far == inf else far] for near, far in self.gaps_mm],
            "warnings": list(self.warnings),
        }


def _without_infinity(content: object) -> object:
    """What JSON can hold: None for an exit pupil at infinity."""
    if isinstance(content, dict):
        return {name: _without_infinity(value) for name, value in content.items()}
    return None if content == inf else content


def lens_sample(model: RayModel, distance_mm: float) -> float:
    """How far apart neighbouring micro lenses see on an object: rays of the central view.

    `distance_mm`: of the object from the micro lenses.
    """
    pitch = model.camera.micro_lenses.pitch_mm
    front = model.image_distance_mm + model.camera.main_lens.principal_plane_separation_mm
    (slope, height), (first_slope, first_height) = (
        tuple(map(float, model.object_ray(0, s))) for s in (pitch, 0.0)
    )
    return abs((slope - first_slope) * (distance_mm - front) + height - first_height)


def resolution_mm(model: RayModel, a: float) -> float:
    """Width of what a slice of a focused camera resolves on an object: pixel, blur and box.

    Under the sharpest type of micro lens. `a`: focus setting of a plane in front of the lens.
    """
    blur = float(sharpest_type(model, a).blur_px)
    widths = abs(a) * max(1.0, blur), float(model.box_at(a)) / model.micro_image_size
    return max(widths) * lens_sample(model, float(model.distance(a).mm))


def depth_error(model: RayModel, distance_mm: float, gap: int, error_px: float) -> float:
    """By how much a distance is off if a disparity is: half of what both signs make together.

    inf where the farther one is not in front of infinity.
    """
    depth = distance_mm - model.entrance_pupil_mm
    disparity = float(model.disparity(depth, gap))
    ends = [model.depth(disparity + sign * error_px, gap) for sign in (-1, 1)]
    if any(end.state() is not State.REAL for end in ends):
        return inf
    return abs(float(ends[0].mm) - float(ends[1].mm)) / 2


def _plane(model: RayModel, a: Fraction, gap: int, error_px: float) -> PlaneFigures | None:
    """The figures of a plane; None if it lies not in front of the lens."""
    planes = model.planes(float(a))
    if planes.centre.state() is not State.REAL or planes.near.state() is not State.REAL:
        return None
    distance, near = float(planes.centre.mm), float(planes.near.mm)
    far = float(planes.far.mm) if planes.far.state() is State.REAL else inf
    sample = lens_sample(model, distance)
    focused = None
    if not model.camera.micro_lenses.standard:
        best = sharpest_type(model, float(a))
        focused = FocusedFigures(
            virtual_depth=float(virtual_depth(model, float(a))),
            box=float(model.box_at(float(a))),
            lens_type=int(best.lens_type) + 1,
            blur_px=float(best.blur_px),
            resolution_mm=resolution_mm(model, float(a)),
        )
    return PlaneFigures(
        a=a,
        distance_mm=distance,
        near_mm=near,
        far_mm=far,
        depth_of_field_mm=far - near,
        lens_sample_mm=sample,
        pixel_sample_mm=sample / model.micro_image_size,
        disparity_px=float(model.disparity(distance - model.entrance_pupil_mm, gap)),
        depth_error_mm=depth_error(model, distance, gap, error_px),
        focused=focused,
    )


def _views(model: RayModel) -> int:
    """G of the outermost views that lie in the entrance pupil."""
    most, bound = model.micro_image_size - 1, model.outermost_view
    return most if bound is None else max(1, min(most, 2 * bound))


def _field_of_view(model: RayModel, pixels: float | None) -> float | None:
    """Angle in degrees that so many pixels see in front of the lens; None if unknown."""
    if pixels is None:
        return None
    array, pitch = model.camera.micro_lenses, model.camera.sensor.pixel_pitch_mm
    # Micro images are farther apart than micro lenses.
    outermost = pixels * pitch / 2 / (1 + array.spacing_mm / model.exit_pupil_mm)
    return 2 * degrees(atan(abs(float(model.object_ray(0, outermost)[0]))))


def resolved_step(model: RayModel, a: float) -> Fraction:
    """Smallest step in a, in 1/M, between planes whose depths of field do not overlap."""
    near = model.near_border(a)
    if near.state() is not State.REAL:
        return _NOT_RESOLVED
    # The plane whose far border is that near border.
    touching = float(model.focus_setting(float(near.mm), "far"))
    if not a < touching < a + _NOT_RESOLVED:
        return _NOT_RESOLVED
    return Fraction(ceil((touching - a) * model.micro_image_size), model.micro_image_size)


def _optics(model: RayModel) -> list[Figure]:
    """Micro images and f-numbers."""
    camera, array = model.camera, model.camera.micro_lenses
    pixel, diameter = camera.sensor.pixel_pitch_mm, camera.main_lens.entrance_pupil_diameter_mm
    stretch = 1 + array.spacing_mm / model.exit_pupil_mm
    pitch = array.pitch_mm * stretch
    # The rim of the pupil is blurred where micro lenses are not focused on it.
    rim = 0.0 if array.standard else float(pupil_blur_px(model).max())
    # Entrance pupil whose micro images touch: views M apart, M not rounded.
    view = float(model.baseline(1))
    touching = max(0.0, view * pitch / pixel - view * rim)
    fill = None
    if diameter is not None:
        fill = (diameter + view * rim) / (view * pitch / pixel)
    number = "f-number of the micro lenses, f_s / p_M"
    if not array.standard:
        number = "working f-number of the micro lenses, b_s / p_M"
    f = camera.main_lens.focal_length_mm
    return [
        Figure(
            "pixels_per_lens", array.pitch_mm / pixel, "px", "pixels under a micro lens, p_M / p_p"
        ),
        Figure("micro_image_pitch_px", pitch / pixel, "px", "micro images from centre to centre"),
        Figure("M", model.micro_image_size, "px", "M, size of the micro images that are used"),
        Figure(
            "micro_lens_f_number",
            array.spacing_mm / array.pitch_mm,
            "",
            number,
        ),
        Figure(
            "matched_f_number",
            f / touching if touching else None,
            "",
            "f-number of the main lens that makes them touch",
        ),
        Figure("matched_pupil_mm", touching, "mm", "diameter of the entrance pupil for that"),
        Figure(
            "f_number",
            None if diameter is None else f / diameter,
            "",
            "f-number of the main lens as it is",
        ),
        Figure(
            "micro_image_fill",
            fill,
            "",
            "micro images: diameter over distance",
        ),
        Figure(
            "rayleigh_limit_um",
            _finite(1000 * rayleigh_limit(camera)),
            "um",
            "Rayleigh limit of a micro lens, 550 nm",
        ),
        Figure("pixel_um", 1000 * pixel, "um", "pixel pitch"),
    ]


def _lens_types(model: RayModel) -> list[Figure]:
    """Where each type of micro lens is sharp, and from where on each covers a picture."""
    array = model.camera.micro_lenses
    if array.standard:
        return []
    figures = [
        Figure("sensor_distance_mm", array.spacing_mm, "mm", "micro lenses to sensor, b_s"),
    ]
    covering = covering_depth(array)
    if covering is not None:
        # The plane of the same |v| on the side where the micro lenses are focused.
        sign = 1 if "Galilean" in array.kinds else -1
        a = float(setting_of_virtual_depth(model, sign * covering))
        figures += [
            Figure("covering_depth", sign * covering, "", "v of the total covering plane"),
            Figure(
                "covering_mm", _finite(float(model.distance(a).mm)), "mm", "distance of that plane"
            ),
        ]
    for number, (part, kind) in enumerate(zip(usable_ranges(model), array.kinds, strict=True), 1):
        name, text = f"type_{number}", f"lens type {number} ({kind}, f_s {part.focal_length_mm:g})"
        figures += [
            Figure(f"{name}_focus", _finite(part.focus), "", f"{text}: sharpest at v"),
            Figure(f"{name}_first", _finite(part.depths[0]), "", f"{text}: sharp from v"),
            Figure(f"{name}_last", _finite(part.depths[1]), "", f"{text}: sharp to v"),
            Figure(f"{name}_far_mm", _finite(part.far_mm), "mm", f"{text}: sharp from"),
            Figure(f"{name}_near_mm", _finite(part.near_mm), "mm", f"{text}: sharp to"),
        ]
    return figures


def _picture(model: RayModel) -> list[Figure]:
    """Sizes of pictures and fields of view."""
    sensor, array = model.camera.sensor, model.camera.micro_lenses
    pitch = array.pitch_mm * (1 + array.spacing_mm / model.exit_pupil_mm)
    sizes = {"columns": sensor.columns, "rows": sensor.rows}
    views = {
        name: None if n is None else int(n * sensor.pixel_pitch_mm / pitch)
        for name, n in sizes.items()
    }
    m = model.micro_image_size
    diagonal = None
    if sensor.columns is not None and sensor.rows is not None:
        diagonal = hypot(sensor.columns, sensor.rows)
    found = [Figure("views", m * m, "", "views, M x M")]
    for name, size in views.items():
        found.append(Figure(f"view_{name}", size, "px", f"{name} of a view: micro lenses"))
    for name, size in views.items():
        raster = None if size is None else size * m
        found.append(Figure(f"raster_{name}", raster, "px", f"{name} of the aligned raw image"))
    for name, text, pixels in (
        ("field_of_view_x_deg", "horizontal", sensor.columns),
        ("field_of_view_y_deg", "vertical", sensor.rows),
        ("field_of_view_deg", "diagonal", diagonal),
    ):
        angle = _field_of_view(model, pixels)
        found.append(Figure(name, angle, "deg", f"{text} field of view"))
    return found


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def _directions(model: RayModel, gap: int, near_mm: float, far_mm: float) -> list[Figure]:
    """Focus, virtual cameras, and focus settings of the range."""
    near, far = (float(model.focus_setting(d)) + 0.0 for d in (near_mm, far_mm))
    middle = (near + far) / 2
    step = float(resolved_step(model, middle))
    # Nothing is resolved where no type of micro lens is sharp.
    steps = [Figure("resolved_step", step, "", "step in a between separate depths of field")]
    if model.near_border(middle).state() is State.BLURRED:
        steps = []
    pupil, tilt = _finite(model.exit_pupil_mm), float(model.tilt(gap)) + 0.0
    ends = "outermost views in the pupil"
    return [
        Figure("extension_mm", model.extension_mm, "mm", "main lens from infinity focus"),
        Figure("exit_pupil_mm", pupil, "mm", "micro lenses to exit pupil"),
        Figure(
            "entrance_pupil_mm", model.entrance_pupil_mm, "mm", "micro lenses to virtual cameras"
        ),
        Figure("baseline_1_mm", float(model.baseline(1)), "mm", "baseline, neighbouring views"),
        Figure("gap", gap, "", f"G, {ends}"),
        Figure("baseline_mm", float(model.baseline(gap)), "mm", f"baseline, {ends}"),
        Figure("tilt_deg", tilt, "deg", f"tilt, {ends}"),
        Figure("a_near", near, "", "a of the near end of the range"),
        Figure("a_far", far, "", "a of the far end of the range"),
        *steps,
    ]


def _warnings(model: RayModel, figures: dict[str, Figure], gaps: bool, covered: bool) -> list[str]:
    """What the figures say against the camera."""
    camera = model.camera
    found = [
        camera.thin_lens_note(),
        model.micro_image_note(),
        diffraction_note(camera),
        model.vignetting_note((model.micro_image_size - 1) // 2),
    ]
    fill = figures["micro_image_fill"].value
    wanted = figures["matched_f_number"].value
    if fill is not None and wanted is None:
        found.append("the blurred rims of micro images are wider than the micro images themselves")
    elif fill is not None and fill > 1 + _MATCHED:
        found.append(
            f"micro images overlap by {100 * (fill - 1):.0f} %: stop the main lens down to "
            f"f/{wanted:.2g}"
        )
    elif fill is not None and fill < 1 - _MATCHED:
        found.append(
            f"micro images fill {100 * fill:.0f} % of their distance, what is between them stays "
            f"dark: open the main lens to f/{wanted:.2g}, or take micro lenses of a longer focal "
            "length"
        )
    if camera.pixels_per_lens < _FEWEST_PIXELS:
        found.append(
            f"{camera.pixels_per_lens:.3g} pixels under a micro lens are too few directions to "
            "refocus"
        )
    if gaps:
        why = "" if camera.micro_lenses.standard else ", or no lens type is sharp"
        found.append(
            f"parts of the range are sharp in no slice; steps of 1/M are too coarse there{why}"
        )
    if not covered:
        found.append("no slice is sharp in the range")
    return [text for text in found if text]


def _nearest_sharp(model: RayModel) -> float:
    """Distance of the nearest plane that a type of micro lens sees sharply."""
    ends = [part.near_mm for part in usable_ranges(model)]
    front = model.image_distance_mm + model.camera.main_lens.principal_plane_separation_mm
    near = np.array([mm for mm in ends if mm > front])
    if not near.size:
        raise InputError("no lens type ends in front of the lens; give a distance", where="near")
    return float(near.min())


def design(
    model: RayModel,
    near_mm: float | None = None,
    far_mm: float = inf,
    *,
    disparity_error_px: float = 0.1,
) -> Design:
    """Compute every figure of a camera at once.

    `model`: the camera, focused. `near_mm`, `far_mm`: the range of distances that matters, from the
    micro lenses; near is that of the plane a = 2 if None, far may be inf. `disparity_error_px`: how
    well a disparity between the outermost views can be measured, in pixels of the views. Raises
    `InputError` if the range is empty or that error not positive.

    Without near the range of a focused camera begins where its types of micro lenses do.
    """
    if not 0 < disparity_error_px < inf:
        raise InputError(
            f"{disparity_error_px:g}; give a positive number of pixels", where="disparity_error"
        )
    if near_mm is None and not model.camera.micro_lenses.standard:
        near_mm = _nearest_sharp(model)
    if near_mm is None:
        plane = model.distance(_NEAR)
        if plane.state() is not State.REAL:
            raise InputError(
                f"no plane a = {_NEAR:g} lies in front of the lens; give a distance", where="near"
            )
        near_mm = float(plane.mm)
    gap = _views(model)
    cover = covering_slices(model, near_mm, far_mm)
    listed = [
        *_optics(model),
        *_lens_types(model),
        *_picture(model),
        *_directions(model, gap, near_mm, far_mm),
        Figure("slices", len(cover.slices), "", "slices that cover the range"),
    ]
    rows = (_plane(model, part.a, gap, disparity_error_px) for part in reversed(cover.slices))
    planes = tuple(row for row in rows if row is not None)
    warnings = _warnings(model, {f.name: f for f in listed}, bool(cover.gaps), bool(cover.slices))
    return Design(
        model,
        near_mm,
        far_mm,
        disparity_error_px,
        gap,
        tuple(listed),
        planes,
        cover.gaps,
        tuple(warnings),
    )
