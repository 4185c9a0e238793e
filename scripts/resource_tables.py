# SPDX-License-Identifier: Apache-2.0
"""Tables of designs' resources and clocks, for `build_docs.py`."""

import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import product
from pathlib import Path

from device_tables import device_table, plan_on, scene_names
from netlist_parts import PARTS, left_out_in_turn, needed_parts
from plenofir.fpga import hdl
from plenofir.fpga.bitstream.top_level import TOP as BOARD
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.devices import DEVICES, Usage
from plenofir.fpga.families import FAMILIES
from plenofir.fpga.resources.estimate import VIDEO, estimate
from plenofir.fpga.resources.record import ECP5_FASTEST, ECP5_SLOWEST, Figures, load_record
from plenofir.fpga.sensors import IMX219_MODES
from plenofir.fpga.synthesis.spartan6 import TMDS_ENDS
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import configure
from plenofir.plan.omissions import full_core
from plenofir.plan.placements import recorded_beside_full
from plenofir_studies.engine_cells import (
    ENGINES,
    SETS,
    SIZES,
    Cell,
    lane_cells,
    placed_cells,
    shown_shifts,
    widest,
)
from plenofir_studies.recorded_designs import (
    SENSORS,
    Design,
    core_designs,
    lane_part_designs,
    scene_designs,
    sensor_design,
    stack_designs,
)
from plenofir_studies.records import load_builds
from table_text import put, table

MEMORY_COLUMNS = 1024
MEMORY_CASES: list[tuple[int, tuple[int, ...], int]] = [
    (3, (1,), 3),
    (3, (6,), 3),
    (5, (-3,), 3),
    (5, (9,), 3),
    (5, (10,), 3),
    (5, tuple(range(-5, 11)), 3),
    (7, (7,), 3),
    (11, (3,), 1),
    (11, (11,), 1),
    (11, tuple(range(-11, 12)), 1),
]
FIGURE_HEADS = "LUT | flip-flops | RAMB16 | RAMB8 | block RAM | DSP48A1 | CARRY4 | path"
_KINDS = {1: "grey", 3: "RGB"}
# Devices of the example of a focused camera, and its pitches in pixels.
_FOCUSED_DEVICES = (
    "lfe5u-85f",
    "lifcl-40",
    "xc6slx45",
    "xc7a35t",
    "xc7z020",
    "xczu3eg",
    "5cseba6",
)
_FOCUSED_PITCHES = (23, 35)


def recorded() -> dict[str, Figures]:
    """Yosys's figures of each design for Spartan-6."""
    return load_record().counted["spartan6"]


def all_figures(f: Figures) -> tuple[int, ...]:
    """A design's numbers under `FIGURE_HEADS`."""
    return f.lut, f.flip_flops, f.ramb16, f.ramb8, f.usage.block_rams, f.dsp, f.carry, f.path


def estimated(usage: Usage) -> tuple[object, ...]:
    """An estimate under `FIGURE_HEADS`: block RAM and multipliers are exact."""
    logic = f"~{usage.lut}", f"~{usage.flip_flops}"
    return *logic, usage.ramb16, usage.ramb8, usage.block_rams, usage.dsp, "", ""


def shown_set(shifts: tuple[int, ...]) -> str:
    """A set of a', by its ends."""
    return str(shifts[0]) if len(shifts) == 1 else f"{shifts[0]} to {shifts[-1]}"


def column_memory() -> Iterator[tuple[object, ...]]:
    """Rows of the table of both engines' column memories."""
    for m, shifts, channels in MEMORY_CASES:
        cores = [
            CoreConfiguration(
                micro_image_size=m,
                shifts=shifts,
                max_columns=MEMORY_COLUMNS,
                channels=channels,
                engine=engine,
            )
            for engine in (FirEngine(), MovingSumEngine())
        ]
        taps, sums = (core.line_buffer_bits for core in cores)
        lines = MovingSumEngine().lines(cores[1])
        both = f"{cores[0].taps - 1}, {taps / 1024:.0f}", f"{lines}, {sums / 1024:.0f}"
        yield m, shown_set(shifts), channels, *both, f"{taps / sums:.2f}"


