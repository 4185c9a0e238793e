# SPDX-License-Identifier: Apache-2.0
"""Changes the VHDL in many small ways and reports what the tests do not notice.

Usage: python scripts/mutate.py [--seeds N ...] [--count N] [--only FILE]
       [--survivors FILE] [--jobs N] [--out FILE] [--resume]

A mutant is one change of one operator, constant, switch bit or reset in one source. The testbenches
that reach its source are simulated until one fails, short ones first. One that nothing notices is
compared with the sources as circuits. A mutant that does not analyse is not counted, one that is
proved to be equal is counted apart.
Which mutants are taken depends on a hash of their text, so that a change of the sources leaves most
of them as they were. mutants.py makes them, mutant_tests.py says which testbenches reach a source,
mutant_proof.py proves that circuits are equal.

Survivors must be explained in scripts/survivors_vhdl.toml; exit code 1 if one is not.
"""

import argparse
import fnmatch
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

from mutant_proof import proved_circuits
from mutant_tests import CHAIN, RASTER, ULX3S, relative, rounds_of
from mutants import Key, Mutant, chosen, explained, is_explained, mutants, write_mutant
from plenofir.fpga import hdl
from plenofir.fpga.names import DEFAULT_BOARD
from plenofir.fpga.simulate.chain import bench_around
from plenofir.fpga.tools.simulators import SimulationError, find_simulator
from plenofir.ground import project

# Processor time of a simulation until a mutant counts as one that hangs; of the chain's.
TEST_SECONDS, CHAIN_SECONDS = 150, 400
# A test of a bench that has failed, in its log.
FAILED = re.compile(rb"cocotb\.regression .* failed")


def is_valid(sources: Sequence[Path], folder: Path) -> bool:
    """Whether all sources analyse."""
    simulator = find_simulator("ghdl")
    folder.mkdir()
    try:
        models = simulator.analysis(hdl.model_sources(), library="unisim", board=True)
        simulator.run(models, folder)
        simulator.run(simulator.analysis([*sources, *bench_around()], board=True), folder)
    except SimulationError:
        return False
    return True


def run_tests(folder: Path, words: Sequence[str]) -> int:
    """Run pytest with the sources of a folder, in this process."""
    seconds = CHAIN_SECONDS if words[0].startswith(CHAIN) else TEST_SECONDS
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    sys.path.insert(0, str(project.root() / "tb"))
    from hunt import simulate as hunter
    from plenofir_tb import runner

    portable = [folder / source.name for source in hdl.hdl_sources()]
    sources_of_board = hdl.board_sources
    simulate = runner._simulate

    def changed(board: str = DEFAULT_BOARD) -> list[Path]:
        # What only other boards have is not changed.
        copies = ((folder / source.name, source) for source in sources_of_board(board))
        return [copy if copy.is_file() else source for copy, source in copies]

    def simulate_once(*words: Any, **options: Any) -> set[str]:
        # A failure is not simulated again for its waveforms.
        suspects = simulate(*words, **options)
        if suspects:
            pytest.fail(f"failed: {', '.join(suspects)}")
        return suspects

    with (
        mock.patch.object(hdl, "hdl_sources", return_value=portable),
        mock.patch.object(hdl, "board_sources", side_effect=changed),
        mock.patch.object(hdl, "all_sources", return_value=changed()),
        mock.patch.object(hunter, "FOLDER", folder / "hunt"),
        mock.patch.object(runner, "_BUILD", folder / "tb"),
        mock.patch.object(runner, "_simulate", simulate_once),
    ):
        options = ["-x", "-q", "-p", "no:cacheprovider", "-m", "not slow"]
        return int(pytest.main([*options, *words]))


def tests_notice(folder: Path, test: str) -> str:
    """The first test of a file that notices a change, or nothing."""
    variables = [word.split("=", 1) for word in test.split() if "=" in word]
    words = [word for word in test.split() if "=" not in word]
    name = Path(words[0]).stem
    environment = {**os.environ, "SEED": "1", **dict(variables)}
    whole = words == [CHAIN] or words == ULX3S.split()
    if whole and not variables and shutil.which("ghdl-llvm") is not None:
        # Long enough for a compiler.
        environment["GHDL_BACKEND"] = "llvm"
    with (folder.parent / "test.log").open("wb") as log:
        process = subprocess.Popen(
            [sys.executable, __file__, "--tests", str(folder), *words],
            cwd=project.root(),
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            while process.poll() is None:
                time.sleep(0.2)
                for run in folder.glob("tb/cases/*/run.log"):
                    failed = FAILED.search(run.read_bytes())
                    if failed:
                        return f"{name}: {failed.group().split()[-2].decode().split('/')[-1]}"
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    shutil.rmtree(folder / "tb", ignore_errors=True)
    passed = process.returncode in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED)
    return "" if passed else name


def outcome(mutant: Mutant | None, number: int, folder: Path) -> str:
    """Outcome of a round for a mutant: "invalid", the test that notices it, "equal", or nothing."""
    if mutant is not None and number == len(rounds_of(mutant)):
        circuits = proved_circuits(mutant, folder)
        return f"equal: {circuits} circuits" if circuits else ""
    sources = write_mutant(mutant, hdl.board_sources(), folder / "hdl")
    if number == 0 and not is_valid(sources, folder / "analysis"):
        return "invalid"
    test = f"{RASTER} -k stalls_gaps" if mutant is None else rounds_of(mutant)[number]
    return tests_notice(folder / "hdl", test)


