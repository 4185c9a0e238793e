# SPDX-License-Identifier: Apache-2.0
"""Proofs with Yosys' SAT solver and with ABC: see docs/verification.md."""

import importlib.util
import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from plenofir.fpga import hdl
from plenofir.fpga.tools.dumps import Dump
from plenofir.fpga.tools.synthesis import Generics, run_yosys, write_verilog, yosys_version
from plenofir.ground import project
from plenofir.ground.errors import ToolError
from plenofir.refocus.moving_sum import SumLayout
from plenofir.refocus.operator import output_offset
from plenofir.refocus.sum_lanes import LaneLayout
from plenofir.refocus.switches import FilterLayout
from plenofir_studies.part_wrapper import TOP, with_part, wrapped

# Invariants for the induction of a `RingProof`.
_RING_SIGNALS = (
    *("state", "y", "row_index", "line_index", "gap", "stride", "top", "bottom", "oldest"),
    *("last_kept", "needed", "kept"),
)
TRACE = "failure.vcd"
"""Steps up to the one in which a property fails, in the folder of the proof."""
# Yosys takes no negative parameters.
_BIAS = 64


def _geometry(micro_image_size: int, shift: int, box: int | None = None) -> str:
    """VHDL of the geometry of one slice; a box of M for None."""
    samples = box or micro_image_size
    return f'geometry_of("{TOP}", {micro_image_size}, "{shift}", true, "{samples}")'


@dataclass(frozen=True)
class FirProof:
    """The row filter equals the gather equation, for all inputs over a number of clocks."""

    micro_image_size: int  # M in pixels
    shift: int  # a' in pixels
    data_bits: int = 1  # width of a pixel
    clocks: int = 14  # from the initial state on
    hold: bool = False  # see `plenofir.refocus.switches.FilterLayout`

    @property
    def name(self) -> str:
        hold = " hold" if self.hold else ""
        return (
            f"filter M={self.micro_image_size} a'={self.shift}{hold}, "
            f"{self.data_bits} bit, {self.clocks} clocks"
        )

    def prove(self, directory: Path, sources: Sequence[Path] | None = None) -> None:
        """Prove it in an empty folder; ToolError if it does not hold.

        `sources` are VHDL files, if not those of the project.
        """
        m, shift = self.micro_image_size, self.shift
        layout = FilterLayout(m, (shift,), hold=self.hold)
        largest = (1 << self.data_bits) - 1
        sum_bits = (m * largest).bit_length()
        values = {
            "GEOMETRY": _geometry(m, shift),
            "SIZES": f"exact_pass({largest}, {m})",
            "HOLD": self.hold,
            "LANES": 1,
            "BROADCAST_TAPS": 0,
        }
        parameters = {
            "M": m,
            "SHIFT_BIASED": shift + _BIAS,
            "OFFSET_BIASED": output_offset(m, shift, "centred") + _BIAS,
            "DATA_BITS": self.data_bits,
            "SUM_BITS": sum_bits,
            "LENGTH": min(self.clocks - layout.delay, 8),
        }
        part = wrapped("fir_stage", values)
        _prepare(TOP, "fir_properties", {}, parameters, directory, sources, part)
        _check(directory, self.name, f"bmc3 -F {self.clocks}", "No output asserted in")


@dataclass(frozen=True)
class LaneProof:
    """The row stage of several pixels a token equals the gather equation, over so many clocks."""

    micro_image_size: int  # M in pixels
    shift: int  # a' in pixels
    pixels: int  # P of a token, a bit each
    clocks: int = 16  # from the initial state on
    box: int | None = None  # samples B, M if None

    @property
    def name(self) -> str:
        m, p = self.micro_image_size, self.pixels
        box = f" box of {self.box}" if self.box else ""
        return f"{p} pixels a token, M={m} a'={self.shift}{box}, {self.clocks} clocks"

    def prove(self, directory: Path, sources: Sequence[Path] | None = None) -> None:
        m, shift, p = self.micro_image_size, self.shift, self.pixels
        box = self.box or m
        lanes = LaneLayout(SumLayout(m, (shift,), boxes=(box,)), p)
        values = {
            "BUILD": f"to_lanes({_geometry(m, shift, box)}, {p}, 1, 1)",
            "SUM_BITS": m.bit_length(),
        }
        parameters = {
            "M": m,
            "P": p,
            "BOX": box,
            "SHIFT_BIASED": shift + _BIAS,
            "OFFSET_BIASED": output_offset(m, shift, "centred", box) + _BIAS,
            "SUM_BITS": m.bit_length(),
            "LEAST": lanes.delay + 1,
            "LENGTH": self.clocks - lanes.clocks - lanes.delay,
        }
        part = wrapped("lane_stage", values)
        _prepare(TOP, "lane_properties", {}, parameters, directory, sources, part)
        _check(directory, self.name, f"bmc3 -F {self.clocks}", "No output asserted in")


