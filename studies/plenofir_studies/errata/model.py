# SPDX-License-Identifier: Apache-2.0
"""Errata of chapter 3, the ray model."""

from math import inf

import numpy as np

from plenofir.camera.rays import RayModel, camera_of, load_camera
from plenofir_studies.errata.entry import Erratum, Shown
from plenofir_studies.intersections import image_side_distance
from plenofir_studies.ray_validation import table_model
from plenofir_studies.thesis_tables import load_table

_GAP = 6


def _setups() -> list[tuple[RayModel, float, float]]:
    """Cameras of Table 5.8 with the printed baseline and tilt between views 0 and 6."""
    return [
        (
            table_model(row.labels["lens"], row.labels["mla"], row["d_f_m"], 13),
            row["predicted_baseline_mm"],
            row["predicted_tilt_deg"],
        )
        for row in load_table("5.8").part().rows
    ]


def _angle(model: RayModel, view: int) -> float:
    """Angle of a virtual camera's axis in degrees (Eq. 3.58)."""
    return float(np.rad2deg(np.arctan(model.object_ray(view, 0.0)[0])))


def _limits() -> Shown:
    counts = {"left": 0, "right": 0, "missed": 0}
    for number in ("5.5", "5.6", "5.7"):
        part = load_table(number).part()
        labels = part.settings.labels
        for row in part.rows:
            model = table_model(labels["lens"], labels["mla"], row["d_f_m"], 13)
            lens = model.camera.main_lens
            front = model.image_distance_mm + lens.principal_plane_separation_mm
            for border, name in ((1, "near_mm"), (0, "mm"), (-1, "far_mm")):
                printed = row[f"predicted_{name}"]
                if np.isfinite(printed):
                    met = float(image_side_distance(model, row["a"], border))
                    # Objects nearer than f_U have images on the other side of the main lens.
                    counts["left" if met - front > lens.focal_length_mm else "right"] += 1
                    counts["missed"] += abs(met / printed - 1) > 2e-4
    total = counts["left"] + counts["right"]
    return Shown(
        f"Of the {total} finite predictions of Tables 5.5 to 5.7, {counts['left']} meet at z below "
        f"U and {counts['right']} at z above U (their objects stand nearer than f_U). Eq. 3.32 "
        f"leaves out the latter, Eq. 3.40 the former; lines without limits give all {total}.",
        printed=min(counts["left"], counts["right"]),
        holds=counts["missed"],
        limit=0,
    )


def _borders() -> Shown:
    model = table_model("f193", "II", inf, 13)
    camera, lens = model.camera, model.camera.main_lens
    pitch, focal = camera.micro_lenses.pitch_mm, camera.micro_lenses.focal_length_mm
    pixel, c, a, edge_lens = camera.sensor.pixel_pitch_mm, 6, 1, 6
    row = next(
        row for row in load_table("5.5").part().rows if row["d_f_m"] == inf and row["a"] == a
    )

    def line(view: int, lens_number: int, pixel_side: int, lens_side: int) -> tuple[float, float]:
        """Slope and height of a ray (Eqs. 3.36 to 3.39)."""
        s = lens_number * pitch
        u = s * (1 + focal / model.exit_pupil_mm) + view * pixel + pixel_side * pixel / 2
        return (s - u) / focal, s + lens_side * pitch / 2

    def distance(first: tuple[int, int], second: tuple[int, int]) -> float:
        """Where two rays meet, through the main lens (Eqs. 3.40 to 3.43)."""
        one, other = line(-c, edge_lens, *first), line(c, edge_lens - a * 2 * c, *second)
        image = model.image_distance_mm - (other[1] - one[1]) / (one[0] - other[0])
        in_front = 1 / (1 / lens.focal_length_mm - 1 / image)
        return model.image_distance_mm + lens.principal_plane_separation_mm + in_front

    same = [distance((sign, sign), (sign, sign)) for sign in (-1, 1)]
    # Inner rays: pixel borders towards the micro images' middles, outer edges of the micro lenses.
    near, far = (distance((sign, sign), (-sign, -sign)) for sign in (1, -1))
    want = (row["predicted_near_mm"], row["predicted_far_mm"])
    return Shown(
        f"f193, (II), infinity, a = 1: with one sign for both rays all four offsets are the same "
        f"for both, so d- = d+ = {same[0]:.4f} mm = d_a and the depth of field is "
        f"{abs(same[1] - same[0]):.4f} mm. With opposite signs the borders are {near:.4f} and "
        f"{far:.4f} mm, as Table 5.5 prints them.",
        max(abs(value_mm - value) for value_mm, value in zip(same, want, strict=True)),
        max(abs(near - want[0]), abs(far - want[1])),
        5e-5,
    )


