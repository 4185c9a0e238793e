# SPDX-License-Identifier: Apache-2.0
"""Build what the documentation takes from the sources.

Committed: the long tables of ``docs/measured``, and the short ones between marks in the pages
that people write. Not committed: one page for each VHDL entity, in ``build/docs/entities``,
and the flower and the planes in the viewer, each in one file, in ``build/docs``.

Usage: python scripts/build_docs.py [--check]

With --check nothing is written; exit code 1 if a committed page is missing, stale or left over.
"""

import json
import sys
from pathlib import Path

from entity_pages import entity_pages, instance_tree
from plenofir import project
from plenofir.camera.rays import RayModel, load_camera
from plenofir.fpga.bitstream.nextpnr import load_builds
from plenofir.fpga.bitstream.top_level import TOP as BOARD
from plenofir.fpga.core import clock_counts
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir import FirEngine
from plenofir.fpga.core.moving_sum import MovingSumEngine
from plenofir.fpga.core.stack import StackEngine
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.hdmi import status
from plenofir.fpga.synthesis.comparison import (
    ENGINES,
    SETS,
    SIZES,
    Cell,
    load_comparison,
    shown_shifts,
    widest,
)
from plenofir.fpga.synthesis.estimate import estimate
from plenofir.fpga.synthesis.parts import PARTS, TMDS_ENDS, left_out_in_turn, needed_parts
from plenofir.fpga.synthesis.spartan6 import Figures
from plenofir.images import read_image
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
from plenofir.refocus import Arithmetic, ExactArithmetic, StoredProductArithmetic
from plenofir.studies import many_pixels, thesis_benchmark
from plenofir.studies.errata import page_lines
from plenofir.view import export, light_field_page

DOCS = project.root() / "docs"
HDL = project.root() / "hdl"
# In the order of reading: each is drawn with what is new in it.
TOPS = (
    "raster_refocuser",
    "focal_stack",
    "depth_index",
    "sensor_raster",
    "load_port",
    "self_test",
    "atlys_top",
    "ulx3s_top",
    "parallel_top",
)
MEASURED = DOCS / "measured"
EXPORTS = project.root() / "build" / "docs"
EXPORT_BYTES = 8_000_000
ENTITIES = project.root() / "build" / "docs" / "entities"
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
BOUND_SIZES = (2, 3, 5, 7, 11)
BOUND_WIDTHS = ((0, 0), (4, 2), (8, 2))


def error_bounds(text: str) -> str:
    """Put the table of error bounds between its marks in a page."""
    arithmetics: list[Arithmetic] = [
        *(StoredProductArithmetic(fraction_bits=f, guard_bits=g) for f, g in BOUND_WIDTHS),
        ExactArithmetic(),
    ]
    heads = [f"F = {f}, G = {g}" for f, g in BOUND_WIDTHS]
    lines = [f"| M | {' | '.join(heads)} | exact |", "| --- " * (len(arithmetics) + 1) + "|"]
    for m in BOUND_SIZES:
        bounds = [f"{float(arithmetic.error_bound(m, 8)):.3f}" for arithmetic in arithmetics]
        lines.append(f"| {m} | {' | '.join(bounds)} |")
    return between_marks(text, "bounds", "\n".join(lines))


def between_marks(text: str, name: str, content: str) -> str:
    """Replace what stands between two marks of a page."""
    before, rest = text.split(f"<!-- {name} -->\n")
    after = rest.split(f"<!-- end of {name} -->\n")[1]
    return f"{before}<!-- {name} -->\n{content}\n<!-- end of {name} -->\n{after}"


def measured(title: str, explained_in: str, *tables: tuple[str, list[str]]) -> str:
    """Make a page of measured tables: titles and lines."""
    lines = [
        f"# {title}",
        "",
        f"Built by `make docs`; explained in [{explained_in}](../{explained_in}).",
    ]
    for heading, table in tables:
        lines += ["", f"## {heading}", "", *table]
    return "\n".join([*lines, ""])


def instance_list(text: str) -> str:
    """Put who instantiates whom between its marks in a page."""
    return between_marks(text, "instances", instance_tree(TOPS))


