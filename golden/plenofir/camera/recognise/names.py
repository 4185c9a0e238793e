# SPDX-License-Identifier: Apache-2.0
"""Which files of a folder are views, and where each belongs, by their names.

What lies beside the views (thumbnails, texts, maps of depth, hidden files) has other names and is
left alone; a view that is missing is named.
"""

import re
from collections.abc import Sequence
from itertools import combinations, pairwise
from math import isqrt
from pathlib import Path
from typing import NamedTuple

from plenofir.ground.errors import InputError

Places = dict[tuple[int, int], Path]

_SUFFIXES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm", ".ppm"}
_ADVICE = (
    "views (R x C) have their row and column, or a running number, in their names, or a folder for "
    "each row"
)
# Coordinates, as some data sets have them (-776.88), do not count, unless there is nothing else
# (``lion.3.7``).
_NUMBER, _BETWEEN_DOTS = re.compile(r"(?<![\d.])\d+(?![\d.]*\.\d|\d)"), re.compile(r"\d+")
_ANY_NUMBER = re.compile(r"[-+]?\d+(\.\d+)*")
# Words of names that are no views where there are others.
_NOT_VIEWS = re.compile(
    r"gt_|depth|disp|mask|label|normal|segment|objectid|thumb|preview|conf|albedo|flow", re.I
)
_NOT_FOLDERS = {"__MACOSX", "@eaDir"}
# Archives put their views one or two folders down; folders below those are other data.
_DEEPEST = 3
# A grid with fewer of its views than this share tells nothing.
_SHARE = 0.75
_NAMED = 3


class Named(NamedTuple):
    """Views by their names."""

    places: Places  # of (row, column); in one row where `running`
    # Whether one number runs through all names: their motion tells how many stand in a row.
    running: bool
    notes: tuple[str, ...] = ()  # what was left alone


def picture_files(folder: Path) -> list[Path]:
    """Pictures that may be views: of a folder, of its only folder with any, or of one a row."""
    return _pictures(folder, _DEEPEST)


def _visible(folder: Path) -> list[Path]:
    return sorted(p for p in folder.iterdir() if p.name[0] != "." and p.name not in _NOT_FOLDERS)


def _pictures(folder: Path, deepest: int) -> list[Path]:
    entries = _visible(folder)
    pictures = [p for p in entries if p.suffix.lower() in _SUFFIXES and p.is_file()]
    if pictures or deepest == 0:
        return pictures
    parts = {p: files for p in entries if p.is_dir() if (files := _pictures(p, deepest - 1))}
    # Rows of one light field have equal counts; other folders are data sets of their own.
    if len(parts) > 1 and len({len(files) for files in parts.values()}) > 1:
        names = ", ".join(p.name for p in list(parts)[:_NAMED])
        raise InputError(
            f"has {len(parts)} folders of pictures ({names}); name the one of the views",
            where=str(folder),
        )
    return [path for files in parts.values() for path in files]


def named_views(paths: Sequence[Path], folder: Path) -> Named:
    """Find the views among pictures, and row and column of each, in the names below a folder.

    Two of the numbers in the names run through all rows and columns (``view_03_07``,
    ``IMG_0002_013_02_08``, ``out_03_07_-776.8_-12.1``, ``03/07``); otherwise one runs through all
    views (``Cam042``). Raises `InputError`, which names what is missing or too much.
    """
    where = str(folder)
    if not paths:
        raise InputError(f"has no image files; {_ADVICE}", where=where)
    names = {path: path.relative_to(folder).as_posix() for path in paths}
    groups: dict[str, list[Path]] = {}
    for path in paths:
        groups.setdefault(_ANY_NUMBER.sub("#", names[path]), []).append(path)
    fitting = {}
    for pattern, group in groups.items():
        if len(group) > 1 and (views := _arranged([names[p] for p in group], group)) is not None:
            fitting[pattern] = views
    most = max((len(views.places) for views in fitting.values()), default=0)
    likely = {p: views for p, views in fitting.items() if not _NOT_VIEWS.search(p)} or fitting
    likely = {p: views for p, views in likely.items() if 4 * len(views.places) >= most}
    if len(likely) > 1:
        raise InputError(
            f"has {len(likely)} sets of pictures that can be views "
            f"({', '.join(list(likely)[:_NAMED])}); leave one of them there",
            where=where,
        )
    if not likely:
        largest = max(groups.values(), key=len)
        raise InputError(_problem([names[p] for p in largest], len(paths)), where=where)
    pattern, views = next(iter(likely.items()))
    others = [names[p] for p in paths if p not in set(groups[pattern])]
    if others and len(others) >= len(views.places) and not _NOT_VIEWS.search(" ".join(others)):
        text = f"{len(views.places)} of {len(paths)} pictures have rows and columns in their names"
        raise InputError(f"{text}; {_ADVICE}", where=where)
    note = f"left alone: {_listed(others)}, named otherwise than the views"
    return views._replace(notes=(note,) if others else ())


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "")


