# SPDX-License-Identifier: Apache-2.0
"""Energy of a pixel: switching activity of a simulated netlist times published energies.

Energies of a Spartan-6's resources are not published, so those of other devices are scaled: energy
is proportional to the size of structures (capacitance) and to the square of the voltage.

- Logic and routing: a CLB of a Virtex-II (150 nm, 1.5 V) takes 5.9 uW/MHz in typical designs, 60 %
  of it in routing, 16 % in logic, 14 % in clocks (L. Shang, A. Kaviani, K. Bathala: Dynamic power
  consumption in the Virtex-II FPGA family, FPGA 2002; the figures were not compared with the paper
  itself). It has eight LUTs with a flip-flop each. A net of a typical design changes in 12.5 % of
  the clocks (the default of Xilinx's power estimator, an average of customers' designs, UG440), so
  a CLB's eight nets change once a clock.
- Block RAM: 39 mW for 4 blocks to 148 mW for 32 blocks of 18 Kbit at 300 MHz, both ports in use,
  half of the bits changing, half of the clocks writing (Virtex-5, 65 nm, 1.0 V; DS512 of March
  2011, table 41).
- Multipliers: 3.1 pJ for 32 x 32 bits in 45 nm at 0.9 V (M. Horowitz: Computing's energy problem,
  ISSCC 2014, as later papers quote its table), which is more than a DSP48A1's 18 x 18 bits need.
- Static power: data sheets give typical quiescent currents at 25 degrees. Two relatives of the
  Spartan-6 LX45 take 24 mA at 1.2 V with 10 mA at 2.5 V (Spartan-3A 1400A, DS681, table 10) and
  41 mA with 25 mA (Spartan-3A DSP 1800A, DS705, table 10): 54 and 112 mW.

Changes are counted without glitches, and wires are assumed as long as in other designs. That the
result is right within a factor of two (`UNCERTAINTY`) is a judgement, not derived. Pins and clock
generation are not included.
"""

import json
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import exp, hypot, log
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.core.stack_engine import StackEngine
from plenofir.fpga.resources.record import Figures
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.ground import project
from plenofir.ground.images import read_image
from plenofir.plan import load_scene, make_plan
from plenofir.refocus import refocus
from plenofir.refocus.operator import Image
from plenofir_studies import DATA
from plenofir_studies.experiments import textures
from plenofir_studies.records import save_records
from plenofir_studies.report_parts import Progress, Report, table
from plenofir_studies.resolution import capture
from plenofir_studies.toggles import simulate_activity

FILE = DATA / "energy.json"
UNCERTAINTY = 2.0
"""Factor, either way, that the energy of a kind of cell may be off: a judgement."""
CONTENT = 1.3
"""Factor, either way, that pictures of another kind may change the energy."""


def _scaled(nanometres: float, volts: float) -> float:
    """Energy of a Spartan-6 (45 nm, 1.2 V) over that of another device."""
    return 45 / nanometres * (1.2 / volts) ** 2


_CLB_PJ = 5.9
_VIRTEX_2 = _scaled(150, 1.5)
NET_PJ = _CLB_PJ * (0.60 + 0.16) / (8 * 0.125) * _VIRTEX_2
"""Change of a net with the logic that drives it."""
CLOCK_PJ = _CLB_PJ * 0.14 / 8 * _VIRTEX_2
"""Clock of a flip-flop."""
_BLOCKS_PJ = (39e-3 / 4 / 300e6 * 1e12, 148e-3 / 32 / 300e6 * 1e12)
BLOCK_RAM_PJ = sum(_BLOCKS_PJ) / 2 * _scaled(65, 1.0)
"""Clock of a block RAM of 18 Kbit; half of it for 9 Kbit."""
MULTIPLIER_PJ = 3.1 * _scaled(45, 0.9)
"""Clock of a multiplier."""

STATIC_MW = (24 * 1.2 + 10 * 2.5, 41 * 1.2 + 25 * 2.5)
"""Static power of two devices of the generation before, about as large."""


