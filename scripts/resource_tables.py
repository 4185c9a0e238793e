# SPDX-License-Identifier: Apache-2.0
"""Tables of what designs take of a device and the clocks that they reach, for `build_docs.py`."""

import json
from dataclasses import replace

from marks import between_marks
from plenofir import project
from plenofir.fpga.bitstream.nextpnr import load_builds
from plenofir.fpga.bitstream.top_level import TOP as BOARD
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.synthesis.comparison import (
    ENGINES,
    SETS,
    SIZES,
    Cell,
    lane_cells,
    load_comparison,
    shown_shifts,
    widest,
)
from plenofir.fpga.synthesis.estimate import estimate
from plenofir.fpga.synthesis.parts import PARTS, TMDS_ENDS, left_out_in_turn, needed_parts
from plenofir.fpga.synthesis.spartan6 import Figures
from plenofir.plan.figures import (
    Design,
    core_designs,
    grid_designs,
    load_figures,
    scene_designs,
    sensor_designs,
    stack_designs,
)
from plenofir.plan.left_out import full_core

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
REFERENCE_GHDL = "2.0.0"
FIGURE_HEADS = "| LUT | flip-flops | RAMB16 | RAMB8 | block RAM | DSP48A1 | CARRY4 | path |"


def column_memory(text: str) -> str:
    """Put the column memories of both engines between their marks in a page."""
    lines = [
        "| M | a' | channels | fir: lines of partial sums, kbit "
        "| moving_sum: lines of pixels, kbit | ratio |",
        "| --- " * 6 + "|",
    ]
    sums_engine = MovingSumEngine()
    for m, shifts, channels in MEMORY_CASES:
        cores = [
            CoreConfiguration(
                micro_image_size=m,
                shifts=shifts,
                max_columns=MEMORY_COLUMNS,
                channels=channels,
                engine=engine,
            )
            for engine in (FirEngine(), sums_engine)
        ]
        taps, sums = (core.line_buffer_bits for core in cores)
        shown = str(shifts[0]) if len(shifts) == 1 else f"{shifts[0]} to {shifts[-1]}"
        lines.append(
            f"| {m} | {shown} | {channels} | {cores[0].taps - 1}, {taps / 1024:.0f} "
            f"| {sums_engine.lines(cores[1])}, {sums / 1024:.0f} | {taps / sums:.2f} |"
        )
    return between_marks(text, "memory", "\n".join(lines))


def moving_sum_tables(text: str) -> str:
    """Put the tables of the page on moving sums between their marks."""
    return lane_table(column_memory(text))


def engine_table() -> list[str]:
    """Make the table of what both engines take, cell by cell."""
    device = DEVICES["xc6slx45"]
    content = load_comparison()

    def part(cell: Cell) -> str:
        measured = content.figures.get(cell.name)
        usage = estimate(cell.core()) if measured is None else measured.usage
        about = "~" if measured is None else ""
        return (
            f"{about}{usage.lut} | {about}{usage.flip_flops} | {usage.block_rams} | {usage.dsp} "
            f"| {widest(cell, device)} | {clock(cell)}"
        )

    def clock(cell: Cell) -> str:
        placed = content.placed.get(cell.name)
        return "" if placed is None else f"{placed.fmax_mhz:.0f}"

    heads = "LUT | flip-flops | block RAM | DSP48A1 | widest | MHz"
    lines = [f"| M | a' | colour | fir: {heads} | moving_sum: {heads} |", "| --- " * 15 + "|"]
    cells = [
        *(
            (m, (shift,), channels)
            for channels in (1, 3)
            for m in SIZES
            for shift in shown_shifts(m)
        ),
        *SETS,
    ]
    for m, shifts, channels in cells:
        shown = str(shifts[0]) if len(shifts) == 1 else f"{shifts[0]} to {shifts[-1]}"
        both = " | ".join(part(Cell(m, shifts, channels, engine)) for engine in ENGINES)
        lines.append(f"| {m} | {shown} | {'grey' if channels == 1 else 'RGB'} | {both} |")
    return lines


def lane_table(text: str) -> str:
    """Put what several pixels a clock take, beside one, between its marks in a page."""
    content = load_comparison()
    heads = "LUT | flip-flops | block RAM | multipliers | MHz on ECP5"
    lines = [
        f"| core | {heads} | LUT of a pixel | flip-flops of a pixel |",
        "| --- " * 8 + "|",
    ]
    for cell in lane_cells():
        one = replace(cell, pixels_per_clock=1)
        base = content.figures[one.name]
        for shown in (one, cell):
            pixels, figures = shown.pixels_per_clock, content.figures[shown.name]
            usage = figures.usage
            colour = "grey" if cell.channels == 1 else "RGB"
            lines.append(
                f"| M = {cell.micro_image_size}, {colour}, P = {pixels} | {usage.lut} "
                f"| {usage.flip_flops} | {usage.block_rams} | {usage.dsp} "
                f"| {content.placed[shown.name].fmax_mhz:.0f} "
                f"| {figures.lut / pixels / base.lut:.0%} "
                f"| {figures.flip_flops / pixels / base.flip_flops:.0%} |"
            )
    return between_marks(text, "lanes", "\n".join(lines))


