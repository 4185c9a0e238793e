# SPDX-License-Identifier: Apache-2.0
"""Many pixels a clock: what the core of a scene takes and reaches with 1 to 32 of them.

`placed_pixels` holds what nextpnr makes of each (`make compare`); the page is built of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.moving_sum_engine import PIXELS_PER_CLOCK, MovingSumEngine
from plenofir.fpga.synthesis.ecp5 import PACKAGE, Placed
from plenofir.plan import Plan, load_scene, make_plan
from plenofir_studies.placed_pixels import GRADE, SCENE, load_placed
from plenofir_studies.report_parts import table, table_of
from plenofir_studies.thesis_benchmark import (
    THESIS_FIRST_S,
    THESIS_NEXT_S,
    THESIS_SOFTWARE_S,
    load_recorded,
)

LARGE_PACKAGE = "CABGA756"
# Pins of it (Lattice FPGA-DS-02012).
_MOST_PINS = 365
WITH_PINS = 16
"""Most pixels a clock that find pins; more are placed behind few of them (`few_pins`)."""


def package(pixels: int) -> str:
    """Package of the device, for nextpnr, with the pins that a core of P pixels a clock has."""
    return PACKAGE if pixels <= 8 else LARGE_PACKAGE


@dataclass(frozen=True)
class Row:
    """A core with its pixels a clock, placed and routed."""

    pixels: int  # P
    placed: Placed
    latency_clocks: int  # from the first pixel in to the first pixel out
    frame_clocks: int  # from a frame to the next
    frame_pixels: int  # of a frame

    @property
    def frames(self) -> float:
        """Frames a second."""
        return self.placed.fmax_mhz * 1e6 / self.frame_clocks

    @property
    def latency_us(self) -> float:
        """Latency in microseconds."""
        return self.latency_clocks / self.placed.fmax_mhz

    @property
    def pixels_a_second(self) -> float:
        """Pixels of frames in a second; the last word of a line may not be full."""
        return self.frames * self.frame_pixels


def scene_core(plan: Plan, pixels: int) -> CoreConfiguration:
    """Core of a plan with another number of pixels a clock."""
    engine = MovingSumEngine.model_validate(
        {**plan.core.engine.model_dump(), "pixels_per_clock": pixels}
    )
    return plan.core.model_copy(update={"engine": engine})


def rows() -> list[Row]:
    """What was placed, by P."""
    plan = make_plan(load_scene(SCENE))
    found = []
    for pixels, placed in load_placed().items():
        core = scene_core(plan, pixels)
        tokens = max(core.line_tokens(plan.columns), core.band_steps(plan.columns))
        found.append(
            Row(
                pixels,
                placed,
                core.latency_clocks(plan.columns, plan.rows),
                tokens * core.frame_lines(plan.rows),
                plan.columns * plan.rows,
            )
        )
    return found


def fitted(pixels: Sequence[int], amounts: Sequence[float]) -> tuple[tuple[float, float], float]:
    """Fit amount = fixed + each * P, with the least squares of relative errors.

    Returns (fixed, each), and the largest relative error of the fit.
    """
    p, goal = np.array(pixels, float), np.array(amounts, float)
    terms = np.stack([np.ones_like(p), p], axis=1)
    weights, *_ = np.linalg.lstsq(terms / goal[:, None], np.ones_like(p), rcond=None)
    worst = float(np.abs(terms @ weights / goal - 1).max())
    return (float(weights[0]), float(weights[1])), worst


def page() -> str:
    """Write the page."""
    found = rows()
    plan = make_plan(load_scene(SCENE))
    lines = [
        "# Many pixels a clock",
        "",
        f"Built by `make docs` from what `make compare` placed: the core of the scene `{SCENE}` "
        f"(M = {plan.core.micro_image_size}, grey, {plan.columns} x {plan.rows} pixels) on an "
        f"LFE5U-85F in grade {GRADE}, the slowest. P neighbouring pixels of a line come with each "
        "clock. Frames a second are those of the placed clock.",
        "",
    ]
    lines += table_of(
        found,
        {
            "P": "{.pixels}",
            "MHz": "{.placed.fmax_mhz:g}",
            "million pixels/s": lambda row: f"{row.pixels_a_second / 1e6:.0f}",
            "frames/s": "{.frames:.1f}",
            "latency": "{.latency_us:.1f} us",
            "LUT4": "{.placed.lut}",
            "LUT4 for each pixel": lambda row: f"{row.placed.lut / row.pixels:.0f}",
            "flip-flops": "{.placed.flip_flops}",
            "block RAM": "{.placed.block_rams}",
            "multipliers": "{.placed.multipliers}",
            "pixels for each LUT4 and second": lambda r: f"{r.pixels_a_second / r.placed.lut:.0f}",
        },
    )
    most = PIXELS_PER_CLOCK[-1]
    bits = most * plan.core.channels * plan.core.pixel_bits
    lines += [
        f"{WITH_PINS} pixels a clock are the most that find pins: {most} want {2 * bits}, in and "
        f"out, and the device's largest package has {_MOST_PINS}. So {most} were placed without "
        f"pins of their own: pixels come over a shift register ({bits} of the flip-flops) and "
        f"leave as their parity (about {-(-(bits - 1) // 3)} of the LUTs).",
        "",
    ]
    many = [row for row in found if row.pixels > 1]
    pixels = [row.pixels for row in many]
    lines += [
        "## The law of growth",
        "",
        "With P above 1, which is an engine of its own:",
        "",
    ]
    for name, amounts in (
        ("LUT4", [row.placed.lut for row in many]),
        ("flip-flops", [row.placed.flip_flops for row in many]),
    ):
        # Two points are on any line.
        if len(many) < 3:
            continue
        (fixed, each), worst = fitted(pixels, amounts)
        lines.append(f"- {name}: {fixed:.0f} + {each:.0f} P, off by {100 * worst:.0f} % at most.")
    lines += [
        "- Multipliers: P for each channel.",
        "- Block RAM: as many bits as with one pixel, in wider words and shorter lines; where "
        "lines are shorter than a block RAM is deep, it is not full.",
        "",
        "## Beside software and the thesis",
        "",
    ]
    recorded = load_recorded()
    best = found[-1]
    beside = [
        [
            "thesis, 3201 rows at once at 100 MHz (its numbers; no device has so many inputs)",
            f"{1 / THESIS_NEXT_S:.0f}",
            f"{THESIS_FIRST_S * 1e6:.4g} us",
        ],
        ["thesis, software", f"{1 / THESIS_SOFTWARE_S:.2g}", f"{THESIS_SOFTWARE_S} s"],
        *(
            [f"ours, {name}", f"{1 / seconds:.3g}", f"{seconds * 1e3:.3g} ms"]
            for name, seconds in recorded.seconds.items()
        ),
        *(
            [
                f"ours, {row.pixels} pixel{'s' if row.pixels > 1 else ''} a clock, ECP5",
                f"{row.frames:.3g}",
                f"{(row.latency_clocks + row.frame_clocks) / row.placed.fmax_mhz / 1e3:.3g} ms",
            ]
            for row in (found[0], *(r for r in found if r.pixels in (8, best.pixels)))
        ),
    ]
    lines += table(["design", "frames/s", "first frame"], beside)
    lines += [
        f"Software is processor time on {recorded.machine}. A frame's first pixel leaves the core "
        "after the latency of the first table, long before the frame is complete.",
    ]
    return "\n".join(lines) + "\n"
