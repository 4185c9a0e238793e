# SPDX-License-Identifier: Apache-2.0
"""The designs that are synthesised and recorded (`plenofir.fpga.resources.record`)."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir.fpga.core.engine import Generics, SliceEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.resources.estimate import Block
from plenofir.fpga.screen.board_screen import Screen
from plenofir.fpga.synthesis.spartan6 import Netlist, synthesise
from plenofir.plan.configure import top_of
from plenofir.plan.loaded_scene import load_scene, scene_files
from plenofir.plan.omissions import full_core
from plenofir.plan.plan import Plan
from plenofir.plan.planner import make_plan, planned_slices
from plenofir.plan.scene_screen import scene_overlay, slice_colours
from plenofir.plan.sensor.resampler import ResamplerConfiguration, SensorLogic
from plenofir.plan.sensor.sensor_bench import CORE as SENSOR
from plenofir.plan.sensor.sensor_bench import sensor_generics
from plenofir.plan.synthesised import (
    core_name,
    core_plan,
    is_nextpnr_board,
    is_stack_core,
    shipped_plans,
    synthesise_plan,
    takes_a_minute,
)
from plenofir.refocus.sharpness import TEXTURE, confidence_level
from plenofir_studies.part_wrapper import TOP, core_call, literal, with_part, wrapped

CORE = "raster_refocuser"
ARRAY = "fir_array"
PICTURE = "picture_core"


@dataclass(frozen=True)
class Design:
    """Something to synthesise."""

    name: str  # in the file of figures
    built: CoreConfiguration | None = None  # None: it contains no core
    top: str = CORE  # entity, unless it is a scene's
    generics: Generics | None = None  # None: those of the core
    plan: Plan | None = None  # of its scene
    slow: bool = True  # its synthesis takes a minute or more
    index: DepthIndexConfiguration | None = None  # only of a depth index
    logic: tuple[Block, ...] = ()  # what is estimated, if not the core
    wrapper: str = ""  # VHDL around `top`, if its generics are records

    @property
    def core(self) -> CoreConfiguration:
        """The core, for designs that have one."""
        assert self.built is not None, self.name
        return self.built

    @property
    def blocks(self) -> tuple[Block, ...]:
        """Blocks for the estimate."""
        return self.logic or self.core.blocks

    def synthesise(self, directory: Path) -> Netlist:
        """Synthesise it for Spartan-6 in an empty folder."""
        if self.plan is not None:
            return synthesise_plan(self.plan, directory)
        if self.wrapper:
            sources = with_part(hdl.hdl_sources(), self.wrapper, directory)
            return synthesise(sources, TOP, {}, directory)
        generics = self.core.generics() if self.generics is None else self.generics
        return synthesise(hdl.hdl_sources(), self.top, generics, directory)


def scene_design(plan: Plan) -> Design:
    return Design(plan.scene, plan.core, top_of(plan), plan=plan, slow=takes_a_minute(plan))


@cache
def scene_designs() -> tuple[Design, ...]:
    """Design of each of the `shipped_plans`."""
    return tuple(map(scene_design, shipped_plans()))


def stack_core_designs() -> Iterator[Design]:
    """Shipped scenes that are cores with all slices at once."""
    for plan in (make_plan(load_scene(file)) for file in scene_files()):
        if is_stack_core(plan):
            yield scene_design(plan)


def core_designs() -> Iterator[Design]:
    """Core of each shipped scene without a sensor, with path "core" instead of its video path."""
    for design in scene_designs():
        plan = design.plan
        assert plan is not None
        if plan.sensor is None:
            yield replace(scene_design(core_plan(plan)), name=core_name(plan))


def full_plan(plan: Plan) -> Plan:
    """The core of a plan as a full build: all slices and channels, no shortcuts."""
    core = full_core(plan.core)
    update = {"path": "core", "core": core, "slices": planned_slices(core, None, Screen())}
    return plan.model_copy(update=update)


def compared_designs() -> Iterator[tuple[Design, Design]]:
    """Core of each shipped scene beside its full build, both without surrounding logic.

    Without scenes with a sensor, or with all slices at once.
    """
    for file in scene_files():
        plan = make_plan(load_scene(file))
        if plan.sensor is not None or not isinstance(plan.core.engine, SliceEngine):
            continue
        name = f"{plan.scene} core" if is_nextpnr_board(plan) else plan.scene
        core, full = plan.model_copy(update={"path": "core"}), full_plan(plan)
        yield (
            Design(name, plan.core, top_of(core), plan=core),
            Design(f"{plan.scene} full", full.core, top_of(full), plan=full),
        )


def grey_core(m: int, shifts: tuple[int, ...], **fields: object) -> CoreConfiguration:
    """A core for grey pixels of 8 bits and 640 columns, apart from `fields`."""
    values = {"micro_image_size": m, "shifts": shifts, "max_columns": 640, **fields}
    return CoreConfiguration.model_validate(values)


def filter_designs() -> Iterator[Design]:
    """Designs that no scene has: linear interpolation, and the array of filters by itself."""
    linear = grey_core(5, (2,), order=1)
    yield Design("core M=5 a'=2 linear interpolation", linear)
    rows = grey_core(3, (1,), engine={"kind": "fir", "parallel_rows": 3})
    wrapper = wrapped(ARRAY, {"CORE": core_call(rows.generics())})
    yield Design("array M=3 a'=1 iota=3", rows, ARRAY, slow=False, wrapper=wrapper)


# Slices of the stacks have the same ends, so that delay and shared memory are equal.
_STACK_SHIFTS = ((-3, 3), (-3, 0, 3))


def stack_designs() -> Iterator[Design]:
    """Focal stacks of two and three slices, and depth indices behind the larger one."""
    for shifts in _STACK_SHIFTS:
        places = ",".join(map(str, shifts))
        core = grey_core(5, shifts, engine=StackEngine())
        yield Design(f"stack M=5 a'={places}", core, "focal_stack")
    index = DepthIndexConfiguration(micro_image_size=5, slices=3, max_columns=640, channels=1)
    yield Design("index M=5 slices=3", None, "depth_index", index.generics(), index=index)
    between = index.model_copy(update={"shifts": _STACK_SHIFTS[1]})
    name = "index M=5 slices=3, between"
    yield Design(name, None, "depth_index", between.generics(), index=between)
    several = index.model_copy(update={"pixels_per_clock": 4})
    name = "index M=5 slices=3, P=4"
    yield Design(name, None, "depth_index", several.generics(), index=several)
    level = confidence_level(TEXTURE, 5, index.radius)
    sharp = index.model_copy(update={"sharp_too": True, "confidence": level})
    name = "index M=5 slices=3, two boxes"
    yield Design(name, None, "depth_index", sharp.generics(), index=sharp)


# The core of which the page on moving sums tells what its parts take, with eight pixels a clock.
LANE_PARTS_CORE = grey_core(
    5, (2,), channels=3, max_columns=1280, engine=MovingSumEngine(pixels_per_clock=8)
)


def lane_part_designs() -> Iterator[Design]:
    """Stages of a core of one and of several pixels a clock, each by itself, and parts of rows."""
    core, engine = LANE_PARTS_CORE, LANE_PARTS_CORE.engine
    assert isinstance(engine, MovingSumEngine)
    m, p, column, row = core.micro_image_size, engine.pixels_per_clock, core.words(0), core.words(1)
    white = (1 << column.data) - 1
    geometry = f'geometry_of("{TOP}", {m}, "{core.shifts[0]}", true)'

    def stage(lanes: int, largest: int, **more: object) -> dict[str, object]:
        sizes = f"exact_pass({largest}, {m})"
        return {"GEOMETRY": geometry, "SIZES": sizes, "LANES": lanes, **more}

    def columns(pixels: int) -> dict[str, object]:
        depth = -(-core.max_columns // pixels)
        return stage(pixels * core.channels, white, COLUMNS=True, DEPTH=depth)

    of_tokens: Generics = {"PIXELS_PER_CLOCK": p, "CHANNELS": core.channels}
    build = f"to_lanes({geometry}, {p}, {core.channels}, {row.data})"
    sums: Generics = {"DIFFERENCE_BITS": row.data + 1, "SUM_BITS": row.sum, "HOLDING": False}
    parts: tuple[tuple[str, str, Mapping[str, object]], ...] = (
        ("P=1 columns", "moving_sum_stage", columns(1)),
        ("P=1 rows", "moving_sum_stage", stage(core.channels, m * white)),
        (f"P={p} columns", "moving_sum_stage", columns(p)),
        (f"P={p} rows", "lane_stage", {"BUILD": build, "SUM_BITS": row.sum}),
        (f"P={p} rows: banks", "pixel_banks", {"BUILD": build}),
    )
    for name, entity, values in parts:
        yield Design(name, None, entity, wrapper=wrapped(entity, values))
    yield Design(f"P={p} rows: prefix sums", None, "prefix_sums", of_tokens | sums)


_TEXT_SHIFTS = (0, 1, 2, 3, 4)


def picture_designs() -> Iterator[Design]:
    """The core of a video path that shows all in focus and depth; text over the picture."""
    shifts = _STACK_SHIFTS[1]
    core = grey_core(5, shifts, channels=3, engine=StackEngine(input_lines=5))
    screen = Screen(outputs="rad", radius=1, colours=slice_colours(shifts))
    stack, values_shown = core.generics(), screen.generics()
    sizes = {name: stack[name] for name in ("MICRO_IMAGE_SIZE", "SHIFTS", "MAX_COLUMNS")}
    judged = {name: value for name, value in values_shown.items() if name != "CONFIDENCE"}
    call = core_call(sizes | judged, of="work.picture_pkg.picture_core_of")
    values = {"CORE": call} | {name: literal(value) for name, value in values_shown.items()}
    wrapper, logic = wrapped(PICTURE, values), screen.blocks(core)
    yield Design("picture M=5 slices=3", core, PICTURE, logic=logic, wrapper=wrapper)
    text = scene_overlay(_TEXT_SHIFTS, 5, colours=slice_colours(_TEXT_SHIFTS))
    generics = {**text.generics()}
    yield Design("text of 5 slices", None, "text_overlay", generics, logic=text.blocks)


# Differences from a resampler for grey pixels, M = 5, 640 columns, 8 lines.
SENSORS: dict[str, dict[str, object]] = {
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
    "focused camera, M = 35, 1200 columns, 18 lines": {
        "micro_image_size": 35,
        "max_columns": 1200,
        "lines": 18,
        "gains": True,
        "lenses": 1500,
        "skewed": True,
    },
}


def sensor_design(name: str) -> Design:
    """A resampler of `SENSORS`, behind a mosaic if it has one."""
    values = {"micro_image_size": 5, "max_columns": 640, "lines": 8, **SENSORS[name]}
    core, mosaic = ResamplerConfiguration.model_validate(values), "mosaic" in name
    generics, logic = sensor_generics(core, mosaic=mosaic), SensorLogic(core, mosaic).blocks
    return Design(f"sensor, {name}", None, SENSOR, generics, logic=logic)


# The second board differs from the first only by its core, which is already listed.
_NOT_RECORDED = ("rgb-720p",)
_FULL = "grey-microscope"


def full_design() -> Design:
    """A core beside its scene's: one that serves any scene of the camera."""
    scene = next(design for design in core_designs() if design.name == _FULL)
    return Design(f"{_FULL} full", full_core(scene.core))


def designs() -> list[Design]:
    """The recorded designs: each entity that a user instantiates, each engine, each option."""
    scenes = {design.name: design for design in [*scene_designs(), *core_designs()]}
    return [
        *(design for name, design in scenes.items() if name not in _NOT_RECORDED),
        full_design(),
        *filter_designs(),
        *stack_designs(),
        *lane_part_designs(),
        *picture_designs(),
        sensor_design("grey"),
        sensor_design("focused camera, M = 35, 1200 columns, 18 lines"),
    ]
