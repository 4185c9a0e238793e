# SPDX-License-Identifier: Apache-2.0
"""Stiff and extreme cases: the ray model and the thesis's formulas against a high-precision oracle.

The oracle evaluates the definitions to 700 digits (mpmath): two rays, their intersection, the lens
equation. It shares no formula with `RayModel`.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from decimal import localcontext
from math import inf, isinf, isnan
from typing import Any

import numpy as np
from mpmath import mp, mpf

from plenofir.camera.rays import condition_numbers
from plenofir.camera.rays.camera import Camera, MainLens, MicroLensArray, Sensor, load_camera
from plenofir.camera.rays.distances import State
from plenofir.camera.rays.model import Border, RayModel, plane_coefficients
from plenofir.camera.rays.precise import CONTEXT
from plenofir_studies.intersections import (
    image_side_distance,
    iterated_image_distance,
    object_side_distance,
)
from plenofir_studies.micro_lens_glass import MICRO_LENS_SELLMEIER, naive_sellmeier_index
from plenofir_studies.report_parts import table
from plenofir_studies.thick_lens import plano_convex

DIGITS = 700
BORDERS: dict[int, Border] = {0: "centre", 1: "near", -1: "far"}


@dataclass(frozen=True)
class Outcome:
    """One extreme case."""

    group: str  # what makes it hard
    case: str
    want: float | None  # the oracle's number, or None where there is none
    state: str  # the plane's state by the model
    error: float  # relative error of the model; 0 if both have no number
    # relative errors of the thesis's formulas, by name; inf where they give no number
    naive: dict[str, float]
    # condition number with respect to all inputs; None if not computed
    condition: float | None = None


def oracle_extension(f: float, separation: float, focus: float) -> Any:
    """Extension b_U - f_U that focuses a lens (Eq. 5.16), to 700 digits."""
    with mp.workdps(DIGITS):
        if focus == inf:
            return mpf(0)
        # b_U^2 - S b_U + S f_U = 0.
        total = mpf(focus) - mpf(separation)
        return (total - mp.sqrt(total * total - 4 * total * mpf(f))) / 2 - mpf(f)


def oracle_distance(model: RayModel, extension: Any, a: float, border: int) -> Any:
    """Distance of a plane (0) or of its near (1) or far (-1) border, to 700 digits."""
    camera = model.camera
    with mp.workdps(DIGITS):
        f = mpf(camera.main_lens.focal_length_mm)
        separation = mpf(camera.main_lens.principal_plane_separation_mm)
        pupil = mpf(camera.main_lens.exit_pupil_mm) + extension
        focal, pitch = mpf(camera.micro_lenses.focal_length_mm), mpf(camera.micro_lenses.pitch_mm)
        pixel = mpf(camera.sensor.pixel_pitch_mm)
        c = mpf(model.micro_image_size - 1) / 2
        image_distance = f + extension
        rays = []
        for sign in (1, -1):
            lens = sign * mpf(a) * c * pitch
            sample = lens * (1 + focal / pupil) - sign * (c - mpf(border) / 2) * pixel
            slope = (lens - sample) / focal
            start = lens + sign * mpf(border) * pitch / 2
            height = start + slope * image_distance
            rays.append((slope - height / f, height))
        (slope1, height1), (slope2, height2) = rays
        if abs(slope1 - slope2) <= mpf(10) ** (50 - DIGITS):
            return None
        return image_distance + separation + (height2 - height1) / (slope1 - slope2)


def condition_of(function: Callable[..., Any], *inputs: Any) -> float:
    """Relative condition number of a function to `DIGITS` digits: the sum of |x/f df/dx|."""
    with mp.workdps(DIGITS):
        step, exact = mpf(10) ** (-DIGITS // 3), [mpf(x) for x in inputs]
        middle, total = function(*exact), mpf(0)
        for n in range(len(exact)):
            ends = [
                function(*exact[:n], exact[n] * (1 + sign * step), *exact[n + 1 :])
                for sign in (1, -1)
            ]
            total += abs((ends[0] - ends[1]) / (2 * step * middle))
        return float(total)


def _error(got: float, want: Any) -> float:
    if want is None:
        return 0.0 if isnan(got) else inf
    if isnan(got) or got in (inf, -inf):
        return inf
    with mp.workdps(DIGITS):
        return float(abs((mpf(got) - want) / want))


def _plane(
    group: str, case: str, model: RayModel, a: float, *, focus: float | None = None, border: int = 0
) -> Outcome:
    extension = (
        mpf(0)
        if focus is None
        else oracle_extension(
            model.camera.main_lens.focal_length_mm,
            model.camera.main_lens.principal_plane_separation_mm,
            focus,
        )
    )
    want = oracle_distance(model, extension, a, border)
    distances = {1: model.near_border, 0: model.distance, -1: model.far_border}[border](a)
    state, got = distances.state(), float(distances.mm)
    if state in (State.INFINITY, State.BEYOND_INFINITY):
        # nan is correct if the oracle's rays are parallel, or meet behind the front of the lens.
        nothing = want is None if state is State.INFINITY else want is not None
        error = 0.0 if isnan(got) and nothing else inf
    else:
        error = _error(got, want)
    naive = {
        "image side": _error(float(image_side_distance(model, a, border)), want),
        "object side": _error(float(object_side_distance(model, a, border)), want),
        "closed form, 32 bit": _error(_in_single_precision(model, a, border), want),
    }
    condition = condition_numbers(model, a, BORDERS[border])["all"]
    number = None if want is None else float(want)
    return Outcome(group, case, number, state.value, error, naive, condition)


def _in_single_precision(model: RayModel, a: float, border: int) -> float:
    """The closed form with coefficients, setting and sums of 32 bits."""
    with localcontext(CONTEXT):
        both = plane_coefficients(model.lengths, model.micro_image_size, BORDERS[border])
        largest = max(abs(c) for pair in both for c in pair)
    setting = np.float32(a)
    with np.errstate(all="ignore"):
        top, bottom = (
            np.float32(float(pair[0] / largest)) + np.float32(float(pair[1] / largest)) * setting
            for pair in both
        )
        return float(top / bottom)


MICROSCOPE = Camera(
    name="microscope",
    main_lens=MainLens(focal_length_mm=4.0, principal_plane_separation_mm=-1.5, exit_pupil_mm=180),
    micro_lenses=MicroLensArray(focal_length_mm=2.5, pitch_mm=0.1),
    sensor=Sensor(pixel_pitch_mm=0.0065),
)
TELESCOPE = Camera(
    name="telescope",
    main_lens=MainLens(
        focal_length_mm=8000.0, principal_plane_separation_mm=20, exit_pupil_mm=7900
    ),
    micro_lenses=MicroLensArray(focal_length_mm=1.25, pitch_mm=0.125),
    sensor=Sensor(pixel_pitch_mm=0.009),
)


def plane_cases() -> Iterator[Outcome]:
    """Planes: near and beyond infinity, inside the lens, small and large M, odd cameras."""
    camera = load_camera("f193-mla2")
    yield from _planes_of_a_camera(camera)
    yield from _planes_of_odd_cameras(camera)


def _planes_of_a_camera(camera: Camera) -> Iterator[Outcome]:
    """Near and beyond infinity, inside the lens, parallel light, small and large M."""
    at_infinity = RayModel.focused(camera, inf, 13)
    for power in (-1, -3, -6, -9, -12, -100, -300):
        for sign in (1, -1):
            yield _plane(
                "a near 0, b_U = f_U", f"a = {sign}e{power}", at_infinity, sign * 10.0**power
            )
    yield _plane("a near 0, b_U = f_U", "a = 0", at_infinity, 0.0)

    focused = RayModel.focused(camera, 1500.0, 13)
    for border, name in ((0, "plane"), (1, "near border"), (-1, "far border")):
        limit = float(focused.focus_setting(inf, BORDERS[border]))
        for power in (-2, -5, -8, -11, -14):
            for sign in (1, -1):
                a = limit * (1 + sign * 10.0**power)
                case = f"{name}, a = limit (1 {'+' if sign > 0 else '-'} 1e{power})"
                yield _plane("planes near infinity", case, focused, a, focus=1500.0, border=border)
    for a in (-5.0, -2.0, 3.0, 10.0, 100.0, 1e6):
        yield _plane("far from focus, inside the lens", f"a = {a:g}", focused, a, focus=1500.0)
    pole = camera.sensor.pixel_pitch_mm / camera.micro_lenses.focal_length_mm
    pole *= camera.main_lens.exit_pupil_mm / camera.micro_lenses.pitch_mm
    for power in (-3, -7, -11, -15):
        for sign in (1, -1):
            a = pole * (1 + sign * 10.0**power)
            case = f"a = pole (1 {'+' if sign > 0 else '-'} 1e{power})"
            yield _plane("parallel behind the micro lenses", case, at_infinity, a)
    for size in (2, 3, 99, 1601):
        model = RayModel.focused(camera, inf, size)
        for border, name in ((0, "plane"), (1, "near border"), (-1, "far border")):
            for a in (0.0, 1.0, 1.0 / size, -1.0 / size):
                case = f"M = {size}, {name}, a = {a:.3g}"
                yield _plane("small and large M", case, model, a, border=border)


def _planes_of_odd_cameras(camera: Camera) -> Iterator[Outcome]:
    """Pupils far away and behind, extreme focal lengths, a microscope and a telescope."""
    for pupil, name in ((inf, "telecentric"), (1e12, "1e12 mm away"), (-50.0, "behind the sensor")):
        lens = camera.main_lens.model_copy(update={"exit_pupil_mm": pupil})
        model = RayModel.focused(camera.model_copy(update={"main_lens": lens}), 1500.0, 13)
        for a in (-0.5, 1e-9, 1.0, 30.0):
            yield _plane("pupils far away and behind", f"{name}, a = {a:g}", model, a, focus=1500.0)
    for f in (1e-6, 1e12):
        lens = camera.main_lens.model_copy(update={"focal_length_mm": f, "exit_pupil_mm": f})
        model = RayModel.focused(camera.model_copy(update={"main_lens": lens}), inf, 13)
        for a in (-1.0, 1e-6, 1.0, 1e6):
            yield _plane("f_U of 1e-6 and 1e12 mm", f"f_U = {f:g}, a = {a:g}", model, a)
    for odd, focuses in ((MICROSCOPE, (inf, 25.0, 14.6)), (TELESCOPE, (inf, 1e9, 1e6, 32100.0))):
        for focus in focuses:
            model = RayModel.focused(odd, focus, 11)
            for a in (-1.0, -1e-6, 1e-6, 1.0):
                case = f"{odd.name}, d_f = {focus:g}, a = {a:g}"
                yield _plane("microscope and telescope", case, model, a, focus=focus)


def focus_cases() -> Iterator[Outcome]:
    """Focus distances: very far, and near 1:1 imaging."""
    camera = load_camera("f193-mla2")
    lens = camera.main_lens
    f, separation = lens.focal_length_mm, lens.principal_plane_separation_mm
    nearest = 4 * f + separation
    cases = [("far focus", d) for d in (1e4, 1e5, 1e6, 1e7, 1e8, 1e9)]
    cases += [("1:1 imaging", nearest * (1 + 10.0**power)) for power in (-1, -4, -8, -12)]
    for group, focus in cases:
        want = oracle_extension(f, separation, focus)
        got = RayModel.focused(camera, focus, 13).extension_mm
        total = focus - separation
        quadratic = (total - (total * total - 4 * total * f) ** 0.5) / 2 - f
        # Near 1:1 the iteration hardly converges; it is stopped after a thousand steps.
        iterated, _ = iterated_image_distance(f, separation, focus, limit=1000)
        naive = {
            "quadratic formula": _error(quadratic, want),
            "iteration": _error(iterated - f, want),
        }
        case = f"d_f = {focus:.15g} mm"
        condition = condition_of(oracle_extension, f, separation, focus)
        yield Outcome(group, case, float(want), "real", _error(got, want), naive, condition)


def view_cases() -> Iterator[Outcome]:
    """Virtual cameras: small and large tilts, depths near and beyond the zero-disparity plane."""
    camera = load_camera("f193-mla2")
    lens, array = camera.main_lens, camera.micro_lenses
    for focus in (1e9, 1e6, 3000.0, 800.0):
        model = RayModel.focused(camera, focus, 13)
        extension = oracle_extension(
            lens.focal_length_mm, lens.principal_plane_separation_mm, focus
        )
        with mp.workdps(DIGITS):
            f, pupil = mpf(lens.focal_length_mm), mpf(lens.exit_pupil_mm)
            slope = mpf(camera.sensor.pixel_pitch_mm) / mpf(array.focal_length_mm)
            first, second = 2 * slope * extension / f, 8 * slope * extension / f
            tilt = mp.degrees(mp.atan(first) - mp.atan(second))
            base = 6 * slope * f * (pupil + extension) / pupil
            unit = mpf(array.pitch_mm) * pupil / ((pupil + extension) * f)
            depth = base / (mpf(2) * unit + mp.tan(mp.atan(second) - mp.atan(first)))
        got = float(model.tilt(6, view=2))
        yield Outcome(
            "virtual cameras",
            f"tilt, d_f = {focus:g}",
            float(tilt),
            "real",
            _error(got, tilt),
            {},
        )
        point = model.depth(2.0, 6, view=2)
        yield Outcome(
            "virtual cameras",
            f"depth at 2 px, d_f = {focus:g}",
            float(depth),
            point.state().value,
            _error(float(point.mm), depth),
            {},
        )


def optics_cases() -> Iterator[Outcome]:
    """Glass with cancelling terms (Eq. 5.7), and micro lenses with a plane side."""
    glass = MICRO_LENS_SELLMEIER
    terms = len(glass.strengths)
    # The coefficients as printed.
    printed = [repr(x) for x in (*glass.strengths, *glass.resonances_um2)]

    def refracting(of: Any, *numbers: Any) -> Any:
        pairs = zip(numbers[:terms], numbers[terms:], strict=True)
        return mp.sqrt(1 + sum(b * of / (of - c) for b, c in pairs))

    for wavelength in (300.0, 400.0, 486.1, 550.0, 656.3, 1000.0, 2500.0):
        with mp.workdps(DIGITS):
            square = (mpf(wavelength) / 1000) ** 2
            want = refracting(square, *map(mpf, printed))
        naive = float(naive_sellmeier_index(glass, wavelength))
        yield Outcome(
            "cancelling Sellmeier terms",
            f"{wavelength:g} nm",
            float(want),
            "real",
            _error(float(glass.index(wavelength)), want),
            {"term by term": _error(naive, want)},
            condition_of(refracting, square, *printed),
        )
    for focal, thickness in ((1.25, 1.1), (2.75, 1.1), (0.025, 0.01), (1e6, 1.1)):
        lens = plano_convex(focal, thickness, 1.5626)
        with mp.workdps(DIGITS):
            index = mpf(1.5626)
            separation = mpf(thickness) * (1 - 1 / index)
        for name, got, want in (
            ("focal length", lens.focal_length_mm, mpf(focal)),
            ("principal planes", lens.principal_plane_separation_mm, separation),
        ):
            case = f"{name}, f_s = {focal:g} mm"
            yield Outcome("plane surfaces", case, float(want), "real", _error(got, want), {})


CASES: tuple[Callable[[], Iterator[Outcome]], ...] = (
    plane_cases,
    focus_cases,
    view_cases,
    optics_cases,
)


def magnitude(error: float) -> str:
    if isinf(error):
        return "no number"
    return "< 1e-15" if error < 1e-15 else f"{error:.1e}"


def summary(outcomes: Sequence[Outcome]) -> list[str]:
    """Markdown table: worst case of each group, by formula, beside the effect of rounded inputs."""
    ways = list(dict.fromkeys(way for outcome in outcomes for way in outcome.naive))
    rows = []
    for group in dict.fromkeys(o.group for o in outcomes if o.naive):
        members = [o for o in outcomes if o.group == group]
        conditions = [o.condition for o in members if o.condition is not None]
        finite = [c for c in conditions if not isinf(c)]
        row = [group, str(len(members)), f"{max(finite):.1e}" if finite else ""]
        cost = max(finite, default=0.0) * 2.0**-53
        row.append("" if not finite else "all digits" if cost >= 1 else magnitude(cost))
        row.append(magnitude(max(o.error for o in members)))
        for way in ways:
            errors = [o.naive[way] for o in members if way in o.naive]
            row.append(magnitude(max(errors)) if errors else "")
        rows.append(row)
    heads = ["cases", "", "condition", "inputs rounded", "plenofir", *ways]
    return table(heads, rows)[:-1]


def all_outcomes() -> list[Outcome]:
    return [outcome for cases in CASES for outcome in cases()]