def clock_table(text: str) -> str:
    """Put the clock counts of the text's example between their marks in a page."""
    return between_marks(text, "extrapolated", clock_counts.table(clock_counts.EXTRAPOLATED))


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


FIGURE_HEADS = "| LUT | flip-flops | RAMB16 | RAMB8 | block RAM | DSP48A1 | CARRY4 | path |"


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


def status_table(text: str) -> str:
    """Put the board's status line and the meaning of its fields between their marks in a page."""
    lines = ["    " + status.example_line(), "", "| field | meaning |", "| --- | --- |"]
    lines += [f"| `{field.name}` | {field.meaning} |" for field in status.FIELDS]
    return between_marks(text, "status", "\n".join(lines))


def errata(text: str) -> str:
    """Put the errata of the thesis between their marks in a page."""
    return between_marks(text, "errata", "\n".join(page_lines()))


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


def committed_pages() -> dict[Path, str]:
    """Make the pages that stand in the repository."""
    of_stacks, of_indices = stack_tables()
    written = {
        DOCS / "board.md": status_table,
        DOCS / "errata.md": errata,
        DOCS / "golden-model.md": error_bounds,
        DOCS / "moving-sum.md": column_memory,
        DOCS / "fir-array.md": clock_table,
        DOCS / "resampling.md": sensor_table,
        DOCS / "flows.md": flow_figures,
        DOCS / "resources.md": resource_tables,
        DOCS / "ulx3s.md": board_builds,
        HDL / "README.md": instance_list,
    }
    return {
        **{path: fill(path.read_text()) for path, fill in written.items()},
        MEASURED / "array-clocks.md": measured(
            "Clocks of the filter array",
            "fir-array.md",
            ("Simulated", clock_counts.table(clock_counts.SIMULATED).splitlines()),
        ),
        MEASURED / "engines.md": measured(
            "Both engines, cell by cell", "moving-sum.md", ("Spartan-6, XC6SLX45", engine_table())
        ),
        MEASURED / "pixels.md": many_pixels.page(),
        MEASURED / "resources.md": measured(
            "Cores and arrays, and clocks",
            "resources.md",
            ("Cores and arrays on a Spartan-6", grid_table()),
            ("Clocks on an ECP5", ecp5_table()),
        ),
        MEASURED / "thesis-benchmark.md": thesis_benchmark.page(thesis_benchmark.load_recorded()),
        MEASURED / "stack.md": measured(
            "Focal stacks", "stack.md", ("Stacks", of_stacks), ("Depth indices", of_indices)
        ),
    }


def light_field_export(name: str, camera: tuple[str, float] | None) -> bytes:
    """A light field of the package as a page of its own, as plenofir view --export makes it."""
    raw = read_image(project.DATA / name)
    model = RayModel.focused(load_camera(camera[0]), camera[1], 5) if camera else None
    page = light_field_page(raw, 5, full_scale=255, title=name, model=model)
    return export(page, EXPORT_BYTES)


def main() -> int:
    """Write or check the pages."""
    pages = committed_pages()
    # Building the other pages checks the headers that they are made of.
    built = entity_pages(ENTITIES)
    stale = {path for path, text in pages.items() if not path.exists() or path.read_text() != text}
    left_over = set(MEASURED.glob("*")) - pages.keys()
    if "--check" in sys.argv[1:]:
        for path in sorted(stale | left_over):
            print(f"{path.relative_to(project.root())} is stale; run make docs", file=sys.stderr)
        return 1 if stale | left_over else 0
    for path in left_over | set(ENTITIES.glob("*")):
        path.unlink()
    for folder in (MEASURED, ENTITIES):
        folder.mkdir(parents=True, exist_ok=True)
    for path, text in {**built, **{path: pages[path] for path in stale}}.items():
        path.write_text(text)
    for name, camera in (("flower", None), ("planes", ("f193-mla2", 1500))):
        path = EXPORTS / f"{name}.html"
        path.write_bytes(light_field_export(f"{name}_5x5.png", camera))
        print(f"{path.relative_to(project.root())}: {path.stat().st_size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