def figure_row(name: str, f: Figures) -> str:
    """Make the row of a design under these heads."""
    return (
        f"| {name} | {f.lut} | {f.flip_flops} | {f.ramb16} | {f.ramb8} "
        f"| {f.usage.block_rams} | {f.dsp} | {f.carry} | {f.path} |"
    )


def resource_tables(text: str) -> str:
    """Put what the designs take of a Spartan-6 between its marks in a page."""
    content = load_figures()
    figures = content.figures[REFERENCE_GHDL]
    lines = [f"| scene {FIGURE_HEADS}", "| --- " * 9 + "|"]
    boards = {design.name: design for design in scene_designs() if design.top == BOARD}
    for design in core_designs():
        scene = design.name.removesuffix(" core")
        if scene in boards:
            lines.append(figure_row(f"**{scene}**, the whole board", figures[scene]))
        lines.append(figure_row(f"**{scene}**, core", figures[design.name]))
        name = f"{scene}, full build"
        if f"{scene} full" in figures:
            lines.append(figure_row(name, figures[f"{scene} full"]))
            continue
        guess = estimate(full_core(design.core))
        lines.append(
            f"| {name} (estimate) | {guess.lut} | {guess.flip_flops} | {guess.ramb16} "
            f"| {guess.ramb8} | {guess.block_rams} | {guess.dsp} | | |"
        )
    for design in scene_designs():
        if design.plan is not None and design.plan.sensor is not None:
            name = f"**{design.name}**, sensor and core"
            lines.append(figure_row(name, figures[design.name]))
    total = DEVICES["xc6slx45"].total
    lines.append(
        f"| XC6SLX45 | {total.lut} | {total.flip_flops} | | | {total.block_rams} | {total.dsp} "
        "| | |"
    )
    text = between_marks(text, "scenes", "\n".join(lines))
    lines = [f"| left out | {' | '.join(PARTS)} | LUT | flip-flops | block RAM | DSP48A1 |"]
    lines.append("| --- " * (len(PARTS) + 5) + "|")
    for what, core in left_out_in_turn():
        parts = needed_parts(core)
        f = figures[f"left out: {what}"]
        lines.append(
            f"| {what} | {' | '.join(str(parts[name]) for name in PARTS)} | {f.lut} "
            f"| {f.flip_flops} | {f.usage.block_rams} | {f.dsp} |"
        )
    text = between_marks(text, "left out", "\n".join(lines))
    lines = [f"| design | {' | '.join(TMDS_ENDS)} |", "| --- " * (len(TMDS_ENDS) + 1) + "|"]
    lines.append(f"| {', '.join(boards)} | {' | '.join(map(str, TMDS_ENDS.values()))} |")
    cores = ", ".join(d.name for d in core_designs())
    lines.append(f"| {cores} | {' | '.join('0' for _ in TMDS_ENDS)} |")
    return between_marks(text, "ends", "\n".join(lines))


def sensor_table(text: str) -> str:
    """Put what resamplers take of a Spartan-6 between its marks in a page."""
    figures = load_figures().figures[REFERENCE_GHDL]
    lines = [f"| resampler {FIGURE_HEADS}", "| --- " * 9 + "|"]
    for design in sensor_designs():
        name = design.name.removeprefix("sensor, ")
        lines.append(figure_row(name, figures[design.name]))
    return between_marks(text, "resamplers", "\n".join(lines))


def flow_figures(text: str) -> str:
    """Put what the examples and the scenes take between its marks in a page."""
    figures = load_figures().figures[REFERENCE_GHDL]
    placed = json.loads((project.DATA / "ecp5.json").read_text())
    scenes = [design.name.removesuffix(" core") for design in core_designs()]
    uses = {
        "grey-microscope": "`examples/vhdl/refocus_button.vhd`",
        "rgb-480p": "`examples/vhdl/pattern_video.vhd`, its core",
    }
    lines = [
        "| core of the scene | where it is used | LUT | flip-flops | block RAM | DSP48A1 "
        "| MHz, ECP5 grade 6 | grade 8 |",
        "| --- " * 8 + "|",
    ]
    for scene in scenes:
        f = figures.get(f"{scene} core", figures[scene])
        reached = (placed[scene].get(grade, {}).get("fmax_mhz", "") for grade in ("6", "8"))
        clocks = " | ".join(str(mhz) for mhz in reached)
        lines.append(
            f"| {scene} | {uses.get(scene, '')} | {f.lut} | {f.flip_flops} "
            f"| {f.usage.block_rams} | {f.dsp} | {clocks} |"
        )
    return between_marks(text, "flows", "\n".join(lines))


