# SPDX-License-Identifier: Apache-2.0
"""Project files of a scene: constants, a top level with its core, and lists for tools."""

import os
from collections.abc import Collection, Sequence
from pathlib import Path

from plenofir.fpga import hdl
from plenofir.fpga.bitstream import gowin, ise, nextpnr, top_level
from plenofir.fpga.boards import Board, board_of
from plenofir.fpga.constraints import Constraints, crossings_of
from plenofir.fpga.hdl_text import used_components, used_units
from plenofir.fpga.hdmi.edid import EDID_PACKAGE, edid_package
from plenofir.fpga.hdmi.modes import find_mode, range_limits
from plenofir.fpga.screen.board_screen import SCREEN_PACKAGE, Screen, screen_package
from plenofir.fpga.screen.chip_light_field import STORED_PACKAGE, stored_package
from plenofir.ground.errors import InputError
from plenofir.ground.files import publish
from plenofir.plan.plan import Plan
from plenofir.plan.scene_top import PACKAGE, TOP, package_text, top_text
from plenofir.plan.sensor.board_camera import CAMERA_PACKAGE, camera_package
from plenofir.plan.sensor.board_load import load_lines
from plenofir.plan.sensor.board_sensor import (
    CAMERA_LATE_LINES,
    SENSOR_OUTPUTS,
    SENSOR_PACKAGE,
    sensor_package,
)
from plenofir.plan.sensor.calibration_loader import LOADER, loader_text
from plenofir.plan.sensor.resampler import Load
from plenofir.plan.verilog import verilog_files

CALIBRATION = "calibration.txt"
# The boards' control runs at this clock, the fastest that data cross from or to.
_CONTROL_MHZ = 100.0


def needed_sources(
    top: str, entity: str, sources: Sequence[Path], left_out: Collection[str] = ()
) -> list[Path]:
    """The sources that an entity needs, in order of analysis.

    `left_out` are components that it does not build, so that no file of them is needed.

    `top` is VHDL that instantiates entities and uses packages. `sources` are in order of analysis,
    one unit a file, named as the unit.
    """
    by_name = {source.stem: source for source in sources}
    needed: set[str] = set()
    waiting = [top]
    while waiting:
        text = waiting.pop()
        for name in used_units(text) | used_components(text).difference(left_out):
            if name in by_name and name not in needed and name != entity:
                needed.add(name)
                waiting.append(by_name[name].read_text(encoding="utf-8"))
    return [source for source in sources if source.stem in needed]


def place_from(source: Path, folder: Path) -> str:
    """Path of a source from a folder, for lists that tools read: with slashes on every system."""
    try:
        return Path(os.path.relpath(source, folder)).as_posix()
    except ValueError:
        # Windows has no path from one drive to another.
        return source.resolve().as_posix()


def top_of(plan: Plan) -> str:
    """Top level of a scene: the board's, or one of the scene's own."""
    if plan.path == "core":
        return TOP
    board = _board(plan)
    return board.top if board.camera is None or plan.path == "video" else board.camera.top


def _board(plan: Plan) -> Board:
    board = board_of(plan.device)
    assert board is not None
    return board


def clock_range_of(plan: Plan) -> int:
    """Range of pixel clocks that the board of a scene with video in and out is built for."""
    assert plan.clock_mhz is not None
    size = plan if plan.sensor is None else plan.sensor
    mode = find_mode(size.columns, size.rows, 1e6 * plan.clock_mhz / plan.frame_clocks)
    assert mode is not None
    return _board(plan).clock_range(mode)


def refuse_board(plan: Plan, *, vivado: bool = False) -> None:
    """InputError for a scene of a whole board; `vivado`: but for one that Vivado builds."""
    if plan.path != "core" and not (vivado and _board(plan).flow == "vivado"):
        raise InputError(
            f"{plan.scene} is for a board; make bitstream builds it. For the core alone take "
            "--device with another device",
            where=plan.scene,
        )


def configure(
    plan: Plan, out: Path, *, verilog: bool = False, loads: Sequence[Load] | None = None
) -> list[Path]:
    """Write the project files of a scene: all of them or none.

    `verilog` writes it in Verilog, too (`plenofir.plan.verilog.verilog_files`); `loads` are a
    calibration's words for the serial port, written as `CALIBRATION`. Returns the VHDL sources in
    order of analysis, those in the folder included.
    """
    top = top_of(plan)
    written = _core_top(plan) if plan.path == "core" else _board_top(plan)
    needed = needed_sources(written[f"{top}.vhd"], top, hdl.all_sources(), plan.core.unbuilt)
    # Own files take the place of those that they replace; the others follow.
    sources = [out / path.name if path.name in written else path for path in needed]
    vhdl = (out / name for name in written if name.endswith(".vhd"))
    sources += [path for path in vhdl if path not in sources]
    places = [place_from(source, out) for source in sources]
    lists = {
        "plan.json": plan.model_dump_json(indent=2) + "\n",
        "sources.txt": "".join(f"{place}\n" for place in places),
    }
    if loads is not None:
        lists[CALIBRATION] = "".join(f"{line}\n" for line in load_lines(loads))
    if verilog:
        lists.update(verilog_files(plan, top, written, sources))
    if plan.chip.family != "spartan6":
        publish({**written, **lists}, out)
        return sources
    lists[f"{top}.prj"] = "".join(f'vhdl work "{place}"\n' for place in places)
    publish({**written, **lists}, out)
    # XST needs an existing folder for its temporary files.
    (out / "xst").mkdir(exist_ok=True)
    return sources