def lane_rows() -> Iterator[tuple[object, ...]]:
    """Rows of the table of resources for several pixels a clock, beside one."""
    placed = load_record().placed[ECP5_SLOWEST]
    for cell in lane_cells():
        one = replace(cell, pixels_per_clock=1)
        base = recorded()[one.name]
        for design in (one, cell):
            pixels, figures = design.pixels_per_clock, recorded()[design.name]
            usage = figures.usage
            yield (
                f"M = {cell.micro_image_size}, {_KINDS[cell.channels]}, P = {pixels}",
                *(usage.lut, usage.flip_flops, usage.block_rams, usage.dsp),
                f"{placed[design.name].fmax_mhz:.0f}",
                f"{figures.lut / pixels / base.lut:.0%}",
                f"{figures.flip_flops / pixels / base.flip_flops:.0%}",
            )


def lane_parts() -> Iterator[tuple[object, ...]]:
    """Rows of the table of the stages of a core of several pixels a clock, each by itself."""
    figures = recorded()
    for design in lane_part_designs():
        figure, (pixels, part) = figures[design.name], design.name.split(" ", 1)
        each = figure.lut / int(pixels.removeprefix("P="))
        part = f"{pixels.replace('=', ' = ')}, {part}"
        yield part, f"`{design.top}`", figure.lut, figure.flip_flops, f"{each:.0f}"


def moving_sum_tables(text: str) -> str:
    """Put the tables of the page on moving sums between their marks."""
    heads = "M | a' | channels | fir: lines of partial sums, kbit "
    heads += "| moving_sum: lines of pixels, kbit | ratio"
    text = put(text, "memory", table(heads, column_memory()))
    heads = "core | LUT | flip-flops | block RAM | multipliers | MHz on ECP5 "
    heads += "| LUT of a pixel | flip-flops of a pixel"
    text = put(text, "lanes", table(heads, lane_rows()))
    heads = "part | entity | LUT | flip-flops | LUT of a pixel"
    return put(text, "lane parts", table(heads, lane_parts()))


def engine_table() -> list[str]:
    """Make the table of both engines' resources, cell by cell."""
    device = DEVICES["xc6slx45"]
    clocks = load_record().placed[ECP5_SLOWEST]

    def part(cell: Cell) -> tuple[object, ...]:
        measured, placed = recorded().get(cell.name), clocks.get(cell.name)
        usage = estimate(cell.core().blocks) if measured is None else measured.usage
        about = "~" if measured is None else ""
        clock = "" if placed is None else f"{placed.fmax_mhz:.0f}"
        logic = f"{about}{usage.lut}", f"{about}{usage.flip_flops}"
        return *logic, usage.block_rams, usage.dsp, widest(cell, device), clock

    heads = "LUT | flip-flops | block RAM | DSP48A1 | widest | MHz"
    cells = [
        *((m, (a,), channels) for channels in (1, 3) for m in SIZES for a in shown_shifts(m)),
        *SETS,
    ]
    return table(
        f"M | a' | colour | fir: {heads} | moving_sum: {heads}",
        (
            (
                *(m, shown_set(shifts), _KINDS[channels]),
                *(x for engine in ENGINES for x in part(Cell(m, shifts, channels, engine))),
            )
            for m, shifts, channels in cells
        ),
    )


def scene_rows(figures: Mapping[str, Figures]) -> Iterator[tuple[object, ...]]:
    """Rows of the shipped scenes: boards, cores, full builds, sensors, and the device."""

    def amounts(name: str, usage: Usage) -> tuple[object, ...]:
        return all_figures(figures[name]) if name in figures else estimated(usage)

    scenes = {design.name: design for design in scene_designs()}
    for design in core_designs():
        scene, usage = design.name.removesuffix(" core"), estimate(design.core.blocks)
        if scenes[scene].top == BOARD:
            board = (*design.core.blocks, VIDEO)
            yield f"**{scene}**, the whole board", *amounts(scene, estimate(board))
        yield f"**{scene}**, core", *amounts(design.name, usage)
        full = estimate(full_core(design.core).blocks)
        yield f"{scene}, full build", *amounts(f"{scene} full", full)
    for design in scenes.values():
        if design.plan is not None and design.plan.sensor is not None:
            yield f"**{design.name}**, sensor and core", *all_figures(figures[design.name])
    total = DEVICES["xc6slx45"].total
    logic = total.lut, total.flip_flops
    yield "XC6SLX45", *logic, "", "", total.block_rams, total.dsp, "", ""


