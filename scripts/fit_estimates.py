# SPDX-License-Identifier: Apache-2.0
"""Fits the weights of the estimates, for scripts/resources.py."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Self, get_args

import numpy as np
from scipy.optimize import nnls

from plenofir.fpga.core.configuration import SLICE_ENGINES, CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.devices import Usage
from plenofir.fpga.families import Family
from plenofir.fpga.names import DEFAULT_ENGINE
from plenofir.fpga.resources.estimate import estimate
from plenofir.fpga.resources.record import ECP5_SLOWEST, Weights, load_record
from plenofir_studies import engine_cells
from plenofir_studies.counted_cores import counted_cores
from plenofir_studies.drawn_cores import drawn_cores, is_drawn
from plenofir_studies.recorded_designs import (
    CORE,
    compared_designs,
    core_designs,
    designs,
    grey_core,
)
from plenofir_studies.records import save_record

# Small designs that are placed besides the scenes: kind, M, a', rows at once.
PLACED = (("core", 1, 0, 1), ("core", 3, 1, 1), ("array", 3, 1, 1), ("array", 3, 1, 3))
CLASS = 0.15
"""Relative error of LUTs and flip-flops that `plan` tells at least."""
ALIKE: Mapping[str, tuple[tuple[Family, ...], ...]] = {
    "lut": (
        ("spartan6", "series7", "cyclonev"),
        ("ecp5", "nexus", "gw2a", "gw5a", "gatemate"),
    ),
    "flip_flops": (
        ("spartan6", "series7"),
        ("cyclonev", "ecp5", "nexus", "gw2a", "gw5a", "gatemate"),
    ),
}
"""Families whose cores tell about each other: look-up tables of six or four inputs, and shift
registers in look-up tables or none."""
LOGIC = frozenset({"table bits", "slice rings", "turned bits"})
"""Parts that take look-up tables only."""
Cell = tuple[str, CoreConfiguration, Usage]


def least_worst(parts: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Non-negative weights whose sums over the parts are as near to 1 as possible.

    The largest deviation of any row is minimised, by iterated least squares in which rows with
    large deviations get more weight (Lawson). Rows of `others` together weigh as much as all of
    `parts`, and that weight stays.
    """
    rows = np.ones(len(parts))
    beside = np.full(len(others), np.sqrt(len(parts) / max(len(others), 1)))
    every = np.concatenate([parts, others])
    candidates: list[tuple[float, np.ndarray]] = []
    for _ in range(40):
        factors = np.concatenate([rows, beside])
        weights, _ = nnls(every * factors[:, None], factors)
        errors = np.abs(parts @ weights - 1)
        candidates.append((float(errors.max()), weights))
        rows *= 0.75 + 0.5 * errors / errors.max()
        rows /= rows.mean()
    return min(candidates, key=lambda pair: pair[0])[1]


def placed_on_ecp5() -> list[tuple[str, CoreConfiguration, Usage]]:
    """Cores that were placed on an ECP5: the comparison's, the scenes', small ones."""
    records = load_record().placed[ECP5_SLOWEST]
    cores = {cell.name: cell.core() for cell in engine_cells.placed_cells() if cell.name in records}
    cores |= {design.name.removesuffix(" core"): design.core for design in core_designs()}
    for pair in compared_designs():
        cores |= {design.name: design.core for design in pair if design.name in records}
    for kind, m, shift, rows in PLACED:
        if kind == "core":
            engine = FirEngine(parallel_rows=rows)
            cores[f"{kind} M={m} a'={shift} iota={rows}"] = grey_core(m, (shift,), engine=engine)
    return [(name, core, records[name].usage) for name, core in cores.items()]


@dataclass(frozen=True)
class Table:
    """What cores of an engine take of a resource of a family, and the parts that take it."""

    cores: list[str]
    names: list[str]  # of the parts
    parts: np.ndarray  # amounts by core and part
    goal: np.ndarray  # what each core takes without its memories
    whole: np.ndarray  # and with them

    @classmethod
    def of(cls, family: Family, cells: Sequence[Cell], resource: str) -> Self:
        """The table of some cores."""
        blocks = [core.blocks[0] for _, core, _ in cells]
        amounts = [block.parts_on(family) for block in blocks]
        names = [name for name in amounts[0] if resource == "lut" or name not in LOGIC]
        parts = np.array([[block[name] for name in names] for block in amounts], dtype=float)
        whole = np.array([getattr(usage, resource) for _, _, usage in cells], dtype=float)
        memories = [sum((m.usage(family) for m in block.memories), Usage()) for block in blocks]
        goal = whole - [getattr(usage, resource) for usage in memories]
        return cls([name for name, _, _ in cells], names, parts, goal, whole)

    def shares(self, without: str) -> np.ndarray:
        """Parts of each core but one for one of what it takes."""
        shares: np.ndarray = self.parts / self.goal[:, None]
        return shares[[name != without for name in self.cores]]

    def ratio_to(self, other: "Table") -> float:
        """How many times as much as of another family cores take that both have; the median."""
        by_name = dict(zip(other.cores, other.goal, strict=True))
        both = zip(self.cores, self.goal, strict=True)
        return float(np.median([goal / by_name[name] for name, goal in both if name in by_name]))


