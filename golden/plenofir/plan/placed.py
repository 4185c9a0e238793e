# SPDX-License-Identifier: Apache-2.0
"""Recorded place and route of shipped scenes' cores beside their full builds."""

import json

from pydantic import BaseModel, ConfigDict

from plenofir.fpga.devices import Usage
from plenofir.fpga.synthesis.ecp5 import NAMES, Placed
from plenofir.ground import project
from plenofir.plan.planned import Plan
from plenofir.plan.planner import make_plan
from plenofir.plan.scene import load_scene, scene_files

FILE = project.DATA / "ecp5.json"
GRADE = "6"
"""Of the clocks: the slowest that is sold."""


class BesideFull(BaseModel):
    """A core and its full build, both placed."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    device: str
    # Amount of each resource, and "clock / MHz".
    scene: dict[str, float]
    full: dict[str, float]


def _amounts(placed: Placed) -> dict[str, float]:
    usage = Usage(placed.lut, placed.flip_flops, placed.block_rams, dsp=placed.multipliers)
    return {**usage.amounts("ecp5"), "clock / MHz": placed.fmax_mhz}


def recorded_beside_full(scene: str) -> BesideFull | None:
    """What is recorded of a shipped scene, by its name."""
    known = json.loads(FILE.read_text())
    core = known.get(f"{scene} core", known.get(scene))
    full = known.get(f"{scene} full")
    if core is None or full is None:
        return None
    one, other = (Placed.model_validate(grades[GRADE]) for grades in (core, full))
    device = next(name for name, short in NAMES.items() if short == other.device).upper()
    return BesideFull(device=f"{device}, grade {GRADE}", scene=_amounts(one), full=_amounts(other))


def placed_beside_full(plan: Plan) -> BesideFull | None:
    """What is recorded of a plan; None if its core is none of a shipped scene."""
    if plan.scene not in {file.stem for file in scene_files()}:
        return None
    if make_plan(load_scene(plan.scene)).core != plan.core:
        return None
    return recorded_beside_full(plan.scene)
