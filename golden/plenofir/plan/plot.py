# SPDX-License-Identifier: Apache-2.0
"""A plan as a picture: depths of field of its slices, and its shares of the device."""

from math import inf

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from plenofir.camera.plots import SharpRange, draw_ranges
from plenofir.plan.plan import Plan


def plot_plan(plan: Plan) -> Figure:
    """Draw depths of field (with a camera), and shares of the device, beside the full build's."""
    ranges: list[SharpRange | str] = [
        SharpRange(f"a = {part.a}", part.near_mm, inf if part.far_mm is None else part.far_mm)
        for part in plan.slices
        if part.near_mm is not None
    ]
    figure, axes = plt.subplots(
        1, 1 + bool(ranges), figsize=(6 + 6 * bool(ranges), 4), constrained_layout=True
    )
    shares = axes[-1] if ranges else axes
    if ranges:
        draw_ranges(axes[0], ranges)
    names = [name for name in plan.needs if plan.available[name]]
    places = np.arange(len(names))
    for offset, label, amounts in (
        (-0.2, "this scene", plan.needs),
        (0.2, "full build", plan.full),
    ):
        percent = [100 * amounts[name] / plan.available[name] for name in names]
        bars = shares.bar(places + offset, percent, 0.4, label=label)
        shares.bar_label(bars, [str(amounts[name]) for name in names], fontsize=8)
    if max(shares.get_ylim()) > 100:
        shares.axhline(100, color="0.4", linewidth=0.8, linestyle=":")
    shares.set_xticks(places, names, fontsize=8)
    shares.set(ylabel=f"share of the {plan.device.upper()} / %", title="estimated resources")
    shares.legend(fontsize=8)
    figure.suptitle(plan.scene)
    return figure
