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

from plenofir import project
from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.screen.board_screen import Screen
from plenofir.fpga.synthesis.parts import left_out_in_turn
from plenofir.fpga.synthesis.spartan6 import Figures, Netlist, synthesise
from plenofir.plan.configure import configure, top_of
from plenofir.plan.left_out import full_core
from plenofir.plan.planned import Plan
from plenofir.plan.planner import make_plan
from plenofir.plan.scene import load_scene, scene_files
from plenofir.plan.scene_screen import scene_overlay, slice_colours
from plenofir.plan.sensor.resampler import ResamplerConfiguration
from plenofir.plan.sensor.sensor_bench import sensor_generics
from plenofir.refocus.arithmetic import StoredProductArithmetic
from plenofir.refocus.sharpness import confidence_level

FILE = project.DATA / "figures.json"
CORE = "raster_refocuser"
ARRAY = "fir_array"
STACK = "focal_stack"
INDEX = "depth_index"
PICTURE = "picture_core"
OVERLAY = "text_overlay"
SENSOR = "sensor_raster"
# GHDL 2.0 needs some kilobytes for each word of a memory: 20 GB for 24 Mbit.
_MAX_LINE_BUFFER_BITS = 1 << 23


@dataclass(frozen=True)
class Design:
    """Something to synthesise."""

    name: str  # in the file of figures
    core: CoreConfiguration
    top: str = CORE  # entity, if it is not a scene's
    plan: Plan | None = None  # of the scene that it is
    slow: bool = False  # its synthesis takes minutes
    # The depth index behind a stack to synthesise, or None.
    index: DepthIndexConfiguration | None = None
    # The resampler in front of a core to synthesise, or None.
    sensor: ResamplerConfiguration | None = None
    mosaic: bool = False  # the resampler is behind a mosaic
    screen: Screen | None = None  # of a video path whose core or text is to synthesise, or None

    def synthesise(self, directory: Path) -> Netlist:
        """Synthesise it for Spartan-6 in an empty folder."""
        if self.plan is not None:
            sources = configure(self.plan, directory)
            board = self.plan.path == "video"
            return synthesise(sources, self.top, {}, directory, board=board)
        generics = self.core.generics() if self.index is None else self.index.generics()
        if self.sensor is not None:
            generics = sensor_generics(self.sensor, mosaic=self.mosaic)
        if self.screen is not None:
            text = self.screen.overlay
            generics = text.generics() if text else self.screen.core_generics(self.core)
        return synthesise(hdl.hdl_sources(), self.top, generics, directory)


def scene_design(plan: Plan) -> Design:
    # Boards, cores of several pixels a clock and sensors take a minute and more.
    core = plan.core
    many = core.parallel_rows > 1 or core.pixels_per_clock > 1
    slow = plan.path == "video" or many or plan.sensor is not None
    return Design(plan.scene, plan.core, top_of(plan), plan, slow=slow)


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
        core = full_core(design.core)
        if core.line_buffer_bits <= _MAX_LINE_BUFFER_BITS:
            name = design.name.removesuffix(" core")
            yield Design(f"{name} full", core, slow=True)


def _grid(top: str, m: int, shift: int, rows: int, *, slow: bool = False) -> Design:
    core = CoreConfiguration(
        micro_image_size=m,
        shifts=(shift,),
        max_columns=640,
        engine=FirEngine(parallel_rows=rows),
    )
    kind = "array" if top == ARRAY else "core"
    return Design(f"{kind} M={m} a'={shift} iota={rows}", core, top, slow=slow)


def _variant(name: str, **generics: object) -> Design:
    values = {"micro_image_size": 5, "shifts": (2,), "max_columns": 640, **generics}
    return Design(name, CoreConfiguration.model_validate(values), slow=True)


def grid_designs() -> Iterator[Design]:
    """Cores and arrays for grey pixels and 640 columns, and variants of one of them."""
    yield _grid(CORE, 1, 0, 1, slow=True)
    yield _grid(CORE, 2, 1, 1, slow=True)
    for shift in (-2, 0, 1, 2):
        yield _grid(CORE, 3, shift, 1, slow=shift != 1)
    for shift in (-3, 1, 2):
        yield _grid(CORE, 5, shift, 1, slow=True)
    yield _grid(CORE, 11, 1, 1)
    yield _grid(CORE, 3, 1, 3, slow=True)
    yield _grid(ARRAY, 3, 1, 1, slow=True)
    yield _grid(ARRAY, 3, 1, 3)
    yield _grid(ARRAY, 5, 1, 5, slow=True)
    stored = StoredProductArithmetic()
    yield _variant("core M=5 a'=2 stored products", arithmetic=stored)
    yield _variant("core M=5 a'=2 linear interpolation", order=1)
    yield _variant("core M=5 a'=-5,0,5", shifts=(-5, 0, 5))
    yield _variant("core M=5 a'=-5,0,5 hold", shifts=(-5, 0, 5), engine=FirEngine(hold=True))
    yield _variant("core M=5 a'=2 RGB", channels=3)
    yield _variant("core M=5 a'=2 16 bit", pixel_bits=16)
    yield _variant("core M=5 a'=2 latches of 4 taps", engine=FirEngine(broadcast_taps=4))


