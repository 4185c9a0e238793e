# SPDX-License-Identifier: Apache-2.0
"""Recorded place and route of shipped scenes' cores beside their full builds."""

from pydantic import BaseModel, ConfigDict

from plenofir.fpga.resources.record import ECP5_SLOWEST, Placed, load_record
from plenofir.fpga.synthesis.ecp5 import NAMES
from plenofir.plan.loaded_scene import load_scene, scene_files
from plenofir.plan.plan import Plan
from plenofir.plan.planner import make_plan


class BesideFull(BaseModel):
    """A core and its full build, both placed."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    device: str
    # Amount of each resource, and "clock / MHz".
    scene: dict[str, float]
    full: dict[str, float]


def _amounts(placed: Placed) -> dict[str, float]:
    return {**placed.usage.amounts("ecp5"), "clock / MHz": placed.fmax_mhz}


def recorded_beside_full(scene: str) -> BesideFull | None:
    """What is recorded of a shipped scene, by its name."""
    placed = load_record().placed[ECP5_SLOWEST]
    core, full = placed.get(f"{scene} core", placed.get(scene)), placed.get(f"{scene} full")
    if core is None or full is None:
        return None
    device = next(name for name, short in NAMES.items() if short == full.device).upper()
    device += f", grade {full.speed_grade}"
    return BesideFull(device=device, scene=_amounts(core), full=_amounts(full))


def placed_beside_full(plan: Plan) -> BesideFull | None:
    """What is recorded of a plan; None if its core is none of a shipped scene."""
    if plan.scene not in {file.stem for file in scene_files()}:
        return None
    # A user's scene may have a shipped one's name, and --device another core.
    if make_plan(load_scene(plan.scene)).core != plan.core:
        return None
    return recorded_beside_full(plan.scene)
