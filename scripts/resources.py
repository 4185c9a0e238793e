# SPDX-License-Identifier: Apache-2.0
"""Records the resources of designs and the clocks that they reach.

Usage: python scripts/resources.py COMMAND [NAMES]. The record is data/resources.json
(plenofir.fpga.resources.record) where no other file is named. The commands:

figures synthesises the designs of plenofir_studies.recorded_designs for Spartan-6 (JOBS at
  once); names of designs, all if there are none.
compare synthesises and places the cells of the comparison of both engines that the record lacks;
  parts of their names; --again measures anew.
devices places the cores of the shipped scenes on the devices of plenofir.fpga.synthesis.placers
  that the record lacks; names of devices, or DEVICE:SCENE: anew.
families counts the cores of plenofir_studies.counted_cores for the families of other vendors that
  the record lacks; names of families.
drawn counts the drawn cores of plenofir_studies.drawn_cores that the record lacks, each for the
  family whose turn it is; names of families, for which all cores are counted.
place places for ECP5, or for the device that is named behind a scene. A scene: its clock and
  resources (recorded of a shipped core with all slices at once), or the bitstream of its board,
  whose report is recorded. Without a scene all shipped scenes, cores and arrays, and the self-test
  of the ULX3S board, whose bitstream goes to build/pnr/.
full places for ECP5 what the record lacks of the shipped scenes' cores and full builds; names of
  scenes, whose full builds are placed anew.
nets places the row filters of plenofir_studies.systolic that their file lacks for ECP5.
pixels places the core of the scene video-m11 with those of 1 to 32 pixels a clock that
  data/pixels.json lacks; numbers of pixels, which are placed anew.
spread places the core of video-m11 ten times for a device with given numbers of pixels a clock,
  for data/spreads.json.
fit writes the engines' weights, fitted to what is recorded: for ECP5 placed cores, else what Yosys
  counts; and how far off drawn cores are by weights that were fitted without them.
energy sends pictures through the netlists of plenofir_studies.energy that data/energy.json lacks;
  "anew" for all.
"""

import os
import sys
import tempfile
import time
from collections.abc import Container, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path

from fit_estimates import PLACED, fit
from plenofir.fpga import hdl
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import PIXELS_PER_CLOCK
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.resources.estimate import estimate
from plenofir.fpga.resources.record import ECP5_FASTEST, ECP5_SLOWEST, Figures, Placed, load_record
from plenofir.fpga.synthesis.counts import count
from plenofir.fpga.synthesis.ecp5 import NAMES, check_tools
from plenofir.fpga.synthesis.placers import PLACERS
from plenofir.fpga.synthesis.spartan6 import synthesise
from plenofir.fpga.tools.synthesis import ghdl_version, yosys_version
from plenofir.ground import project
from plenofir.ground.errors import EXIT_BAD_INPUT, EXIT_TOOL_FAILED, InputError, ToolError
from plenofir.ground.files import publish_files
from plenofir.plan.board_build import build_scene
from plenofir.plan.configure import configure
from plenofir.plan.loaded_scene import load_scene, scene_files
from plenofir.plan.plan import Plan
from plenofir.plan.planner import make_plan
from plenofir.plan.scene_top import TOP
from plenofir.plan.synthesised import is_nextpnr_board, is_stack_core
from plenofir_studies import energy, engine_cells, many_pixels, systolic
from plenofir_studies.counted_cores import COUNTED, counted_cores
from plenofir_studies.drawn_cores import DRAWN_FAMILIES, counted_for, drawn_cores
from plenofir_studies.placed_cores import place_core as place_on
from plenofir_studies.placed_ecp5 import make_netlist, place, write_bitstream
from plenofir_studies.recorded_designs import (
    ARRAY,
    CORE,
    Design,
    compared_designs,
    core_designs,
    designs,
    grey_core,
    stack_core_designs,
)
from plenofir_studies.records import (
    load_builds,
    record_design,
    record_name,
    save_builds,
    save_record,
)
from self_test import TOP as SELF_TEST
from self_test import self_test_generics

FULL_DEVICE = "lfe5u-45f"
BITSTREAMS = project.root() / "build" / "pnr"
BOARD_CORE = CoreConfiguration(micro_image_size=5, shifts=(-3,), max_columns=640, channels=3)
BOARD_ROWS = 480
_WIDE_GOAL_MHZ = 50.0


def _counted_with_these_tools() -> dict[str, Figures]:
    """Figures for Spartan-6 by the installed tools; the record forgets those of other versions."""
    ghdl, yosys = ghdl_version(), yosys_version()
    record = load_record()
    if (ghdl, yosys) != (record.ghdl, record.yosys):
        record = save_record(ghdl=ghdl, yosys=yosys, counted={**record.counted, "spartan6": {}})
    return dict(record.counted["spartan6"])


