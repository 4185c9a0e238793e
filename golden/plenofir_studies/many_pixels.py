# SPDX-License-Identifier: Apache-2.0
"""Many pixels a clock: what the core of a scene takes and reaches with 1 to 32 of them.

``data/pixels.json`` holds what nextpnr makes of each (`make compare`); the page is built of it.
"""

import json
from dataclasses import dataclass

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import PIXELS_PER_CLOCK
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.synthesis.ecp5 import PACKAGE, Placed
from plenofir.fpga.synthesis.records import save_records
from plenofir.plan import Plan, load_scene, make_plan
from plenofir_studies import DATA
from plenofir_studies.report_parts import table_of

SCENE = "video-m11"
FILE = DATA / "pixels.json"
DEVICE, GRADE = "85k", 6
LARGE_PACKAGE = "CABGA756"
# Pins of it (Lattice FPGA-DS-02012).
_MOST_PINS = 365
WITH_PINS = 16
"""Most pixels a clock that find pins; more are placed behind few of them (`few_pins`)."""


def load_placed() -> dict[int, Placed]:
    """Read the file: pixels a clock to what nextpnr made of them."""
    content = json.loads(FILE.read_text())
    return {int(pixels): Placed.model_validate(placed) for pixels, placed in content.items()}


def save_placed(placed: dict[int, Placed]) -> None:
    """Write the file, a core a line."""
    save_records(FILE, {str(p): placed[p].model_dump() for p in sorted(placed)})


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
    lines += [
        "Multipliers: P for each channel. Block RAM: as many bits as with one pixel, in wider "
        "words and shorter lines; where lines are shorter than a block RAM is deep, it is not "
        "full. [The benchmark of the thesis](../thesis.md#the-benchmark-of-the-thesis) has the "
        "clocks of one frame, beside software.",
    ]
    return "\n".join(lines) + "\n"
