# SPDX-License-Identifier: Apache-2.0
"""Places and routes for ECP5 and prints clock and resources: python scripts/place.py [scene.toml].

A scene of a board with an ECP5: its bitstream, whose figures go into data/boards.json.

Without a scene: all shipped scenes, cores and arrays, whose results go into data/ecp5.json and with
`make docs` into docs/resources.md, and the self-test of the ULX3S board, whose bitstream goes to
build/pnr/.
"""

import json
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from plenofir import project
from plenofir.errors import EXIT_BAD_INPUT, EXIT_TOOL_FAILED, InputError, ToolError
from plenofir.files import publish_files
from plenofir.fpga import hdl
from plenofir.fpga.bitstream.nextpnr import build, load_builds, save_builds
from plenofir.fpga.bitstream.top_level import board_generics
from plenofir.fpga.boards import board_of
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.synthesis.ecp5 import (
    NAMES,
    Placed,
    check_tools,
    make_netlist,
    place,
    write_bitstream,
)
from plenofir.fpga.synthesis.self_test import TOP as SELF_TEST
from plenofir.fpga.synthesis.self_test import self_test_generics
from plenofir.plan.configure import board_packages, clock_range_of
from plenofir.plan.figures import Design, core_designs, grid_designs, is_ecp5_board
from plenofir.plan.planned import Plan
from plenofir.plan.planner import make_plan
from plenofir.plan.scene import load_scene, scene_files
from plenofir.plan.scene_top import TOP

RESULTS = project.DATA / "ecp5.json"
GRID = ("core M=1 a'=0 iota=1", "core M=3 a'=1 iota=1", "array M=3 a'=1 iota=1")
ARRAYS = ("array M=3 a'=1 iota=3",)
BOARD_CORE = CoreConfiguration(micro_image_size=5, shifts=(-3,), max_columns=640, channels=3)
BOARD_ROWS = 480


def place_design(design: Design, folder: Path) -> dict[int, Placed]:
    """Place a design for both speed grades."""
    if design.plan is not None:
        from plenofir.plan.configure import configure

        netlist = make_netlist(configure(design.plan, folder), TOP, {}, folder)
    else:
        netlist = make_netlist(hdl.hdl_sources(), design.top, design.core.generics(), folder)
    # A scene for a Spartan-6 goes where it fits.
    name = "" if design.plan is None else design.plan.device
    device = NAMES.get(name)
    return {grade: place(netlist, speed_grade=grade, device=device) for grade in (6, 8)}


def place_board(out: Path) -> Placed:
    """Make the bitstream of the ULX3S self-test."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        netlist = make_netlist(
            hdl.hdl_sources(), SELF_TEST, self_test_generics(BOARD_CORE, BOARD_ROWS), folder
        )
        constraints = project.root() / "constraints" / "ulx3s_self_test.lpf"
        placed = place(netlist, constraints=constraints, goal_mhz=25)
        write_bitstream(folder / f"{netlist.stem}.config")
        publish_files(folder, out)
    return placed


def save(results: dict[str, dict[str, object]]) -> None:
    """Write the results, a design a line."""
    lines = [f"  {json.dumps(name)}: {json.dumps(value)}" for name, value in results.items()]
    RESULTS.write_text("{\n" + ",\n".join(lines) + "\n}\n")


def say(name: str, placed: Placed) -> None:
    """Print a result."""
    print(
        f"{name}: {placed.fmax_mhz} MHz (ECP5 {placed.device}, grade {placed.speed_grade}), "
        f"{placed.lut} LUT4, {placed.flip_flops} flip-flops, {placed.block_rams} DP16KD, "
        f"{placed.multipliers} MULT18X18D",
        flush=True,
    )


def run(arguments: list[str]) -> None:
    """Place what the arguments ask for."""
    check_tools()
    if arguments:
        plan = make_plan(load_scene(arguments[0]))
        if is_ecp5_board(plan):
            record_build(plan)
            return
        # The board's TMDS ends are Spartan-6 primitives: what can be placed here is the core.
        plan = plan.model_copy(update={"path": "core"})
        chosen = [Design(plan.scene, plan.core, TOP, plan)]
    else:
        chosen = [replace(d, name=d.name.removesuffix(" core")) for d in core_designs()]
        chosen += [design for design in grid_designs() if design.name in GRID + ARRAYS]
    results: dict[str, dict[str, object]] = {}
    for design in chosen:
        with tempfile.TemporaryDirectory() as folder:
            placed = place_design(design, Path(folder))
        for result in placed.values():
            say(design.name, result)
        results[design.name] = {str(g): result.model_dump() for g, result in placed.items()}
        if not arguments:
            save(results)
    if not arguments:
        out = project.root() / "build" / "pnr"
        board = place_board(out)
        say("ulx3s self-test", board)
        print(f"bitstream: {out / SELF_TEST}.bit")
        results["ulx3s self-test"] = {"6": board.model_dump()}
        save(results)
        save_builds({})
        for plan in (make_plan(load_scene(file)) for file in scene_files()):
            if is_ecp5_board(plan):
                record_build(plan)


def record_build(plan: Plan) -> None:
    """Make the bitstream of a board with an ECP5 and record its figures."""
    board = board_of(plan.device)
    assert board is not None
    folder = project.root() / "build" / "pnr" / plan.scene
    generics = board_generics(plan.core, board.top)
    result = build(
        *(board, plan.device, generics, clock_range_of(plan), folder, lambda *_: None),
        board_packages(plan),
    )
    save_builds(dict(sorted({**load_builds(), plan.scene: result}.items())))
    for clock in result.timing:
        print(f"{plan.scene}: {clock.clock} {clock.reached_mhz} of {clock.wanted_mhz} MHz wanted")
    print(f"bitstream: {folder / 'plenofir.bit'}", flush=True)


def main() -> int:
    """Run, errors in one line."""
    try:
        run(sys.argv[1:])
    except InputError as error:
        print(f"place: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except ToolError as error:
        print(f"place: {error}", file=sys.stderr)
        return EXIT_TOOL_FAILED
    return 0


if __name__ == "__main__":
    sys.exit(main())