def _exit_baseline() -> Shown:
    model = table_model("f193", "II", 3.0, 13)
    lenses = model.micro_lens_position(np.arange(-20, 21))
    view = 4
    baseline = model.chief_ray_slope(view, lenses) * model.exit_pupil_mm
    want = -view * model.pixel_slope * model.exit_pupil_mm
    printed = float(np.abs(baseline - want).max())
    holds = float(np.abs(baseline + lenses - want).max())
    return Shown(
        f"f193, (II), 3 m, view {view}: the rays of all micro lenses pass the exit pupil "
        f"{abs(want):.4f} mm from its centre. As printed, micro lens 20 gives a height that is off "
        f"by {printed:.4f} mm.",
        printed,
        holds,
        1e-9,
    )


def _baseline() -> Shown:
    printed, holds = 0.0, 0.0
    for model, cell, _ in _setups():
        for view in (-3, 0):
            first, second = (float(model.virtual_camera(i)) for i in (view, view + _GAP))
            printed = max(printed, abs(first + second - cell))
            holds = max(holds, abs(first - second - cell))
    model, cell, _ = _setups()[0]
    ends = [float(model.virtual_camera(i)) for i in (-3, 3)]
    return Shown(
        f"Table 5.8, f193, (II), infinity: {cell} mm. Cameras -3 and 3 stand at {ends[0]:+.4f} and "
        f"{ends[1]:+.4f} mm: sum {abs(sum(ends)):.4f}, difference {ends[0] - ends[1]:.4f}. The "
        "difference gives all nine baselines of the table, wherever the first camera is.",
        printed,
        holds,
        5e-5,
    )


def _tilt() -> Shown:
    printed, holds = 0.0, 0.0
    for model, _, cell in _setups():
        first, second = _angle(model, 0), _angle(model, _GAP)
        printed = max(printed, abs(first + second - cell))
        holds = max(holds, abs(first - second - cell))
    model, _, cell = _setups()[3]
    return Shown(
        f"Table 5.8, f193, (II), 3 m: {cell} degree. Phi_0 = {abs(_angle(model, 0)):.4f}, Phi_6 = "
        f"{_angle(model, _GAP):+.4f}: the sum has the wrong sign, the difference gives all nine "
        "tilts of the table.",
        printed,
        holds,
        5e-5,
    )


def _triangulation() -> Shown:
    printed, holds, wrong = 0.0, 0.0, 0
    rows = [row for row in load_table("5.9").part().rows if np.isfinite(row["d_f_m"])]
    for row in rows:
        model = table_model(row.labels["lens"], row.labels["mla"], row["d_f_m"], 13)
        baseline = float(model.baseline(_GAP))
        tangent = np.tan(np.radians(float(model.tilt(_GAP))))
        # p_N / b_N (Eqs. 3.56, 3.57); the table counts pixels for each view.
        step = model.camera.micro_lenses.pitch_mm
        unit = abs(float(model.object_ray(0, step)[0] - model.object_ray(0, 0.0)[0]))
        turn = _GAP * row["disparity_px"] * unit
        with_plus, with_minus = baseline / (turn + tangent), baseline / (turn - tangent)
        printed = max(printed, abs(with_plus / row["predicted_mm"] - 1))
        holds = max(holds, abs(with_minus / row["predicted_mm"] - 1))
        wrong += with_plus < 0
    return Shown(
        f"With the tilts as Table 5.8 prints them (negative), the {len(rows)} distances of Table "
        f"5.9 at 3 and 1.5 m follow with the minus to the printed digits; with the plus {wrong} of "
        "them come out negative. Table 5.12 prints the same kind of tilt as positive, for which "
        "the plus would be right.",
        printed,
        holds,
        1e-6,
    )