def load(file: Path) -> dict[Key, tuple[int, str]]:
    """Rounds of mutants so far, and their outcomes."""
    if not file.is_file():
        return {}
    return {
        (entry["file"], entry["old"].strip(), entry["new"].strip(), entry["place"]): (
            entry["rounds"],
            entry["outcome"],
        )
        for entry in json.loads(file.read_text())
    }


def argument_parser() -> argparse.ArgumentParser:
    """Parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1], help="a sample for each")
    parser.add_argument("--count", type=int, default=120, help="mutants of a sample")
    parser.add_argument("--only", default="*", help="sources, a pattern: stack/*")
    parser.add_argument("--survivors", type=Path, help="those that survive in an --out, no sample")
    parser.add_argument("--out", type=Path, default=project.root() / "build" / "mutants.json")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="mutants at a time")
    parser.add_argument(
        "--resume", action="store_true", help="go on from --out; only while nothing has changed"
    )
    return parser


def main() -> int:
    """Run the mutants; exit code 1 if the sources themselves fail, or a survivor is not known."""
    if sys.argv[1:2] == ["--tests"]:
        return run_tests(Path(sys.argv[2]), sys.argv[3:])
    parser = argument_parser()
    arguments = parser.parse_args()
    if shutil.which("ghdl-mcode") is not None:
        # The mcode back end, as most simulations are short.
        os.environ.setdefault("GHDL_BACKEND", "mcode")
    work = project.root() / "build" / "work"
    work.mkdir(parents=True, exist_ok=True)

    def run(mutant: Mutant | None, number: int) -> str:
        with tempfile.TemporaryDirectory(dir=work, prefix="mutant-") as name:
            return outcome(mutant, number, Path(name))

    if failure := run(None, 0):
        print(f"the sources themselves fail the suite: {failure}", file=sys.stderr)
        return 1
    sources = [
        source
        for source in hdl.board_sources()
        if any(fnmatch.fnmatch(name, arguments.only) for name in (source.name, relative(source)))
    ]
    if not sources:
        parser.error(f"--only {arguments.only}: no such source")
    # Two rules may make the same of a line.
    every = list(dict.fromkeys(mutants(sources)))
    samples = {f"seed {seed}": chosen(every, seed, arguments.count) for seed in arguments.seeds}
    if arguments.survivors:
        survivors = {key for key, (_, failure) in load(arguments.survivors).items() if not failure}
        samples = {
            arguments.survivors.name: [mutant for mutant in every if mutant.key in survivors]
        }
    mutants_to_run = list(dict.fromkeys(mutant for sample in samples.values() for mutant in sample))
    explanations = explained()
    outcomes = load(arguments.out) if arguments.resume else {}
    started = time.perf_counter()

    def save() -> None:
        arguments.out.parent.mkdir(parents=True, exist_ok=True)
        results = [
            {
                **asdict(mutant),
                **dict(zip(("rounds", "outcome"), outcomes[mutant.key], strict=True)),
            }
            for mutant in mutants_to_run
            if mutant.key in outcomes
        ]
        arguments.out.write_text(json.dumps(results, indent=1) + "\n")

    # All mutants go through the short tests before any goes through the long ones, and proofs last.
    for number in range(1 + max(len(rounds_of(mutant)) for mutant in mutants_to_run)):
        waiting = []
        for mutant in mutants_to_run:
            rounds, failure = outcomes.get(mutant.key, (0, ""))
            # Explained mutants are only checked to be valid.
            last = number > len(rounds_of(mutant)) or (
                number > 0 and is_explained(mutant, explanations)
            )
            if not (failure or number < rounds or last):
                waiting.append(mutant)
        with ThreadPoolExecutor(arguments.jobs) as pool:
            running = {pool.submit(run, mutant, number): mutant for mutant in waiting}
            try:
                for place, future in enumerate(as_completed(running), 1):
                    outcomes[running[future].key] = (number + 1, future.result())
                    save()
                    if sys.stderr.isatty():
                        print(
                            f"\rround {number + 1}: {place} of {len(waiting)}",
                            end="",
                            file=sys.stderr,
                        )
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise
    unexplained = [
        m for m in mutants_to_run if not (outcomes[m.key][1] or is_explained(m, explanations))
    ]
    for mutant in unexplained:
        print(
            f"survives: {mutant.file}:{mutant.line} ({mutant.place}): "
            f"{mutant.new.strip() or 'dropped'}   (was {mutant.old.strip()})"
        )
    report_samples(samples, outcomes, explanations)
    print(f"{len(every)} possible; {time.perf_counter() - started:.0f} s")
    return 1 if unexplained else 0


def report_samples(
    samples: dict[str, list[Mutant]], results: dict[Key, tuple[int, str]], explanations: set[Key]
) -> None:
    """Print how many mutants of each sample were killed."""
    for name, sample in samples.items():
        outcomes = [results[mutant.key][1] for mutant in sample]
        equal = sum(outcome.startswith("equal") for outcome in outcomes)
        survivors = [m for m, outcome in zip(sample, outcomes, strict=True) if not outcome]
        unknown = sum(not is_explained(mutant, explanations) for mutant in survivors)
        invalid = outcomes.count("invalid")
        killed = len(sample) - invalid - equal - len(survivors)
        share = 100 * killed / max(killed + unknown, 1)
        print(
            f"{name}: {killed} of {killed + unknown} mutants killed ({share:.1f} %); besides "
            f"{equal} equal by proof, {len(survivors) - unknown} explained in "
            f"scripts/survivors_vhdl.toml, {invalid} that are not valid VHDL"
        )


if __name__ == "__main__":
    sys.exit(main())
