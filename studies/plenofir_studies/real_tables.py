# SPDX-License-Identifier: Apache-2.0
"""Tables 5.5 to 5.9 by real rays through the shipped lenses, for all focuses and micro lenses.

The thesis simulates f193 and f90, whose prescriptions are not at hand. Here the same planes,
borders, virtual cameras and triangulated distances are predicted and traced through other lenses.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from math import inf

import numpy as np

from plenofir.camera.optics.prescription import shipped_lenses
from plenofir.camera.rays import RayModel
from plenofir.camera.rays.camera import MicroLensArray
from plenofir.camera.rays.precise import Values
from plenofir_studies.real_rays import (
    Comparison,
    VirtualComparison,
    compare_distances,
    compare_virtual_cameras,
    real_camera,
)
from plenofir_studies.report_parts import table
from plenofir_studies.thesis_tables import load_table

FOCUSES_MM = (inf, 3000.0, 1500.0)
MICRO_IMAGE_SIZE, GAP = 13, 6
BORDERS = {"near": 1, "plane": 0, "far": -1}
_TABLES = ("5.5", "5.6", "5.7")


def micro_lens_arrays() -> dict[str, MicroLensArray]:
    """Micro lenses of Table 5.1, by their number."""
    return {
        row.labels["mla"]: MicroLensArray(
            focal_length_mm=row["f_s_mm"], pitch_mm=row["p_m_um"] / 1000
        )
        for row in load_table("5.1").part().rows
    }


def settings_of(focus_mm: float) -> Values:
    """Focus settings a that Tables 5.5 to 5.7 have for a focus."""
    rows = (row for name in _TABLES for row in load_table(name).part().rows)
    return np.array(sorted({row["a"] for row in rows if 1000 * row["d_f_m"] == focus_mm}))


@dataclass(frozen=True)
class Traced:
    """A lens with micro lenses at a focus: predicted, and by real rays."""

    lens: str
    mla: str
    focus_mm: float
    planes: dict[str, Comparison]  # by border
    cameras: VirtualComparison


@cache
def traced_tables() -> tuple[Traced, ...]:
    """All lenses, micro lenses and focuses."""
    return tuple(_traced())


def _traced() -> Iterator[Traced]:
    for lens in shipped_lenses():
        for mla, micro_lenses in micro_lens_arrays().items():
            for focus in FOCUSES_MM:
                camera = real_camera(lens, micro_lenses).camera
                extension = RayModel.focused(camera, focus, MICRO_IMAGE_SIZE).extension_mm
                planes = {
                    name: compare_distances(
                        lens,
                        settings_of(focus),
                        MICRO_IMAGE_SIZE,
                        extension_mm=extension,
                        border=border,
                        micro_lenses=micro_lenses,
                    )
                    for name, border in BORDERS.items()
                }
                # Rays with disparity 0 are parallel if the focus is at infinity.
                cameras = compare_virtual_cameras(
                    lens,
                    GAP,
                    extension_mm=extension,
                    per_view=(1.0, 2.0) if focus == inf else (0.0, 1.0, 2.0),
                    micro_lenses=micro_lenses,
                )
                yield Traced(lens, mla, focus, planes, cameras)


def largest(values: list[Values]) -> float:
    """Largest absolute deviation, without nan; nan if there is none."""
    sizes = np.abs(np.concatenate([np.atleast_1d(v) for v in values]))
    return float(np.nanmax(sizes)) if np.isfinite(sizes).any() else float("nan")


def plane_deviations(traced: Traced, *, near: bool) -> list[Values]:
    """Deviations of planes and borders in percent; nan for those not in front of the lens.

    `near`: planes with a of at least 1; otherwise of at most 0, at the focus and beyond.
    """
    deviations = []
    for comparison in traced.planes.values():
        # Nothing can be inside the lens.
        there = comparison.predicted > comparison.model.image_distance_mm
        chosen = there & ((comparison.a >= 1) == near)
        deviations.append(np.where(chosen, comparison.deviation_percent, np.nan))
    return deviations


def _printed(lens: str, mla: str) -> list[float]:
    """The thesis's largest deviations of the same, from its own real rays."""
    planes: dict[bool, list[float]] = {True: [], False: []}
    cameras, depths = dict[str, list[float]](), []
    for number in _TABLES:
        part = load_table(number).part()
        if (part.settings.labels["lens"], part.settings.labels["mla"]) == (lens, mla):
            for row in part.rows:
                errors = [abs(row[name]) for name in row.numbers if name.startswith("error")]
                planes[row["a"] >= 1] += errors
    for row in load_table("5.8").part().rows:
        if (row.labels["lens"], row.labels["mla"]) == (lens, mla):
            for name in ("pupil", "baseline", "tilt"):
                if f"{name}_error_pct" in row.numbers:
                    cameras.setdefault(name, []).append(abs(row[f"{name}_error_pct"]))
    for row in load_table("5.9").part().rows:
        if (row.labels["lens"], row.labels["mla"]) == (lens, mla) and "error_pct" in row.numbers:
            depths.append(abs(row["error_pct"]))
    named = (*planes.values(), *(cameras.get(n, []) for n in ("pupil", "baseline", "tilt")), depths)
    return [max(values, default=float("nan")) for values in named]


def summary() -> list[str]:
    """Lines of a table: the largest deviation over all focuses, of each lens and array."""
    rows: list[list[str]] = []

    def row(name: str, mla: str, numbers: list[float]) -> None:
        cells = ("" if np.isnan(n) else f"{n:.2g} %" for n in numbers)
        rows.append([name, mla, *cells])

    keys = dict.fromkeys((traced.lens, traced.mla) for traced in traced_tables())
    for lens, mla in keys:
        group = [f for f in traced_tables() if (f.lens, f.mla) == (lens, mla)]
        planes = (
            largest([v for traced in group for v in plane_deviations(traced, near=near)])
            for near in (True, False)
        )
        cameras = (
            largest([traced.cameras.deviations_percent[name] for traced in group])
            for name in ("pupil", "baseline", "tilt", "depths")
        )
        row(lens, mla, [*planes, *cameras])
    for lens, mla in (("f193", "II"), ("f193", "I"), ("f90", "II"), ("f90", "I")):
        printed = _printed(lens, mla)
        if not np.isnan(printed).all():
            row(f"thesis: {lens}", mla, printed)
    heads = ["lens", "MLA", "planes and borders, a >= 1", "a <= 0", "entrance pupil"]
    heads.append(f"baseline, G = {GAP}")
    return table([*heads, "tilt", "triangulated distances"], rows)[:-1]


def planes_of(lens: str) -> list[str]:
    """Lines of a table: the rows of Tables 5.5 to 5.7 for a lens, predicted and by real rays."""
    rows = []
    for traced in (f for f in traced_tables() if f.lens == lens):
        for k, a in enumerate(settings_of(traced.focus_mm)):
            cells = [
                f"{c.predicted[k]:.4f} / {c.real[k]:.4f}" if np.isfinite(c.predicted[k]) else ""
                for c in traced.planes.values()
            ]
            rows.append([traced.mla, f"{traced.focus_mm:g}", f"{a:g}", *cells])
    heads = ["MLA", "focus / mm", "a", *(f"{b}: predicted / real, mm" for b in BORDERS)]
    return table(heads, rows)
