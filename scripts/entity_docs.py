"""Write one page for each entity from its VHDL source: header, generics, ports.

Usage: python scripts/entity_docs.py [--check]

With --check nothing is written; exit code 1 if a page is missing, stale or left over.
"""

import re
import sys
from dataclasses import dataclass
from pathlib import Path

from plenofir import project

PAGES = project.root() / "docs" / "entities"
SECTIONS = ("Latency", "Throughput", "Ports", "Equation")


@dataclass(frozen=True)
class Declaration:
    """One generic or port: name, mode (ports), type, default, and the comment above it."""

    name: str
    mode: str
    type_name: str
    default: str
    comment: str


def declarations(text: str, kind: str) -> list[Declaration]:
    """Read the generic or port clause of an entity."""
    clause = re.search(rf"^  {kind} \(\n(.*?)^  \);", text, re.S | re.M)
    found = []
    comment: list[str] = []
    for line in clause.group(1).splitlines() if clause else []:
        stripped = line.strip().rstrip(";")
        if stripped.startswith("--"):
            comment.append(stripped[2:].strip())
            continue
        name, _, rest = (part.strip() for part in stripped.partition(":"))
        mode = ""
        if kind == "port":
            mode, rest = rest.split(None, 1)
        type_name, _, default = (part.strip() for part in rest.partition(":="))
        found.append(Declaration(name, mode, type_name, default, " ".join(comment)))
        comment = []
    return found


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


def main() -> int:
    """Write or check the pages."""
    paths = project.hdl_sources()
    pages = {f"{path.stem}.md": page(path) for path in paths} | {"README.md": index(paths)}
    if "--check" not in sys.argv[1:]:
        PAGES.mkdir(parents=True, exist_ok=True)
        for old in PAGES.glob("*.md"):
            old.unlink()
        for name, text in pages.items():
            (PAGES / name).write_text(text)
        return 0
    present = {path.name: path.read_text() for path in PAGES.glob("*.md")}
    stale = sorted(n for n in pages.keys() | present.keys() if pages.get(n) != present.get(n))
    if stale:
        print(f"docs/entities: stale, run make docs: {', '.join(stale)}", file=sys.stderr)
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
