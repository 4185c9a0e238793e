# SPDX-License-Identifier: Apache-2.0
"""Extreme inputs: largest sums, unusual frames, and weak points of floating point."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from math import isnan, nan
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import numpy.typing as npt

from plenofir.refocus import ExactArithmetic, StoredProductArithmetic, refocus
from plenofir.refocus.division import division
from plenofir.refocus.operator import Image
from plenofir_studies import DATA
from plenofir_studies.methods import exact_sums, in_hardware, running_sums, shift_and_sum
from plenofir_studies.records import save_records
from plenofir_studies.report_parts import Progress, Report, machine, table

Work = Callable[[Any, int, int], Any]

_LENGTHS = tuple(10**power for power in range(3, 9))
_CHUNK = 10**7
_RECORDED = DATA / "refocus_stability.json"


@dataclass(frozen=True)
class Outcome:
    """One extreme input."""

    group: str  # what makes it hard
    case: str
    # largest error of each method in grey levels, beyond correct rounding if the result is rounded;
    # inf if it is wrongly nan
    errors: dict[str, float]


def _fast(raw: Image, m: int, shift: int) -> Image:
    return refocus(raw, m, Fraction(shift, m))


METHODS: dict[str, Work] = {
    "refocus": _fast,
    "reference": in_hardware(ExactArithmetic()),
    "core, F = 8, G = 2": in_hardware(StoredProductArithmetic()),
    "shift and sum, float64": partial(shift_and_sum, kind=np.float64),
    "shift and sum, float32": partial(shift_and_sum, kind=np.float32),
    "running sums, float64": partial(running_sums, kind=np.float64),
    "running sums, float32": partial(running_sums, kind=np.float32),
}
"""Ways that are compared; the first three take integers only."""
FLOATING = tuple(name for name in METHODS if "float" in name)


def _errors(raw: Image, m: int, shift: int) -> dict[str, float]:
    exact = exact_sums(raw, m, shift)
    errors = {}
    for name, work in METHODS.items():
        # Shifting takes M^2 passes over the frame, which are slow on long lines.
        if name.startswith("shift") and m * m * raw.size > 1e8:
            continue
        image = work(raw, m, shift)
        want = np.floor(exact + 0.5) if np.issubdtype(image.dtype, np.integer) else exact
        errors[name] = float(np.abs(image - want).max())
    return errors


def frames() -> Iterator[tuple[str, str, Image, int, int]]:
    """Extreme frames that integers can hold."""
    rng = np.random.default_rng(0)

    def random(rows: int, columns: int, kind: type = np.uint16) -> Image:
        return rng.integers(0, np.iinfo(kind).max, (rows, columns), kind, endpoint=True)

    for m, shift in ((5, -3), (11, 1), (11, 7), (16, 3)):
        white = np.full((20 * m, 20 * m), 65535, np.uint16)
        yield "all white (flat), 16 bit", f"M = {m}, a' = {shift}", white, m, shift
    for place in ((0, 0), (31, 17), (54, 54)):
        impulse = np.zeros((55, 55), np.uint16)
        impulse[place] = 65535
        yield "one pixel", f"at {place}, M = 11, a' = 4", impulse, 11, 4
    yield "M = 1", "a' = 7", random(50, 60), 1, 7
    for m, shift in ((2, 1), (4, 2), (4, 3), (10, -4), (100, 50)):
        yield "even M", f"M = {m}, a' = {shift}", random(3 * m + 1, 4 * m + 3), m, shift
    for shift in (1, -98, 1000):
        yield "M = 99", f"a' = {shift}", random(300, 320), 99, shift
    for shift in (1000, -1000, 10**6, -(10**6)):
        for m in (3, 11):
            yield "a' to +-10^6", f"M = {m}, a' = {shift}", random(200, 2200), m, shift
    for m, shift in ((3, 1), (11, -5), (99, 1000)):
        yield "one micro image", f"M = {m}, a' = {shift}", random(m, m), m, shift
    yield "1 x 20000", "M = 1, a' = 3", random(1, 20000), 1, 3
    for m, shift in ((5, 3), (11, 7)):
        yield f"{m} x 20000", f"M = {m}, a' = {shift}", random(m, 20000), m, shift
    few = np.where(rng.random((200, 2000)) < 0.001, 65535, 1).astype(np.uint16)
    yield "contrast", "65535 to 1, M = 11, a' = 7", few, 11, 7


def floating_frames() -> Iterator[tuple[str, str, npt.NDArray[np.float64], int, int]]:
    """Extreme frames that only floating point can hold."""
    rng = np.random.default_rng(1)
    plain = rng.random((100, 2000)) + 1
    spike = plain.copy()
    spike[50, 1000] = 1e9
    yield "contrast of 10^9", "one pixel of 1e9 among 1 to 2", spike, 5, 3
    half = plain.copy()
    half[:, :1000] *= 1e9
    yield "contrast of 10^9", "left half 1e9, right half 1", half, 5, 3
    yield "denormals", "1e-42", np.full((100, 200), 1e-42), 5, 3
    broken = plain.copy()
    broken[50, 1000] = np.nan
    yield "nan", "one pixel", broken, 5, 3


def _float_errors(raw: npt.NDArray[np.float64], m: int, shift: int) -> dict[str, float]:
    """Largest error relative to each pixel's exact value, where the exact value is no nan."""
    exact = shift_and_sum(raw, m, shift, np.longdouble)
    errors = {}
    for name in FLOATING:
        with np.errstate(invalid="ignore"):
            image = METHODS[name](raw, m, shift)
        judged = ~np.isnan(exact) & (exact != 0)
        distance = np.abs(image[judged] - exact[judged]) / np.abs(exact[judged])
        errors[name] = float("inf") if np.isnan(distance).any() else float(distance.max())
    return errors


