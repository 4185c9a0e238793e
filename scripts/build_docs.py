"""Build what the documentation takes from the sources.

One page for each VHDL entity (header, generics, ports), the table of error bounds in
``docs/golden-model.md``, the clock counts in ``docs/module-array.md`` and the figures of the
synthesis in ``docs/resources.md`` and ``docs/stack.md``.

Usage: python scripts/build_docs.py [--check]

With --check nothing is written; exit code 1 if a page is missing, stale or left over.
"""

import json
import re
import sys
from pathlib import Path

from plenofir import project
from plenofir.fpga import hdl
from plenofir.fpga.bitstream.ise import TOP as BOARD
from plenofir.fpga.core import clock_counts
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.stack import StackConfiguration
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.hdl_text import Declaration, declarations
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
from plenofir.plan.figures import (
    Design,
    core_designs,
    grid_designs,
    load_figures,
    scene_designs,
    stack_designs,
)
from plenofir.plan.planner import full_core
from plenofir.refocus import ExactArithmetic, StoredProductArithmetic

ENTITIES = project.root() / "docs" / "entities"
GOLDEN_MODEL = project.root() / "docs" / "golden-model.md"
MOVING_SUM = project.root() / "docs" / "moving-sum.md"
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
MODULE_ARRAY = project.root() / "docs" / "module-array.md"
RESOURCES = project.root() / "docs" / "resources.md"
STACK = project.root() / "docs" / "stack.md"
REFERENCE_GHDL = "2.0.0"
BOUND_SIZES = (2, 3, 5, 7, 11)
BOUND_WIDTHS = ((0, 0), (4, 2), (8, 2))
SECTIONS = ("Latency", "Throughput", "Ports", "Equation")


def header_of(text: str) -> tuple[str, dict[str, str]]:
    """Split the header comment into its description and its named sections."""
    header = text[: text.index("\nlibrary ")]
    lines = [line[3:] if line.startswith("-- ") else line[2:] for line in header.splitlines()]
    body = "\n".join(lines)
    # Sections may share a line ("Latency: 1 clock. Throughput: ...").
    parts = re.split(rf"\b({'|'.join(SECTIONS)}): ", body)
    sections = {
        name: " ".join(content.split())
        for name, content in zip(parts[1::2], parts[2::2], strict=True)
    }
    return parts[0].strip(), sections


def escaped(text: str) -> str:
    """Keep Markdown from reading operators as emphasis."""
    return text.replace("*", r"\*")


def table(kind: str, rows: list[Declaration]) -> list[str]:
    """Format declarations as a Markdown table."""
    if not rows:
        return []
    if kind == "generic":
        lines = [
            "## Generics",
            "",
            "| name | type | default | meaning |",
            "| --- | --- | --- | --- |",
        ]
        lines += [
            f"| `{r.name}` | {r.type_name} | {r.default} | {escaped(r.comment)} |" for r in rows
        ]
    else:
        lines = ["## Ports", "", "| name | mode | type |", "| --- | --- | --- |"]
        lines += [f"| `{r.name}` | {r.mode} | {r.type_name} |" for r in rows]
    return [*lines, ""]


def page(path: Path) -> str:
    """Make the page of one source file."""
    text = path.read_text()
    description, sections = header_of(text)
    source = path.relative_to(project.root())
    used = sorted(set(re.findall(r"entity work\.(\w+)", text)))
    lines = [
        f"# {path.stem}",
        "",
        f"Built by `make docs` from [`{source}`](../../{source}).",
        "",
        # Text that is set out in columns (equations) stays as it is.
        *(
            f"    {line}" if line.startswith("  ") else escaped(line)
            for line in description.splitlines()
        ),
        "",
    ]
    lines += [f"- **{name}:** {escaped(sections[name])}" for name in SECTIONS if name in sections]
    lines += [""] if sections else []
    lines += table("generic", declarations(text, "generic"))
    lines += table("port", declarations(text, "port"))
    if used:
        lines += ["Built of " + ", ".join(f"[{name}]({name}.md)" for name in used) + ".", ""]
    return "\n".join(lines)


