# SPDX-License-Identifier: Apache-2.0
"""The designs whose synthesis is kept watch of, and the file with their figures.

``data/figures.json`` holds, for each version of GHDL, what Yosys makes of each design. Tests
synthesise them anew and want the very same counts, so that a change that costs area shows in
review.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.engine import Generics
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.devices import DEVICES, Usage
from plenofir.fpga.screen.board_screen import Screen
from plenofir.fpga.screen.picture_estimate import overlay_usage, picture_usage
from plenofir.fpga.synthesis.parts import left_out_in_turn
from plenofir.fpga.synthesis.records import save_records
from plenofir.fpga.synthesis.spartan6 import Figures, Netlist, synthesise
from plenofir.ground import project
from plenofir.plan.configure import configure, top_of
from plenofir.plan.left_out import full_core
from plenofir.plan.planned import Plan
from plenofir.plan.planner import make_plan
from plenofir.plan.scene import load_scene, scene_files
from plenofir.plan.scene_screen import scene_overlay, slice_colours
from plenofir.plan.sensor.resampler import ResamplerConfiguration
from plenofir.plan.sensor.sensor_bench import CORE as SENSOR
from plenofir.plan.sensor.sensor_bench import sensor_generics
from plenofir.plan.sensor.sensor_estimate import sensor_usage
from plenofir.refocus.arithmetic import StoredProductArithmetic
from plenofir.refocus.sharpness import confidence_level

FILE = project.DATA / "figures.json"
CORE = "raster_refocuser"
ARRAY = "fir_array"
# GHDL 2.0 needs some kilobytes for each word of a memory: 20 GB for 24 Mbit.
_MAX_LINE_BUFFER_BITS = 1 << 23


@dataclass(frozen=True)
class Design:
    """Something to synthesise."""

    name: str  # in the file of figures
    built: CoreConfiguration | None = None  # None: no core is part of it
    top: str = CORE  # entity, if it is not a scene's
    generics: Generics | None = None  # None: those of the core
    plan: Plan | None = None  # of the scene that it is
    slow: bool = True  # its synthesis takes a minute or more
    index: DepthIndexConfiguration | None = None  # if it is a depth index
    usage: Usage | None = None  # the estimate, if it is not that of a core

    @property
    def core(self) -> CoreConfiguration:
        """The core; asked of designs that have one."""
        assert self.built is not None, self.name
        return self.built

    def synthesise(self, directory: Path) -> Netlist:
        """Synthesise it for Spartan-6 in an empty folder."""
        if self.plan is not None:
            sources = configure(self.plan, directory)
            board = self.plan.path == "video"
            return synthesise(sources, self.top, {}, directory, board=board)
        generics = self.core.generics() if self.generics is None else self.generics
        return synthesise(hdl.hdl_sources(), self.top, generics, directory)


def scene_design(plan: Plan) -> Design:
    # Boards, cores of several pixels a clock and sensors take a minute and more.
    core = plan.core
    many = core.parallel_rows > 1 or core.pixels_per_clock > 1
    slow = plan.path == "video" or many or plan.sensor is not None
    return Design(plan.scene, plan.core, top_of(plan), plan=plan, slow=slow)


def scene_designs() -> Iterator[Design]:
    """Design of each shipped scene: a core, or the whole board.

    Boards with an ECP5 are not among them: their builds are in ``data/boards.json``.
    """
    for file in scene_files():
        plan = make_plan(load_scene(file))
        if not is_ecp5_board(plan):
            yield scene_design(plan)


def is_ecp5_board(plan: Plan) -> bool:
    """Whether nextpnr makes a scene's bitstream; then it has no netlist for Spartan-6."""
    return plan.path == "video" and DEVICES[plan.device].family == "ecp5"


def core_designs() -> Iterator[Design]:
    """Core of each shipped scene without a sensor, without the video path around it ("core")."""
    for design in scene_designs():
        plan = design.plan
        assert plan is not None
        if plan.sensor is not None:
            continue
        if plan.path == "core":
            yield design
        else:
            core = scene_design(plan.model_copy(update={"path": "core"}))
            yield replace(core, name=f"{plan.scene} core")


def full_designs() -> Iterator[Design]:
    """Full build ("full") of those cores whose line buffers GHDL can synthesise."""
    for design in core_designs():
        full = full_core(design.core)
        if full.line_buffer_bits <= _MAX_LINE_BUFFER_BITS:
            yield Design(f"{design.name.removesuffix(' core')} full", full)


def _core(m: int, shifts: tuple[int, ...], **fields: object) -> CoreConfiguration:
    """A core of 640 columns, of grey pixels unless `fields` say something else."""
    values = {"micro_image_size": m, "shifts": shifts, "max_columns": 640, **fields}
    return CoreConfiguration.model_validate(values)


# Cores and arrays by M, a' and rows at once; those that are synthesised in each run of the tests.
_CORES = (
    *((1, 0, 1), (2, 1, 1), (3, -2, 1), (3, 0, 1), (3, 1, 1), (3, 2, 1), (5, -3, 1), (5, 1, 1)),
    *((5, 2, 1), (11, 1, 1), (3, 1, 3)),
)
_ARRAYS = ((3, 1, 1), (3, 1, 3), (5, 1, 5))
_QUICK = ("core M=3 a'=1 iota=1", "core M=11 a'=1 iota=1", "array M=3 a'=1 iota=3")
# What a core of M = 5, a' = 2 has besides.
_VARIANTS: dict[str, tuple[tuple[int, ...], dict[str, object]]] = {
    "a'=2 stored products": ((2,), {"arithmetic": StoredProductArithmetic()}),
    "a'=2 linear interpolation": ((2,), {"order": 1}),
    "a'=-5,0,5": ((-5, 0, 5), {}),
    "a'=-5,0,5 hold": ((-5, 0, 5), {"engine": FirEngine(hold=True)}),
    "a'=2 RGB": ((2,), {"channels": 3}),
    "a'=2 16 bit": ((2,), {"pixel_bits": 16}),
    "a'=2 latches of 4 taps": ((2,), {"engine": FirEngine(broadcast_taps=4)}),
}