def _core_top(plan: Plan) -> dict[str, str]:
    """Package, top level, clock and XST's script of a core.

    For an ECP5 the clock alone; for other families neither, see `plenofir.plan.project_files`.
    """
    part = plan.chip
    constraints = Constraints({"clk": plan.built_mhz})
    vhdl = {f"{PACKAGE}.vhd": package_text(plan)}
    if plan.sensor is not None and plan.sensor.calibrated:
        loads = plan.sensor.loads
        vhdl[f"{LOADER}.vhd"] = loader_text(plan.sensor.core, loads, f"of the scene {plan.scene}")
    vhdl[f"{TOP}.vhd"] = top_text(plan)
    if part.family == "ecp5":
        return {**vhdl, f"{TOP}.lpf": constraints.text("lpf")}
    if part.family != "spartan6":
        return vhdl
    return {
        **vhdl,
        f"{TOP}.ucf": (
            f"# Clock of the scene {plan.scene}: {plan.built_mhz:g} MHz.\n{constraints.text('ucf')}"
        ),
        f"{TOP}.xst": ise.xst_script(TOP, f"{part.name}-{part.grade}-{part.package}"),
    }


def scene_generics(plan: Plan) -> dict[str, top_level.Value]:
    """Generics of the board's top level; with a sensor the longest line is a raw frame's."""
    core, top = plan.core, top_of(plan)
    if plan.camera is not None:
        divide = plan.camera.clock_divide
        generics = {"CLOCK_DIVIDE": divide} if divide else {}
        # Rows of a sensor are in sensor_pkg.
        generics |= {"ROWS": plan.rows} if plan.sensor is None else {}
        return top_level.camera_generics(core, top) | generics
    if plan.sensor is not None:
        # Channels and the raster's line length are in sensor_pkg.
        size = {"channels": 3, "max_columns": plan.sensor.columns}
        core = core.model_copy(update=size)
    return top_level.board_generics(core, top)


def board_packages(plan: Plan) -> dict[str, str]:
    """VHDL packages (name to text) that replace the board's for a scene with video in and out."""
    packages = {}
    if plan.camera is not None:
        packages[CAMERA_PACKAGE] = camera_package(plan.camera.board)
    if plan.edid is not None:
        packages[EDID_PACKAGE] = edid_package(bytes.fromhex(plan.edid))
    if plan.sensor is not None:
        late = 0 if plan.camera is None or plan.sensor.shown is None else CAMERA_LATE_LINES
        packages[SENSOR_PACKAGE] = sensor_package(plan.sensor.board_sensor(late))
        if plan.camera is None:
            packages[SCREEN_PACKAGE] = screen_package(Screen(outputs=SENSOR_OUTPUTS))
    elif plan.screen != Screen():
        packages[SCREEN_PACKAGE] = screen_package(plan.screen)
    if plan.stored is not None:
        packages[STORED_PACKAGE] = stored_package(plan.stored)
    return packages


def _board_top(plan: Plan) -> dict[str, str]:
    """Top level with the scene's generics, its EDID, pins and clocks, XST's script of the board."""
    packages = {f"{name}.vhd": text for name, text in board_packages(plan).items()}
    board = _board(plan)
    generics = scene_generics(plan)
    if plan.camera is not None:
        top = top_of(plan)
        constraints = board.constraints_of(top)
        return {
            **packages,
            f"{top}.vhd": top_level.top_with_generics(generics, top),
            f"{top}{constraints.suffix}": constraints.read_text(encoding="utf-8"),
        }
    if board.own_mode is not None:
        return {
            **packages,
            f"{board.top}.vhd": top_level.top_with_generics(generics, board.top),
            f"{board.top}.cst": board.constraints.read_text(encoding="utf-8"),
            f"{board.top}.sdc": gowin.clock_constraints(board.own_mode),
        }
    if board.flow == "vivado":
        clock_range = clock_range_of(plan)
        generics |= nextpnr.range_generics(clock_range)
        top = top_level.top_with_generics(generics, board.top)
        limits = Constraints(
            {"in_clk_p": range_limits(clock_range)[1] / 1000},
            crossings_of(needed_sources(top, board.top, hdl.all_sources())),
            limit_mhz=_CONTROL_MHZ,
        )
        return {
            **packages,
            f"{board.top}.vhd": top,
            f"{board.top}.xdc": board.constraints.read_text(encoding="utf-8") + limits.text("xdc"),
        }
    if board.flow == "nextpnr":
        clock_range = clock_range_of(plan)
        generics |= nextpnr.range_generics(clock_range)
        fastest_mhz = range_limits(clock_range)[1] / 1000
        return {
            **packages,
            f"{board.top}.vhd": top_level.top_with_generics(generics, board.top),
            f"{board.top}.lpf": board.constraints.read_text(encoding="utf-8")
            + nextpnr.frequencies(board, fastest_mhz),
        }
    return {
        **packages,
        f"{board.top}.vhd": top_level.top_with_generics(generics),
        f"{board.top}.ucf": ise.constraints_file().read_text(encoding="utf-8"),
        f"{board.top}.xst": ise.xst_script(),
    }