def index(paths: list[Path]) -> str:
    """Make the list of all pages."""
    lines = ["# Entities", "", "One page each, built by `make docs`, in the order of analysis.", ""]
    for path in paths:
        description, _ = header_of(path.read_text())
        summary = escaped(" ".join(description.split("\n\n")[0].split()))
        lines.append(f"- [{path.stem}]({path.stem}.md): {summary}")
    return "\n".join([*lines, ""])


def error_bounds(text: str) -> str:
    """Put the table of error bounds between its marks in a page."""
    arithmetics = [
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


def clock_tables(text: str) -> str:
    """Put the clock counts of the module array between their marks in a page."""
    text = between_marks(text, "simulated", clock_counts.table(clock_counts.SIMULATED))
    return between_marks(text, "extrapolated", clock_counts.table(clock_counts.EXTRAPOLATED))


def column_memory(text: str) -> str:
    """Put the column memories of both engines between their marks in a page."""
    lines = [
        "| M | a' | channels | fir: lines of partial sums, kbit "
        "| moving_sum: lines of pixels, kbit | ratio |",
        "| --- " * 6 + "|",
    ]
    for m, shifts, channels in MEMORY_CASES:
        cores = [
            CoreConfiguration.model_validate(
                {
                    "micro_image_size": m,
                    "shifts": shifts,
                    "max_columns": MEMORY_COLUMNS,
                    "channels": channels,
                    "engine": engine,
                }
            )
            for engine in ("fir", "moving_sum")
        ]
        taps, sums = (core.line_buffer_bits for core in cores)
        shown = str(shifts[0]) if len(shifts) == 1 else f"{shifts[0]} to {shifts[-1]}"
        lines.append(
            f"| {m} | {shown} | {channels} | {cores[0].taps - 1}, {taps / 1024:.0f} "
            f"| {sum(cores[1].sum_layout.ring_lines)}, {sums / 1024:.0f} | {taps / sums:.2f} |"
        )
    return between_marks(text, "memory", "\n".join(lines))


def engine_tables(text: str) -> str:
    """Put what both engines take, cell by cell, between its marks in a page."""
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
    return between_marks(text, "engines", "\n".join(lines))


def resource_tables(text: str) -> str:
    """Put what the designs take of a Spartan-6 between its marks in a page."""
    content = load_figures()
    figures = content.figures[REFERENCE_GHDL]
    heads = "| LUT | flip-flops | RAMB16 | RAMB8 | block RAM | DSP48A1 | CARRY4 | path |"
    rule = "| --- " * 9 + "|"

    def row(name: str, f: Figures) -> str:
        return (
            f"| {name} | {f.lut} | {f.flip_flops} | {f.ramb16} | {f.ramb8} "
            f"| {f.usage.block_rams} | {f.dsp} | {f.carry} | {f.path} |"
        )

    lines = [f"| scene {heads}", rule]
    boards = {design.name: design for design in scene_designs() if design.top == BOARD}
    for design in core_designs():
        scene = design.name.removesuffix(" core")
        if scene in boards:
            lines.append(row(f"**{scene}**, the whole board", figures[scene]))
        lines.append(row(f"**{scene}**, core", figures[design.name]))
        name = f"{scene}, full build"
        if f"{scene} full" in figures:
            lines.append(row(name, figures[f"{scene} full"]))
            continue
        guess = estimate(full_core(design.core))
        lines.append(
            f"| {name} (estimate) | {guess.lut} | {guess.flip_flops} | {guess.ramb16} "
            f"| {guess.ramb8} | {guess.block_rams} | {guess.dsp} | | |"
        )
    total = DEVICES["xc6slx45"].total
    lines.append(
        f"| XC6SLX45 | {total.lut} | {total.flip_flops} | | | {total.block_rams} | {total.dsp} "
        "| | |"
    )
    text = between_marks(text, "scenes", "\n".join(lines))
    lines = [f"| design {heads}", rule]
    lines += [
        row(design.name, figures[design.name])
        for design in grid_designs()
        if design.name in figures
    ]
    text = between_marks(text, "grid", "\n".join(lines))
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
    text = between_marks(text, "ends", "\n".join(lines))
    lines = ["| design | grade | MHz | LUT4 | flip-flops | DP16KD | MULT18X18D | device |"]
    lines.append("| --- " * 8 + "|")
    for name, grades in json.loads((project.DATA / "ecp5.json").read_text()).items():
        for grade, p in grades.items():
            lines.append(
                f"| {name} | {grade} | {p['fmax_mhz']} | {p['lut']} | {p['flip_flops']} "
                f"| {p['block_rams']} | {p['multipliers']} | {p['device']} |"
            )
    return between_marks(text, "ecp5", "\n".join(lines))


def stack_tables(text: str) -> str:
    """Put what focal stacks and their depth indices take between their marks in a page."""
    figures = load_figures().figures[REFERENCE_GHDL]
    heads = "LUT | flip-flops | RAMB16 | RAMB8 | block RAM | DSP48A1 | path"

    def counts(f: Figures) -> list[int]:
        return [f.lut, f.flip_flops, f.ramb16, f.ramb8, f.usage.block_rams, f.dsp]

    def row(design: Design, memory: str) -> str:
        f = figures[design.name]
        return "| " + " | ".join([design.name, *map(str, counts(f)), str(f.path), memory]) + " |"

    stacks: list[tuple[Design, StackConfiguration]] = []
    lines = [
        f"| design | {heads} | shared + slices: kbit | an engine each: kbit |",
        "| --- " * 10 + "|",
    ]
    for design in stack_designs():
        if design.index is None and design.name in figures:
            core = design.core
            assert isinstance(core, StackConfiguration)
            own = core.line_buffer_bits - core.history_bits
            apart = sum(
                CoreConfiguration(
                    micro_image_size=core.micro_image_size,
                    shifts=(shift,),
                    max_columns=core.max_columns,
                    channels=core.channels,
                    engine="moving_sum",
                ).line_buffer_bits
                for shift in core.shifts
            )
            memory = f"{core.history_bits / 1024:.0f} + {own / 1024:.0f} | {apart / 1024:.0f}"
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
        own = (many_core.line_buffer_bits - many_core.history_bits) - (
            few_core.line_buffer_bits - few_core.history_bits
        )
        kind = "grey" if channels == 1 else "RGB"
        shown = " | ".join(
            f"{value:.0f}" if value == int(value) else f"{value:.1f}" for value in each
        )
        lines.append(
            f"| **each slice more, M = {m}, {kind}** | {shown} | | {own / added / 1024:.0f} | |"
        )
    text = between_marks(text, "stack", "\n".join(lines))
    lines = [f"| design | {heads} | waiting, judged: kbit |", "| --- " * 9 + "|"]
    for design in stack_designs():
        if design.index is not None and design.name in figures:
            waiting, judged = design.index.memory_bits
            lines.append(row(design, f"{waiting / 1024:.0f}, {judged / 1024:.0f}"))
    return between_marks(text, "index", "\n".join(lines))


def main() -> int:
    """Write or check the pages."""
    paths = hdl.board_sources()
    pages = {ENTITIES / f"{path.stem}.md": page(path) for path in paths}
    pages[ENTITIES / "README.md"] = index(paths)
    pages[GOLDEN_MODEL] = error_bounds(GOLDEN_MODEL.read_text())
    pages[MOVING_SUM] = engine_tables(column_memory(MOVING_SUM.read_text()))
    pages[MODULE_ARRAY] = clock_tables(MODULE_ARRAY.read_text())
    pages[RESOURCES] = resource_tables(RESOURCES.read_text())
    pages[STACK] = stack_tables(STACK.read_text())
    present = {*ENTITIES.glob("*.md"), GOLDEN_MODEL, MODULE_ARRAY, MOVING_SUM, RESOURCES, STACK}
    stale = {path for path in pages if path not in present or path.read_text() != pages[path]}
    stale |= present - pages.keys()
    if "--check" in sys.argv[1:]:
        for path in sorted(stale):
            print(f"{path.relative_to(project.root())} is stale; run make docs", file=sys.stderr)
        return 1 if stale else 0
    ENTITIES.mkdir(parents=True, exist_ok=True)
    for path in stale:
        if path in pages:
            path.write_text(pages[path])
        else:
            path.unlink()
    return 0


if __name__ == "__main__":
    sys.exit(main())
