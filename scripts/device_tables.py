# SPDX-License-Identifier: Apache-2.0
"""Tables of devices, for scripts/build_docs.py."""

import re
from functools import cache

from plenofir.fpga.devices import DEVICES
from plenofir.fpga.families import FAMILIES
from plenofir.fpga.resources.record import ECP5_SLOWEST, load_record
from plenofir.fpga.synthesis.ecp5 import NAMES
from plenofir.ground.errors import InputError
from plenofir.plan import Plan, load_scene, make_plan
from plenofir.plan.loaded_scene import scene_files
from plenofir_studies.records import load_builds
from table_text import put, table


def scene_names() -> list[str]:
    """Names of the shipped scenes."""
    return [file.stem for file in scene_files()]


@cache
def plan_on(scene: str, device: str) -> Plan | str:
    """The plan of a scene on a device, or briefly why there is none."""
    try:
        return make_plan(load_scene(scene, device))
    except InputError as error:
        over = re.search(r"needs (\d+) of (\d+) ([^;(]+)", str(error))
        if over is not None:
            return f"{over[1]} of {over[2]} {over[3].strip()}"
        if "MHz" in str(error):
            return "too slow"
        if "not a mode" in str(error) or "build.path" in str(error):
            return "board's video"
        raise


def _clock_of(scene: str, plan: Plan) -> float | None:
    """Clock in MHz of a scene's core on a device, or of its board, if it was placed."""
    builds = load_builds()
    build = builds.get(f"{scene} on {plan.device}", builds.get(scene))
    if build is not None and build.device == plan.device:
        return next(clock.reached_mhz for clock in build.timing if clock.clock == "clk")
    placed = load_record().placed
    cores = placed.get(plan.device, {})
    if (core := cores.get(scene, cores.get(f"{scene} core"))) is not None:
        return core.fmax_mhz
    slowest = placed[ECP5_SLOWEST].get(scene)
    if plan.path == "core" and slowest and NAMES.get(plan.device) == slowest.device:
        return slowest.fmax_mhz
    return None


def _on_device(scene: str, device: str) -> str:
    """Resources of a scene's core on a device, or why it does not fit."""
    plan = plan_on(scene, device)
    if isinstance(plan, str):
        return plan
    names = FAMILIES[DEVICES[device].family].names
    lut, blocks = (plan.needs[name] for name in (names[0], names[2]))
    at_once = f", {plan.core.pixels_per_clock} px" if plan.core.pixels_per_clock > 1 else ""
    clock = _clock_of(scene, plan)
    whole = " board" if plan.path != "core" else ""
    return f"{lut} + {blocks}{whole}{at_once}" + (f" **{clock:g} MHz**" if clock else "")


def scenes_on(device: str) -> list[str]:
    """Make the table of how far each shipped scene went on a device."""
    rows = []
    for scene in scene_names():
        plan = plan_on(scene, device)
        if isinstance(plan, str):
            rows.append((scene, f"does not fit: {plan}"))
            continue
        clock, part = _clock_of(scene, plan), "board" if plan.path != "core" else "core"
        fits = f"the {part} fits; not placed"
        rows.append((scene, fits if clock is None else f"the {part} placed: {clock:g} MHz"))
    return table(f"scene | on the {DEVICES[device].title}", rows)


def device_table(text: str) -> str:
    """Put the resources of the shipped scenes' cores on every device between its marks."""
    rows = []
    for device in DEVICES.values():
        total, names = device.total, FAMILIES[device.family].names
        has = f"{total.lut} {names[0]}, {total.ramb16} {names[2]}"
        rows.append(
            (device.title, has, *(_on_device(scene, device.name) for scene in scene_names()))
        )
    return put(text, "devices", table(f"device | it has | {' | '.join(scene_names())}", rows))


def device_shares() -> list[str]:
    """Make the table of the shares of a device that scenes take, where they fit."""
    rows = []
    for device in DEVICES.values():
        cells = []
        for scene in scene_names():
            plan = plan_on(scene, device.name)
            shares = (
                ""
                if isinstance(plan, str)
                else " / ".join(
                    f"{100 * need / plan.available[name]:.0f}" if plan.available[name] else "-"
                    for name, need in plan.needs.items()
                )
            )
            cells.append(shares)
        rows.append((device.title, *cells))
    return table(f"device | {' | '.join(scene_names())}", rows)


def device_sources() -> list[str]:
    """Make the table of sources for each family's devices."""
    families = {device.family: device.source for device in DEVICES.values()}
    return table(
        "family | amounts", ((FAMILIES[f].title, source) for f, source in families.items())
    )
