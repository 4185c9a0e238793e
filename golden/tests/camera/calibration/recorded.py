# SPDX-License-Identifier: Apache-2.0
"""A record of what the calibration computes, by which any change of it shows.

Each case runs a part of the calibration on input that is drawn from a seed. What it returns is
recorded, and for every function of the package that was called the number of calls and a digest of
all that it returned. The record tells that a change alters results, not whether they are right:
whoever alters them on purpose records anew, ``python golden/tests/camera/calibration/recorded.py``
(with names of cases, only those), and says in the change what altered and why.
"""

import functools
import importlib
import inspect
import json
import pkgutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

import plenofir.camera.calibration as package
from plenofir.ground.errors import InputError

RECORD = Path(__file__).with_name("recorded.json")
# Numbers of another processor differ by less than this share of them (in a digest, of the root mean
# square of all that the function returned), plus the lesser of a millionth and `_SMALL` of them,
# plus a least difference. First of results, then of digests.
_SHARE, _SMALL, _LEAST = (1e-6, 2e-5), 1e-4, (1e-6, 1e-9)
# Size of the centres' offsets in pixels, whose rounding remains in their differences.
_OF_CENTRES = 1e-3
# Functions that return nothing, or texts.
_UNTAPPED = {
    "no_grid",
    "lines",
    "order_of",
    "refine",
    "flatten",
    "divide",
    "redraw",
    "relight",
    "repeat_edges",
}


@dataclass(frozen=True)
class Case:
    """What is drawn, and what is done with it."""

    draw: Callable[[], Any]
    run: Callable[[Any], Any]


def numbers(value: Any) -> Iterator[np.ndarray]:
    """All numbers in a result."""
    if isinstance(value, np.ndarray):
        if value.dtype != object:
            flat = np.ascontiguousarray(value).ravel()
            yield (flat.view(flat.real.dtype) if np.iscomplexobj(flat) else flat).astype(np.float64)
    elif isinstance(value, bool | int | float | np.generic):
        yield np.array([value], dtype=np.float64)
    elif isinstance(value, dict):
        yield from numbers(list(value.values()))
    elif isinstance(value, list | tuple):
        if all(type(part) is float for part in value):
            yield np.array(value)
        else:
            for part in value:
                yield from numbers(part)
    elif isinstance(value, BaseModel):
        yield from numbers([getattr(value, name) for name in type(value).model_fields])
    elif is_dataclass(value):
        yield from numbers([getattr(value, field.name) for field in fields(value)])


_weights = np.empty(0)


def weights(count: int) -> np.ndarray:
    """Uneven weights from 1 to 2."""
    global _weights
    if len(_weights) < count:
        _weights = 1 + (np.arange(2 * count) * 0.7548776662466927) % 1
    return _weights[:count]


class Digest:
    """Number of results, root mean square of their numbers, and their sum with uneven weights."""

    def __init__(self) -> None:
        self.calls = self.count = 0
        self.squares = self.sum = 0.0

    def add(self, result: Any) -> None:
        """Another result."""
        self.calls += 1
        for values in numbers(result):
            square = float(values @ values)
            if not np.isfinite(square):
                values = np.nan_to_num(values, nan=-0.5, posinf=-1.0, neginf=-2.0)
                square = float(values @ values)
            self.squares += square
            self.sum += float(values @ weights(len(values))) * (1 + self.count % 7)
            self.count += len(values)

    def taken(self) -> list[float]:
        """As it is recorded."""
        count = max(self.count, 1)
        numbers = ((self.squares / count) ** 0.5, self.sum / count)
        return [self.calls, *(float(f"{n:.7g}") for n in numbers)]


