# SPDX-License-Identifier: Apache-2.0
"""The thesis's printed predictions beside those of the ray model, for tests and the report."""

from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from math import inf, isnan

from plenofir.camera.rays.camera import load_camera
from plenofir.camera.rays.distances import Distances, State
from plenofir.camera.rays.focused import Origin
from plenofir.camera.rays.model import RayModel
from plenofir_studies.thesis_tables import Cells, Printed, load_table
from plenofir_studies.thick_lens import plano_convex


@dataclass(frozen=True)
class Check:
    """One printed number and its counterpart."""

    table: str  # number of the table, with its part
    row: str
    quantity: str  # name of the number, with its unit
    printed: Printed  # the number as printed
    computed: float  # by the model
    erratum: str | None = None  # key of the erratum that says why it is wrong, or None

    @property
    def agrees(self) -> bool:
        """Whether the two agree to the printed digits."""
        return self.printed.agrees(self.computed)


def _as_printed(distances: Distances) -> float:
    """Distance as the thesis prints it: planes at and beyond infinity are infinity."""
    value = float(distances.mm)
    beyond = (State.INFINITY, State.BEYOND_INFINITY)
    return inf if isnan(value) and distances.state() in beyond else value


def table_model(
    lens: str, mla: str, focus_m: float, micro_image_size: int, *, rounded: bool = True
) -> RayModel:
    """Model of a table's camera.

    The thesis's tables start from the image distance of Table 5.2, rounded to 0.1 um (`rounded`),
    the commands from the distance in focus.
    """
    camera = load_camera(f"{lens}-mla{len(mla)}")
    if not rounded:
        return RayModel.focused(camera, 1000 * focus_m, micro_image_size)
    if focus_m == inf:
        return RayModel(camera, Decimal(0), micro_image_size)
    for row in load_table("5.2").part().rows:
        if row.labels["lens"] == lens and row["d_f_m"] == focus_m:
            image_distance = Decimal(row.numbers["b_u_mm"].text)
            focal_length = Decimal(str(camera.main_lens.focal_length_mm))
            return RayModel(camera, image_distance - focal_length, micro_image_size)
    raise ValueError(f"Table 5.2 has no focus of {focus_m} m for {lens}")


def focus_checks() -> Iterator[Check]:
    """Table 5.2: image distances and exit pupils."""
    for row in load_table("5.2").part().rows:
        lens, focus = row.labels["lens"], row["d_f_m"]
        model = RayModel.focused(load_camera(f"{lens}-mla2"), 1000 * focus, 13)
        label = f"{lens}, d_f = {focus:g} m"
        for name, value in (
            ("b_u_mm", model.image_distance_mm),
            ("d_exit_mm", model.exit_pupil_mm),
        ):
            yield Check("5.2", label, name, row.numbers[name], value)


def micro_lens_checks() -> Iterator[Check]:
    """Table 5.1: micro lenses."""
    for row in load_table("5.1").part().rows:
        focal, pitch = row["f_s_mm"], row["p_m_um"] / 1000
        lens = plano_convex(focal, row["t_s_mm"], row["n"])
        for name, value in (
            ("f_number", focal / pitch),
            ("r1_mm", lens.front_radius_mm),
            ("h1h2_mm", lens.principal_plane_separation_mm),
            ("d_s_mm", lens.sensor_distance_mm),
        ):
            yield Check("5.1", f"MLA {row.labels['mla']}", name, row.numbers[name], value)


def micro_image_checks(*, rounded: bool = True) -> Iterator[Check]:
    """Tables 5.3 and 5.4: micro image centres for different origins of chief rays."""
    for number in ("5.3", "5.4"):
        for part in load_table(number).parts:
            labels, focus = part.settings.labels, part.settings["d_f_m"]
            model = table_model(labels["lens"], labels["mla"], focus, 13, rounded=rounded)
            for row in part.rows:
                position = float(model.micro_lens_position(row["s_over_p_m"]))
                label = f"{labels['lens']}, MLA {labels['mla']}, lens {row['s_over_p_m']:g}"
                origins: tuple[tuple[str, Origin], ...] = (
                    ("principal_plane_mm", "principal plane"),
                    ("stop_mm", "aperture stop"),
                    ("exit_pupil_mm", "exit pupil"),
                )
                for name, origin in origins:
                    computed = float(model.micro_image_centre(position, origin))
                    # Only the prediction from the exit pupil is wrong.
                    erratum = row.erratum if origin == "exit pupil" else None
                    printed = row.numbers[name]
                    yield Check(number + part.name, label, name, printed, computed, erratum)


def _distance_row(table: str, label: str, model: RayModel, row: Cells) -> Iterator[Check]:
    a = row["a"]
    for name, distances in (
        ("predicted_near_mm", model.near_border(a)),
        ("predicted_mm", model.distance(a)),
        ("predicted_far_mm", model.far_border(a)),
    ):
        if name in row.numbers:
            value = _as_printed(distances)
            yield Check(table, label, name, row.numbers[name], value, row.erratum)


