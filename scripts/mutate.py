"""Changes the VHDL in many small ways and reports the share that the tests notice.

Usage: python scripts/mutate.py [--seed N] [--count N] [--out FILE]

A mutant is one change of one operator, constant, switch bit or reset in one source. Each is
simulated with a small suite: a few cores in the file pump, with and without stalls, against the
golden model. A mutant that no longer analyses is not counted. Survivors are printed with file, line
and change.
"""

import argparse
import json
import random
import re
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np

from plenofir import project
from plenofir.core import CoreConfiguration
from plenofir.refocus import StoredProductArithmetic
from plenofir.simulation import pump
from plenofir.simulation.simulators import SimulationError, find_simulator

# What may be changed: pattern, and what takes its place.
RULES: tuple[tuple[str, tuple[str, ...]], ...] = (
    (r"(?<= )\+(?= )", ("-",)),
    (r"(?<= )-(?= )", ("+",)),
    (r"(?<= )and(?= )", ("or",)),
    (r"(?<= )or(?= )", ("and",)),
    (r"(?<= )not (?=\w)", ("",)),
    (r"(?<= )=(?= )", ("/=",)),
    (r"(?<= )/=(?= )", ("=",)),
    (r"(?<= )<(?= )", ("<=", ">=")),
    (r"(?<= )>(?= )", (">=", "<")),
    (r"(?<= )>=(?= )", (">", "<")),
    (r"(?<== )'0'", ("'1'",)),
    (r"(?<== )'1'", ("'0'",)),
    (r"(?<=<= )'0'(?=;| when)", ("'1'",)),
    (r"(?<=<= )'1'(?=;| when)", ("'0'",)),
    (r"(?<=[-+/] )1(?=[ ;)])", ("0", "2")),
    (r"(?<=> )0(?= )", ("1",)),
)
# A line of a reset branch: dropped as a whole.
RESET = re.compile(r"if reset = '1' then\n(.*?)\n +end if;", re.S)
# Nothing in here is logic: text, declarations of ports, checks of generics.
SKIPPED = re.compile(r"--|assert|report|severity|: +in |: +out |library|use |generic|range")
# Sources whose mutants the small suite cannot reach.
LEFT_OUT = {"self_test"}
STALLS = 25


@dataclass(frozen=True)
class Mutant:
    """One change.

    Attributes
    ----------
    file, line
        Where it is.
    old, new
        The line before and after.
    """

    file: str
    line: int
    old: str
    new: str


@dataclass(frozen=True)
class Case:
    """One run of the suite.

    Attributes
    ----------
    core
        Generics.
    columns, rows, frames
        What goes through it.
    """

    core: CoreConfiguration
    columns: int
    rows: int
    frames: int


def _core(**values: object) -> CoreConfiguration:
    return CoreConfiguration.model_validate({"max_columns": 24, **values})


CASES = (
    Case(_core(micro_image_size=3, shifts=(2,)), 20, 9, 3),
    Case(_core(micro_image_size=3, shifts=(-2, 1, 3), channels=3), 17, 7, 4),
    Case(_core(micro_image_size=2, shifts=(3,), parallel_rows=3), 12, 8, 3),
    Case(
        _core(
            micro_image_size=5,
            shifts=(-5, 0, 5),
            hold=True,
            arithmetic=StoredProductArithmetic(fraction_bits=4, guard_bits=2),
        ),
        23,
        11,
        4,
    ),
    Case(_core(micro_image_size=3, shifts=(0,), order=1, broadcast_taps=2), 16, 9, 2),
    Case(_core(micro_image_size=4, shifts=(1,), max_columns=6, align="causal"), 3, 5, 3),
)


def mutants(sources: list[Path]) -> Iterator[Mutant]:
    """All changes that the rules allow."""
    for source in sources:
        if source.stem in LEFT_OUT:
            continue
        text = source.read_text()
        body = text.index("architecture ") if "architecture " in text else text.index("body ")
        first = text[:body].count("\n")
        lines = text.splitlines()
        for number, line in enumerate(lines[first:], first + 1):
            code = line.split("--")[0]
            if SKIPPED.search(line):
                continue
            for pattern, replacements in RULES:
                for match in re.finditer(pattern, code):
                    for replacement in replacements:
                        changed = code[: match.start()] + replacement + code[match.end() :]
                        yield Mutant(source.name, number, code, changed)
        for block in RESET.finditer(text):
            start = text[: block.start(1)].count("\n") + 1
            for offset, line in enumerate(block.group(1).splitlines()):
                if "<=" in line and line.strip().endswith(";"):
                    yield Mutant(source.name, start + offset, line, "")