@contextmanager
def tapped() -> Iterator[dict[str, Digest]]:
    """Digests of what all functions of the package return meanwhile, by name."""
    digests: dict[str, Digest] = {}

    def tap(name: str, work: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(work)
        def tapping(*arguments: Any, **options: Any) -> Any:
            result = work(*arguments, **options)
            digests.setdefault(name, Digest()).add(result)
            return result

        return tapping

    names = [f"{package.__name__}.{one.name}" for one in pkgutil.iter_modules(package.__path__)]
    modules = [package, *map(importlib.import_module, names)]
    before: list[tuple[Any, str, Any]] = []
    replaced: dict[int, Callable[..., Any]] = {}
    for module in modules:
        short = module.__name__.rsplit(".", 1)[1]
        for name, value in list(vars(module).items()):
            if getattr(value, "__module__", "") != module.__name__ or name in _UNTAPPED:
                continue
            if inspect.isfunction(value):
                replaced[id(value)] = tap(f"{short}.{name}", value)
            elif inspect.isclass(value) and not issubclass(value, Enum):
                for own, method in list(vars(value).items()):
                    if own.startswith("__") or own in _UNTAPPED:
                        continue
                    if inspect.isfunction(method):
                        before.append((value, own, method))
                        setattr(value, own, tap(f"{short}.{own}", method))
                    elif isinstance(method, property) and method.fget is not None:
                        before.append((value, own, method))
                        setattr(value, own, property(tap(f"{short}.{own}", method.fget)))
    for module in modules:
        for name, value in list(vars(module).items()):
            if id(value) in replaced:
                before.append((module, name, value))
                setattr(module, name, replaced[id(value)])
    try:
        yield digests
    finally:
        for owner, name, value in before:
            setattr(owner, name, value)


def plain(value: Any) -> Any:
    """A result as JSON holds it."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, float):
        return float(f"{value:.9g}") if np.isfinite(value) else str(value)
    if isinstance(value, dict):
        return {str(key): plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    return value


def measured(case: Case) -> dict[str, Any]:
    """What a case gives."""
    drawn = case.draw()
    with tapped() as digests:
        try:
            result = case.run(drawn)
        except InputError as error:
            result = {"refused": str(error)}
    parts = {name: digest.taken() for name, digest in sorted(digests.items())}
    return {"result": plain(result), "digests": plain(parts)}


def differences(found: Any, known: Any, where: str = "", scale: float = 0.0) -> Iterator[str]:
    """Where a result differs from the record by more than another machine's rounding."""
    if isinstance(known, dict) and isinstance(found, dict):
        for name in [*known, *(name for name in found if name not in known)]:
            if name not in found or name not in known:
                yield f"{where}{name}: {'gone' if name in known else 'new'}"
                continue
            more = abs(known[name][1]) if where == "digests/" else scale
            more += _OF_CENTRES if name == "growing.repeated" else 0
            yield from differences(found[name], known[name], f"{where}{name}/", more)
    elif isinstance(known, list) and isinstance(found, list) and len(known) == len(found):
        for n, (one, other) in enumerate(zip(found, known, strict=True)):
            yield from differences(one, other, f"{where}{n}/", scale)
    elif isinstance(known, float) and isinstance(found, float | int):
        size, kind = max(abs(known), scale), scale > 0
        slack = _SHARE[kind] * size + min(1e-6, _SMALL * size) + _LEAST[kind]
        if abs(found - known) > slack:
            yield f"{where[:-1]}: {known} became {found}"
    elif found != known:
        yield f"{where[:-1]}: {known!r} became {found!r}"


def record() -> dict[str, Any]:
    """The record."""
    return dict(json.loads(RECORD.read_text())) if RECORD.exists() else {}


def main(names: list[str]) -> None:
    """Record anew, and say what altered."""
    from recorded_cases import CASES

    known = {name: one for name, one in record().items() if name in CASES}
    for name in names or CASES:
        found = measured(CASES[name])
        altered = list(differences(found, known.get(name, {})))
        print(
            f"{name}: {len(altered)} numbers altered",
            *(line[:150] for line in altered[:3]),
            sep="\n    ",
        )
        known[name] = found
    lines = [
        f"{json.dumps(name)}: {{\n"
        + ",\n".join(
            f"  {json.dumps(part)}: "
            + (
                "{\n"
                + ",\n".join(f"    {json.dumps(k)}: {json.dumps(v)}" for k, v in one.items())
                + "\n  }"
                if isinstance(one, dict)
                else json.dumps(one)
            )
            for part, one in known[name].items()
        )
        + "\n}"
        for name in CASES
    ]
    RECORD.write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