@dataclass(frozen=True)
class DivideProof:
    """The division by a weight is exact, for every weight and value of some width."""

    weight_bits: int  # width of a weight
    quotient_bits: int  # width of a pixel

    @property
    def name(self) -> str:
        return f"division of {self.quotient_bits} bit by any weight of {self.weight_bits} bit"

    def prove(self, directory: Path, sources: Sequence[Path] | None = None) -> None:
        weight_max = (1 << self.weight_bits) - 1
        generics: Generics = {
            "LANES": 1,
            "VALUE_BITS": self.weight_bits + self.quotient_bits,
            "WEIGHT_MAX": weight_max,
            "QUOTIENT_BITS": self.quotient_bits,
        }
        parameters = {"WEIGHT_BITS": self.weight_bits, "QUOTIENT_BITS": self.quotient_bits}
        _prepare("divide_weighted", "divide_properties", generics, parameters, directory, sources)
        clocks = self.quotient_bits + 3
        _check(directory, self.name, f"bmc3 -F {clocks}", "No output asserted in")


@dataclass(frozen=True)
class RoundProof:
    """The division by a constant rounds to the nearest, halves up, for every value."""

    divisor: int  # the square of M
    quotient_bits: int = 4  # width of a pixel

    @property
    def name(self) -> str:
        return f"division of sums by {self.divisor}, rounded to {self.quotient_bits} bit"

    def prove(self, directory: Path, sources: Sequence[Path] | None = None) -> None:
        largest = self.divisor * ((1 << self.quotient_bits) - 1)
        sizes = {
            "DIVISOR": self.divisor,
            "VALUE_MAX": largest,
            "QUOTIENT_BITS": self.quotient_bits,
        }
        parameters = {**sizes, "VALUE_BITS": largest.bit_length()}
        _prepare("divide_round", "round_properties", sizes, parameters, directory, sources)
        _check(directory, self.name, "bmc3 -F 6", "No output asserted in")


@dataclass(frozen=True)
class FifoProof:
    """The stream buffer keeps order and number of words, for all inputs and for ever."""

    address_bits: int  # it holds 2**address_bits words
    width: int = 1  # bits of a word

    @property
    def name(self) -> str:
        return f"buffer of {1 << self.address_bits} words of {self.width} bit, no bound"

    def prove(self, directory: Path, sources: Sequence[Path] | None = None) -> None:
        sizes = {"WIDTH": self.width, "ADDRESS_BITS": self.address_bits}
        _prepare("axis_fifo", "fifo_properties", sizes, sizes, directory, sources)
        _check(directory, self.name, "scorr; pdr -T 300", "Property proved")


@dataclass(frozen=True)
class BusProof:
    """An entity on a bus keeps to its rules, for all masters and slaves and for ever.

    ``axi_lite_slave`` to AXI4-Lite, ``wishbone_bridge`` to Wishbone and, behind it, AXI4-Lite.
    """

    address_bits: int  # of an address in bytes
    entity: Literal["axi_lite_slave", "wishbone_bridge"] = "axi_lite_slave"

    @property
    def name(self) -> str:
        return f"{self.entity} with addresses of {self.address_bits} bit, no bound"

    def prove(self, directory: Path, sources: Sequence[Path] | None = None) -> None:
        sizes = {"ADDRESS_BITS": self.address_bits}
        properties = f"{self.entity.rsplit('_', 1)[0]}_properties"
        _prepare(self.entity, properties, sizes, sizes, directory, sources)
        _check(directory, self.name, "scorr; pdr -T 300", "Property proved")


@dataclass(frozen=True)
class EventProof:
    """No fault and no event is lost, in the clock in which software clears its bit too."""

    counters: int = 1  # events that are counted

    @property
    def name(self) -> str:
        return "events that are kept until they are cleared, no bound"

    def prove(self, directory: Path, sources: Sequence[Path] | None = None) -> None:
        generics: Generics = {"COUNTERS": self.counters}
        _prepare("event_registers", "event_properties", generics, {}, directory, sources)
        _check(directory, self.name, "pdr -T 300", "Property proved")