def figures(names: Sequence[str]) -> None:
    """Record the figures of designs, after each design; other tools count everything anew."""

    def measure(design: Design) -> tuple[Figures, float]:
        started = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            figures_now = design.synthesise(Path(folder)).figures
        return figures_now, time.perf_counter() - started

    counted = _counted_with_these_tools()
    chosen = [design for design in designs() if design.name in names or not names]
    # The largest first, so that all jobs end together.
    chosen.sort(key=lambda d: -counted[d.name].lut if d.name in counted else -(10**9))
    with ThreadPoolExecutor(int(os.environ.get("JOBS") or os.cpu_count() or 1)) as jobs:
        running = {jobs.submit(measure, design): design.name for design in chosen}
        for future in as_completed(running):
            name = running[future]
            counted[name], seconds = future.result()
            print(f"{name}: {counted[name]} ({seconds:.0f} s)", flush=True)
            record_design("counted", "spartan6", name, counted[name])


def compare(words: Sequence[str]) -> None:
    """Record the cells of the comparison, after each cell."""
    check_tools()
    again = "--again" in words
    patterns = [word for word in words if word != "--again"]

    def chosen(cells: list[engine_cells.Cell], recorded: Container[str]) -> list[engine_cells.Cell]:
        named = [c for c in cells if not patterns or any(text in c.name for text in patterns)]
        return [cell for cell in named if again or cell.name not in recorded]

    for cell in chosen(list(engine_cells.measured_cells()), _counted_with_these_tools()):
        with tempfile.TemporaryDirectory() as folder:
            generics = cell.core().generics()
            figures_now = synthesise(hdl.hdl_sources(), CORE, generics, Path(folder)).figures
        print(f"{cell.name}: {figures_now}", flush=True)
        record_design("counted", "spartan6", cell.name, figures_now)
    for cell in chosen(list(engine_cells.placed_cells()), load_record().placed[ECP5_SLOWEST]):
        placed = place_core(cell.core(), behind_few_pins=cell.pixels_per_clock > 1)
        say(cell.name, placed)
        record_design("placed", ECP5_SLOWEST, cell.name, placed)


def families(names: Sequence[str]) -> None:
    """Record the counts of cores for families, after each core."""
    for family in COUNTED:
        if names and family not in names:
            continue
        for name, core in counted_cores():
            if name in load_record().counted.get(family, {}):
                continue
            with tempfile.TemporaryDirectory() as folder:
                amounts = count(family, hdl.hdl_sources(), CORE, core.generics(), Path(folder))
            record_design("counted", family, name, amounts)
            print(f"{family}, {name}: {amounts.usage.amounts(family)}", flush=True)


def drawn(names: Sequence[str]) -> None:
    """Record the counts of drawn cores, after each core."""
    for name, core in drawn_cores():
        for family in DRAWN_FAMILIES:
            chosen = family in names if names else family == counted_for(name)
            if not chosen or name in load_record().counted[family]:
                continue
            with tempfile.TemporaryDirectory() as folder:
                amounts = count(family, hdl.hdl_sources(), CORE, core.generics(), Path(folder))
            record_design("counted", family, name, amounts)
            beside = estimate(core.blocks, family).amounts(family)
            print(f"{family}, {name}: {amounts.usage.amounts(family)}, estimated {beside}")


def devices(names: Sequence[str]) -> None:
    """Record cores placed on devices with other open tools, after each core."""
    for name in PLACERS:
        device = DEVICES[name]
        for design in core_designs():
            placements, scene = (
                load_record().placed.get(name, {}),
                design.name.removesuffix(" core"),
            )
            named = bool({name, f"{name}:{scene}"} & set(names))
            if (names and not named) or (design.name in placements and not named):
                continue
            if device.overflow(estimate(design.core.blocks, device.family)):
                print(f"{name}, {design.name}: does not fit")
                continue
            with tempfile.TemporaryDirectory() as folder:
                placed = place_on(
                    *(name, device.family, hdl.hdl_sources(), CORE),
                    *(design.core.generics(), Path(folder)),
                )
            record_design("placed", name, design.name, placed)
            print(f"{name}, {design.name}: {placed}", flush=True)


def place_core(core: CoreConfiguration, *, behind_few_pins: bool, **options: object) -> Placed:
    """Synthesise a core for ECP5, place and route it."""
    with tempfile.TemporaryDirectory() as name:
        netlist = make_netlist(
            *(hdl.hdl_sources(), CORE, core.generics(), Path(name)),
            behind_few_pins=behind_few_pins,
        )
        return place(netlist, **options)  # type: ignore[arg-type]