def distance_checks(*, rounded: bool = True) -> Iterator[Check]:
    """Tables 5.5 to 5.7 and 5.10: refocusing distances and depth of field borders."""
    for number in ("5.5", "5.6", "5.7"):
        part = load_table(number).part()
        lens, mla = part.settings.labels["lens"], part.settings.labels["mla"]
        for row in part.rows:
            size = int(part.settings["micro_image_px"])
            model = table_model(lens, mla, row["d_f_m"], size, rounded=rounded)
            label = f"{lens}, MLA {mla}, d_f = {row['d_f_m']:g} m, a = {row['a']:g}"
            yield from _distance_row(number, label, model, row)
    for part in load_table("5.10").parts:
        settings = part.settings
        size = int(settings["micro_image_px"])
        lens, mla = settings.labels["lens"], settings.labels["mla"]
        model = table_model(lens, mla, settings["d_f_m"], size, rounded=rounded)
        for row in part.rows:
            a = row["a"]
            for name, distances in (
                ("near_cm", model.near_border(a)),
                ("distance_cm", model.distance(a)),
                ("far_cm", model.far_border(a)),
            ):
                if name in row.numbers:
                    # Counted from the front of the lens.
                    value = _as_printed(distances) / 10 - settings["front_cm"]
                    label = f"M = {size}, a = {row.numbers['a'].text}"
                    yield Check("5.10" + part.name, label, name, row.numbers[name], value)


def virtual_camera_checks(*, rounded: bool = True) -> Iterator[Check]:
    """Tables 5.8, 5.9, 5.11, 5.12 and 5.13: virtual cameras and triangulation."""
    part = load_table("5.8").part()
    gap = int(part.settings["gap"])
    for row in part.rows:
        lens, mla, focus = row.labels["lens"], row.labels["mla"], row["d_f_m"]
        model = table_model(lens, mla, focus, 13, rounded=rounded)
        label = f"{lens}, MLA {mla}, d_f = {focus:g} m"
        pupil = model.entrance_pupil_from_vertex_mm
        for name, value in (
            ("predicted_pupil_mm", inf if pupil is None else pupil),
            ("predicted_baseline_mm", float(model.baseline(gap))),
            ("predicted_tilt_deg", float(model.tilt(gap))),
        ):
            yield Check("5.8", label, name, row.numbers[name], value)
    part = load_table("5.9").part()
    gap = int(part.settings["gap"])
    for row in part.rows:
        lens, mla, focus = row.labels["lens"], row.labels["mla"], row["d_f_m"]
        model = table_model(lens, mla, focus, 13, rounded=rounded)
        label = f"{lens}, MLA {mla}, d_f = {focus:g} m, {row['disparity_px']:g} px"
        depth_mm = _as_printed(model.depth(row["disparity_px"], gap, unit="pixels per view"))
        yield Check("5.9", label, "predicted_mm", row.numbers["predicted_mm"], depth_mm)
    for number, name, cell in (
        ("5.11", "baseline", "predicted_baseline_mm"),
        ("5.12", "tilt", "predicted_tilt_deg"),
    ):
        for part in load_table(number).parts:
            settings = part.settings
            lens, mla, focus = settings.labels["lens"], settings.labels["mla"], settings["d_f_m"]
            model = table_model(lens, mla, focus, 11, rounded=rounded)
            for row in part.rows:
                gap = int(row["gap"] if "gap" in row.numbers else settings["gap"])
                if cell in row.numbers:
                    # Table 5.12 prints the absolute value of the tilt.
                    value = float(model.baseline(gap) if name == "baseline" else -model.tilt(gap))
                    label = f"{lens}, G = {gap}"
                    yield Check(number + part.name, label, cell, row.numbers[cell], value)
                else:
                    label = f"{lens}, G = {gap}, disparity {row['disparity_px']:g} px"
                    depth = float(model.depth(row["disparity_px"], gap).mm) / 10
                    printed = row.numbers["distance_cm"]
                    yield Check(number + part.name, label, "distance_cm", printed, depth)
    for row in load_table("5.13").part().rows:
        name = "wide" if row["f_u_mm"] < 10 else "tele"
        model = RayModel.focused(load_camera(f"lytro1-{name}"), inf, 9)
        for gap in (1, 8):
            cell = f"baseline_{gap}_mm"
            value = float(model.baseline(gap))
            yield Check("5.13", f"lytro1-{name}, G = {gap}", cell, row.numbers[cell], value)


@cache
def all_checks(*, rounded: bool = True) -> list[Check]:
    """All printed numbers that the ray model predicts, from rounded image distances or its own."""
    return [
        *micro_lens_checks(),
        *focus_checks(),
        *micro_image_checks(rounded=rounded),
        *distance_checks(rounded=rounded),
        *virtual_camera_checks(rounded=rounded),
    ]


def digits_of_rounding() -> tuple[int, int, float]:
    """How many numbers agree only with the rounded image distances, and of how many.

    Third, the largest relative difference of the model's numbers from both image distances.
    """
    pairs = [
        (one, other)
        for one, other in zip(all_checks(), all_checks(rounded=False), strict=True)
        if one.agrees and not other.agrees
    ]
    far = max(abs(other.computed / one.computed - 1) for one, other in pairs)
    return len(pairs), len(all_checks()), far


def rounding_sentences() -> str:
    """Sentences about the printed digits that the model gives without rounded image distances."""
    count, of, far = digits_of_rounding()
    return (
        "From the image distances of Table 5.2, which the thesis rounded to 0.1 um, the model "
        f"gives every printed digit of {of} numbers, but for the errata. From the distances in "
        f"focus, as the commands compute, {count} of them (in Tables 5.5 to 5.7 and 5.9) differ in "
        f"their last digits, by {100 * far:.4f} % at most."
    )