@dataclass(frozen=True)
class Design:
    """A core, and the frames for its netlist."""

    name: str
    core: CoreConfiguration
    frames: Image  # shape (frames, rows, columns[, 3])


class Measured(BaseModel):
    """Resources of a netlist, and its switching activity."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    figures: Figures
    clocks: int  # from the first pixel in to the last pixel out
    input_pixels: int
    pixels: int  # refocused: those of all slices
    nets: int  # nets that leave their slice
    toggles: int  # changes of these nets

    @property
    def clocks_a_pixel(self) -> float:
        """Clocks for each input pixel, including the latency of the last ones."""
        return self.clocks / self.input_pixels


@dataclass(frozen=True)
class Energy:
    """Energy of a core for each refocused pixel, in pJ."""

    nets: float
    clocks: float
    block_rams: float
    multipliers: float

    @property
    def parts(self) -> tuple[float, float, float, float]:
        """In the order of the sources above."""
        return self.nets, self.clocks, self.block_rams, self.multipliers

    @property
    def total(self) -> float:
        """Sum for each refocused pixel, in pJ."""
        return sum(self.parts)

    @property
    def factor(self) -> float:
        """Uncertainty of the sum, as a factor, from independent ones of its parts."""
        spread = hypot(*(part / self.total * log(UNCERTAINTY) for part in self.parts))
        return exp(hypot(spread, log(CONTENT)))


def energy_of(measured: Measured) -> Energy:
    """Energy of the activity, for each refocused pixel."""
    figures, clocks = measured.figures, measured.clocks / measured.pixels
    return Energy(
        nets=NET_PJ * measured.toggles / measured.pixels,
        clocks=CLOCK_PJ * figures.flip_flops * clocks,
        block_rams=BLOCK_RAM_PJ * (figures.ramb16 + figures.ramb8 / 2) * clocks,
        multipliers=MULTIPLIER_PJ * figures.dsp * clocks,
    )


def _frames(m: int, rows: int = 30) -> Image:
    """Two frames of a plane with texture, about 300 pixels wide."""
    lenses = 300 // m // 2 * 2 + 1
    raw = capture(m, Fraction(2, m), textures()[0], lenses)
    return (raw[: 2 * rows] >> 8).astype(np.uint8).reshape(2, rows, -1)


def grey(
    m: int = 5,
    shifts: tuple[int, ...] = (2,),
    columns: int = 640,
    pixels: int = 1,
    engine: str = "moving_sum",
) -> CoreConfiguration:
    """The core to vary: grey, 8 bit, exact."""
    kind = {"fir": FirEngine, "stack": StackEngine}.get(engine)
    return CoreConfiguration(
        micro_image_size=m,
        shifts=shifts,
        max_columns=columns,
        engine=kind() if kind else MovingSumEngine.model_validate({"pixels_per_clock": pixels}),
    )


PIXELS = (1, 2, 4, 8, 16)
_SCENE = "thesis-m3"
_CONTENTS = ("planes", "noise", "one grey level")


def _cores() -> list[CoreConfiguration]:
    return [
        *(grey(pixels=p) for p in PIXELS),
        grey(engine="fir"),
        grey(shifts=(-3, 2, 7), engine="stack"),
        grey(m=11),
    ]


def names() -> list[str]:
    base = name_of(grey())
    return [*map(name_of, _cores()), *(f"{base}, {content}" for content in _CONTENTS), _SCENE]


def designs() -> Iterator[Design]:
    """Both engines, P, a stack, another M, pictures of other kinds, a scene."""
    for core in _cores():
        yield Design(name_of(core), core, _frames(core.micro_image_size))
    five = _frames(5)
    planes = read_image(project.DATA / "planes_5x5.png")[100:160, 150:450, 1]
    random = np.random.default_rng(0)
    for content, frames in zip(
        _CONTENTS,
        (
            np.ascontiguousarray(planes).reshape(2, 30, -1),
            random.integers(0, 256, five.shape, np.uint8),
            np.full_like(five, 90),
        ),
        strict=True,
    ):
        yield Design(f"{name_of(grey())}, {content}", grey(), frames)
    core = make_plan(load_scene(_SCENE)).core
    frames = _frames(core.micro_image_size)
    yield Design(_SCENE, core, np.stack([frames] * 3, axis=-1) if core.channels == 3 else frames)


def name_of(core: CoreConfiguration) -> str:
    shifts = ", ".join(map(str, core.shifts))
    kind = {"fir": "filters", "stack": "stack"}.get(core.engine.kind, "moving sums")
    lanes = f", P = {core.pixels_per_clock}" if core.engine.kind == "moving_sum" else ""
    return f"{kind}, M = {core.micro_image_size}, a' = {shifts}, {core.max_columns} columns{lanes}"


def load_measured() -> dict[str, Measured]:
    """What was measured, by the names of designs."""
    return {name: Measured.model_validate(m) for name, m in json.loads(FILE.read_text()).items()}


def measure(design: Design) -> Measured:
    """Synthesise a design and send its frames through the netlist."""
    with tempfile.TemporaryDirectory() as folder:
        activity = simulate_activity(
            find_simulator("verilator"), design.core, design.frames, Path(folder)
        )
    slices = len(design.core.shifts) if isinstance(design.core.engine, StackEngine) else 1
    return Measured(
        figures=activity.figures,
        clocks=activity.clocks,
        input_pixels=activity.pixels,
        pixels=activity.pixels * slices,
        nets=activity.nets,
        toggles=activity.toggles,
    )


def measure_missing(records: dict[str, Measured]) -> None:
    """Measure missing designs, and record each at once in ``data/energy.json``."""
    for design in designs():
        if design.name not in records:
            records[design.name] = measure(design)
            save_records(FILE, {name: m.model_dump() for name, m in records.items()})


ASIC = "rendering processor for light fields, 40 nm"
ASIC_PJ = 46.0
"""250 mW at 5.4 G pixels a second (OJ-SSCS 2023, by its abstract; the paper was not read)."""
_COUNTERS = Path("/sys/class/powercap")


def joules(root: Path = _COUNTERS) -> float | None:
    """Values of the processors' energy counters (RAPL) in J; None if there are none."""
    counters = []
    for path in root.glob("*/energy_uj"):
        # Only whole packages: their parts have names with two numbers.
        if path.parent.name.count(":") == 1:
            try:
                counters.append(int(path.read_text()))
            except OSError:
                return None
    return 1e-6 * sum(counters) if counters else None


