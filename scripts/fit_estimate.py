"""Fits the weights of plenofir.plan.estimate to the file of figures and prints them."""

import numpy as np

from plenofir.plan.devices import Usage
from plenofir.plan.estimate import memories, structure
from plenofir.synthesis.figures import CORE, designs, load_figures

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
    return weights / scale


def main() -> None:
    """Print both tables, and how far off the worst design is."""
    known = load_figures().figures["2.0.0"]
    cores = [design for design in designs() if design.name in known and design.top == CORE]
    counted = [structure(design.core) for design in cores]
    names = list(counted[0])
    parts = np.array([[count[name] for name in names] for count in counted], dtype=float)
    in_memories = [
        sum((memory.usage for memory in memories(design.core)), Usage()).lut for design in cores
    ]
    figures = [known[design.name] for design in cores]
    for title, wanted in (
        ("_LUT_WEIGHTS", [f.lut - lut for f, lut in zip(figures, in_memories, strict=True)]),
        ("_FLIP_FLOP_WEIGHTS", [f.flip_flops for f in figures]),
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
        print(f"# worst: {cores[worst].name}, {errors[worst]:+.1%}")


if __name__ == "__main__":
    main()