def say(name: str, placed: Placed) -> None:
    """Print a result."""
    print(
        f"{name}: {placed.fmax_mhz} MHz (ECP5 {placed.device}, grade {placed.speed_grade}), "
        f"{placed.lut} LUT4, {placed.flip_flops} flip-flops, {placed.block_rams} DP16KD, "
        f"{placed.multipliers} MULT18X18D",
        flush=True,
    )


def place_design(design: Design, grades: Sequence[int] = (6, 8)) -> dict[str, Placed]:
    """Place a design for ECP5 grades, by their places in the record.

    A scene for a Spartan-6 goes where it fits.
    """
    goal_mhz, route = 150.0, True
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if design.plan is not None:
            wide = is_stack_core(design.plan)
            sources = configure(design.plan, folder)
            netlist = make_netlist(sources, TOP, {}, folder, behind_few_pins=wide)
            device = NAMES.get(design.plan.device)
            if wide:
                # Wide cores fill a device, and nextpnr would route for an hour.
                goal_mhz, route, grades = _WIDE_GOAL_MHZ, False, grades[:1]
        else:
            generics, device = design.core.generics(), None
            netlist = make_netlist(hdl.hdl_sources(), design.top, generics, folder)
        placements = {
            f"ecp5-{grade}": place(
                netlist, speed_grade=grade, device=device, goal_mhz=goal_mhz, route=route
            )
            for grade in grades
        }
    for placed in placements.values():
        say(design.name, placed)
    return placements


def record_placed(name: str, grades: dict[str, Placed]) -> None:
    """Record what `place_design` returned."""
    for grade, placed in grades.items():
        record_design("placed", grade, name, placed)


def place_full(names: Sequence[str]) -> None:
    """Place cores beside their full builds, those that fit the device, after each design."""
    check_tools()
    for design in (design for pair in compared_designs() for design in pair):
        assert design.plan is not None
        placements = load_record().placed[ECP5_SLOWEST]
        if names and design.plan.scene not in names:
            continue
        # What `place` records has a second grade.
        if design.name in placements and (not names or design.name == design.plan.scene):
            continue
        if DEVICES[FULL_DEVICE].overflow(estimate(design.core.blocks, "ecp5")):
            print(f"{design.name}: does not fit")
            continue
        record_placed(design.name, place_design(design, (6,)))


def place_all(names: Sequence[str]) -> None:
    """Place a scene, or everything that is recorded."""
    check_tools()
    if names:
        plan = make_plan(load_scene(names[0], names[1] if len(names) > 1 else None))
        if is_nextpnr_board(plan):
            record_build(plan)
        elif plan.device in PLACERS:
            place_scene(plan)
        else:
            # The board's TMDS ends are Spartan-6 primitives: what can be placed here is the core.
            plan = plan.model_copy(update={"path": "core"})
            placements = place_design(Design(plan.scene, plan.core, TOP, plan=plan))
            if names[0] in {design.name for design in stack_core_designs()} and len(names) == 1:
                record_placed(plan.scene, placements)
        return
    chosen = [replace(d, name=d.name.removesuffix(" core")) for d in core_designs()]
    for kind, m, shift, rows in PLACED:
        core = grey_core(m, (shift,), engine=FirEngine(parallel_rows=rows))
        top = CORE if kind == "core" else ARRAY
        chosen.append(Design(f"{kind} M={m} a'={shift} iota={rows}", core, top))
    chosen += stack_core_designs()
    cells, record = {cell.name for cell in engine_cells.placed_cells()}, load_record()
    kept = {name: p for name, p in record.placed[ECP5_SLOWEST].items() if name in cells}
    save_record(placed={**record.placed, ECP5_SLOWEST: kept, ECP5_FASTEST: {}})
    for design in chosen:
        record_placed(design.name, place_design(design))
    record_design("placed", ECP5_SLOWEST, "ulx3s self-test", place_self_test())
    place_full(())
    save_builds({})
    for plan in (make_plan(load_scene(file)) for file in scene_files()):
        if is_nextpnr_board(plan):
            record_build(plan)
    # The scene that is built without options is recorded for all devices.
    board = BOARDS["ulx3s"]
    scene_device = load_scene(board.scene).scene.build.device
    for device in board.devices:
        if device != scene_device:
            record_build(make_plan(load_scene(board.scene, device)))


