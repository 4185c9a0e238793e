# SPDX-License-Identifier: Apache-2.0
"""Fits the weights of the engines (plenofir.fpga.core) to the files of figures and prints them."""

import numpy as np

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.devices import Usage
from plenofir.fpga.synthesis.comparison import load_comparison, measured_cells
from plenofir.fpga.synthesis.estimate import memories, structure
from plenofir.fpga.synthesis.spartan6 import Figures
from plenofir.plan.figures import CORE, designs, load_figures

_STEPS = 20000


def fitted(parts: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Weights, none of them negative, with the least squares of relative errors."""
    rows = parts / wanted[:, None]
    scale = np.linalg.norm(rows, axis=0) + 1e-12
    rows /= scale
    step = 1 / np.linalg.norm(rows.T @ rows, 2)
    weights = np.zeros(rows.shape[1])
    for _ in range(_STEPS):
        weights = np.maximum(0, weights - step * rows.T @ (rows @ weights - 1))
    found: np.ndarray = weights / scale
    return found


def fit(kind: str, cells: list[tuple[str, CoreConfiguration, Figures]]) -> None:
    """Print both tables of an engine, and how far off the worst design is."""
    counted = [structure(core) for _, core, _ in cells]
    names = list(counted[0])
    parts = np.array([[count[name] for name in names] for count in counted], dtype=float)
    in_memories = [sum((m.usage for m in memories(core)), Usage()).lut for _, core, _ in cells]
    luts = [f.lut - lut for (_, _, f), lut in zip(cells, in_memories, strict=True)]
    for title, wanted in (
        (f"{kind}: LUT_WEIGHTS", luts),
        (f"{kind}: FLIP_FLOP_WEIGHTS", [f.flip_flops for _, _, f in cells]),
    ):
        goal = np.array(wanted, dtype=float)
        weights = fitted(parts, goal)
        print(f"{title} = {{")
        for name, weight in zip(names, weights, strict=True):
            if weight >= 0.005:
                print(f'    "{name}": {weight:.3g},')
        print("}")
        errors = parts @ weights / goal - 1
        worst = int(np.abs(errors).argmax())
        print(f"# worst: {cells[worst][0]}, {errors[worst]:+.1%}")


def main() -> None:
    """Print the tables of both engines."""
    known = load_figures().figures["2.0.0"]
    cores = [
        (design.name, design.core, known[design.name])
        for design in designs()
        if design.name in known and design.top == CORE
    ]
    measured = load_comparison().figures
    cells = [
        (cell.name, cell.core(), measured[cell.name])
        for cell in measured_cells()
        if cell.name in measured
    ]
    # Cores of filters are as they were fitted before there were cells.
    for kind, parts in (("fir", cores), ("moving_sum", [*cores, *cells])):
        fit(kind, [part for part in parts if part[1].engine.kind == kind])


if __name__ == "__main__":
    main()