def outcomes(progress: Progress | None = None) -> tuple[list[Outcome], list[Outcome]]:
    whole, floating = list(frames()), list(floating_frames())
    total = len(whole) + len(floating)
    integers, floats = [], []
    for group, case, raw, m, shift in whole:
        integers.append(Outcome(group, case, _errors(raw, m, shift)))
        if progress is not None:
            progress(len(integers), total)
    for group, case, values, m, shift in floating:
        floats.append(Outcome(group, case, _float_errors(values, m, shift)))
        if progress is not None:
            progress(len(integers) + len(floats), total)
    return integers, floats


def long_sums(lengths: tuple[int, ...] = _LENGTHS) -> dict[str, list[float]]:
    """Error of the mean of M = 5 neighbours at the end of an ever longer line."""
    m, tail = 5, 1000
    rng = np.random.default_rng(0)
    carried: dict[str, Any] = {"float32": np.float32(0), "float64": np.float64(0)}
    errors: dict[str, list[float]] = {f"running sums, {kind}": [] for kind in carried}
    summed = 0
    for length in lengths:
        while summed < length:
            count = min(_CHUNK, length - summed)
            part = rng.integers(0, 65536, count)
            for name, before in carried.items():
                kind = np.dtype(name).type
                sums = np.cumsum(np.concatenate(([before], part.astype(kind))), dtype=kind)
                carried[name] = sums[-1]
                if summed + count == length:
                    last = sums[-min(tail, count - m) :]
                    first = sums[-min(tail, count - m) - m : -m]
                    exact = np.convolve(part, np.ones(m), "valid")[-last.size :]
                    error = np.abs((last.astype(float) - first.astype(float) - exact) / m).max()
                    errors[f"running sums, {name}"].append(float(error))
            summed += count
    errors["refocus"] = []
    for length in lengths:
        columns = length // m
        raw = rng.integers(0, 65536, (m, columns), dtype=np.uint16)
        kept = min(columns, 40 * m + columns % m)
        got = refocus(raw, m, "3/5", region=(slice(None), slice(columns - 20 * m, None)))
        if length <= 10**7:
            # The whole frame, which must not affect the last columns.
            got = refocus(raw, m, "3/5")[:, -20 * m :]
        want = ExactArithmetic().refocus(raw[:, columns - kept :], m, shift=3)[:, -20 * m :]
        difference = got.astype(int) - want.astype(int)
        errors["refocus"].append(float(np.abs(difference[:, : 20 * m]).max()))
    return errors


def _cell(error: float) -> str:
    if isnan(error):
        return "-"
    if error == float("inf"):
        return "nan spreads"
    return "0" if error == 0 else f"{error:.1e}"


