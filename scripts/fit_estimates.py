# SPDX-License-Identifier: Apache-2.0
"""Fits the weights of the estimates, for scripts/resources.py."""

import json
from collections.abc import Mapping, Sequence
from typing import get_args

import numpy as np
from scipy.optimize import nnls

from plenofir.fpga.core.configuration import SLICE_ENGINES, CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.weights import FILE as WEIGHTS
from plenofir.fpga.core.weights import RESOURCES, load_weights
from plenofir.fpga.devices import Usage
from plenofir.fpga.families import Family
from plenofir.fpga.names import DEFAULT_ENGINE
from plenofir.fpga.synthesis import comparison
from plenofir.fpga.synthesis.counts import (
    counted_cores,
    load_counts,
)
from plenofir.fpga.synthesis.ecp5 import (
    Placed,
)
from plenofir.fpga.synthesis.estimate import estimate, memories, structure
from plenofir.ground import project
from plenofir.ground.records import save_records
from plenofir.plan.figures import (
    CORE,
    compared_designs,
    core_designs,
    designs,
    grey_core,
    load_figures,
)

ECP5_RESULTS = project.DATA / "ecp5.json"
# Small designs that are placed besides the scenes: kind, M, a', rows at once.
PLACED = (("core", 1, 0, 1), ("core", 3, 1, 1), ("array", 3, 1, 1), ("array", 3, 1, 3))


def least_worst(parts: np.ndarray) -> np.ndarray:
    """Non-negative weights whose sums over the parts are as near to 1 as possible.

    The largest deviation of any row is minimised, by iterated least squares in which rows with
    large deviations get more weight (Lawson).
    """
    rows = np.ones(len(parts))
    found: list[tuple[float, np.ndarray]] = []
    for _ in range(40):
        weights, _ = nnls(parts * rows[:, None], rows)
        errors = np.abs(parts @ weights - 1)
        found.append((float(errors.max()), weights))
        rows *= 0.75 + 0.5 * errors / errors.max()
        rows /= rows.mean()
    return min(found, key=lambda pair: pair[0])[1]


def placed_on_ecp5() -> list[tuple[str, CoreConfiguration, Usage]]:
    """Cores that were placed on an ECP5: the comparison's, the scenes', small ones."""
    known = dict(comparison.load_comparison().placed)
    cores = {cell.name: cell.core() for cell in comparison.placed_cells() if cell.name in known}
    for name, grades in json.loads(ECP5_RESULTS.read_text()).items():
        known[name] = Placed.model_validate(grades["6"])
    cores |= {design.name.removesuffix(" core"): design.core for design in core_designs()}
    for pair in compared_designs():
        cores |= {design.name: design.core for design in pair if design.name in known}
    for kind, m, shift, rows in PLACED:
        if kind == "core":
            engine = FirEngine(parallel_rows=rows)
            cores[f"{kind} M={m} a'={shift} iota={rows}"] = grey_core(m, (shift,), engine=engine)
    return [
        (name, core, Usage(p.lut, p.flip_flops, p.block_rams, dsp=p.multipliers))
        for name, core in cores.items()
        for p in [known[name]]
    ]


def fit_engine(
    kind: str, family: Family, cells: list[tuple[str, CoreConfiguration, Usage]]
) -> dict[str, dict[str, float]]:
    """Weights of each part, for the least of the largest relative errors."""
    counted = [structure(core, family) for _, core, _ in cells]
    names = list(counted[0])
    parts = np.array([[count[name] for name in names] for count in counted], dtype=float)
    used = [sum((m.usage(family) for m in memories(core)), Usage()).lut for _, core, _ in cells]
    goals: Mapping[str, list[int]] = {
        "lut": [u.lut - n for (_, _, u), n in zip(cells, used, strict=True)],
        "flip_flops": [u.flip_flops for _, _, u in cells],
    }
    tables = {}
    for resource, wanted in goals.items():
        goal = np.array(wanted, dtype=float)
        weights = least_worst(parts / goal[:, None])
        rounded = [float(f"{weight:.3g}") for weight in weights]
        tables[resource] = {n: w for n, w in zip(names, rounded, strict=True) if w}
        errors = parts @ np.array(rounded) / goal - 1
        worst = int(np.abs(errors).argmax())
        print(f"{family}, {kind}, {resource}: worst {cells[worst][0]}, {errors[worst]:+.1%}")
    return tables


def fit(names: Sequence[str]) -> None:
    """Write the weights of the engines; of a Spartan-6 from figures and the comparison."""
    known, measured = load_figures().figures["2.0.0"], comparison.load_comparison().figures
    counts = load_counts()
    counted = dict(counted_cores())
    weights = {kind: dict(families) for kind, families in load_weights().items()}
    for family in get_args(Family):
        if family not in weights[DEFAULT_ENGINE] or (names and family not in names):
            continue
        if family == "spartan6":
            cells = [
                (design.name, design.core, known[design.name].usage)
                for design in designs()
                if design.name in known and design.top == CORE
            ]
            cells += [
                (cell.name, cell.core(), measured[cell.name].usage)
                for cell in comparison.measured_cells()
                if cell.name in measured
            ]
        elif family == "ecp5":
            cells = placed_on_ecp5()
        else:
            cells = [(name, core, counts[family][name]) for name, core in counted.items()]
        for kind in SLICE_ENGINES:
            own = [cell for cell in cells if cell[1].engine.kind == kind]
            if own:
                weights.setdefault(kind, {})[family] = fit_engine(kind, family, own)
        if family == "spartan6":
            continue
        # For designs without a fit: LUTs and flip-flops relative to a Spartan-6, from the same
        # cores.
        times = [
            [getattr(u, r) / getattr(estimate(core), r) for _, core, u in cells] for r in RESOURCES
        ]
        factors = [round(float(np.median(t)), 2) for t in times]
        for part in ("sharpener", "sensor"):
            weights[part][family] = factors
        # Weights of stacks stay, which were compared with boards.
        weights["picture"].setdefault(family, factors)
    save_records(WEIGHTS, weights, levels=2)
