# SPDX-License-Identifier: Apache-2.0
"""Builds the VHDL and runs cocotb testbenches on it.

The environment variable ``SIM`` (ghdl or nvc) selects the simulator. Cases that are given together
run side by side in one simulation. A case that fails is run again alone with the same seed and
with waveforms.
"""

import hashlib
import json
import os
import random
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest import mock
from xml.etree import ElementTree

import pytest
from cocotb_tools.runner import Runner, get_runner

from plenofir.fpga import hdl
from plenofir.fpga.boards import BOARDS
from plenofir.fpga.hdl_text import used_units
from plenofir.fpga.simulate.chain import chain_sources
from plenofir.fpga.tools.simulators import (
    GHDL_RUN_OPTIONS,
    Simulator,
    coverage_options,
    find_simulator,
)
from plenofir.ground import project
from plenofir_tb.case import CASES_VARIABLE
from plenofir_tb.compiled import copy_library
from plenofir_tb.wrapper import TOP, wrapper

_BUILD = project.root() / "build" / "tb"


def simulator_name() -> str:
    """Name of the simulator that the tests run on."""
    return os.environ.get("SIM") or "ghdl"


def vhdl_simulator(*, brief: bool = True) -> Simulator:
    """The simulator of benches in VHDL: GHDL in place of Verilator, which does not read them."""
    name = simulator_name()
    return find_simulator("ghdl" if name == "verilator" else name, brief=brief)


def draw_seed() -> int:
    """Seed of all random choices: the environment variable ``SEED``, or a new one."""
    return int(os.environ.get("SEED") or random.SystemRandom().randrange(1 << 31))