def _example_of_the_listings() -> Shown:
    f100, f193 = (load_camera(f"{lens}-mla2") for lens in ("f100", "f193"))
    row = next(
        row for row in load_table("5.5").part().rows if row["d_f_m"] == inf and row["a"] == 1
    )
    names = ("predicted_near_mm", "predicted_mm", "predicted_far_mm")
    printed = [row[name] for name in names]
    distances, misses = [], []
    for pupil in (f193.main_lens.exit_pupil_mm, f100.main_lens.exit_pupil_mm):
        model = RayModel.focused(camera_of(f193, {"exit_pupil": pupil}), inf, 13)
        planes = model.near_border(1), model.distance(1), model.far_border(1)
        distances.append([float(plane.mm) for plane in planes])
        misses.append(max(abs(mm - w) for mm, w in zip(distances[-1], printed, strict=True)))
    right, mixed = (", ".join(f"{mm:.4f}" for mm in both) for both in distances)
    return Shown(
        f"f193, (II), infinity, a = 1: an exit pupil at {f193.main_lens.exit_pupil_mm:.4f} mm "
        f"gives {right} mm (near border, plane, far border), as Table 5.5 prints them; one at "
        f"{f100.main_lens.exit_pupil_mm:.4f} mm gives {mixed} mm.",
        misses[1],
        misses[0],
        5e-5,
    )


ERRATA = (
    Erratum(
        "limits-of-z",
        "Eqs. 3.31, 3.32, 3.39, 3.40",
        "the rays behind the micro lenses meet at z in (-infinity, U] (3.31, 3.32, 3.39), or in "
        "[U, infinity) (3.40)",
        "the lines have no limits: the rays are extended as far as they need to meet",
        _limits,
    ),
    Erratum(
        "borders",
        "Eqs. 3.36 to 3.40, 3.44",
        "the two rays of a depth of field border take the same sign: A+ meets B+, A- meets B-",
        "opposite signs: the ray of one micro image's upper border meets that of the other one's "
        "lower border, and the same for the micro lens edges",
        _borders,
    ),
    Erratum(
        "exit-baseline",
        "Eq. 3.51",
        "B_A' = m_(c+i,j) d_A' for any micro lens j",
        "m_(c+i,j) d_A' + s_j, which is -i d_A' p_p / f_s for all j; as printed for the central "
        "micro lens (s_j = 0) alone",
        _exit_baseline,
    ),
    Erratum(
        "baseline",
        "Eq. 3.55",
        "B_G = A_i'' + A_(i+G)''",
        "B_G = A_i'' - A_(i+G)''",
        _baseline,
    ),
    Erratum(
        "tilt",
        "Eq. 3.59",
        "Phi_G = Phi_i + Phi_(i+G)",
        "Phi_G = Phi_i - Phi_(i+G)",
        _tilt,
    ),
    Erratum(
        "sign-of-the-tilt",
        "Eqs. 3.60, 5.24, 5.25 and Tables 5.8, 5.12",
        "Z = b_N B_G / (Delta_x p_N + b_N tan(Phi_G)), with a negative Phi_G in Table 5.8 and a "
        "positive one in Table 5.12",
        "with Phi_G = Phi_i - Phi_(i+G), negative where the axes converge, as in Table 5.8: minus "
        "b_N tan(Phi_G); Table 5.12 prints -Phi_G",
        _triangulation,
    ),
    Erratum(
        "example-of-the-listings",
        "Appendix A, example of the listings (section 3.3)",
        "the main lens f193 with an exit pupil 108.1293 mm from the micro lenses; this is as noted "
        "from another copy, because the copy at hand leaves the listings out",
        "111.0324 mm, which Table 5.2 has for f193 at infinity, and the script that the author "
        "published apart; 108.1293 mm belongs to f100",
        _example_of_the_listings,
    ),
)