def _columns(
    names: Sequence[str], number: re.Pattern[str] = _NUMBER
) -> tuple[list[list[int]], list[list[int]]] | None:
    """Numbers of each name, and the values of each of these fields."""
    numbers = [[int(n) for n in number.findall(name.rpartition(".")[0])] for name in names]
    if len({len(n) for n in numbers}) > 1:
        return None
    return numbers, [sorted({n[k] for n in numbers}) for k in range(len(numbers[0]))]


def _arranged(names: Sequence[str], paths: Sequence[Path]) -> Named | None:
    """Rows and columns of names; None where they have none, or not all of them."""
    return _by(_NUMBER, names, paths) or _by(_BETWEEN_DOTS, names, paths)


def _by(number: re.Pattern[str], names: Sequence[str], paths: Sequence[Path]) -> Named | None:
    fields = _columns(names, number)
    if fields is None:
        return None
    numbers, columns = fields
    # The last pair that fits: exposures and dates come before it. A square is the likelier one.
    pairs = list(reversed(list(combinations(range(len(columns)), 2))))
    for square in (True, False):
        for first, second in pairs:
            a, b = columns[first], columns[second]
            if min(len(a), len(b)) < 2 or (square and len(a) != len(b)):
                continue
            places = {
                (a.index(n[first]), b.index(n[second])): path
                for n, path in zip(numbers, paths, strict=True)
            }
            if len(a) * len(b) == len(places) == len(paths):
                return Named(places, running=False)
    for field in reversed(range(len(columns))):
        run = columns[field]
        if len(run) == len(paths) and len({b - a for a, b in pairwise(run)}) == 1:
            places = {
                (0, run.index(n[field])): path for n, path in zip(numbers, paths, strict=True)
            }
            return Named(places, running=True)
    return None


def _problem(names: Sequence[str], count: int) -> str:
    """Why pictures are no views, of the largest group of alike names."""
    fields = _columns(names)
    if fields is None:
        return f"some names have more numbers than others; {_ADVICE}"
    numbers, columns = fields
    # The last numbers of a name count views; those in front are dates and numbers of scenes.
    for first, second in reversed(list(combinations(range(len(columns)), 2))):
        a, b = columns[first], columns[second]
        pairs = {(n[first], n[second]) for n in numbers}
        whole = len(a) * len(b)
        if min(len(a), len(b)) > 1 and len(pairs) == len(names) and len(names) >= _SHARE * whole:
            gone = [(x, y) for x in a for y in b if (x, y) not in pairs]
            named = [_other(names[0], {first: x, second: y}) for x, y in gone]
            return f"of {len(a)} x {len(b)} views {_listed(named)} {_is(named)} missing"
    for field in reversed(range(len(columns))):
        run = columns[field]
        if len(run) == len(names) > 1 and len(run) >= _SHARE * (run[-1] - run[0] + 1):
            gone_numbers = sorted(set(range(run[0], run[-1] + 1)) - set(run))
            named = [_other(names[0], {field: number}) for number in gone_numbers]
            return f"of {len(run) + len(named)} views {_listed(named)} {_is(named)} missing"
    m = isqrt(count)
    count_text = f"{count} files" if count != m * m else "no rows and columns in the names"
    return f"{count_text}; {_ADVICE}"


def _is(names: Sequence[str]) -> str:
    return "is" if len(names) == 1 else "are"


def _other(name: str, numbers: dict[int, int]) -> str:
    """A name with other numbers in some of its fields."""
    stem, dot, suffix = name.rpartition(".")
    field = -1

    def changed(match: re.Match[str]) -> str:
        nonlocal field
        field += 1
        text = match[0]
        return f"{numbers[field]:0{len(text)}}" if field in numbers else text

    return _NUMBER.sub(changed, stem) + dot + suffix
