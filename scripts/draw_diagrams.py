# SPDX-License-Identifier: Apache-2.0
"""Draw the block diagrams of the documentation, docs/images/*.svg: see `diagrams.py`.

Usage: python scripts/draw_diagrams.py [--check]

With --check nothing is written; exit code 1 if a drawing is missing or stale, or if a block has
the name of no entity.
"""

import sys
from html import escape

from diagrams import DIAGRAMS, Diagram, Point
from plenofir import project

IMAGES = project.root() / "docs" / "images"

COLOURS = {
    "outside": "#eeeeee",
    "io": "#f9d5d3",
    "half": "#fde7c4",
    "pixel": "#d6ead0",
    "tx": "#d3e5f5",
    "control": "#e5daf0",
    "frame": "none",
}


def _text(point: Point, text: str, *, anchor: str = "middle", bold: bool = False) -> str:
    weight = ' font-weight="bold"' if bold else ""
    at = f'x="{point[0]:g}" y="{point[1]:g}" text-anchor="{anchor}"{weight}'
    return f"<text {at}>{escape(text)}</text>"


def svg(diagram: Diagram) -> str:
    """Drawing as SVG."""
    size = f"{diagram.width} {diagram.height}"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}" '
        'font-family="sans-serif" font-size="12">',
        '<marker id="head" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" '
        'orient="auto"><path d="M0,0 L8,4 L0,8 z"/></marker>',
        f'<rect width="{diagram.width}" height="{diagram.height}" fill="white"/>',
    ]
    for box in diagram.boxes:
        frame = box.colour == "frame"
        dash = ' stroke-dasharray="5 3"' if frame else ""
        parts.append(
            f'<rect x="{box.x}" y="{box.y}" width="{box.width}" height="{box.height}" rx="4" '
            f'fill="{COLOURS[box.colour]}" stroke="#444444"{dash}/>'
        )
        middle = box.y + box.height / 2 - 8 * (len(box.lines) - 1) + 4
        top = box.y + 17 if frame else middle
        for i, line in enumerate(box.lines):
            parts.append(_text((box.x + box.width / 2, top + 16 * i), line, bold=i == 0))
    for points, label, place in diagram.arrows:
        path = " ".join(f"{x},{y}" for x, y in points)
        parts.append(
            f'<polyline points="{path}" fill="none" stroke="black" marker-end="url(#head)"/>'
        )
        if label:
            parts.append(_text(place, label))
    parts += [_text(place, text) for place, text in diagram.notes]
    for i, (colour, name) in enumerate(diagram.legend.items()):
        x, y = diagram.legend_at[0], diagram.legend_at[1] + 30 * i
        parts.append(
            f'<rect x="{x}" y="{y}" width="20" height="18" fill="{COLOURS[colour]}" '
            'stroke="#444444"/>'
        )
        parts.append(_text((x + 28, y + 13), name, anchor="start"))
    return "\n".join([*parts, "</svg>", ""])


def unknown_names() -> list[str]:
    """Bold names with an underscore that are no entity of hdl/."""
    entities = {path.stem for path in (project.root() / "hdl").rglob("*.vhd")}
    names = {box.lines[0].split()[0] for d in DIAGRAMS.values() for box in d.boxes}
    return sorted(name for name in names if "_" in name and name not in entities)


def main() -> int:
    """Write or check the drawings."""
    if names := unknown_names():
        print(f"scripts/draw_diagrams.py: {', '.join(names)}: no such entity", file=sys.stderr)
        return 1
    for name, diagram in DIAGRAMS.items():
        path = IMAGES / f"{name}.svg"
        text = svg(diagram)
        if "--check" not in sys.argv[1:]:
            path.write_text(text)
        elif not path.exists() or path.read_text() != text:
            print(f"{path.relative_to(project.root())} is stale; run make docs", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