@dataclass(frozen=True)
class HeaderProof:
    """One wrong bit of a CSI-2 header is corrected, two are found, for all headers."""

    clocks: int = 4  # from the initial state on; nothing lasts longer than two

    @property
    def name(self) -> str:
        return "every one and every two wrong bits of every CSI-2 header"

    def prove(self, directory: Path, sources: Sequence[Path] | None = None) -> None:
        _prepare("header_ecc", "header_properties", {}, {}, directory, sources)
        _check(directory, self.name, f"bmc3 -F {self.clocks}", "No output asserted in")


@dataclass(frozen=True)
class MergeProof:
    """Lanes of CSI-2 come out in step, for all skews and bursts and for ever."""

    lanes: int
    skew: int  # the largest, in clocks
    bits: int = 1  # of each byte that are compared

    @property
    def name(self) -> str:
        size = f"{self.lanes} lanes, {self.skew} clocks of skew, {self.bits} bit of a byte"
        return f"merge of {size}, no bound"

    def prove(self, directory: Path, sources: Sequence[Path] | None = None) -> None:
        sizes = {"LANES": self.lanes, "MAX_SKEW": self.skew}
        parameters = {**sizes, "BITS": self.bits}
        _prepare("lane_merge", "merge_properties", sizes, parameters, directory, sources)
        _check(directory, self.name, "scorr; pdr -T 300", "Property proved")


@dataclass(frozen=True)
class RingProof:
    """The resampler reads only lines that the ring holds, for every calibration and for ever."""

    micro_image_size: int  # M in pixels
    lines: int  # of the ring
    fraction_bits: int = 8  # of positions

    @property
    def name(self) -> str:
        return f"ring of {self.lines} lines, M={self.micro_image_size}, no bound"

    def prove(self, directory: Path, sources: Sequence[Path] | None = None) -> None:
        generics: Generics = {
            "MICRO_IMAGE_SIZE": self.micro_image_size,
            "LINES": self.lines,
            "FRACTION_BITS": self.fraction_bits,
        }
        entity, properties = "lens_rows", "ring_properties"
        verilog = write_verilog(sources or hdl.hdl_sources(), entity, generics, directory)
        file = project.root() / "formal" / f"{properties}.sv"
        values = f"-set M {self.micro_image_size} -set LINES {self.lines}"
        values += f" -set FRACTION_BITS {self.fraction_bits}"
        log = directory / "proof.log"
        try:
            run_yosys(
                [
                    f"read_verilog {verilog.name}",
                    "expose " + " ".join(f"{entity}/w:{name}" for name in _RING_SIGNALS),
                    f"read_verilog -sv -formal {file}",
                    f"chparam {values} {properties}",
                    f"prep -top {properties}; flatten; memory_map; opt -full; async2sync",
                    "chformal -lower; opt -full",
                    "sat -verify -prove-asserts -set-assumes -tempinduct -maxsteps 1"
                    f" -show-public -dump_vcd {TRACE}",
                ],
                log,
            )
        except ToolError as error:
            trace = directory / TRACE
            if trace.exists():
                # Steps of a proof have no time; readers of waves need a unit.
                trace.write_text("$timescale 1ns $end\n" + trace.read_text())
            raise _not_proved(directory, self.name, str(error)) from None
        if "Induction step proven" not in log.read_text():
            raise _not_proved(directory, self.name, log.read_text()[-500:])


Proof = (
    FirProof
    | LaneProof
    | DivideProof
    | RoundProof
    | FifoProof
    | BusProof
    | EventProof
    | HeaderProof
    | MergeProof
    | RingProof
)


def abc_program() -> Path:
    """ABC, as the installed Yosys brings it."""
    yosys_version()
    package = importlib.util.find_spec("pyosys")
    assert package is not None
    assert package.origin is not None
    return Path(package.origin).parent / "yosys-abc"


def _check(directory: Path, name: str, commands: str, verdict: str) -> None:
    """Let ABC check the properties of ``proof.aig``."""
    witness = directory / "failure.aiw"
    process = subprocess.run(
        [
            str(abc_program()),
            "-c",
            f"read_aiger proof.aig; fold; strash; {commands}; write_cex -a {witness.name}",
        ],
        cwd=directory,
        capture_output=True,
        text=True,
        check=False,
    )
    (directory / "proof.log").write_text(process.stdout + process.stderr)
    if verdict not in process.stdout:
        if witness.exists():
            _replay(directory, witness)
        raise _not_proved(directory, name, process.stdout[-500:])


