# SPDX-License-Identifier: Apache-2.0
"""Energy of a frame: what switches in a simulated netlist, times published energies of devices.

There is no published energy for each resource of a Spartan-6, so those of other devices are scaled:
energy goes with the size of structures (capacitance) and with the square of the voltage.

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

Changes are counted without glitches, wires have the length that they have in other designs. That
the result is good to a factor of two either way, which `UNCERTAINTY` says, is a judgement and not
derived. Pins and clock generation are not in it.
"""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.fpga.simulate.toggles import Activity, simulate_activity
from plenofir.fpga.tools.simulators import Simulator, find_simulator
from plenofir.ground import project
from plenofir.ground.images import read_image
from plenofir.plan import load_scene, make_plan
from plenofir.refocus.operator import Image
from plenofir_studies.experiments import textures
from plenofir_studies.report_parts import Columns, Progress, Report
from plenofir_studies.resolution import capture, central_directions

UNCERTAINTY = 2.0
"""Factor, either way, that an energy may be off."""


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
_FRAMES = 60


@dataclass(frozen=True)
class Load:
    """A core, what goes through its netlist, and the frame that the energy is told of."""

    name: str
    core: CoreConfiguration
    frames: Image  # shape (frames, rows, columns[, 3])
    columns: int
    rows: int


@dataclass(frozen=True)
class Energy:
    """Energy of a core for each clock, in pJ; at full rate a clock takes a pixel."""

    load: Load
    activity: Activity
    nets: float
    clocks: float
    block_rams: float
    multipliers: float

    @property
    def total(self) -> float:
        """Sum for each clock, in pJ."""
        return self.nets + self.clocks + self.block_rams + self.multipliers

    @property
    def frame_mj(self) -> float:
        """Energy of a frame of the load's size, in mJ."""
        return self.total * self.load.columns * self.load.rows * 1e-9


def energy_of(load: Load, activity: Activity) -> Energy:
    """Weigh what switches, for each clock."""
    figures = activity.figures
    return Energy(
        load,
        activity,
        nets=NET_PJ * activity.toggles / activity.clocks,
        clocks=CLOCK_PJ * figures.flip_flops,
        block_rams=BLOCK_RAM_PJ * (figures.ramb16 + figures.ramb8 / 2),
        multipliers=MULTIPLIER_PJ * figures.dsp,
    )


def loads() -> Iterator[Load]:
    """Both engines, the thesis's architecture, and the cores of the other large scenes."""
    planes = read_image(project.DATA / "planes_5x5.png")
    five = np.stack([planes[100:200, 150:450], planes[200:300, 300:600]])
    for engine in (FirEngine(), MovingSumEngine()):
        core = CoreConfiguration(micro_image_size=5, shifts=(2,), max_columns=640, engine=engine)
        name = f"grey, M = 5, a = 2/5, {engine.kind}"
        yield Load(name, core, np.ascontiguousarray(five[..., 1]), 640, 480)
    three = central_directions(planes, 5, 3)
    parts = np.stack([three[30:120, 60:240], three[120:210, 200:380]])
    plan = make_plan(load_scene("thesis-m3"))
    yield Load("thesis-m3", plan.core, parts, plan.columns, plan.rows)
    plan = make_plan(load_scene("rgb-720p"))
    yield Load("rgb-720p, the core", plan.core, five, plan.columns, plan.rows)
    plan = make_plan(load_scene("video-m11"))
    eleven = capture(11, Fraction(1, 2).limit_denominator(11), textures()[0], 31)
    still = (eleven[:242] >> 8).astype(np.uint8).reshape(2, 121, -1)
    core = plan.core.model_copy(update={"engine": MovingSumEngine()})
    yield Load("video-m11, one pixel a clock", core, still, plan.columns, plan.rows)


