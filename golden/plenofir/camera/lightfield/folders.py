# SPDX-License-Identifier: Apache-2.0
"""Views as image files in a folder, whatever their names."""

import re
from collections.abc import Callable
from itertools import combinations
from math import isqrt
from pathlib import Path
from typing import Literal

import numpy as np

from plenofir.camera.lightfield.indexing import views
from plenofir.ground.errors import InputError
from plenofir.ground.images import Image, Picture, read_picture, write_png

ViewOrder = Literal["rows", "columns"]
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


def read_views(
    folder: Path,
    *,
    order: ViewOrder = "rows",
    progress: Callable[[int, int], None] | None = None,
) -> Image:
    """Read the views of a light field from a folder.

    `folder`: folder with M x M images and no others. `order`: "rows": the first number in the names
    counts downwards, the second to the right; "columns": the other way round. Result: shape (v, u,
    t, s[, 3]), as `plenofir.camera.lightfield.compose` takes it. Raises `InputError` if the folder,
    the names or the images cannot be used.
    """
    return read_views_picture(folder, order=order, progress=progress).pixels


def read_views_picture(
    folder: Path,
    *,
    order: ViewOrder = "rows",
    progress: Callable[[int, int], None] | None = None,
) -> Picture:
    """The views of `read_views`, with what their files say of the numbers."""
    if not folder.is_dir():
        raise InputError(f"no such folder; {_ADVICE}", where=str(folder))
    if order not in ("rows", "columns"):
        raise InputError(f"there is no order {order!r}; use rows or columns")
    paths = image_paths(folder)
    if not paths:
        raise InputError(f"has no image files; {_ADVICE}", where=str(folder))
    places = arrange(paths, str(folder))
    if order == "columns":
        places = {(row, column): path for (column, row), path in places.items()}
    return read_paths(places, progress=progress)


def read_paths(places: Places, *, progress: Callable[[int, int], None] | None = None) -> Picture:
    """Read views of one size and depth by their places, a full square: shape (v, u, t, s[, 3])."""
    m = isqrt(len(places))
    first: Picture | None = None
    for done, (place, path) in enumerate(sorted(places.items()), 1):
        picture = read_picture(path)
        image = picture.pixels
        if first is None:
            result = np.empty((m, m, *image.shape), dtype=image.dtype)
            first = picture
        if image.shape != first.pixels.shape or image.dtype != result.dtype:
            raise InputError(
                f"has shape {image.shape} and type {image.dtype}; the first view has "
                f"{first.pixels.shape} and {result.dtype}",
                where=str(path),
            )
        if picture.full_scale != first.full_scale:
            raise InputError(
                f"counts {picture.full_scale} as white, the first view {first.full_scale}",
                where=str(path),
            )
        result[place] = image
        if progress is not None:
            progress(done, len(places))
    assert first is not None
    return first.like(result)


def named_views(raw: Image, m: int) -> dict[str, Image]:
    """Views with the names of their files."""
    images = views(raw, m)
    digits = max(2, len(str(m - 1)))
    return {
        f"view_{v:0{digits}}_{u:0{digits}}.png": images[v, u] for v in range(m) for u in range(m)
    }


def write_views(raw: Image, micro_image_size: int, folder: Path) -> list[Path]:
    """Write the views of a raw image, see `named_views`."""
    paths = []
    for name, image in named_views(raw, micro_image_size).items():
        write_png(folder / name, np.ascontiguousarray(image))
        paths.append(folder / name)
    return paths