def grid_table() -> list[str]:
    """Make the table of what cores and arrays take of a Spartan-6."""
    figures = load_figures().figures[REFERENCE_GHDL]
    return [
        f"| design {FIGURE_HEADS}",
        "| --- " * 9 + "|",
        *(
            figure_row(design.name, figures[design.name])
            for design in grid_designs()
            if design.name in figures
        ),
    ]


def ecp5_table() -> list[str]:
    """Make the table of the clocks that designs reach on an ECP5."""
    lines = ["| design | grade | MHz | LUT4 | flip-flops | DP16KD | MULT18X18D | device |"]
    lines.append("| --- " * 8 + "|")
    for name, grades in json.loads((project.DATA / "ecp5.json").read_text()).items():
        for grade, p in grades.items():
            lines.append(
                f"| {name} | {grade} | {p['fmax_mhz']} | {p['lut']} | {p['flip_flops']} "
                f"| {p['block_rams']} | {p['multipliers']} | {p['device']} |"
            )
    return lines


def stack_tables() -> tuple[list[str], list[str]]:
    """Make the tables of what focal stacks and their depth indices take."""
    figures = load_figures().figures[REFERENCE_GHDL]
    heads = "LUT | flip-flops | RAMB16 | RAMB8 | block RAM | DSP48A1 | path"

    def counts(f: Figures) -> list[int]:
        return [f.lut, f.flip_flops, f.ramb16, f.ramb8, f.usage.block_rams, f.dsp]

    def row(design: Design, memory: str) -> str:
        f = figures[design.name]
        return "| " + " | ".join([design.name, *map(str, counts(f)), str(f.path), memory]) + " |"

    stacks: list[tuple[Design, CoreConfiguration]] = []
    lines = [
        f"| design | {heads} | shared + slices: kbit | an engine each: kbit |",
        "| --- " * 10 + "|",
    ]
    for design in stack_designs():
        if design.index is None and design.name in figures:
            core = design.core
            assert isinstance(core.engine, StackEngine)
            shared, own = core.engine.history_bits(core), core.engine.slice_bits(core)
            apart = sum(
                CoreConfiguration(
                    micro_image_size=core.micro_image_size,
                    shifts=(shift,),
                    max_columns=core.max_columns,
                    channels=core.channels,
                    engine=MovingSumEngine(),
                ).line_buffer_bits
                for shift in core.shifts
            )
            memory = f"{shared / 1024:.0f} + {own / 1024:.0f} | {apart / 1024:.0f}"
            lines.append(row(design, memory))
            stacks.append((design, core))
    for m, channels in sorted({(core.micro_image_size, core.channels) for _, core in stacks}):
        those = [
            (design, core)
            for design, core in stacks
            if (core.micro_image_size, core.channels) == (m, channels)
        ]
        # The first one has other ends, and so another delay, if there are more than two.
        (few, few_core), (many, many_core) = those[1 if len(those) > 2 else 0], those[-1]
        added = len(many_core.shifts) - len(few_core.shifts)
        each = [
            (more - less) / added
            for less, more in zip(
                counts(figures[few.name]), counts(figures[many.name]), strict=True
            )
        ]
        # The memory that the slices share has the same size in both.
        own = many_core.line_buffer_bits - few_core.line_buffer_bits
        kind = "grey" if channels == 1 else "RGB"
        shown = " | ".join(
            f"{value:.0f}" if value == int(value) else f"{value:.1f}" for value in each
        )
        lines.append(
            f"| **each slice more, M = {m}, {kind}** | {shown} | | {own / added / 1024:.0f} | |"
        )
    of_stacks = lines
    lines = [f"| design | {heads} | waiting, judged: kbit |", "| --- " * 9 + "|"]
    for design in stack_designs():
        if design.index is not None and design.name in figures:
            waiting, judged = design.index.memory_bits
            lines.append(row(design, f"{waiting / 1024:.0f}, {judged / 1024:.0f}"))
    return of_stacks, lines


def board_builds(text: str) -> str:
    """Put what the recorded builds of boards with an ECP5 are between its marks in a page."""
    lines = [
        "| scene | device | clocks in MHz, reached (wanted) | LUT4 | flip-flops | block RAM "
        "| multipliers | seconds |",
        "| --- " * 8 + "|",
    ]
    for name, build in load_builds().items():
        clocks = ", ".join(
            f"`{clock.clock}` {clock.reached_mhz:g} ({clock.wanted_mhz:g})"
            for clock in build.timing
        )
        used = [
            str(build.utilisation[kind][0])
            for kind in ("LUT4", "flip-flops", "block RAM (18 Kbit)", "MULT18X18D")
        ]
        seconds = sum(build.seconds.values())
        lines.append(
            f"| `{name}` | {build.device} | {clocks} | {' | '.join(used)} | {seconds:.0f} |"
        )
    return between_marks(text, "builds", "\n".join(lines))
