# SPDX-License-Identifier: Apache-2.0
"""Fits the weights of the estimates, for scripts/resources.py."""

from collections.abc import Mapping, Sequence
from math import ceil
from typing import get_args

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
from plenofir_studies.drawn_cores import CHECKED, FITTED, drawn_cores
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
Cell = tuple[str, CoreConfiguration, Usage]


def least_worst(parts: np.ndarray) -> np.ndarray:
    """Non-negative weights whose sums over the parts are as near to 1 as possible.

    The largest deviation of any row is minimised, by iterated least squares in which rows with
    large deviations get more weight (Lawson).
    """
    rows = np.ones(len(parts))
    candidates: list[tuple[float, np.ndarray]] = []
    for _ in range(40):
        weights, _ = nnls(parts * rows[:, None], rows)
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


def fit_engine(kind: str, family: Family, cells: list[Cell], checked: Sequence[Cell]) -> Weights:
    """Weights of each part, for the least of the largest relative errors.

    The class of error is `CLASS`, or what cores are off that the weights were not fitted to.
    """
    parts, used, names = parts_of(family, [*cells, *checked])
    memories = np.array(used)
    goals: Mapping[str, list[int]] = {
        "lut": [u.lut - n for (_, _, u), n in zip((*cells, *checked), used, strict=True)],
        "flip_flops": [u.flip_flops for _, _, u in (*cells, *checked)],
    }
    tables: dict[str, dict[str, float]] = {}
    within, fitted = CLASS, len(cells)
    for resource, values in goals.items():
        goal = np.array(values, dtype=float)
        weights = least_worst((parts / goal[:, None])[:fitted])
        rounded = [float(f"{weight:.3g}") for weight in weights]
        tables[resource] = {n: w for n, w in zip(names, rounded, strict=True) if w}
        whole = goal + (memories if resource == "lut" else 0)
        errors = (parts @ np.array(rounded) - goal) / whole
        worst = int(np.abs(errors[:fitted]).argmax())
        within = max(within, float(np.abs(errors).max()))
        print(
            f"{family}, {kind}, {resource}: worst {cells[worst][0]}, {errors[worst]:+.1%}", end=""
        )
        print("; checked", ", ".join(f"{error:+.1%}" for error in errors[fitted:]) or "by none")
    return Weights.model_validate({**tables, "within": ceil(100 * within) / 100})


def parts_of(family: Family, cells: Sequence[Cell]) -> tuple[np.ndarray, list[int], list[str]]:
    """Parts of each core, LUTs of its memories, and the names of the parts."""
    blocks = [core.blocks[0] for _, core, _ in cells]
    amounts = [block.parts_on(family) for block in blocks]
    names = list(amounts[0])
    parts = np.array([[block[name] for name in names] for block in amounts], dtype=float)
    memories = [sum((m.usage(family) for m in block.memories), Usage()).lut for block in blocks]
    return parts, memories, names


def fit(names: Sequence[str]) -> None:
    """Write the weights of the engines, and what a family takes for each of a Spartan-6."""
    counts, counted = load_record().counted, dict(counted_cores())
    weights = {kind: dict(families) for kind, families in load_record().weights.items()}
    factors = dict(load_record().times)
    for family in get_args(Family):
        if family not in weights[DEFAULT_ENGINE] or (names and family not in names):
            continue
        if family == "spartan6":
            cores = {design.name: design.core for design in designs() if design.top == CORE}
            cores |= {cell.name: cell.core() for cell in engine_cells.measured_cells()}
            records = counts[family]
            cells = [
                (name, core, records[name].usage) for name, core in cores.items() if name in records
            ]
        elif family == "ecp5":
            cells = placed_on_ecp5()
        else:
            cells = [(name, core, counts[family][name].usage) for name, core in counted.items()]
        known = counts.get(family, {})
        drawn, checked = (
            [(n, core, known[n].usage) for n, core in drawn_cores(*which) if n in known]
            for which in (FITTED, CHECKED)
        )
        cells += drawn
        for kind in SLICE_ENGINES:
            of_kind, unseen = (
                [cell for cell in every if cell[1].engine.kind == kind]
                for every in (cells, checked)
            )
            if of_kind:
                weights.setdefault(kind, {})[family] = fit_engine(kind, family, of_kind, unseen)
        if family == "spartan6":
            continue
        # For designs without a fit: LUTs and flip-flops relative to a Spartan-6, from the same
        # cores.
        lut, flip_flops = (
            [getattr(u, r) / getattr(estimate(core.blocks), r) for _, core, u in cells]
            for r in ("lut", "flip_flops")
        )
        factors[family] = round(float(np.median(lut)), 2), round(float(np.median(flip_flops)), 2)
    save_record(weights=weights, times=factors)
