# SPDX-License-Identifier: Apache-2.0
"""How time, memory, logic and energy grow: measured at several sizes, a law fitted, and its end.

Software and Dask are timed on a machine and kept in ``data/growth.json``; cores are the netlists
of ``data/energy.json`` and the placed ones of ``data/pixels.json``. ``make docs`` writes the page
of these records.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from plenofir.camera.plots import figure_pixels
from plenofir.fpga.names import SliceEngineName
from plenofir.fpga.resources.estimate import estimate
from plenofir.fpga.resources.record import Figures, load_record
from plenofir.ground import project
from plenofir.ground.images import encode_png
from plenofir.plan import load_scene, make_plan
from plenofir_studies import energy, many_pixels
from plenofir_studies.engine_cells import SIZES, Cell
from plenofir_studies.growth_measured import (
    REAL,
    ROUNDS,
    RUN_FRAMES,
    SIDE,
    M,
    Points,
    Recorded,
    measure,
    save_recorded,
)
from plenofir_studies.report_parts import Progress, Report, table

_LEAST_POINTS = 4
_GOAL_PIXELS, _GOAL_FRAMES = 1e9, 10**6


@dataclass(frozen=True)
class Law:
    """y = start + slope x^power, fitted to points."""

    start: float
    slope: float
    power: float
    off: float  # largest relative deviation of a point

    def at(self, x: float) -> float:
        return float(self.start + self.slope * x**self.power)

    def text(self, digits: int = 3) -> str:
        """The law as a formula."""
        start, slope = (f"{value:.{digits}g}" for value in (self.start, self.slope))
        if self.power == 0:
            return start
        if self.start:
            return f"{start} + {slope} x"
        return f"{slope} x^{self.power:.2f}"


def fit(points: Mapping[int, float], kind: str) -> Law:
    """Fit a law: "constant", "line" or "power"; least squares of relative deviations."""
    x, y = (np.array(part, float) for part in (list(points), list(points.values())))
    if kind == "constant":
        start, slope, power = float(np.exp(np.log(y).mean())), 0.0, 0.0
    elif kind == "line":
        matrix = np.stack([1 / y, x / y], axis=1)
        (start, slope), power = np.linalg.lstsq(matrix, np.ones_like(y), rcond=None)[0], 1.0
    else:
        power, level = np.polyfit(np.log(x), np.log(y), 1)
        start, slope = 0.0, float(np.exp(level))
    law = Law(float(start), float(slope), float(power), 0.0)
    off = max(abs(law.at(k) / value - 1) for k, value in points.items())
    return Law(law.start, law.slope, law.power, float(off))


@dataclass(frozen=True)
class Growth:
    """A quantity against what is varied."""

    quantity: str  # with its unit
    against: str
    points: Points
    kind: str  # of law
    end: str  # where it ends

    @property
    def law(self) -> Law:
        """What fits the points."""
        return fit(self.points, self.kind)


def growths(recorded: Recorded, records: Mapping[str, energy.Measured]) -> Iterator[Growth]:
    """All measured quantities, in the order of the page."""
    ns, mb, batch = recorded.nanoseconds, recorded.megabytes, recorded.batch
    time_ = "software: ns a pixel"
    frames = {side**2: 1e-6 * side**2 * value for side, value in ns["pixels of a side"].items()}
    yield Growth(
        "software: ms a frame", "pixels", frames, "line",
        "below 10^6 pixels a call's own time counts; above 4 10^7 not tried",
    )  # fmt: skip
    yield Growth(
        time_, "M", ns["M"], "constant",
        "steps, where sums of 8 bit pixels outgrow words: above M = 16, lines' above M = 257",
    )  # fmt: skip
    yield Growth(
        time_, "a' (M = 11)", ns["a' (M = 11)"], "constant",
        "where (M - 1) a' is as wide as the picture: less and less is left to add",
    )  # fmt: skip
    yield Growth(
        time_, "slices", ns["slices"], "line", "none found: each slice is a call of its own"
    )  # fmt: skip
    if "threads" in ns:
        yield Growth(time_, "threads", ns["threads"], "power", "at the number of processors")
    memory = "software: MB beside input and output"
    yield Growth(
        memory, "pixels of a side", mb["pixels of a side"], "line",
        "6,000 columns: blocks get no wider",
    )  # fmt: skip
    yield Growth(
        memory, "M", mb["M"], "line", "at the width of the picture: no line is longer"
    )  # fmt: skip
    yield Growth(memory, "threads", mb["threads"], "line", "none found")
    few, tiny, real = batch
    scheduler = "Dask: ms of a run, client and scheduler"
    yield Growth(
        scheduler, few, batch[few], "line",
        "none found: 1,000 frames are held at a time, the record grows by a line a frame",
    )  # fmt: skip
    yield Growth(
        scheduler, tiny, batch[tiny], "line", "none found: a worker more to start and to hear"
    )
    yield Growth(
        "Dask: ms of a run, workers together", real, batch[real], "line",
        "none of its own: the files' disk, or the scheduler",
    )  # fmt: skip
    yield from _of_cores()
    yield from _of_stacks(recorded)
    energies = {
        p: energy.energy_of(records[name]).total
        for p in energy.PIXELS
        if (name := energy.name_of(energy.grey(pixels=p))) in records
    }
    if len(energies) >= _LEAST_POINTS:
        yield Growth(
            "core: pJ a refocused pixel", "P", energies, "power",
            "at P = 4: beyond, rotations, and block RAM that short lines do not fill",
        )  # fmt: skip


def _of_cores() -> Iterator[Growth]:
    """Recorded results of the cells of the comparison, and of placed cores with P pixels."""
    cells = load_record().counted["spartan6"]
    kinds: tuple[tuple[SliceEngineName, str], ...] = (
        ("moving_sum", "moving sums"),
        ("fir", "filters"),
    )
    for engine, kind in kinds:
        by_m = {m: cells[Cell(m, (2,), 1, engine).name] for m in SIZES}
        by_a = {
            shift: cells[name]
            for shift in (1, 2, 5, 10, 15)
            if (name := Cell(5, (shift,), 1, engine).name) in cells
        }
        grows = "(M - 1) abs(a' - 1) + M taps, a line of sums each" if engine == "fir" else ""
        quantities: tuple[tuple[str, Callable[[Figures], float], str], ...] = (
            ("core: LUT", lambda f: float(f.lut), "tables of schedules outgrow LUTs as memory"),
            ("core: 9 Kbit of block RAM", lambda f: float(2 * f.ramb16 + f.ramb8), "whole blocks"),
        )
        for quantity, value_of, end in quantities:
            points = {m: value_of(figures) for m, figures in by_m.items()}
            yield Growth(quantity, f"M, {kind}", points, "line", grows or end)
            points = {shift: value_of(figures) for shift, figures in by_a.items()}
            yield Growth(quantity, f"a', {kind} (M = 5)", points, "line", grows or end)
    lines = {
        columns: float(estimate(energy.grey(columns=columns).blocks).block_rams)
        for columns in (640, 1280, 2560, 5120)
    }
    yield Growth(
        "core: 9 Kbit of block RAM", "columns, moving sums (M = 5)",
        {columns: 2 * blocks for columns, blocks in lines.items()}, "line", "whole blocks",
    )  # fmt: skip
    rows = {row.pixels: row for row in many_pixels.rows()}
    yield Growth(
        "core: clocks a frame of 3201 x 3201", "P",
        {p: float(row.frame_clocks) for p, row in rows.items()}, "power",
        "lines that are no multiple of P are padded: 3201 = 100 x 32 + 1",
    )  # fmt: skip
    yield Growth(
        "core: million pixels a second", "P",
        {p: row.pixels_a_second / 1e6 for p, row in rows.items()}, "power",
        "the clock falls as rotations grow",
    )  # fmt: skip
    yield Growth(
        "core: LUT4 (ECP5)", "P", {p: float(row.placed.lut) for p, row in rows.items()}, "line",
        "rotations grow with P log P",
    )  # fmt: skip
    sides = (801, 1601, 3201, 6401)
    core = many_pixels.scene_core(make_plan(load_scene(many_pixels.SCENE)), 8)
    yield Growth(
        "core: clocks a frame, P = 8", "pixels of a side",
        {side: float(core.line_tokens(side) * core.frame_lines(side)) for side in sides}, "power",
        "8,192 columns; lines shorter than the row stage's period",
    )  # fmt: skip


def _of_stacks(recorded: Recorded) -> Iterator[Growth]:
    for quantity, against in (("lut", "core: LUT"), ("block_rams", "core: 9 Kbit of block RAM")):
        points = {n: float(figures[quantity]) for n, figures in recorded.stacks.items()}
        yield Growth(
            against,
            "slices at once (M = 5)",
            points,
            "line",
            "none but the device: banks are shared",
        )


def planned(recorded: Recorded, energies: Mapping[str, energy.Measured]) -> list[str]:
    """Plans for 10^9 pixels a second and for 10^6 frames, by the same numbers."""
    sides = recorded.nanoseconds["pixels of a side"]
    ns = fit({side**2: value * side**2 for side, value in sides.items()}, "line").slope
    few, _, real = recorded.batch
    scheduler = fit(recorded.batch[few], "line").slope
    frame = fit(recorded.batch[real], "line").start / RUN_FRAMES[REAL]
    rows = {row.pixels: row for row in many_pixels.rows()}
    enough = [p for p in sorted(rows) if rows[p].pixels_a_second >= _GOAL_PIXELS]
    cores = ns * 1e-9 * _GOAL_PIXELS
    hours = frame * 1e-3 * _GOAL_FRAMES / 3600
    most = frame / scheduler
    lines = [
        "### 10^9 pixels a second, 10^6 frames",
        "",
        f"- Software: {ns:.2f} ns a pixel and thread are {cores:.2f} processors' time for 10^9 "
        "pixels a second. A pixel read and a pixel written are 2 GB/s, a fraction of what a copy "
        "of frames reaches on one processor.",
    ]
    if enough:
        row = rows[enough[0]]
        eight = energies.get(energy.name_of(energy.grey(pixels=min(16, enough[0]))))
        watts = (
            ""
            if eight is None
            else f"; {energy.energy_of(eight).total * 1e-3:.2f} W at M = 5 by the estimate of "
            "[energy](#energy-of-a-pixel), static power not counted"
        )
        lines.append(
            f"- VHDL: P = {row.pixels} at the {row.placed.fmax_mhz:g} MHz that were placed on the "
            f"slowest ECP5 (M = 11) makes {row.pixels_a_second / 1e9:.2f} 10^9 pixels a second: "
            f"{row.placed.lut} LUT4, {row.placed.block_rams} block RAM{watts}."
        )
    lines.append(
        f"- 10^6 frames of 2200 x 2200, read, refocused and written as PNG: {frame:.0f} ms of a "
        f"processor each, {hours:.0f} hours for one. One scheduler hands out and records a frame "
        f"in {scheduler:.1f} ms, {scheduler * 1e-3 * _GOAL_FRAMES / 3600:.1f} hours for all: "
        f"so more than {most:.0f} processors on one run gain nothing, on however many machines; "
        "beyond, split the frames into several runs. The record takes about 300 MB."
    )
    return lines


def laws(recorded: Recorded, energies: Mapping[str, energy.Measured]) -> list[str]:
    """How it was measured, and a table of every law with its points."""
    rows = [
        [
            g.quantity,
            g.against,
            ", ".join(f"{x}: {y:.3g}" for x, y in g.points.items()),
            g.law.text(),
            f"{100 * g.law.off:.0f} %",
            g.end,
        ]
        for g in growths(recorded, energies)
    ]
    return [
        f"Software measured on {recorded.machine}: one thread unless threads are varied, 8 bit, "
        f"grey, {SIDE} x {SIDE}, M = {M}, a' = 1, the least of {ROUNDS} times: processor time, "
        "wall time where threads vary. Dask: whole runs of `plenofir batch`, start and all; more "
        "workers than processors stand for more machines, as these share the scheduler, which is "
        "what ends the law. Cores: both engines on Spartan-6, 1280 columns; P placed on an ECP5, "
        "M = 11; stacks of 640 columns; energy as `plenofir report energy` estimates it. Clocks "
        "follow from formulas that benches confirm, block RAM over columns from the estimate, "
        "which is exact.",
        "",
        *(
            []
            if "threads" in recorded.nanoseconds
            else ["Threads were not measured: other work kept the processors busy.", ""]
        ),
        *table(["quantity", "against x", "measured", "law", "off by up to", "ends"], rows),
    ]


def picture(recorded: Recorded, energies: Mapping[str, energy.Measured]) -> Figure:
    """Points and laws, relative to their least values, a panel for each kind of quantity."""
    kinds: dict[str, list[Growth]] = {}
    for growth in growths(recorded, energies):
        kinds.setdefault(growth.quantity, []).append(growth)
    figure, axes = plt.subplots(-(-len(kinds) // 4), 4, figsize=(13, 9), constrained_layout=True)
    for panel, (quantity, group) in zip(axes.flat, kinds.items(), strict=False):
        for growth in group:
            x = np.array(list(growth.points), float)
            places = x if (x > 0).all() else x - x.min() + 1
            (line,) = panel.plot(places, list(growth.points.values()), "o", markersize=4)
            fine = np.geomspace(places.min(), places.max(), 60)
            values = [growth.law.at(value + (x - places)[0]) for value in fine]
            panel.plot(fine, values, color=line.get_color(), label=growth.against)
        panel.set(xscale="log", yscale="log")
        panel.set_title(quantity, fontsize=9)
        panel.legend(fontsize=6)
        panel.xaxis.set_minor_formatter(NullFormatter())
        panel.grid(alpha=0.3)
    for panel in axes.flat[len(kinds) :]:
        panel.axis("off")
    return figure


def add_section(
    report: Report, recorded: Recorded, energies: Mapping[str, energy.Measured]
) -> None:
    report.picture("growth", picture(recorded, energies), "Measured points and fitted laws")
    report.add([*laws(recorded, energies), *planned(recorded, energies)])


def write_report(folder: Path, progress: Progress | None = None) -> Path:
    """Measure this machine and write ``growth.md``; cores are the recorded ones."""
    report = Report(folder, "growth.md", 4, progress)
    report.say("# Growth")
    add_section(report, measure(report.step), energy.load_measured())
    return report.write()


def record() -> None:
    """Measure this machine, and keep it and its picture for the docs."""
    recorded = measure()
    save_recorded(recorded)
    drawing = figure_pixels(picture(recorded, energy.load_measured()))
    (project.root() / "docs" / "images" / "growth.png").write_bytes(encode_png(drawing))
