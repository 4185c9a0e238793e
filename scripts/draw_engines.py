# SPDX-License-Identifier: Apache-2.0
"""Draws docs/images/engines.png (both engines over a') and moving-sum.png (how it works)."""

import sys

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from plenofir import project
from plenofir.fpga.synthesis.comparison import ENGINES, SIZES, Cell, all_shifts, load_comparison
from plenofir.fpga.synthesis.estimate import estimate
from plenofir.refocus.moving_sum import SumLayout

IMAGES = project.root() / "docs" / "images"
COLOURS = {"fir": "tab:orange", "moving_sum": "tab:blue"}


def draw_resources() -> None:
    """LUTs and block RAM over a': lines are estimates, dots were synthesised."""
    measured = load_comparison().figures
    figure, axes = plt.subplots(
        2, len(SIZES), figsize=(15, 6), sharex="col", constrained_layout=True
    )
    for column, m in enumerate(SIZES):
        for engine in ENGINES:
            shifts = list(all_shifts(m))
            cells = [Cell(m, (shift,), 1, engine) for shift in shifts]
            usages = [estimate(cell.core()) for cell in cells]
            dots = [
                (shift, measured[cell.name].usage)
                for shift, cell in zip(shifts, cells, strict=True)
                if cell.name in measured
            ]
            for row, amount in enumerate(("lut", "block_rams")):
                axis = axes[row, column]
                colour = COLOURS[engine]
                axis.plot(shifts, [getattr(u, amount) for u in usages], color=colour, label=engine)
                axis.plot(
                    [shift for shift, _ in dots],
                    [getattr(usage, amount) for _, usage in dots],
                    "o",
                    markersize=4,
                    color=colour,
                )
        axes[1, column].axhline(116, color="grey", linestyle=":", label="XC6SLX45")
        axes[0, column].set_title(f"M = {m}")
        axes[1, column].set_xlabel("a' in pixels")
        for row in range(2):
            axes[row, column].set_yscale("log")
    axes[0, 0].set_ylabel("LUT")
    axes[1, 0].set_ylabel("block RAM (18 Kbit)")
    axes[1, 0].legend()
    figure.suptitle("Grey, 1280 columns: lines are estimates, dots were synthesised")
    figure.savefig(IMAGES / "engines.png", dpi=90)
    plt.close(figure)


def draw_movement(m: int = 3, shift: int = 2, length: int = 12) -> None:
    """Re-ordering, moving sum and occupancy of the rings for one slice."""
    layout = SumLayout(m, (shift,))
    figure, (order, rings) = plt.subplots(1, 2, figsize=(13, 5), constrained_layout=True)
    colours = plt.get_cmap("tab10")
    for i in range(length):
        v = i % m
        place = i + v * (shift - 1) + layout.place_in_group(0, v)
        order.plot(
            [i, place], [1, 0], "o-", color=colours(v), label=f"phase {v}" if i < m else None
        )
        order.annotate(str(i), (i, 1.03), ha="center")
        order.annotate(str(place), (place, -0.08), ha="center")
    order.fill_between([3.6, 3.4 + m], -0.15, -0.02, color="gold", alpha=0.5)
    order.annotate(f"sum over {m} places", (3.5 + m / 2, -0.22), ha="center")
    order.set_yticks([0, 1], ["place", "pixel"])
    order.set_ylim(-0.5, 1.15)
    order.set_xlabel("steps")
    order.set_title(f"Re-ordering, M = {m}, a' = {shift}: none left out, none twice")
    order.legend(loc="lower center", ncol=m)
    for i in range(length):
        v = i % m
        age = layout.entering_age(0, v)
        rings.barh(i, age, left=i, height=0.6, color=colours(v), alpha=0.5)
        rings.barh(i, m, left=i + age, height=0.6, color=colours(v))
    rings.invert_yaxis()
    rings.set_xlabel("step: a line of the frame comes in with each")
    rings.set_ylabel("line")
    rings.set_xticks(np.arange(0, length + layout.delay + 2 * m))
    lines = ", ".join(str(n) for n in layout.ring_lines)
    rings.set_title(f"Kept: waiting (pale), in the sum (full); rings of {lines} lines")
    figure.savefig(IMAGES / "moving-sum.png", dpi=90)
    plt.close(figure)


def main() -> int:
    """Draw both."""
    draw_resources()
    draw_movement()
    return 0


if __name__ == "__main__":
    sys.exit(main())
