# SPDX-License-Identifier: Apache-2.0
"""The page of a folder of pictures: what ``make sim`` leaves, two at a time."""

import json
from collections.abc import Callable, Iterable
from math import ceil
from pathlib import Path
from typing import Any

from plenofir.camera.exposure import exposure
from plenofir.ground.errors import InputError
from plenofir.ground.files import as_text, checksum, input_file
from plenofir.ground.images import Picture, encode_png, read_picture
from plenofir.view.mosaic import planes
from plenofir.view.page import Page, Part, PartRequest

REPORT = "report.json"
# In this order: the VHDL beside its golden model.
_FIRST = ("refocused", "golden", "diff")
# Files of that many times the limit are refused before they are packed.
_FAR = 2
# Files may be packed better than parts are.
_MORE = 1.2
# Pictures that do not show a scene are not exposed.
_MAPS = ("diff", "depth", "confidence", "sharpness")


def _order(path: Path) -> tuple[str, int, str]:
    kind, _, rest = path.stem.partition("_")
    is_listed = kind in _FIRST
    return (rest if is_listed else "~", _FIRST.index(kind) if is_listed else 0, path.name)


def pictures_page(folder: Path, title: str = "") -> Page:
    """Make the page of a folder of PNG files, two at least.

    For results of ``make sim`` the refocused picture comes first, beside that of the golden model;
    InputError if one of them is not from the run of ``report.json``. Pictures are read at each
    request, so a reload shows a new run.
    """
    files = {as_text(path.name): path for path in sorted(folder.glob("*.png"), key=_order)}
    if len(files) < 2:
        raise InputError(
            f"has {len(files)} pictures; name a folder with two or more (PNG), such as "
            "make sim leaves",
            where=str(folder),
        )
    for path in files.values():
        _read(path)
    first = next(iter(files.values()))

    def part(path: Path) -> Callable[[PartRequest], Part]:
        return lambda _: _part(path, first)

    notes = _of_report(folder / REPORT)
    field = {"title": title or as_text(folder), "pictures": list(files), "notes": notes}
    parts = {name: part(path) for name, path in files.items()}
    return Page(
        "pictures.html",
        ("tone.js", "source.js", "pane.js", "pictures.js"),
        field,
        parts,
        lambda limit: (field, _within(parts, limit, files.values())),
    )


def _report(path: Path) -> dict[str, Any]:
    """The report of a run; empty if there is none."""
    try:
        report: Any = json.loads(input_file(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return report if isinstance(report, dict) else {}


def _read(path: Path) -> Picture:
    """A picture of the folder; InputError if it is not from the report's run."""
    checksums = _report(path.with_name(REPORT)).get("sha256")
    picture = read_picture(path)
    if isinstance(checksums, dict) and checksums.get(path.name) != checksum(path):
        problem = "was changed since" if path.name in checksums else "is not of"
        raise InputError(
            f"{problem} the run that {REPORT} tells of; run make sim again, or move it elsewhere",
            where=str(path),
        )
    return picture


def _part(path: Path, first: Path) -> Part:
    """A picture for the browser, which decodes 8 bits: 16 bits in two parts."""
    picture = _read(path)
    pixels = picture.pixels
    look = exposure(picture, 1, "off", 1.0)
    if not path.stem.startswith(_MAPS):
        # Compared pictures have the same exposure.
        alike = _read(first)
        same = picture[1:] == alike[1:] and pixels.dtype == alike.pixels.dtype
        look = exposure(alike if same else picture, 1)
    stored = exposure(picture, 1, "off")
    deep = pixels.dtype.itemsize > 1
    facts = {
        "bits": str(8 * pixels.dtype.itemsize),
        "channels": str(pixels.shape[2] if pixels.ndim == 3 else 1),
        "exposure": json.dumps({"auto": look._asdict(), "stored": stored._asdict()}),
    }
    return Part(encode_png(planes(pixels) if deep else pixels), "image/png", facts)


def _of_report(path: Path) -> list[str]:
    """The comparison with the golden model, from the report of a simulation."""
    report = _report(path)
    notes = []
    if "mismatches" in report:
        notes.append(f"{report['mismatches']} pixels differ between VHDL and golden model.")
        if "sha256" not in report:
            notes.append("Not checked: the report is of an older version, without checksums.")
    return notes


def _within(
    parts: dict[str, Callable[[PartRequest], Part]], limit: int, files: Iterable[Path]
) -> dict[str, Part]:
    """All parts, in at most `limit` bytes; where files are far too large they are not packed."""
    size = sum(path.stat().st_size for path in files)
    contents: dict[str, Part] = {}
    if size <= _FAR * limit:
        contents = {name: make(PartRequest()) for name, make in parts.items()}
        size = sum(len(part.content) for part in contents.values())
    if size > limit:
        # Base64 has four bytes for three; and the page itself.
        least = ceil(size * 4 / 3e6 * _MORE) + 1
        raise InputError(
            f"{size / 1e6:.1f} MB of pictures do not fit; give {least} or more", where="limit"
        )
    return contents
