# SPDX-License-Identifier: Apache-2.0
"""Rows and columns of views in the names of their files."""

import re
from itertools import combinations
from math import isqrt
from pathlib import Path

from plenofir.ground.errors import InputError

Places = dict[tuple[int, int], Path]

_SUFFIXES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm", ".ppm"}
_ADVICE = "views (M x M) have their row and column, or a running number, in their names"


def _numbers(path: Path) -> list[int]:
    """Whole numbers in a name; coordinates as some data sets have them (-776.88) do not count."""
    return [int(n) for n in re.findall(r"(?<![\d.])\d+(?![\d.]*\.\d|\d)", path.stem)]


def arrange(paths: list[Path], where: str) -> Places:
    """Find row and column of views in their names."""
    # Two of the numbers in the names must run through a full square of rows and columns
    # (``view_03_07``, ``IMG_0002_013_02_08``, ``out_03_07_-776.8_-12.1``); otherwise one must run
    # through a square number of views, line by line (``Cam042``).
    m = isqrt(len(paths))
    numbers = [_numbers(path) for path in paths]
    fields = min((len(n) for n in numbers), default=0)
    if len({len(n) for n in numbers}) > 1:
        raise InputError(f"some names have more numbers than others; {_ADVICE}", where=where)
    columns = [sorted({n[k] for n in numbers}) for k in range(fields)]
    # The last pair that fits: exposures and dates come before it.
    for first, second in reversed(list(combinations(range(fields), 2))):
        a, b = columns[first], columns[second]
        pairs = {(n[first], n[second]) for n in numbers}
        if len(a) == len(b) == m and len(pairs) == m * m == len(paths):
            return {
                (a.index(n[first]), b.index(n[second])): path
                for n, path in zip(numbers, paths, strict=True)
            }
    for field in reversed(range(fields)):
        run = columns[field]
        if len(run) == len(paths) == m * m and run[-1] - run[0] == len(run) - 1:
            return {
                divmod(n[field] - run[0], m): path for n, path in zip(numbers, paths, strict=True)
            }
    found = f"{len(paths)} files" if len(paths) != m * m else "no rows and columns in the names"
    raise InputError(f"{found}; {_ADVICE}", where=where)


def image_paths(folder: Path) -> list[Path]:
    """Pictures of a folder, by name."""
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES)
