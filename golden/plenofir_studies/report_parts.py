# SPDX-License-Identifier: Apache-2.0
"""What all reports share: Markdown tables, and the machine that something was measured on."""

import os
import platform
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from pathlib import Path

from plenofir.refocus import processors


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Format a Markdown table."""
    lines = [f"| {' | '.join(heads)} |", "| " + " | ".join("---" for _ in heads) + " |"]
    return [*lines, *(f"| {' | '.join(row)} |" for row in rows), ""]


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