def _two_digits(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"


def _range(energy: Energy) -> str:
    low, high = (_two_digits(energy.frame_mj * f) for f in (1 / UNCERTAINTY, UNCERTAINTY))
    return f"{low} to {high}"


def energies(report: Report, results: Sequence[Energy]) -> None:
    """Text and tables of the report."""
    report.say(
        "# Energy of a frame",
        "Written by `plenofir report energy`. The thesis calls its architecture power-efficient "
        "and leaves the proof to future work. This is an estimate; nothing was measured on a "
        "board.",
        "Each core is synthesised for Spartan-6 with GHDL and Yosys, and pictures go through its "
        "netlist in Verilator; what comes out must equal the golden model. The changes of every "
        "net are counted. "
        f"A change of a net that leaves its slice counts {NET_PJ:.2f} pJ, a clock of a flip-flop "
        f"{CLOCK_PJ:.3f} pJ, of a block RAM of 18 Kbit {BLOCK_RAM_PJ:.0f} pJ, of a multiplier "
        f"{MULTIPLIER_PJ:.1f} pJ. These are published figures of other devices, scaled to 45 nm "
        "and 1.2 V; `plenofir_studies.energy` names them. Glitches, the true lengths of wires, "
        "pins and clock generation are not in it. Expect a factor of "
        f"{UNCERTAINTY:g} either way: that is a judgement, for want of a measurement.",
    )
    core: Columns = {"core": "{.load.name}"}
    report.table_of(
        results,
        {
            **core,
            "nets": "{.activity.nets}",
            "changes a clock, each net": "{.activity.rate:.3f}",
            "nets / pJ": "{.nets:.0f}",
            "clocks / pJ": "{.clocks:.0f}",
            "block RAM / pJ": "{.block_rams:.0f}",
            "multipliers / pJ": "{.multipliers:.0f}",
            "sum / pJ a clock": "{.total:.0f}",
        },
    )
    report.say("A clock takes a pixel, so the energy of a frame does not depend on the clock:")
    report.table_of(
        results,
        {
            **core,
            "frame": "{0.load.columns} x {0.load.rows}",
            "mJ a frame": lambda e: _two_digits(e.frame_mj),
            "range": _range,
            f"mW at {_FRAMES} frames a second": lambda e: _two_digits(_FRAMES * e.frame_mj),
        },
    )
    low, high = (_two_digits(power / _FRAMES) for power in STATIC_MW)
    report.say(
        f"Static power comes on top, whatever the core does. For the Spartan-6 LX45 no figure is "
        f"known here; two devices of the generation before, about as large, take "
        f"{STATIC_MW[0]:.0f} and {STATIC_MW[1]:.0f} mW at 25 degrees by their data sheets. At "
        f"{_FRAMES} frames a second that would be {low} to {high} mJ a frame.",
        "How much the assumed energies matter: by how many percent the sum grows if one of them "
        "is twice as large as assumed (it shrinks by half of that if it is half as large).",
    )
    report.table_of(
        results,
        {
            **core,
            "change of a net": lambda e: f"{100 * e.nets / e.total:.0f}",
            "clock of a flip-flop": lambda e: f"{100 * e.clocks / e.total:.0f}",
            "block RAM": lambda e: f"{100 * e.block_rams / e.total:.0f}",
            "multiplier": lambda e: f"{100 * e.multipliers / e.total:.0f}",
        },
    )
    shares = [(100 * e.block_rams / e.total, e.load.name) for e in results]
    (least, narrow), (most, wide) = min(shares), max(shares)
    report.say(
        f"Block RAM takes {least:.0f} % ({narrow}) to {most:.0f} % ({wide}) of the energy. In wide "
        "frames the lines that wait cost more than the arithmetic.",
    )


def write_report(folder: Path, progress: Progress | None = None) -> Path:
    """Simulate every core and write ``energy.md``."""
    chosen = list(loads())
    report = Report(folder, "energy.md", len(chosen), progress)
    simulator: Simulator = find_simulator("verilator")
    results = []
    for load in chosen:
        with tempfile.TemporaryDirectory() as name:
            activity = simulate_activity(simulator, load.core, load.frames, Path(name))
        results.append(energy_of(load, activity))
        report.step()
    energies(report, results)
    return report.write()
