# SPDX-License-Identifier: Apache-2.0
"""Shared by all reports: Markdown with tables and pictures, and a description of the machine."""

import os
import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from plenofir.camera.plots import figure_pixels
from plenofir.ground.files import check_folder, publish
from plenofir.ground.images import encode_png
from plenofir.refocus import processors
from plenofir.refocus.operator import Image

Progress = Callable[[int, int], None]
Columns = Mapping[str, str | Callable[[Any], str]]
"""Head of a column to the cell of an item: a format, such as ``{.seconds:.2f}``, or a function."""


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    lines = [f"| {' | '.join(heads)} |", "| " + " | ".join("---" for _ in heads) + " |"]
    return [*lines, *(f"| {' | '.join(map(str, row))} |" for row in rows), ""]


def table_of(items: Iterable[Any], columns: Columns) -> list[str]:
    """Format a Markdown table with a row for each item."""
    cells = [cell.format if isinstance(cell, str) else cell for cell in columns.values()]
    return table(list(columns), [[cell(item) for cell in cells] for item in items])


class Report:
    """A page of Markdown with files beside it: all are written at the end, or nothing is."""

    def __init__(
        self, folder: Path, name: str, steps: int = 0, progress: Progress | None = None
    ) -> None:
        check_folder(folder, str(folder), [name])
        self._folder, self._name = folder, name
        self._lines: list[str] = []
        self._files: dict[str, bytes] = {}
        self._done, self._steps, self._progress = 0, steps, progress

    def say(self, *paragraphs: str) -> None:
        for paragraph in paragraphs:
            self._lines += [paragraph, ""]

    def add(self, lines: Iterable[str]) -> None:
        """Add lines, such as those of a table."""
        self._lines += lines

    def table(self, heads: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
        self.add(table(heads, rows))

    def table_of(self, items: Iterable[Any], columns: Columns) -> None:
        """Add a table with a row for each item."""
        self.add(table_of(items, columns))

    def picture(self, name: str, picture: Image | Figure, text: str = "") -> None:
        """Add a picture, ``name`` with ``.png``; `text` is its alternative text."""
        pixels = figure_pixels(picture) if isinstance(picture, Figure) else picture
        self._files[f"{name}.png"] = encode_png(pixels)
        self.say(f"![{text}]({name}.png)")

    def attach(self, name: str, content: bytes) -> None:
        """Add a file beside the page."""
        self._files[name] = content

    def step(self) -> None:
        self._done += 1
        if self._progress is not None:
            self._progress(self._done, self._steps)

    def write(self) -> Path:
        """Write the page and its pictures; returns the page."""
        publish({**self._files, self._name: "\n".join(self._lines)}, self._folder)
        return self._folder / self._name


def machine() -> str:
    """Processor, caches, load and versions of libraries."""
    name = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text().splitlines():
            if line.startswith("model name"):
                name = line.split(":", 1)[1].strip()
                break
    parts = [f"{name}, {processors()} processors"]
    caches = []
    for index in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        level, kind, size = ((index / n).read_text().strip() for n in ("level", "type", "size"))
        if kind != "Instruction":
            caches.append(f"L{level} {size}")
    if caches:
        parts.append(" ".join(caches))
    if hasattr(os, "getloadavg"):
        parts.append(f"load {os.getloadavg()[0]:.1f}")
    parts.append(f"Python {platform.python_version()}")
    parts += [f"{package} {version(package)}" for package in ("numpy", "numba", "scipy")]
    return ", ".join(parts)