def widths() -> list[list[str]]:
    """Widths of sums: derived, beside those of the types that hold them."""
    rows = []
    for m, order in ((5, 0), (11, 0), (16, 0), (17, 0), (99, 0), (11, 1), (11, 3), (99, 1)):
        for bits in (8, 16):
            largest = ExactArithmetic().largest_sum(m, bits, order)
            kind = np.dtype(f"u{division(m ** (2 + 2 * order), (1 << bits) - 1).bits // 8}")
            rows.append([str(m), str(order), str(bits), str(largest.bit_length()), kind.name])
    return rows


def rows(
    integers: list[Outcome], floats: list[Outcome], growth: dict[str, list[float]]
) -> list[list[str]]:
    """The worst of each kind of input, by method, as in the table of the documentation."""
    table = []
    for outcomes_of, where in ((integers, ""), (floats, ", floating point: relative")):
        for group in dict.fromkeys(o.group for o in outcomes_of):
            errors = [o.errors for o in outcomes_of if o.group == group]
            worst = [max((e[name] for e in errors if name in e), default=nan) for name in METHODS]
            table.append([f"{group}{where}", str(len(errors)), *map(_cell, worst)])
    ends = [growth.get(name, [nan])[-1] for name in METHODS]
    return [*table, ["a line of 10^8 pixels", "1", *map(_cell, ends)]]


def record() -> None:
    """Run everything, and keep the rows of the documentation's table."""
    table = rows(*outcomes(), long_sums())
    save_records(_RECORDED, table)


def load_recorded() -> list[list[str]]:
    table: list[list[str]] = json.loads(_RECORDED.read_text())
    return table


def summary() -> list[str]:
    """Markdown table of what was recorded."""
    return table(["input", "cases", *METHODS], load_recorded())[:-1]


def write_report(folder: Path, progress: Progress | None = None) -> Path:
    """Run everything and write ``stability.md`` with its figure."""
    report = Report(folder, "stability.md")
    integers, floats = outcomes(progress)
    growth = long_sums()
    worst = max(max(o.errors[name] for o in integers) for name in ("refocus", "reference"))
    worst = max(worst, *growth["refocus"])
    verdict = (
        "The integer path is exact in every case: it does not drift, overflow or wrap."
        if worst == 0
        else f"**The integer path is off by {worst:g} grey levels.**"
    )
    poisoned = [name for name in FLOATING if any(o.errors[name] == np.inf for o in floats)]
    report.say(
        "# Stability",
        f"{verdict} Running sums in floating point lose digits with every pixel, and after a "
        "pixel of 10^9 all smaller contributions; sums that start again for each output do not. "
        f"Methods in which one nan spoils all later outputs: {', '.join(poisoned) or 'none'}. "
        "`refocus` accepts no floating point at all.",
        f"Measured on: {machine()}.",
        "## Extreme frames",
        "Largest error in grey levels, beyond the correct rounding where results are rounded.",
    )
    cells = [[o.group, o.case, *(_cell(o.errors.get(n, nan)) for n in METHODS)] for o in integers]
    report.table(["input", "case", *METHODS], cells)
    report.say(
        "## Floating point frames",
        "Largest relative error of a pixel that is a number in exact arithmetic.",
    )
    cells = [[o.group, o.case, *(_cell(o.errors[n]) for n in FLOATING)] for o in floats]
    report.table(["input", "case", *FLOATING], cells)
    report.say("## Long sums")
    figure, axes = plt.subplots(figsize=(7, 4.5), constrained_layout=True)
    for name, errors in growth.items():
        axes.loglog(_LENGTHS, np.maximum(errors, 1e-16), "o-", label=name)
    axes.set(
        xlabel="pixels summed",
        ylabel="largest error / grey levels of 65535",
        title="A moving mean of 5 pixels at the end of a line (0 is drawn at the bottom)",
    )
    axes.grid(True, alpha=0.3)
    axes.legend()
    report.picture("stability_growth", figure)
    of_length = zip(_LENGTHS, *growth.values(), strict=True)
    report.table(
        ["pixels", *growth],
        [[f"{length:.0e}", *map(_cell, errors)] for length, *errors in of_length],
    )
    report.say("## Widths of sums", "Derived from M, order and depth.")
    report.table(["M", "order", "bits of a pixel", "bits of the largest sum", "type"], widths())
    return report.write()