def _replay(directory: Path, witness: Path) -> None:
    """Simulate the inputs with which a property fails, and write `TRACE`."""
    # Registers that ABC has left out start at 0 as well.
    with (directory / "proof.aig").open("rb") as file:
        registers = int(file.readline().split()[3])
    _, *steps = witness.read_text().splitlines()
    witness.write_text("\n".join(["0" * registers, *steps, ""]))
    run_yosys(
        [
            "read_rtlil proof.il",
            f"sim -r {witness.name} -map proof.aim -clock clk -zinit -timescale 1ns -vcd {TRACE}",
        ],
        directory / "replay.log",
    )


def _not_proved(directory: Path, name: str, told: str) -> ToolError:
    """The error, with the signals of the properties in the step that fails where there is one."""
    trace, replay = directory / TRACE, directory / "replay.log"
    if not trace.exists():
        return ToolError(f"{name}: not proved:\n{told}")
    told = replay.read_text() if replay.exists() else ""
    broken = re.findall(r"Failed assertion \S+ at\s+(\S+)", told)
    place = f" at {Path(broken[-1]).name}" if broken else ""
    dump = Dump(trace)
    values = []
    for signal in dump.signals:
        scope, _, plain = signal.canonical.rpartition(".")
        changes = dump.changes(signal).values
        if "." not in scope and changes and plain != "clk" and "$" not in plain:
            values.append(f"  {plain} = {changes[-1]}")
    lines = [f"{name}: not proved; the last step of {trace} fails{place}:", *sorted(values)]
    return ToolError("\n".join(lines))


def _prepare(
    entity: str,
    properties: str,
    generics: Generics,
    parameters: dict[str, int],
    directory: Path,
    sources: Sequence[Path] | None,
    part: str = "",
) -> None:
    """Write the entity with its properties as one circuit of gates, proof.aig.

    `part` is the entity's VHDL, if it is a wrapper.
    """
    design = list(sources or hdl.hdl_sources())
    if part:
        design = with_part(design, part, directory)
    verilog = write_verilog(design, entity, generics, directory)
    file = project.root() / "formal" / f"{properties}.sv"
    values = " ".join(f"-set {name} {value}" for name, value in parameters.items())
    run_yosys(
        [
            f"read_verilog {verilog.name}",
            f"read_verilog -sv -formal {file}",
            f"chparam {values} {properties}",
            f"prep -top {properties}; flatten; memory_map; opt -full; async2sync",
            "setundef -undriven -anyseq; setundef -init -zero",
            "techmap; opt -full; dffunmap; setundef -init -zero; zinit -all",
            "dfflegalize -cell $_DFF_P_ 01; aigmap; opt_clean; stat",
            "write_aiger -zinit -map proof.aim proof.aig; write_rtlil proof.il",
        ],
        directory / "prepare.log",
    )


PROOFS = (
    FirProof(2, 1),
    FirProof(2, -1),
    FirProof(3, 1),
    FirProof(3, 2),
    LaneProof(3, 2, 2, box=2),
    DivideProof(4, 4),
    RoundProof(16),
    RoundProof(25),
    RoundProof(36),
    FifoProof(2),
    BusProof(4),
    EventProof(),
    HeaderProof(),
    MergeProof(2, 1),
    BusProof(4, "wishbone_bridge"),
)
"""Proofs of `make test`."""

LONG_PROOFS = (
    FirProof(2, 3, data_bits=2, clocks=18),
    FirProof(3, 0),
    FirProof(3, 0, hold=True, clocks=20),
    FirProof(3, -1, clocks=16),
    FirProof(3, 2, data_bits=2, clocks=16),
    LaneProof(3, 2, 2),
    LaneProof(2, -1, 2, clocks=17),
    LaneProof(2, 2, 2, clocks=18),
    LaneProof(3, 3, 2, clocks=18),
    LaneProof(5, 2, 2),
    LaneProof(3, 2, 4),
    LaneProof(1, 2, 4),
    DivideProof(5, 8),
    DivideProof(7, 8),
    FifoProof(2, width=2),
    FifoProof(3),
    BusProof(12),
    MergeProof(2, 1, bits=8),
    MergeProof(2, 2),
    BusProof(12, "wishbone_bridge"),
    RingProof(3, 4),
    RingProof(5, 16, fraction_bits=16),
)
"""Proofs that `make test-full` adds."""