def resource_tables(text: str) -> str:
    """Put the designs' resources on a Spartan-6 between their marks in a page."""
    figures = recorded()
    text = put(text, "scenes", table(f"scene | {FIGURE_HEADS}", scene_rows(figures)))
    text = device_table(text)
    text = put(text, "estimates", estimate_errors())
    lines = []
    for feature, core in left_out_in_turn():
        parts, usage = needed_parts(core), estimate(core.blocks)
        counts = [parts[name] for name in PARTS]
        logic = f"~{usage.lut}", f"~{usage.flip_flops}"
        lines.append((feature, *counts, *logic, usage.block_rams, usage.dsp))
    heads = f"left out | {' | '.join(PARTS)} | LUT | flip-flops | block RAM | DSP48A1"
    text = put(text, "left out", table(heads, lines))
    boards = ", ".join(design.name for design in scene_designs() if design.top == BOARD)
    cores = ", ".join(design.name for design in core_designs())
    rows = [(boards, *TMDS_ENDS.values()), (cores, *("0" for _ in TMDS_ENDS))]
    text = put(text, "full builds", beside_full_builds())
    return put(text, "ends", table(f"design | {' | '.join(TMDS_ENDS)}", rows))


def estimate_errors() -> list[str]:
    """Make the table of how far estimates of drawn cores are off."""
    titles = {"lut": "LUT, LUT4, ALM or half CPE", "flip_flops": "flip-flops"}
    return table(
        "estimate | counts of drawn cores | worst | 95 % within",
        (
            (titles[resource], number, f"{worst:.1%}", f"{usual:.1%}")
            for resource, (number, worst, usual) in load_record().drawn_errors.items()
        ),
    )


def placed_table() -> list[str]:
    """Make the table of the cores that were placed on devices with other open tools."""
    return table(
        "device | scene | MHz | LUT | flip-flops | block RAM | multipliers",
        (
            (
                DEVICES[name].title,
                scene.removesuffix(" core"),
                core.fmax_mhz,
                *core.usage.amounts().values(),
            )
            for name, cores in load_record().placed.items()
            if name in DEVICES
            for scene, core in cores.items()
        ),
    )


def left_out_of_scenes() -> list[str]:
    """Make the table of what was left out of each scene's core, on the first device it fits."""
    rows = []
    for scene in scene_names():
        plans = [plan_on(scene, name) for name in DEVICES]
        fitting = [plan for plan in plans if not isinstance(plan, str)]
        core = next((plan for plan in fitting if plan.path == "core"), fitting[0])
        parts = "; ".join(part.what for part in core.left_out)
        rows.append((scene, f"{len(fitting)} of {len(DEVICES)}", parts))
    return table("scene | devices it fits | left out", rows)


def _beside_full(scene: str) -> Iterator[object]:
    """Cells of a scene's core beside its full build: how known, and each amount of both."""
    placed, plan = recorded_beside_full(scene), make_plan(load_scene(scene))
    if placed is not None:
        yield f"placed, {placed.device}"
        both: Iterable[tuple[float, float]] = zip(
            placed.scene.values(), placed.full.values(), strict=True
        )
    else:
        yield f"estimate, {plan.device.upper()}"
        both = zip(plan.needs.values(), plan.full.values(), strict=True)
    for needed, full in both:
        change = round(100 * (needed / full - 1)) if full else 0
        yield f"{needed:g} of {full:g}" + (f" ({change:+d} %)" if change else "")
    if placed is None:
        yield ""


