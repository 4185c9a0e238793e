# SPDX-License-Identifier: Apache-2.0
"""Many pixels a clock: resources and clock of a scene's core with 1 to 32 of them.

``data/pixels.json`` holds nextpnr's results (`make compare`), from which the page is built.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.engine import PIXELS_PER_CLOCK
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.devices import DEVICES
from plenofir.fpga.resources.record import Placed
from plenofir.fpga.synthesis.ecp5 import NAMES
from plenofir.fpga.synthesis.placers import PLACERS
from plenofir.ground.errors import InputError, ToolError
from plenofir.plan import Plan, load_scene, make_plan
from plenofir_studies import DATA
from plenofir_studies.placed_cores import route_core, synthesise_core
from plenofir_studies.placed_ecp5 import PACKAGE, make_netlist, place
from plenofir_studies.recorded_designs import CORE
from plenofir_studies.records import save_records
from plenofir_studies.report_parts import Columns, table_of

SCENE = "video-m11"
FILE = DATA / "pixels.json"
SPREADS = DATA / "spreads.json"
PLACEMENTS = 10
DEVICE, GRADE = "85k", 6
LARGE_PACKAGE = "CABGA756"
# Pins of each package (Lattice FPGA-DS-02012).
_MOST_PINS = 365
WITH_PINS = 16
"""Most pixels a clock that find pins; more are placed behind few of them (`few_pins`)."""


def load_placed() -> dict[int, Placed]:
    """Read the file: nextpnr's result for each number of pixels a clock."""
    content = json.loads(FILE.read_text())
    return {int(pixels): Placed.model_validate(placed) for pixels, placed in content.items()}


def save_placed(placed: dict[int, Placed]) -> None:
    """Write the file, a core a line."""
    save_records(FILE, {str(p): placed[p].model_dump() for p in sorted(placed)})


def package(pixels: int) -> str:
    """Package of the device, for nextpnr, with enough pins for a core of P pixels a clock."""
    return PACKAGE if pixels <= 8 else LARGE_PACKAGE


Spreads = dict[str, dict[str, list[float | None]]]
"""Device to pixels a clock to MHz of each placement; None where nextpnr found no way."""
_NO_WAY = "Failed to route arc"


def load_spreads() -> Spreads:
    """Read the clocks of repeated placements."""
    content: Spreads = json.loads(SPREADS.read_text()) if SPREADS.exists() else {}
    return content


def place_again(device: str, pixels: int, folder: Path) -> Iterator[float | None]:
    """Clocks in MHz of a core of P pixels a clock, placed for the seeds that are not recorded.

    One netlist is placed and routed `PLACEMENTS` times; each clock is recorded when it is known.
    From some places of a LIFCL-40's oscillator nextpnr finds no way to the clock's net: None.
    """
    if device not in {*NAMES, *PLACERS} or pixels not in PIXELS_PER_CLOCK:
        raise InputError(
            f"{device} with {pixels} pixels a clock cannot be placed; give one of "
            f"{', '.join([*NAMES, *PLACERS])}, and one of {PIXELS_PER_CLOCK} pixels"
        )
    core = scene_core(make_plan(load_scene(SCENE)), pixels)
    sources, generics, family = hdl.hdl_sources(), core.generics(), DEVICES[device].family
    placements = len(load_spreads().get(device, {}).get(str(pixels), ()))
    if device in PLACERS:
        synthesise_core(device, family, sources, CORE, generics, folder)
    else:
        few = pixels > WITH_PINS
        netlist = make_netlist(sources, CORE, generics, folder, behind_few_pins=few)
    for seed in range(placements + 1, PLACEMENTS + 1):
        fmax: float | None = None
        try:
            if device in PLACERS:
                fmax = route_core(device, family, folder, seed=seed).fmax_mhz
            else:
                fmax = place(
                    netlist,
                    speed_grade=GRADE,
                    device=NAMES[device],
                    package=package(pixels),
                    seed=seed,
                ).fmax_mhz
        except ToolError as error:
            if _NO_WAY not in str(error):
                raise
        spreads = load_spreads()
        spreads.setdefault(device, {}).setdefault(str(pixels), []).append(fmax)
        save_records(SPREADS, spreads, levels=2)
        yield fmax


@dataclass(frozen=True)
class Spread:
    """Clocks of one core in several placements, MHz."""

    device: str
    pixels: int  # P
    clocks: Sequence[float]
    seeds: int  # placements that were tried

    @property
    def million_pixels(self) -> float:
        """Million pixels a second at the median clock."""
        return self.pixels * median(self.clocks)


def spread_lines() -> list[str]:
    """Write the section of repeated placements."""
    spreads = [
        Spread(device, int(pixels), [clock for clock in clocks if clock is not None], len(clocks))
        for device, cores in load_spreads().items()
        for pixels, clocks in sorted(cores.items(), key=lambda item: int(item[0]))
    ]
    columns: Columns = {
        "device": lambda s: f"{s.device.upper()}",
        "P": "{.pixels}",
        "placements": lambda s: f"{len(s.clocks)} of {s.seeds}",
        "least MHz": lambda s: f"{min(s.clocks):g}",
        "median MHz": lambda s: f"{median(s.clocks):.1f}",
        "most MHz": lambda s: f"{max(s.clocks):g}",
        "million pixels/s at the median": lambda s: f"{s.million_pixels:.0f}",
    }
    return [
        "### Spread of the clock",
        "",
        "nextpnr starts from random places, so the same netlist reaches another clock with another "
        f"seed. `scripts/resources.py spread DEVICE P` places the core of `{SCENE}` with the seeds "
        f"1 to {PLACEMENTS} (ECP5 in grade {GRADE}, LIFCL-40 in grade 9 behind a shift register). "
        "The seeds that a line has fewer were not run; without a clock are those for which nextpnr "
        "found no way to the net of the clock. A change of a design is better or worse where it "
        "moves the median by more than this.",
        "",
        *table_of(spreads, columns),
    ]


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
        return self.placed.fmax_mhz * 1e6 / self.frame_clocks

    @property
    def latency_us(self) -> float:
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
    plan = make_plan(load_scene(SCENE))
    table = []
    for pixels, placed in load_placed().items():
        core = scene_core(plan, pixels)
        tokens = max(core.line_tokens(plan.columns), core.band_steps(plan.columns))
        table.append(
            Row(
                pixels,
                placed,
                core.latency_clocks(plan.columns, plan.rows),
                tokens * core.frame_lines(plan.rows),
                plan.columns * plan.rows,
            )
        )
    return table


def page() -> str:
    table = rows()
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
        table,
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
        "",
        *spread_lines(),
    ]
    return "\n".join(lines) + "\n"