def write_mutant(mutant: Mutant, sources: list[Path], folder: Path) -> list[Path]:
    """Copy the sources with one line changed."""
    copies = []
    for source in sources:
        lines = source.read_text().splitlines()
        if source.name == mutant.file:
            lines[mutant.line - 1] = mutant.new
        copies.append(folder / source.name)
        copies[-1].write_text("\n".join([*lines, ""]))
    return copies


def frames_of(case: Case) -> np.ndarray:
    """Random frames, white among them."""
    channels = (case.core.channels,) if case.core.channels > 1 else ()
    shape = (case.frames, case.rows, case.columns, *channels)
    frames = np.random.default_rng(3).integers(0, 256, shape, dtype=np.uint8)
    frames[-1] = 255
    return frames


def wanted(case: Case, frames: np.ndarray) -> np.ndarray:
    """What must come out."""
    core = case.core
    return np.array(
        [
            core.arithmetic.refocus(
                frame,
                core.micro_image_size,
                core.shifts[number % len(core.shifts)],
                align=core.align,
                order=core.order,
            )
            for number, frame in enumerate(frames)
        ]
    )


def refuse_excess(pixels: int, received: int) -> None:
    """End the simulation of a core that does not stop giving pixels."""
    if received > pixels:
        raise SimulationError(f"{received} pixels for {pixels}")


def outcome(sources: list[Path], folder: Path) -> str:
    """What becomes of a set of sources: "survives", "invalid", or what notices the change."""
    simulator = find_simulator("ghdl")
    # A core that hangs is given up sooner than one that works might need.
    pump_file = folder / "refocus_pump.vhd"
    text = (project.root() / "tb" / "pump" / "refocus_pump.vhd").read_text()
    patient, impatient = "IDLE_LIMIT : positive := 100000", "IDLE_LIMIT : positive := 3000"
    assert patient in text
    pump_file.write_text(text.replace(patient, impatient))
    try:
        for command in simulator.build_commands([*sources, pump_file], pump.TOP):
            simulator.run(command, folder)
    except SimulationError:
        return "invalid"
    for number, case in enumerate(CASES):
        frames = frames_of(case)
        sweep = 1 if len(case.core.shifts) > 1 else 0
        limit = partial(refuse_excess, case.columns * case.rows * case.frames)
        for stalls in (0, STALLS):
            try:
                result = pump.run_pump(
                    simulator,
                    case.core,
                    frames,
                    folder,
                    sweep_frames=sweep,
                    stall_percent=stalls,
                    built=True,
                    progress=limit,
                )
            except (SimulationError, KeyError, OSError, ValueError):
                return f"case {number}: simulation"
            if not np.array_equal(result.frames, wanted(case, frames)):
                return f"case {number}: pixels"
            if stalls == 0 and result.latency_clocks != case.core.latency_clocks(
                case.columns, case.rows, case.frames
            ):
                return f"case {number}: latency"
    return "survives"


def main() -> int:
    """Run the mutants; exit code 1 if the sources themselves fail."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=120)
    parser.add_argument("--out", type=Path, default=project.root() / "build" / "mutants.json")
    arguments = parser.parse_args()
    sources = project.hdl_sources()
    work = project.root() / "build" / "work"
    work.mkdir(parents=True, exist_ok=True)

    def run(mutant: Mutant | None) -> str:
        with tempfile.TemporaryDirectory(dir=work, prefix="mutant-") as name:
            folder = Path(name)
            if mutant is None:
                return outcome(sources, folder)
            return outcome(write_mutant(mutant, sources, folder), folder)

    if run(None) != "survives":
        print("the sources themselves fail the suite", file=sys.stderr)
        return 1
    every = list(mutants(sources))
    chosen = random.Random(arguments.seed).sample(every, min(arguments.count, len(every)))
    results = []
    started = time.perf_counter()
    for number, mutant in enumerate(chosen, 1):
        found = run(mutant)
        results.append({**asdict(mutant), "outcome": found})
        if found == "survives":
            print(
                f"survives: {mutant.file}:{mutant.line}: {mutant.new.strip() or 'dropped'}"
                f"   (was {mutant.old.strip()})",
                flush=True,
            )
        if sys.stderr.isatty():
            print(f"\r{number} of {len(chosen)}", end="", file=sys.stderr)
    counted = [result for result in results if result["outcome"] != "invalid"]
    killed = [result for result in counted if result["outcome"] != "survives"]
    print(
        f"{len(killed)} of {len(counted)} mutants killed "
        f"({100 * len(killed) / max(len(counted), 1):.1f} %), {len(results) - len(counted)} not "
        f"valid VHDL, of {len(every)} possible; seed {arguments.seed}, "
        f"{time.perf_counter() - started:.0f} s"
    )
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(results, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