def left_out_designs() -> Iterator[Design]:
    """Full build of a small core, and the same without one thing after the other."""
    for what, core in left_out_in_turn():
        yield Design(f"left out: {what}", core, slow=True)


# Slices of the stacks: from two on with the same ends, so that delay and shared memory are equal.
STACK_SLICES = {
    5: ((-3,), (-3, 3), (-3, 0, 3), (-3, -1, 1, 3)),
    11: ((-5,), (-5, 5), (-5, 0, 5), (-5, -2, 2, 5)),
}


def _stack(shifts: tuple[int, ...], m: int, channels: int, *, index: bool = False) -> Design:
    core = CoreConfiguration(
        micro_image_size=m,
        shifts=shifts,
        max_columns=640,
        channels=channels,
        engine=StackEngine(),
    )
    kind = "grey" if channels == 1 else "RGB"
    if not index:
        shown = ",".join(str(shift) for shift in shifts)
        return Design(f"stack M={m} a'={shown} {kind}", core, STACK, slow=True)
    judged = DepthIndexConfiguration(
        micro_image_size=m, slices=len(shifts), max_columns=640, channels=channels
    )
    name = f"index M={m} slices={len(shifts)} {kind}"
    return Design(name, core, INDEX, slow=True, index=judged)


def stack_designs() -> Iterator[Design]:
    """Focal stacks of 1 to 4 slices for 640 columns, and depth indices behind them."""
    for m, sets in STACK_SLICES.items():
        for shifts in sets:
            yield _stack(shifts, m, 1)
    few, many = STACK_SLICES[5][0], STACK_SLICES[5][2]
    for shifts in (few, many):
        yield _stack(shifts, 5, 3)
    for shifts, channels in ((few, 1), (many, 1), (many, 3)):
        yield _stack(shifts, 5, channels, index=True)


# Video cores that show depth: M, a', radius, radius of votes.
_PICTURES = ((3, (-1, 2), 0, 0), (5, (-3, 0, 3), 1, 0), (3, (-2, -1, 0, 1, 2), 1, 1))
_TEXT_SHIFTS = (0, 1, 2, 3, 4)


def picture_designs() -> Iterator[Design]:
    """Cores of video paths that show all in focus and depth, of 640 columns; a text over them."""
    for m, shifts, radius, vote_radius in _PICTURES:
        core = CoreConfiguration(
            micro_image_size=m,
            shifts=shifts,
            max_columns=640,
            channels=3,
            engine=StackEngine(input_lines=m),
        )
        screen = Screen(
            outputs="rad",
            radius=radius,
            confidence=confidence_level(6, m, radius, 3) if vote_radius else 0,
            vote_radius=vote_radius,
            colours=slice_colours(shifts),
        )
        name = f"picture M={m} slices={len(shifts)} radius={radius} votes={vote_radius}"
        yield Design(name, core, PICTURE, slow=True, screen=screen)
    colours = slice_colours(_TEXT_SHIFTS)
    text = scene_overlay(_TEXT_SHIFTS, 5, colours=colours)
    none = CoreConfiguration(micro_image_size=1, shifts=(0,), max_columns=1)
    yield Design("text of 5 slices", none, OVERLAY, slow=True, screen=Screen(overlay=text))


# Generics that differ from a resampler for grey pixels, M = 5, 640 columns, 8 lines.
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
    none = CoreConfiguration(micro_image_size=1, shifts=(0,), max_columns=1)
    for what, generics in _SENSORS.items():
        values = {"micro_image_size": 5, "max_columns": 640, "lines": 8, **generics}
        core = ResamplerConfiguration.model_validate(values)
        name, mosaic = f"sensor, {what}", "mosaic" in what
        yield Design(name, none, SENSOR, slow=True, sensor=core, mosaic=mosaic)


def designs() -> list[Design]:
    scenes = {design.name: design for design in [*scene_designs(), *core_designs()]}
    return [
        *scenes.values(),
        *grid_designs(),
        *left_out_designs(),
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
    parts = []
    for version, figures in sorted(content.figures.items()):
        lines = [
            f"      {json.dumps(name)}: {json.dumps(values.model_dump())}"
            for name, values in figures.items()
        ]
        parts.append(f"    {json.dumps(version)}: {{\n" + ",\n".join(lines) + "\n    }")
    body = ",\n".join(parts)
    FILE.write_text(
        f'{{\n  "yosys": {json.dumps(content.yosys)},\n  "figures": {{\n{body}\n  }}\n}}\n'
    )
