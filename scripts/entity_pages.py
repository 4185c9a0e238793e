# SPDX-License-Identifier: Apache-2.0
"""The built pages of the VHDL entities: header, generics, ports with their meaning."""

import re
from pathlib import Path

from plenofir.fpga import hdl
from plenofir.fpga.hdl_text import declarations
from plenofir.ground import project
from vhdl_instances import instances

SECTIONS = ("Latency", "Throughput", "Equation")


def header_of(text: str) -> tuple[str, dict[str, str]]:
    """Split the header comment into its description and its named sections."""
    header = text[: re.search(r"^[^-]", text, re.M).start()]  # type: ignore[union-attr]
    comments = [line for line in header.splitlines() if "SPDX-License" not in line]
    lines = [line[3:] if line.startswith("-- ") else line[2:] for line in comments]
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


def declaration_table(text: str, kind: str) -> list[str]:
    """Make a Markdown table of what a source declares, "generic" or "port"; empty without any.

    A comment for several declarations is beside the first of them.
    """
    rows = declarations(text, kind)
    if not rows:
        return []
    last = "default" if kind == "generic" else "mode"
    lines = [f"| {kind} | type | {last} | meaning |", "| --- | --- | --- | --- |"]
    before = ""
    for row in rows:
        meaning = "" if row.comment == before else escaped(row.comment)
        before = row.comment
        type_name = escaped(row.type_name)
        third = row.default if kind == "generic" else row.mode
        if kind == "port" and row.default:
            third = f"{row.mode}, default {escaped(row.default)}"
        lines.append(f"| `{row.name}` | {type_name} | {third} | {meaning} |")
    return lines


def page(path: Path, folder: Path) -> str:
    """Make the page of one source file, for a folder of the project."""
    text = path.read_text()
    description, sections = header_of(text)
    source = path.relative_to(project.root())
    up = "../" * len(folder.relative_to(project.root()).parts)
    used = sorted(set(re.findall(r"entity work\.(\w+)", text)))
    lines = [
        f"# {path.stem}",
        "",
        f"Built by `make docs` from [`{source}`]({up}{source}).",
        "",
        # Text in columns (equations) stays unchanged.
        *(
            f"    {line}" if line.startswith("  ") else escaped(line)
            for line in description.splitlines()
        ),
        "",
    ]
    lines += [f"- **{name}:** {escaped(sections[name])}" for name in SECTIONS if name in sections]
    lines += [""] if sections else []
    for kind in ("generic", "port"):
        rows = declaration_table(text, kind)
        lines += [f"## {kind.title()}s", "", *rows, ""] if rows else []
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


def entity_pages(folder: Path) -> dict[Path, str]:
    """Make all pages, to be written into a folder of the project."""
    paths = hdl.all_sources()
    return {
        folder / "README.md": index(paths),
        **{folder / f"{path.stem}.md": page(path, folder) for path in paths},
    }


def instance_tree(tops: tuple[str, ...]) -> str:
    """Draw who instantiates whom; parts drawn before are not repeated."""
    sources = {path.stem: path for path in hdl.all_sources()}
    drawn: set[str] = set()

    def lines(entity: str, depth: int) -> list[str]:
        parts = {i.of: None for i in instances(sources[entity].read_text()) if i.of in sources}
        again = entity in drawn and bool(parts)
        drawn.add(entity)
        first = f"{'  ' * depth}{entity}{' (above)' if again else ''}"
        first = f"{first:<40}{sources[entity].parent.name}"
        return [first, *(line for part in parts if not again for line in lines(part, depth + 1))]

    trees = ["\n".join(lines(top, 0)) for top in tops]
    entities = {name for name, path in sources.items() if "\nentity " in path.read_text()}
    if missing := entities - drawn:
        raise ValueError(f"instantiated by no top: {', '.join(sorted(missing))}")
    return "```text\n" + "\n\n".join(trees) + "\n```"
