"""Build what the documentation takes from the sources.

One page for each VHDL entity (header, generics, ports), the table of error bounds in
``docs/golden-model.md`` and the clock counts in ``docs/module-array.md``.

Usage: python scripts/build_docs.py [--check]

With --check nothing is written; exit code 1 if a page is missing, stale or left over.
"""

import re
import sys
from pathlib import Path

from plenofir import clock_counts, project
from plenofir.core import CoreConfiguration
from plenofir.hdl_text import Declaration, declarations
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
        "| M | a' | channels | taps: lines of partial sums, kbit "
        "| moving sums: lines of pixels, kbit | ratio |",
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
            for engine in ("taps", "sums")
        ]
        taps, sums = (core.line_buffer_bits for core in cores)
        shown = str(shifts[0]) if len(shifts) == 1 else f"{shifts[0]} to {shifts[-1]}"
        lines.append(
            f"| {m} | {shown} | {channels} | {cores[0].taps - 1}, {taps / 1024:.0f} "
            f"| {sum(cores[1].sum_layout.ring_lines)}, {sums / 1024:.0f} | {taps / sums:.2f} |"
        )
    return between_marks(text, "memory", "\n".join(lines))


def main() -> int:
    """Write or check the pages."""
    paths = project.board_sources()
    pages = {ENTITIES / f"{path.stem}.md": page(path) for path in paths}
    pages[ENTITIES / "README.md"] = index(paths)
    pages[GOLDEN_MODEL] = error_bounds(GOLDEN_MODEL.read_text())
    pages[MOVING_SUM] = column_memory(MOVING_SUM.read_text())
    pages[MODULE_ARRAY] = clock_tables(MODULE_ARRAY.read_text())
    present = {*ENTITIES.glob("*.md"), GOLDEN_MODEL, MODULE_ARRAY, MOVING_SUM}
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