def fitted_weights(own: Table, others: Sequence[Table], without: str = "") -> np.ndarray:
    """Weights of each part, for the least of the largest relative errors; one core may be left out.

    Cores of other families tell about settings of which a family has few cores.
    """
    beside = [other.shares(without) / own.ratio_to(other) for other in others]
    shares = own.shares(without)
    weights = least_worst(shares, np.concatenate([shares[:0], *beside]))
    return np.array([float(f"{weight:.3g}") for weight in weights])


def fit_engine(
    kind: str, family: Family, cells: Mapping[Family, Sequence[Cell]]
) -> tuple[Weights, dict[str, list[float]]]:
    """Weights of each part, and how far off each drawn core is if they are fitted without it.

    The class of error is `CLASS`, or the largest of these errors.
    """
    weights: dict[str, dict[str, float]] = {}
    errors: dict[str, list[float]] = {}
    for resource, groups in ALIKE.items():
        alike = next(group for group in groups if family in group)
        tables = {f: Table.of(f, cells[f], resource) for f in alike}
        own = tables.pop(family)
        others = list(tables.values())
        fitted = fitted_weights(own, others)
        weights[resource] = {n: w for n, w in zip(own.names, fitted, strict=True) if w}
        off = (own.parts @ fitted - own.goal) / own.whole
        worst = int(np.abs(off).argmax())
        print(f"{family}, {kind}, {resource}: worst {own.cores[worst]}, {off[worst]:+.1%}", end="")
        errors[resource] = []
        for row, name in enumerate(own.cores):
            if is_drawn(name):
                without = own.parts[row] @ fitted_weights(own, others, name)
                errors[resource].append((without - own.goal[row]) / own.whole[row])
        print("; drawn", ", ".join(f"{error:+.1%}" for error in errors[resource]) or "none")
    within = max([CLASS, *(abs(error) for every in errors.values() for error in every)])
    return Weights.model_validate({**weights, "within": ceil(100 * within) / 100}), errors


def cells_of(family: Family) -> list[Cell]:
    """Cores of a family that were counted, or for an ECP5 placed, besides drawn ones."""
    if family == "ecp5":
        return placed_on_ecp5()
    cores = dict(counted_cores())
    if family == "spartan6":
        alone = [design for design in designs() if design.top == CORE]
        alone += core_designs()
        cores = {design.name: design.core for design in alone}
        cores |= {cell.name: cell.core() for cell in engine_cells.measured_cells()}
    records = load_record().counted[family]
    return [(name, core, records[name].usage) for name, core in cores.items() if name in records]


def drawn_cells(family: Family) -> list[Cell]:
    """Drawn cores that were counted for a family."""
    records = load_record().counted[family]
    return [(name, core, records[name].usage) for name, core in drawn_cores() if name in records]


def fit(_names: Sequence[str]) -> None:
    """Write the weights of the engines, and what a family takes for each of a Spartan-6."""
    weights = {kind: dict(families) for kind, families in load_record().weights.items()}
    factors = dict(load_record().times)
    families = [family for family in get_args(Family) if family in weights[DEFAULT_ENGINE]]
    every = {family: cells_of(family) + drawn_cells(family) for family in families}
    drawn: dict[str, list[float]] = {resource: [] for resource in ALIKE}
    for family in families:
        for kind in SLICE_ENGINES:
            cells = {
                f: [cell for cell in every[f] if cell[1].engine.kind == kind] for f in families
            }
            weights.setdefault(kind, {})[family], errors = fit_engine(kind, family, cells)
            for resource, values in errors.items():
                drawn[resource] += map(abs, values)
        if family == "spartan6":
            continue
        # For designs without a fit: LUTs and flip-flops relative to a Spartan-6, from the same
        # cores.
        lut, flip_flops = (
            [getattr(u, r) / getattr(estimate(core.blocks), r) for _, core, u in every[family]]
            for r in ("lut", "flip_flops")
        )
        factors[family] = round(float(np.median(lut)), 2), round(float(np.median(flip_flops)), 2)
    print("drawn cores, each by weights that were fitted without it: worst, and 95 % within")
    off: dict[str, tuple[int, float, float]] = {}
    for resource, values in drawn.items():
        usual = float(np.quantile(values, 0.95))
        off[resource] = len(values), round(max(values), 3), round(usual, 3)
        print(f"{resource}, {len(values)}: {max(values):.1%}, {usual:.1%}")
    save_record(weights=weights, times=factors, drawn_errors=off)
