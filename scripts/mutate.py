# SPDX-License-Identifier: Apache-2.0
"""Changes the VHDL in many small ways and reports what the tests do not notice.

Usage: python scripts/mutate.py [--seeds N ...] [--count N] [--only FILE]
       [--survivors FILE] [--jobs N] [--out FILE] [--resume]

A mutant is one change of one operator, constant, switch bit or reset in one source. It is simulated
until something fails: first a few small cores in the file bench against the golden model, then the
testbenches that reach its source, short ones first. A mutant that does not analyse is not counted.
Which mutants are taken depends on a hash of their text, so that a change of the sources leaves most
of them as they were; mutants.py makes them.

Survivors must be explained in docs/mutants.md; exit code 1 if one is not.
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
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest

from mutants import Key, Mutant, chosen, explained, mutants, write_mutant
from plenofir import project
from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir import FirEngine
from plenofir.fpga.core.moving_sum import MovingSumEngine
from plenofir.fpga.simulate import file_bench
from plenofir.fpga.simulate.simulators import SimulationError, find_simulator
from plenofir.refocus import StoredProductArithmetic

STALLS = 25
# Processor time of a simulation until a mutant counts as one that hangs; of the chain's.
TEST_SECONDS, CHAIN_SECONDS = 150, 400
# A test of a bench that has failed, in its log.
FAILED = re.compile(rb"cocotb\.regression .* failed")

RASTER = "tb/core/test_raster_refocuser.py"
SUMS = "tb/moving_sum/test_moving_sum_engine.py"
STACK = "tb/stack/test_focal_stack.py"
INDEX = "tb/depth/test_depth_index.py"
RESAMPLER = "tb/resample/test_resampler.py"
SHARPENER = "tb/sharpen/test_lens_sharpener.py"
BOARD = "tb/board/test_board_entities.py"
LINK = "tb/board/test_link_entities.py"
TMDS = "tb/tmds/test_tmds_entities.py"
CHAIN = "tb/hdmi/test_chain.py"
# Words in front of a file of tests are variables; here, which of the chain's tests run.
CONTROL = f"COCOTB_TEST_FILTER=commands|focus|pattern|wrong {CHAIN}"
OVERLAY = "tb/overlay/test_text_overlay.py"
VIDEO = "tb/video/test_video.py"
PARALLEL = "tb/video/test_parallel.py"
LOADS = "tb/board/test_load_port.py"
SENSOR_VIDEO = "tb/video/test_sensor_video.py -k raw_aligned"
OF_VIDEO = (
    *(f"{VIDEO} -k units", f"{VIDEO} -k blanking", f"{VIDEO} -k refocus_video"),
    *(SENSOR_VIDEO, CHAIN),
)
# Tests behind the file bench for a source's mutants, the first pattern that fits; {} is its
# entity.
TESTS: tuple[tuple[str, tuple[str, ...]], ...] = (
    (
        "moving_sum/sum_lanes_pkg*",
        ("tb/moving_sum/test_moving_sum_schedule.py", f"{SUMS} -k lanes"),
    ),
    ("moving_sum/*_pkg*", ("tb/moving_sum/test_moving_sum_schedule.py", f"{SUMS} -k sets_stalls")),
    (
        "moving_sum/moving_sum_control*",
        (f"{SUMS} -k control", f"{SUMS} -k sets_stalls", f"{SUMS} -k every_slice"),
    ),
    ("moving_sum/lane_*", (f"{SUMS} -k lanes",)),
    ("moving_sum/*_array*", (f"{SUMS} -k sets_stalls", f"{SUMS} -k lanes")),
    ("moving_sum/[abrp]*_[besw]*", (f"{SUMS} -k lanes",)),
    (
        "moving_sum/*",
        (f"{SUMS} -k sets_stalls", f"{SUMS} -k every_slice", f"{STACK} -k stalls_and_faults"),
    ),
    ("refocuser/focal_stack*", (STACK,)),
    ("stack/*", (STACK,)),
    ("depth/*", (INDEX, f"{INDEX} -m slow -k more_indices", f"{VIDEO} -k all_in_focus")),
    ("resample/sensor*", ("tb/simulate/test_sensor_run.py -m slow -k file_bench",)),
    (
        "resample/*",
        (f"{RESAMPLER} -k grids_and_mosaic", f"{RESAMPLER} -m slow -k registers_that_change"),
    ),
    ("sharpen/*", (f"{SHARPENER} -k sizes", "tb/core/test_sharpened.py")),
    ("common/hex*", (OVERLAY, f"{VIDEO} -k all_in_focus")),
    ("common/bus*", ("tb/core/test_units.py -k {}", CHAIN)),
    ("common/event*", (f"{LINK} -k {{}}", CHAIN)),
    ("common/[es]*", (f"{TMDS} -k {{}}", CHAIN)),
    ("common/reset*", (CHAIN,)),
    ("video/sensor_front*", (SENSOR_VIDEO,)),
    ("board/[mt]*", ("tb/board/test_monitor.py", CHAIN)),
    ("board/load_crossing*", (f"{LOADS} -k pixel_clock", CONTROL, CHAIN)),
    ("board/load_port*", (f"{LOADS} -k load_port",)),
    ("board/i2c_reader*", ("tb/board/test_monitor.py", CHAIN)),
    ("board/c[lo]*", (f"{LINK} -k {{}}", f"{BOARD} -k board_control", CONTROL, CHAIN)),
    ("board/[bdiu]*", (f"{BOARD} -k {{}}", f"{BOARD} -k board_control", CONTROL, CHAIN)),
    ("board/parallel*", (PARALLEL,)),
    ("board/[rs]e*", (f"{LINK} -k hdmi_control", CONTROL, CHAIN)),
    ("board/hdmi_[cp]*", (f"{LINK} -k hdmi_control", CONTROL, CHAIN)),
    ("board/[fl]*", (f"{LINK} -k {{}}", CONTROL, CHAIN)),
    ("board/*", (f"{CHAIN} -k two_slices", CONTROL, CHAIN)),
    ("tmds/tmds_pkg*", (TMDS, CHAIN)),
    ("tmds/*", (f"{TMDS} -k {{}}", f"{TMDS} -k receiver", CHAIN)),
    ("spartan6/p[hl]*", (f"{LINK} -k {{}}", CONTROL, CHAIN)),
    ("spartan6/*", (CHAIN,)),
    ("ecp5/phase*", (f"{LINK} -k phase_search", f"{CHAIN} -k ulx3s")),
    ("ecp5/*", (f"{CHAIN} -k ulx3s",)),
    ("overlay/*", (OVERLAY, CHAIN)),
    ("video/*parallel*", (PARALLEL,)),
    ("video/picture*", (f"{VIDEO} -k blanking", f"{VIDEO} -k all_in_focus", CHAIN)),
    ("video/*", OF_VIDEO),
    ("selftest/*", ("tb/selftest/test_self_test.py",)),
    (
        "*",
        (
            "tb/core/test_units.py -k {}",
            f"{RASTER} -k stalls_gaps",
            f"{RASTER} -k array_slices",
            "tb/fir/test_fir_array.py",
            f"{SUMS} -k sets_stalls",
        ),
    ),
)
# Of these the file bench simulates every line.
IN_FILE_BENCH = ("core/*", "refocuser/raster*", "fir/*", "moving_sum/*", "common/*")


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
    Case(_core(micro_image_size=2, shifts=(3,), engine=FirEngine(parallel_rows=3)), 12, 8, 3),
    Case(
        _core(micro_image_size=4, shifts=(2, -3), engine=MovingSumEngine(pixels_per_clock=4)),
        *(22, 9, 4),
    ),
    Case(
        _core(
            micro_image_size=5,
            shifts=(-5, 0, 5),
            engine=FirEngine(hold=True),
            arithmetic=StoredProductArithmetic(fraction_bits=4, guard_bits=2),
        ),
        23,
        11,
        4,
    ),
    Case(
        _core(micro_image_size=3, shifts=(0,), order=1, engine=FirEngine(broadcast_taps=2)),
        16,
        9,
        2,
    ),
    Case(_core(micro_image_size=4, shifts=(1,), max_columns=6, align="causal"), 3, 5, 3),
    Case(_core(micro_image_size=3, shifts=(-2, 1, 3), engine=MovingSumEngine()), 17, 10, 4),
    Case(
        _core(
            micro_image_size=4,
            shifts=(1,),
            channels=3,
            engine=MovingSumEngine(),
            arithmetic=StoredProductArithmetic(fraction_bits=4, guard_bits=2),
        ),
        19,
        9,
        2,
    ),
)


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
                shift=core.shifts[number % len(core.shifts)],
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


def is_valid(sources: Sequence[Path], folder: Path) -> bool:
    """Whether all sources analyse."""
    simulator = find_simulator("ghdl")
    folder.mkdir()
    bench = project.root() / "tb" / "file_bench"
    tops = [bench / "board_atlys.vhd", bench / "hdmi_bench.vhd"]
    try:
        for command in simulator.model_commands(hdl.model_sources()):
            simulator.run(command, folder)
        files = [str(source) for source in (*sources, *tops)]
        simulator.run(["ghdl", "-a", *simulator.global_options(board=True), *files], folder)
    except SimulationError:
        return False
    return True


def bench_notices(sources: Sequence[Path], folder: Path) -> str:
    """What of the small suite in the file bench notices a change, or nothing."""
    simulator = find_simulator("ghdl")
    folder.mkdir()
    # A core that hangs is given up sooner than one that works might need.
    *_, design, patient_bench = file_bench.bench_sources()
    bench = folder / patient_bench.name
    text = patient_bench.read_text()
    patient, impatient = "IDLE_LIMIT : positive := 100000", "IDLE_LIMIT : positive := 3000"
    assert patient in text
    bench.write_text(text.replace(patient, impatient))
    names = {source.name for source in hdl.hdl_sources()}
    core = [source for source in sources if source.name in names]
    for command in simulator.build_commands([*core, design, bench], file_bench.TOP):
        simulator.run(command, folder)
    for number, case in enumerate(CASES):
        frames = frames_of(case)
        sweep = 1 if len(case.core.shifts) > 1 else 0
        limit = partial(refuse_excess, case.columns * case.rows * case.frames)
        for stalls in (0, STALLS):
            try:
                result = file_bench.run_bench(
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
                return f"bench {number}: simulation"
            if not np.array_equal(result.frames, wanted(case, frames)):
                return f"bench {number}: pixels"
            if stalls == 0 and result.latency_clocks != case.core.latency_clocks(
                case.columns, case.rows, case.frames
            ):
                return f"bench {number}: latency"
    return ""


def run_tests(folder: Path, words: Sequence[str]) -> int:
    """Run pytest with the sources of a folder, in this process."""
    seconds = CHAIN_SECONDS if words[0] == CHAIN else TEST_SECONDS
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    sys.path.insert(0, str(project.root() / "tb"))
    from plenofir_tb import runner

    portable = [folder / source.name for source in hdl.hdl_sources()]
    board = [folder / source.name for source in hdl.board_sources()]
    simulate = runner._simulate

    def simulate_once(*words: Any, **options: Any) -> set[str]:
        # A failure is not simulated again for its waveforms.
        suspects = simulate(*words, **options)
        if suspects:
            pytest.fail(f"failed: {', '.join(suspects)}")
        return suspects

    with (
        mock.patch.object(hdl, "hdl_sources", return_value=portable),
        mock.patch.object(hdl, "board_sources", return_value=board),
        mock.patch.object(runner, "_BUILD", folder / "tb"),
        mock.patch.object(runner, "_simulate", simulate_once),
    ):
        options = ["-x", "-q", "-p", "no:cacheprovider", "-m", "not slow"]
        return int(pytest.main([*options, *words]))


def tests_notice(folder: Path, test: str) -> str:
    """What of a file of tests notices a change, or nothing; the first failure ends it."""
    variables = [word.split("=", 1) for word in test.split() if "=" in word]
    words = [word for word in test.split() if "=" not in word]
    name = Path(words[0]).stem
    environment = {**os.environ, "SEED": "1", **dict(variables)}
    if words == [CHAIN] and not variables and shutil.which("ghdl-llvm") is not None:
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


def relative(source: Path) -> str:
    """A source, relative to the folder of all sources."""
    return str(source.relative_to(project.root() / "hdl"))


def place_of(mutant: Mutant) -> str:
    """Source of a mutant, relative to the folder of all sources."""
    return relative(next(s for s in hdl.board_sources() if s.name == mutant.file))


def tests_of(place: str) -> tuple[str, ...]:
    """Files of tests that reach a source."""
    return next(tests for pattern, tests in TESTS if fnmatch.fnmatch(place, pattern))


def rounds_of(mutant: Mutant) -> tuple[str, ...]:
    """What a mutant is put to, in turn: "bench", then files of tests."""
    place = place_of(mutant)
    benched = any(fnmatch.fnmatch(place, pattern) for pattern in IN_FILE_BENCH)
    entity = Path(place).stem
    return ("bench" if benched else "", *(test.replace("{}", entity) for test in tests_of(place)))


def outcome(mutant: Mutant | None, number: int, folder: Path) -> str:
    """What a round makes of a mutant: "invalid", what notices the change, or nothing."""
    sources = write_mutant(mutant, hdl.board_sources(), folder / "hdl")
    if number == 0 and not is_valid(sources, folder / "analysis"):
        return "invalid"
    test = "bench" if mutant is None else rounds_of(mutant)[number]
    if test == "bench":
        return bench_notices(sources, folder / "bench")
    return tests_notice(folder / "hdl", test) if test else ""


def load(file: Path) -> dict[Key, tuple[int, str]]:
    """Rounds that mutants have been through, and what became of them."""
    if not file.is_file():
        return {}
    return {
        (entry["file"], entry["old"].strip(), entry["new"].strip(), entry["place"]): (
            entry["rounds"],
            entry["outcome"],
        )
        for entry in json.loads(file.read_text())
    }


def main() -> int:
    """Run the mutants; exit code 1 if the sources themselves fail, or a survivor is not known."""
    if sys.argv[1:2] == ["--tests"]:
        return run_tests(Path(sys.argv[2]), sys.argv[3:])
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
    arguments = parser.parse_args()
    if shutil.which("ghdl-mcode") is not None:
        # It compiles in no time, and most simulations are short.
        os.environ.setdefault("GHDL_BACKEND", "mcode")
    work = project.root() / "build" / "work"
    work.mkdir(parents=True, exist_ok=True)

    def run(mutant: Mutant | None, number: int) -> str:
        with tempfile.TemporaryDirectory(dir=work, prefix="mutant-") as name:
            return outcome(mutant, number, Path(name))

    if run(None, 0):
        print("the sources themselves fail the suite", file=sys.stderr)
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
        left = {key for key, (_, found) in load(arguments.survivors).items() if not found}
        samples = {arguments.survivors.name: [mutant for mutant in every if mutant.key in left]}
    taken = list(dict.fromkeys(mutant for sample in samples.values() for mutant in sample))
    known = explained()
    done = load(arguments.out) if arguments.resume else {}
    started = time.perf_counter()

    def save() -> None:
        arguments.out.parent.mkdir(parents=True, exist_ok=True)
        results = [
            {**asdict(mutant), **dict(zip(("rounds", "outcome"), done[mutant.key], strict=True))}
            for mutant in taken
            if mutant.key in done
        ]
        arguments.out.write_text(json.dumps(results, indent=1) + "\n")

    # All mutants go through the short tests before any goes through the long ones.
    for number in range(max(len(rounds_of(mutant)) for mutant in taken)):
        waiting = []
        for mutant in taken:
            rounds, found = done.get(mutant.key, (0, ""))
            # What is known to be noticed by nothing is only seen to be valid.
            last = number >= len(rounds_of(mutant)) or (number > 0 and mutant.key in known)
            if not (found or number < rounds or last):
                waiting.append(mutant)
        with ThreadPoolExecutor(arguments.jobs) as pool:
            running = {pool.submit(run, mutant, number): mutant for mutant in waiting}
            try:
                for place, future in enumerate(as_completed(running), 1):
                    done[running[future].key] = (number + 1, future.result())
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
    unexplained = [m for m in taken if not done[m.key][1] and m.key not in known]
    for mutant in unexplained:
        print(
            f"survives: {mutant.file}:{mutant.line} ({mutant.place}): "
            f"{mutant.new.strip() or 'dropped'}   (was {mutant.old.strip()})"
        )
    for name, sample in samples.items():
        outcomes = [done[mutant.key][1] for mutant in sample]
        counted = sum(found != "invalid" for found in outcomes)
        survivors = [m for m, found in zip(sample, outcomes, strict=True) if not found]
        killed = counted - len(survivors)
        unknown = sum(mutant.key not in known for mutant in survivors)
        share = 100 * killed / max(counted, 1)
        print(
            f"{name}: {killed} of {counted} mutants killed ({share:.1f} %), "
            f"{len(survivors)} survive, {unknown} of them not explained in docs/mutants.md; "
            f"{outcomes.count('invalid')} not valid VHDL"
        )
    print(f"{len(every)} possible; {time.perf_counter() - started:.0f} s")
    return 1 if unexplained else 0


if __name__ == "__main__":
    sys.exit(main())
