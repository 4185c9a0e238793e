# SPDX-License-Identifier: Apache-2.0
"""The page of a folder of pictures: what ``make sim`` leaves, two at a time."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from plenofir.ground.errors import InputError
from plenofir.ground.files import as_text, input_file
from plenofir.ground.images import read_image
from plenofir.view.page import Page, Part, Wanted

_EXPECTED = "a folder with two pictures (PNG) or more, such as make sim leaves"
# In this order: the VHDL beside its golden model.
_FIRST = ("refocused", "golden", "diff")


def _order(path: Path) -> tuple[str, int, str]:
    kind, _, rest = path.stem.partition("_")
    known = kind in _FIRST
    return (rest if known else "~", _FIRST.index(kind) if known else 0, path.name)


def pictures_page(folder: Path, title: str = "") -> Page:
    """Make the page of a folder of PNG files, two at least.

    Of those of ``make sim`` the refocused picture comes first, beside that of the golden model.
    When pictures are asked for they are read again: a new run shows by a reload.
    """
    files = {as_text(path.name): path for path in sorted(folder.glob("*.png"), key=_order)}
    if len(files) < 2:
        raise InputError(f"{len(files)} pictures", where=str(folder), expected=_EXPECTED)
    deep = [name for name, path in files.items() if read_image(path).dtype.itemsize > 1]
    notes = _of_report(folder / "report.json")
    if deep:
        notes.append("The browser shows 16 bit pictures with 8 bit.")

    def part(path: Path) -> Callable[[Wanted], Part]:
        return lambda _: Part(input_file(path).read_bytes(), "image/png")

    field = {"title": title or as_text(folder), "pictures": list(files), "notes": notes}
    parts = {name: part(path) for name, path in files.items()}
    return Page(
        "pictures.html",
        ("source.js", "pictures.js"),
        field,
        parts,
        lambda limit: (field, _within(parts, limit, folder)),
    )


def _of_report(path: Path) -> list[str]:
    """What the report of a simulation says about the comparison with the golden model."""
    try:
        report: Any = json.loads(input_file(path).read_text())
        mismatches = report["mismatches"]
    except (OSError, ValueError, KeyError, TypeError):
        return []
    return [f"{mismatches} pixels differ between VHDL and golden model."]


def _within(
    parts: dict[str, Callable[[Wanted], Part]], limit: int, folder: Path
) -> dict[str, Part]:
    made = {name: make(Wanted()) for name, make in parts.items()}
    size = sum(len(part.content) for part in made.values()) * 4 // 3
    if size > limit:
        raise InputError(
            f"{size / 1e6:.1f} MB of pictures",
            where=str(folder),
            expected=f"at most {limit / 1e6:g} MB, or another --limit",
        )
    return made