@dataclass(frozen=True)
class Case:
    """An entity and its bench."""

    top: str
    bench: str  # Python module with the cocotb tests
    generics: Mapping[str, int | bool | str] = field(default_factory=dict)
    # Parameters of the testbench, which reads them with `plenofir_tb.case.read_case`.
    case: Mapping[str, Any] = field(default_factory=dict)
    # VHDL packages that replace those of the sources: names and texts. Cases with different
    # packages have simulations of their own.
    packages: Mapping[str, str] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Short name, the same for the same case."""
        facts = (self.bench, self.generics, self.case, *([self.packages] if self.packages else []))
        digest = hashlib.sha256(repr(facts).encode())
        return f"{self.top}-{digest.hexdigest()[:10]}"


def _build(
    cases: Sequence[Case], simulator: Simulator, work: Path, *, board: str, compiled: bool
) -> Runner:
    """Analyse and elaborate in a folder what the cases need; it may have a `compiled` library."""
    sources = hdl.hdl_sources()
    runner = get_runner(simulator.name)
    options = simulator.global_options(board=bool(board))
    if board:
        sources = chain_sources(board)[:-1]
        library = BOARDS[board].library
        models = hdl.model_sources(library)
        if simulator.name == "nvc":
            # With cocotb's options, which keep the case of names: else no component is bound.
            runner.build(sources=models, hdl_library=library, build_args=options, build_dir=work)
        else:
            simulator.run(simulator.analysis(models, library=library, board=True), work)
    own_packages = cases[0].packages
    sources = list(sources)
    for number, source in enumerate(sources):
        if source.stem in own_packages:
            sources[number] = work / source.name
            sources[number].write_text(own_packages[source.stem])
    # Some entities have a bench in VHDL around them; examples are designs of their own.
    folders = project.root() / "tb", project.root() / "examples" / "vhdl"
    benches = {path.stem: path for folder in folders for path in folder.rglob("*.vhd")}
    around = [benches[name] for name in sorted({case.top for case in cases} & benches.keys())]
    # A bench may hold another one.
    held = {
        benches[name] for bench in around for name in used_units(bench.read_text()) & benches.keys()
    }
    benches_of_case = [*sorted(held), *(bench for bench in around if bench not in held)]
    sources += [bench for bench in benches_of_case if bench not in sources]
    there = set(hdl.hdl_sources()) if compiled else set()
    top = work / f"{TOP}.vhd"
    top.write_text(wrapper([(case.top, case.generics) for case in cases], sources))
    runner.build(
        sources=[*(source for source in sources if source not in there), top],
        hdl_toplevel=TOP,
        build_args=options,
        build_dir=work,
        log_file=work / "build.log",
    )
    return runner


def _simulate(
    cases: Sequence[Case], seed: int, scratch: Path, *, board: str, long: bool, waves: bool
) -> set[str]:
    """Run cases side by side; labels of those that did not pass."""
    shutil.rmtree(scratch, ignore_errors=True)
    work = scratch / "work"
    work.mkdir(parents=True)
    simulator = find_simulator(simulator_name(), brief=not long)
    compiled = long and not board and copy_library(simulator, "top", hdl.hdl_sources(), work)
    options = list(GHDL_RUN_OPTIONS) if simulator.name == "ghdl" else []
    options_of_run = simulator.global_options(board=bool(board)) if options else []
    if waves:
        file = scratch / "waves.fst"
        nvc = [f"--wave={file}", "--format=fst"]
        options += [f"--fst={file}"] if simulator.name == "ghdl" else nvc
    todo = scratch / "cases.json"
    pictures = str(scratch / "pictures")
    todo.write_text(
        json.dumps(
            [
                {
                    "label": case.label,
                    "bench": case.bench,
                    "case": {**case.case, "pictures": pictures},
                }
                for case in cases
            ]
        )
    )
    results = scratch / "run.xml"
    try:
        with mock.patch.dict(os.environ, simulator.environment):
            runner = _build(cases, simulator, work, board=board, compiled=compiled)
            runner.test(
                test_module="plenofir_tb.cases_bench",
                hdl_toplevel=TOP,
                hdl_toplevel_lang="vhdl",
                build_dir=work,
                test_dir=work,
                elab_args=coverage_options(simulator.name),
                test_args=options_of_run,
                plusargs=options,
                seed=seed,
                extra_env={
                    CASES_VARIABLE: str(todo),
                    "COCOTB_LOG_LEVEL": "INFO",
                    # Alone, a case stops at its first failure.
                    "COCOTB_MAX_FAILURES": str(int(len(cases) == 1)),
                    # Only assertions of benches are rewritten by pytest, and no plugins are loaded,
                    # which saves a second and a half at each start.
                    "COCOTB_REWRITE_ASSERTION_FILES": "*bench.py",
                    "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
                    "PYTHONPATH": os.pathsep.join([str(project.root() / "tb"), *_python_path()]),
                },
                results_xml=str(results),
                log_file=scratch / "run.log",
            )
    except (RuntimeError, SystemExit):
        pass
    # A case without any test that ran counts as failed.
    passed: dict[str, bool] = {}
    if results.exists():
        for test in ElementTree.parse(results).getroot().findall(".//testcase"):
            if test.find("skipped") is None:
                label = test.attrib["name"].split("/")[0]
                good = test.find("failure") is None and test.find("error") is None
                passed[label] = passed.get(label, True) and good
    return {case.label for case in cases if not passed.get(case.label, False)}


def run_cases(
    cases: Sequence[Case], *, seed: int | None = None, board: str = "", long: bool = False
) -> None:
    """Run benches on entities, in one simulation; fail the calling pytest test if any fails.

    The environment variable ``CASE`` selects one by its label. A seed of None is drawn and printed.
    `board`: the board with the needed sources and models of primitives. `long`: simulation takes
    ten seconds or more, much longer than compilation.
    """
    if "CASE" in os.environ:
        cases = [case for case in cases if case.label == os.environ["CASE"]]
        if not cases:
            pytest.skip(f"CASE={os.environ['CASE']} is elsewhere")
    if seed is None:
        seed = draw_seed()
    others = [case for case in cases if case.packages != cases[0].packages]
    if others:
        cases = [case for case in cases if case.packages == cases[0].packages]
    together = cases[0].label if len(cases) == 1 else f"{cases[0].label}-and-{len(cases) - 1}"
    scratch = _BUILD / "cases" / f"{together}-{seed}"

    def simulate(cases: Sequence[Case], scratch: Path, *, waves: bool = False) -> set[str]:
        return _simulate(cases, seed, scratch, board=board, long=long, waves=waves)

    suspects = simulate(cases, scratch)
    if not suspects:
        shutil.rmtree(scratch)
        if others:
            run_cases(others, seed=seed, board=board, long=long)
        return
    reports = []
    for case in cases:
        if case.label in suspects:
            alone = _BUILD / "cases" / f"{case.label}-{seed}"
            # Waveforms of the board's serial bits would have gigabytes.
            if not board and not simulate([case], alone, waves=True):
                reports.append(f"{case.label} failed beside others only; log in {scratch}")
            else:
                reports.append(_report(case, seed, alone if alone.exists() else scratch))
    pytest.fail("\n".join(reports), pytrace=False)


def run_case(
    top: str,
    bench: str,
    *,
    generics: Mapping[str, int | bool | str],
    case: Mapping[str, Any] | None = None,
    packages: Mapping[str, str] | None = None,
    board: str = "",
    long: bool = False,
) -> None:
    run_cases([Case(top, bench, generics, case or {}, packages or {})], board=board, long=long)


def _report(case: Case, seed: int, scratch: Path) -> str:
    logs = [scratch / "run.log", scratch / "work" / "build.log", scratch / "work" / "simulator.log"]
    lines = [
        line.strip()
        for log in logs
        if log.exists()
        for line in log.read_text(errors="replace").splitlines()
    ]
    return "\n".join(
        [
            f"{case.bench} on {case.top} failed",
            f"generics {dict(case.generics)}",
            f"rerun with SEED={seed} CASE={case.label}; log, waves and pictures in {scratch}",
            *[line for line in lines if "error" in line.lower()][:10],
        ]
    )


def _python_path() -> list[str]:
    return [p for p in os.environ.get("PYTHONPATH", "").split(os.pathsep) if p]
