# SPDX-License-Identifier: Apache-2.0
"""Which slices a scene needs, and effects of its camera's optics on them."""

from fractions import Fraction
from math import inf

from plenofir.camera.rays import Cover, RayModel, covering_slices, diffraction_note
from plenofir.camera.rays.cover import Slice, depth_of_field, gaps_between
from plenofir.ground.errors import InputError
from plenofir.plan.plan import PlannedSlice
from plenofir.plan.scene import LoadedScene
from plenofir.refocus.shifts import shift_to_text


def without_idle_slices(cover: Cover, near_mm: float, far_mm: float) -> Cover:
    """Drop slices whose depth of field adds nothing to that of the others."""

    def uncovered(slices: list[Slice]) -> float:
        # In reciprocal distances a gap to infinity has a finite size.
        return sum(1 / low - (0 if high == inf else 1 / high) for low, high in gaps(slices))

    def gaps(slices: list[Slice]) -> tuple[tuple[float, float], ...]:
        return gaps_between(slices, near_mm, far_mm)

    kept = list(cover.slices)
    for part in cover.slices:
        others = [other for other in kept if other is not part]
        if others and uncovered(others) <= uncovered(kept):
            kept = others
    return Cover(tuple(kept), gaps(kept))


def cover_of(loaded: LoadedScene, model: RayModel) -> Cover:
    """Slices that cover the depth of a scene; InputError if there are none."""
    depth = loaded.scene.depth
    assert depth.near_mm is not None
    assert depth.far_mm is not None
    cover = covering_slices(model, depth.near_mm, depth.far_mm)
    if not cover.slices:
        raise InputError(
            f"no slice of {loaded.scene.camera.model} is in focus between "
            f"{depth.near_mm:g} and {depth.far_mm:g} mm; give distances in front of the "
            "lens, or another focus_mm",
            where=f"{loaded.path}: depth",
        )
    return without_idle_slices(cover, depth.near_mm, depth.far_mm)


def planned_slice(shift: int, m: int, model: RayModel | None) -> PlannedSlice:
    """A slice with its depth of field."""
    field = None if model is None else depth_of_field(model, Fraction(shift, m))
    return PlannedSlice(
        a=shift_to_text(shift, m),
        shift=shift,
        near_mm=None if field is None else field.near_mm,
        far_mm=None if field is None or field.far_mm == inf else field.far_mm,
    )


def notes_on(model: RayModel | None) -> tuple[str, ...]:
    """Notes on the effects of the camera's optics on the slices."""
    if model is None:
        return ()
    notes = diffraction_note(model.camera), model.vignetting_note(model.micro_image_size // 2)
    return tuple(note for note in notes if note)