def software_pj(root: Path = _COUNTERS, seconds: float = 2.0) -> float | None:
    """Energy of `refocus` for each pixel by the counters, which include the whole package."""
    raw = np.random.default_rng(0).integers(0, 256, (3201, 3201), np.uint8)
    out = np.empty_like(raw)
    refocus(raw, 11, "1/11", out=out)
    before, frames, end = joules(root), 0, time.monotonic() + seconds
    if before is None:
        return None
    while time.monotonic() < end:
        refocus(raw, 11, "1/11", out=out)
        frames += 1
    after = joules(root)
    return None if after is None else 1e12 * (after - before) / frames / raw.size


def _two_digits(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"


def _shown(name: str, measured: Measured) -> list[str]:
    energy = energy_of(measured)
    low, high = energy.total / energy.factor, energy.total * energy.factor
    return [
        name,
        f"{measured.figures.lut}",
        f"{measured.clocks_a_pixel:.2f}",
        f"{measured.toggles / measured.nets / measured.clocks:.3f}",
        *(_two_digits(part) for part in energy.parts),
        f"**{_two_digits(energy.total)}**",
        f"{_two_digits(low)} to {_two_digits(high)}",
    ]


def page(records: Mapping[str, Measured], software: float | None) -> list[str]:
    """The report: energy of each design for a pixel, its uncertainty, and other devices."""
    base = energy_of(records[name_of(grey())]).total
    contents = {
        content: energy_of(records[name]).total / base
        for content in _CONTENTS
        if (name := f"{name_of(grey())}, {content}") in records
    }
    missing = [name for name in names() if name not in records]
    spread = ", ".join(f"{content} {ratio:.2f}" for content, ratio in contents.items())
    lines = [
        "The thesis calls its architecture power-efficient and leaves the proof to future work. "
        "This is an estimate; nothing was measured on a board.",
        "",
        "Each core is synthesised for Spartan-6 with GHDL and Yosys, and pictures go through its "
        "netlist in Verilator; the output must equal the golden model. The changes of every "
        f"net are counted. A change of a net that leaves its slice counts {NET_PJ:.2f} pJ, a clock "
        f"of a flip-flop {CLOCK_PJ:.3f} pJ, of a block RAM of 18 Kbit {BLOCK_RAM_PJ:.0f} pJ, of a "
        f"multiplier {MULTIPLIER_PJ:.1f} pJ: published figures of other devices, scaled to 45 nm "
        "and 1.2 V, which `plenofir_studies.energy` names.",
        "",
        "The table has the energy for each refocused pixel, in pJ. A stack refocuses a pixel for "
        "each of its slices; its depth index is included. Frames have only 30 lines, so the "
        "latency of a core, once a frame, adds clocks to the one for each P pixels: most in the "
        "stack, whose energy in large frames is about two thirds of that.",
        "",
        *table(
            [
                "design",
                "LUT",
                "clocks a pixel in",
                "changes a clock of a net",
                "nets",
                "clocks",
                "block RAM",
                "multipliers",
                "sum",
                "range",
            ],
            (_shown(name, m) for name, m in records.items() if not name.endswith(_CONTENTS)),
        ),
        f"For comparison, a {ASIC}: {ASIC_PJ:.0f} pJ a rendered pixel, 250 mW at 5.4 G pixels a "
        "second (Chen, OJ-SSCS 2023, by its abstract). "
        + (
            f"`refocus` on this machine by its counters: {_two_digits(software)} pJ, all of the "
            "package counted."
            if software is not None
            else "`refocus` was not measured: this machine shows no energy counters (RAPL, "
            f"`{_COUNTERS}`); where it does, `plenofir report energy` reads them."
        ),
        "",
        "Uncertainty. "
        + (
            f"*Pictures*: relative to a textured plane, the same core takes with others: {spread}. "
            if contents
            else ""
        )
        + f"The ranges include a factor of {CONTENT} for other pictures. *Energy of a cell*: each "
        f"of the four kinds may be wrong by a factor of {UNCERTAINTY:g} either way, which is a "
        "judgement and not a measurement; a sum of several kinds is less uncertain. The ranges "
        "include this too. *Not included*: glitches (the simulation has no delays, and filters "
        "have deeper logic than moving sums), the true lengths of wires, pins, clock generation.",
        "",
        *(
            [f"Not measured yet (`python scripts/resources.py energy`): {'; '.join(missing)}.", ""]
            if missing
            else []
        ),
        "Static power comes in addition, whatever the core does. Two devices of the generation "
        f"before the Spartan-6 LX45, about as large, take {STATIC_MW[0]:.0f} and "
        f"{STATIC_MW[1]:.0f} mW at 25 degrees by their data sheets. At 100 Mpx/s that is "
        f"{10 * STATIC_MW[0]:.0f} to {10 * STATIC_MW[1]:.0f} pJ a pixel, so several pixels a "
        "clock save most there.",
    ]
    return lines


def write_report(folder: Path, progress: Progress | None = None) -> Path:
    """Measure every design anew and write ``energy.md``."""
    chosen = list(designs())
    report = Report(folder, "energy.md", len(chosen), progress)
    records = {}
    for design in chosen:
        records[design.name] = measure(design)
        report.step()
    report.say("# Energy of a pixel")
    report.add(page(records, software_pj()))
    return report.write()