def _listed_files(scene: str) -> str:
    """How many of all VHDL sources the project of a scene has."""
    with tempfile.TemporaryDirectory() as folder:
        sources = configure(make_plan(load_scene(scene)), Path(folder))
        inside = sum(source.parent == Path(folder) for source in sources)
    return f"{len(sources) - inside} of {len(hdl.all_sources())}"


def beside_full_builds() -> list[str]:
    """Make the table of the shipped scenes beside their full builds."""
    heads = "scene | how known | LUT | flip-flops | block RAM | multipliers | MHz | files"
    rows = ((scene, *_beside_full(scene), _listed_files(scene)) for scene in scene_names())
    return table(heads, rows)


def costs_of_leaving_out() -> list[str]:
    """Make the table of features whose omission costs something, by the estimates."""
    rows = []
    for scene in scene_names():
        plan = make_plan(load_scene(scene))
        rows += [
            (scene, part.what, part.change(plan.available), part.reason)
            for part in plan.left_out
            if part.costs
        ]
    return table("scene | left out | change, and its share of the device | left out because", rows)


def imx219_table(text: str) -> str:
    """Put an IMX219's requirements for receiver and core between their marks in a page."""
    heads = "size | frames a second | Mpx/s over a line | pixels a clock at 100 MHz | BUFFER_BITS"
    rows = [
        (
            f"{mode.columns} x {mode.rows}",
            f"{mode.frames_per_second:.0f}",
            f"{mode.line_rate / 1e6:.1f}",
            mode.pixels_per_clock(100e6),
            mode.buffer_bits(100e6),
        )
        for mode in IMX219_MODES
    ]
    return put(text, "imx219", table(heads, rows))


def focused_scenes() -> list[str]:
    """Make the table of the example of a focused camera, with M of two pitches, on devices."""
    example = (project.root() / "examples" / "focused-raw.toml").read_text()
    rows: list[tuple[object, ...]] = []
    with tempfile.TemporaryDirectory() as folder:
        for device, m in product(_FOCUSED_DEVICES, _FOCUSED_PITCHES):
            file = Path(folder) / f"{m}.toml"
            file.write_text(example.replace("23", str(m)))
            try:
                plan = make_plan(load_scene(str(file), device))
            except InputError as error:
                reason = error.problem.partition("it needs ")[2].partition(";")[0]
                rows.append((device.upper(), m, "", "", f"no: {reason}", ""))
                continue
            lut, flip_flops, memory, multipliers = plan.needs.values()
            share = f"{memory} of {list(plan.available.values())[2]}"
            rows.append((device.upper(), m, lut, flip_flops, share, multipliers))
    return table("device | M | LUT | flip-flops | block RAM | multipliers", rows)


def sensor_table(text: str) -> str:
    """Put the resources of resamplers, and of a focused camera's scene, into their page."""
    text = put(text, "focused scenes", focused_scenes())
    figures, rows = recorded(), []
    for name in SENSORS:
        design = sensor_design(name)
        is_recorded = design.name in figures
        amounts = (
            all_figures(figures[design.name]) if is_recorded else estimated(estimate(design.blocks))
        )
        rows.append((name, *amounts))
    return imx219_table(put(text, "resamplers", table(f"resampler | {FIGURE_HEADS}", rows)))


def flow_figures(text: str) -> str:
    """Put the resources of the examples and scenes between their marks in a page."""
    figures = recorded()
    grades = [load_record().placed[grade] for grade in (ECP5_SLOWEST, ECP5_FASTEST)]
    uses = {
        "grey-microscope": "`examples/vhdl/refocus_button.vhd`",
        "rgb-480p": "`examples/vhdl/pattern_video.vhd`, its core",
    }
    rows = []
    for scene in (design.name.removesuffix(" core") for design in core_designs()):
        f = figures.get(f"{scene} core") or figures[scene]
        clocks = (placed[scene].fmax_mhz if scene in placed else "" for placed in grades)
        amounts = f.lut, f.flip_flops, f.usage.block_rams, f.dsp
        rows.append((scene, uses.get(scene, ""), *amounts, *clocks))
    heads = "core of the scene | where it is used | LUT | flip-flops | block RAM | DSP48A1 "
    heads += "| MHz, ECP5 grade 6 | grade 8"
    return put(text, "flows", table(heads, rows))


