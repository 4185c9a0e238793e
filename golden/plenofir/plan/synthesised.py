# SPDX-License-Identifier: Apache-2.0
"""Scenes that Yosys synthesises for Spartan-6."""

from collections.abc import Iterator
from pathlib import Path

from plenofir.fpga.synthesis.spartan6 import Netlist, synthesise
from plenofir.plan.configure import configure, top_of
from plenofir.plan.loaded_scene import load_scene, scene_files
from plenofir.plan.plan import Plan
from plenofir.plan.planner import make_plan


def is_stack_core(plan: Plan) -> bool:
    """Whether a scene is a core with all slices at once: wider than a device has pins."""
    return plan.path == "core" and plan.screen.needs_stack


def is_nextpnr_board(plan: Plan) -> bool:
    """Whether nextpnr makes a scene's bitstream, so that it has no netlist for Spartan-6."""
    return plan.path != "core" and plan.chip.family != "spartan6"


def core_plan(plan: Plan) -> Plan:
    """The plan of a scene's core alone, without its video path; a core's is the plan itself."""
    return plan if plan.path == "core" else plan.model_copy(update={"path": "core"})


def core_name(plan: Plan) -> str:
    """Name of a scene's core alone in the record of figures."""
    return plan.scene if plan.path == "core" else f"{plan.scene} core"


def shipped_plans() -> Iterator[Plan]:
    """Plans of the shipped scenes that have a netlist for Spartan-6: a core, or the whole board.

    Boards for nextpnr are not among them: their builds are recorded; nor are cores with all slices
    at once, which are larger than a Spartan-6.
    """
    for plan in (make_plan(load_scene(file)) for file in scene_files()):
        if not is_nextpnr_board(plan) and not is_stack_core(plan):
            yield plan


def takes_a_minute(plan: Plan) -> bool:
    """Whether Yosys works a minute or more: boards, cores of several pixels a clock, sensors."""
    core = plan.core
    several = core.parallel_rows > 1 or core.pixels_per_clock > 1
    return several or plan.path != "core" or plan.sensor is not None


def synthesise_plan(plan: Plan, directory: Path) -> Netlist:
    """Synthesise a scene for Spartan-6 in an empty folder."""
    sources = configure(plan, directory)
    return synthesise(sources, top_of(plan), {}, directory, board=plan.path != "core")