def grid_designs() -> Iterator[Design]:
    """Cores and arrays for grey pixels and 640 columns, and variants of one of them."""
    for kind, top, sizes in (("core", CORE, _CORES), ("array", ARRAY, _ARRAYS)):
        for m, shift, rows in sizes:
            core = _core(m, (shift,), engine=FirEngine(parallel_rows=rows))
            name = f"{kind} M={m} a'={shift} iota={rows}"
            yield Design(name, core, top, slow=name not in _QUICK)
    for what, (shifts, fields) in _VARIANTS.items():
        yield Design(f"core M=5 {what}", _core(5, shifts, **fields))


# Slices of the stacks: from two on with the same ends, so that delay and shared memory are equal.
STACK_SLICES = {
    5: ((-3,), (-3, 3), (-3, 0, 3), (-3, -1, 1, 3)),
    11: ((-5,), (-5, 5), (-5, 0, 5), (-5, -2, 2, 5)),
}
_COLOURS = {1: "grey", 3: "RGB"}


def stack_designs() -> Iterator[Design]:
    """Focal stacks of 1 to 4 slices for 640 columns, and depth indices behind them."""
    few, many = STACK_SLICES[5][0], STACK_SLICES[5][2]
    stacks = [(m, shifts, 1) for m, sets in STACK_SLICES.items() for shifts in sets]
    for m, shifts, channels in (*stacks, (5, few, 3), (5, many, 3)):
        core = _core(m, shifts, channels=channels, engine=StackEngine())
        shown = ",".join(map(str, shifts))
        yield Design(f"stack M={m} a'={shown} {_COLOURS[channels]}", core, "focal_stack")
    for slices, channels in ((len(few), 1), (len(many), 1), (len(many), 3)):
        index = DepthIndexConfiguration(
            micro_image_size=5, slices=slices, max_columns=640, channels=channels
        )
        name = f"index M=5 slices={slices} {_COLOURS[channels]}"
        yield Design(name, None, "depth_index", index.generics(), index=index)


# Video cores that show depth: M, a', radius, radius of votes.
_PICTURES = ((3, (-1, 2), 0, 0), (5, (-3, 0, 3), 1, 0), (3, (-2, -1, 0, 1, 2), 1, 1))
_TEXT_SHIFTS = (0, 1, 2, 3, 4)


def picture_designs() -> Iterator[Design]:
    """Cores of video paths that show all in focus and depth, of 640 columns; a text over them."""
    for m, shifts, radius, vote_radius in _PICTURES:
        core = _core(m, shifts, channels=3, engine=StackEngine(input_lines=m))
        screen = Screen(
            outputs="rad",
            radius=radius,
            confidence=confidence_level(6, m, radius, 3) if vote_radius else 0,
            vote_radius=vote_radius,
            colours=slice_colours(shifts),
        )
        name = f"picture M={m} slices={len(shifts)} radius={radius} votes={vote_radius}"
        generics, usage = screen.core_generics(core), picture_usage(core, screen)
        yield Design(name, core, "picture_core", generics, usage=usage)
    text = scene_overlay(_TEXT_SHIFTS, 5, colours=slice_colours(_TEXT_SHIFTS))
    name, generics = "text of 5 slices", text.generics()
    yield Design(name, None, "text_overlay", {**generics}, usage=overlay_usage(text))


# What differs from a resampler for grey pixels, M = 5, 640 columns, 8 lines.
_SENSORS: dict[str, dict[str, object]] = {
    "grey": {},
    "grey, M = 13, 860 columns, 16 lines": {
        "micro_image_size": 13,
        "max_columns": 860,
        "lines": 16,
    },
    "RGB": {"channels": 3},
    "Bayer mosaic": {"channels": 3},
    "hexagonal": {"hexagonal": True},
    "4000 lenses moved": {"moves": True, "lenses": 4000},
    "4000 lenses with gains": {"gains": True, "lenses": 4000},
}


def sensor_designs() -> Iterator[Design]:
    """Resamplers, one of them behind a mosaic."""
    for what, fields in _SENSORS.items():
        values = {"micro_image_size": 5, "max_columns": 640, "lines": 8, **fields}
        core, mosaic = ResamplerConfiguration.model_validate(values), "mosaic" in what
        generics, usage = sensor_generics(core, mosaic=mosaic), sensor_usage(core, mosaic=mosaic)
        yield Design(f"sensor, {what}", None, SENSOR, generics, usage=usage)


def designs() -> list[Design]:
    return [
        *{design.name: design for design in [*scene_designs(), *core_designs()]}.values(),
        *grid_designs(),
        # Full build of a small core, and the same without one thing after the other.
        *(Design(f"left out: {what}", core) for what, core in left_out_in_turn()),
        *stack_designs(),
        *picture_designs(),
        *sensor_designs(),
        *full_designs(),
    ]


class FiguresFile(BaseModel):
    """Content of the file of figures."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    yosys: str  # version that made them
    figures: dict[str, dict[str, Figures]]  # version of GHDL to the name of a design to its figures


def load_figures() -> FiguresFile:
    """Read the file of figures."""
    return FiguresFile.model_validate(json.loads(FILE.read_text()))


def save_figures(content: FiguresFile) -> None:
    """Write the file of figures, a design a line."""
    figures = dict(sorted(content.model_dump()["figures"].items()))
    save_records(FILE, {"yosys": content.yosys, "figures": figures}, levels=3)