def ecp5_table() -> list[str]:
    """Make the table of the clocks that designs reach on an ECP5."""
    grades = [load_record().placed[grade] for grade in (ECP5_SLOWEST, ECP5_FASTEST)]
    cells = {cell.name for cell in placed_cells()}
    return table(
        "design | grade | MHz | LUT4 | flip-flops | DP16KD | MULT18X18D | device",
        (
            (design, p.speed_grade, p.fmax_mhz, *p.usage.amounts().values(), p.device)
            for design in grades[0]
            if design not in cells
            for p in (placed[design] for placed in grades if design in placed)
        ),
    )


def _stack_figures(f: Figures) -> tuple[int, ...]:
    """Numbers of a stack or an index; no carry chains."""
    *amounts, _, path = all_figures(f)
    return *amounts, path


def each_slice_more(few: Design, many: Design) -> tuple[object, ...]:
    """Row of the resources of one more slice: two stacks with the same ends."""
    added, figures = len(many.core.shifts) - len(few.core.shifts), recorded()
    both = zip(*(_stack_figures(figures[d.name])[:-1] for d in (few, many)), strict=True)
    each = [(more - less) / added for less, more in both]
    # The memory that the slices share has the same size in both.
    buffer_bits = many.core.line_buffer_bits - few.core.line_buffer_bits
    amounts = [f"{value:.0f}" if value == int(value) else f"{value:.1f}" for value in each]
    return "**each slice more**", *amounts, "", f"{buffer_bits / added / 1024:.0f}", ""


def stack_tables() -> tuple[list[str], list[str]]:
    """Make the tables of the resources of focal stacks and their depth index."""
    figures = recorded()
    rows: list[tuple[object, ...]] = []
    stacks: list[Design] = []
    indices: list[tuple[object, ...]] = []
    for design in stack_designs():
        amounts = _stack_figures(figures[design.name])
        if design.index is not None:
            waiting, judged = design.index.memory_bits
            memory = f"{waiting / 1024:.0f}, {judged / 1024:.0f}"
            indices.append((design.name, *amounts, memory))
            continue
        core = design.core
        assert isinstance(core.engine, StackEngine)
        shared, of_slice = core.engine.history_bits(core), core.engine.slice_bits(core)
        apart = sum(
            core.model_copy(
                update={"shifts": (shift,), "engine": MovingSumEngine()}
            ).line_buffer_bits
            for shift in core.shifts
        )
        memory = f"{shared / 1024:.0f} + {of_slice / 1024:.0f}"
        rows.append((design.name, *amounts, memory, f"{apart / 1024:.0f}"))
        stacks.append(design)
    rows.append(each_slice_more(*stacks))
    heads = "design | LUT | flip-flops | RAMB16 | RAMB8 | block RAM | DSP48A1 | path"
    of_stacks = table(f"{heads} | shared + slices: kbit | an engine each: kbit", rows)
    return of_stacks, table(f"{heads} | waiting, judged: kbit", indices)


def board_builds() -> list[str]:
    """What the recorded builds of boards with open tools are."""
    rows = []
    for name, build in load_builds().items():
        clocks = ", ".join(
            f"`{clock.clock}` {clock.reached_mhz:g} ({clock.wanted_mhz:g})"
            for clock in build.timing
        )
        kinds = FAMILIES[DEVICES[build.device].family].names
        used = [build.utilisation[kind][0] for kind in kinds]
        rows.append(
            (f"`{name}`", build.device, clocks, *used, f"{sum(build.seconds.values()):.0f}")
        )
    heads = "scene | device | clocks in MHz, reached (wanted) | LUT4 | flip-flops | block RAM "
    return table(f"{heads}| multipliers | seconds", rows)