def place_scene(plan: Plan) -> None:
    """Place a scene's core for a device that another tool than ECP5's places."""
    folder = BITSTREAMS / f"{plan.scene}-{plan.device}"
    with tempfile.TemporaryDirectory() as name:
        sources = configure(plan, Path(name))
        family = DEVICES[plan.device].family
        placed = place_on(plan.device, family, sources, TOP, {}, Path(name))
        publish_files(Path(name), folder)
    amounts = ", ".join(f"{n} {resource}" for resource, n in placed.usage.amounts(family).items())
    print(f"{plan.scene} on {plan.device}: {placed.fmax_mhz} MHz, {amounts}")
    print(f"bitstream: {folder / PLACERS[plan.device].bitstream}")


def place_self_test() -> Placed:
    """Make the bitstream of the ULX3S self-test."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        generics = self_test_generics(BOARD_CORE, BOARD_ROWS)
        netlist = make_netlist(hdl.hdl_sources(), SELF_TEST, generics, folder)
        constraints = project.root() / "constraints" / "ulx3s_self_test.lpf"
        placed = place(netlist, constraints=constraints, goal_mhz=25)
        write_bitstream(folder / f"{netlist.stem}.config")
        publish_files(folder, BITSTREAMS)
    say("ulx3s self-test", placed)
    print(f"bitstream: {BITSTREAMS / SELF_TEST}.bit")
    return placed


def record_build(plan: Plan) -> None:
    """Make the bitstream of a board with open tools and record its report."""
    folder = BITSTREAMS / plan.scene
    result = build_scene(plan, folder, lambda *_: None)
    name = record_name(plan.scene, plan.device, load_scene(plan.scene).scene.build.device)
    save_builds(dict(sorted({**load_builds(), name: result}.items())))
    for clock in result.timing:
        print(f"{plan.scene}: {clock.clock} {clock.reached_mhz} of {clock.wanted_mhz} MHz wanted")
    print(f"bitstream: {folder / BOARDS[result.board].bitstream}", flush=True)


def pixels(words: Sequence[str]) -> None:
    """Write the file of several pixels a clock, after each core."""
    check_tools()
    plan = make_plan(load_scene(many_pixels.SCENE))
    for number in PIXELS_PER_CLOCK:
        placements = many_pixels.load_placed() if many_pixels.FILE.exists() else {}
        if (str(number) not in words) if words else (number in placements):
            continue
        placed = place_core(
            many_pixels.scene_core(plan, number),
            behind_few_pins=number > many_pixels.WITH_PINS,
            speed_grade=many_pixels.GRADE,
            device=many_pixels.DEVICE,
            package=many_pixels.package(number),
        )
        say(f"{number} pixels a clock", placed)
        many_pixels.save_placed({**placements, number: placed})


def spread(words: Sequence[str]) -> None:
    """Write the file of repeated placements: a device, then numbers of pixels a clock."""
    check_tools()
    if not words or not all(word.isdecimal() for word in words[1:]):
        raise InputError("give a device, then numbers of pixels a clock")
    device, *numbers = words
    for number in numbers:
        with tempfile.TemporaryDirectory() as folder:
            for fmax in many_pixels.place_again(device, int(number), Path(folder)):
                print(f"{device}, {number} pixels a clock: {fmax} MHz", flush=True)


def nets(names: Sequence[str]) -> None:
    """Write the file of row filters with different broadcast nets, after each filter."""
    check_tools()
    for row in systolic.row_filters():
        placements = systolic.load_placed()
        if row.name in placements and row.name not in names:
            continue
        with tempfile.TemporaryDirectory() as folder:
            sources = [*hdl.hdl_sources(), systolic.SOURCE]
            netlist = make_netlist(sources, systolic.TOP, row.generics(), Path(folder))
            placed = place(netlist)
        say(row.name, placed)
        systolic.save_placed({**placements, row.name: placed})


def energies(words: Sequence[str]) -> None:
    """Send pictures through the netlists of `plenofir_studies.energy` that were not measured."""
    records = {} if "anew" in words else energy.load_measured()
    energy.measure_missing(records)


COMMANDS = {
    "figures": figures,
    "compare": compare,
    "drawn": drawn,
    "devices": devices,
    "families": families,
    "place": place_all,
    "full": place_full,
    "nets": nets,
    "pixels": pixels,
    "spread": spread,
    "fit": fit,
    "energy": energies,
}


def main() -> int:
    """Run a command, errors in one line."""
    if len(sys.argv) < 2 or sys.argv[1] not in COMMANDS:
        print(__doc__, file=sys.stderr)
        return EXIT_BAD_INPUT
    try:
        COMMANDS[sys.argv[1]](sys.argv[2:])
    except (InputError, ToolError) as error:
        print(f"resources: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT if isinstance(error, InputError) else EXIT_TOOL_FAILED
    return 0


if __name__ == "__main__":
    sys.exit(main())
