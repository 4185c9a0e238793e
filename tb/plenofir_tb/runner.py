"""Building the VHDL and running cocotb testbenches on it, on whichever simulator is chosen.

The environment variable ``SIM`` (ghdl or nvc) chooses the simulator. A case that fails is run once
more with the same seed and with waves on.
"""

import fcntl
import functools
import hashlib
import json
import os
import random
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from cocotb_tools.runner import Nvc, Runner, get_runner

from plenofir import project
from plenofir.fpga import hdl
from plenofir.fpga.simulate.simulators import GHDL_RUN_OPTIONS, NVC_RELAXED, find_simulator

CASE_VARIABLE = "PLENOFIR_CASE"
_BUILD = project.root() / "build" / "tb"


def simulator_name() -> str:
    """Name of the simulator that the tests run on."""
    return os.environ.get("SIM") or "ghdl"


def draw_seed() -> int:
    """Seed of all random choices: the environment variable ``SEED``, or a new one."""
    return int(os.environ.get("SEED") or random.SystemRandom().randrange(1 << 31))


class _RelaxedNvc(Nvc):
    """NVC that takes the shared variables of VHDL-93 in a design of a later standard."""

    def _build_command(self) -> list[list[str]]:
        command = super()._build_command()[0]
        place = command.index("-a") + 1
        return [[*command[:place], *NVC_RELAXED, *command[place:]]]


@functools.cache
def _built(top: str, board: bool = False) -> tuple[Runner, Path]:
    """Analyse and elaborate the sources once for each version of them.

    Returns the runner and its build folder. GHDL's build is shared by all workers; NVC's runner
    needs to have built by itself, so each worker has a library of its own.
    """
    simulator = find_simulator(simulator_name())
    os.environ.update(simulator.environment)
    sources = hdl.hdl_sources()
    models: list[Path] = []
    if board:
        sources = [*hdl.board_sources(), project.root() / "tb" / "file_bench" / "hdmi_pump.vhd"]
        models = hdl.unisim_sources()
    digest = hashlib.sha256(simulator.version.encode())
    for source in [*models, *sources]:
        digest.update(source.read_bytes())
    shared = simulator.name == "ghdl"
    owner = "" if shared else "-" + os.environ.get("PYTEST_XDIST_WORKER", "main")
    build = _BUILD / simulator.name / f"{top}-{digest.hexdigest()[:12]}{owner}"
    build.parent.mkdir(parents=True, exist_ok=True)
    runner = _RelaxedNvc() if board and simulator.name == "nvc" else get_runner(simulator.name)
    with build.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (shared and (build / "built").exists()):
            shutil.rmtree(build, ignore_errors=True)
            if models:
                build.mkdir()
                for command in simulator.model_commands(models):
                    simulator.run(command, build)
            runner.build(
                sources=sources,
                hdl_toplevel=top,
                build_args=simulator.global_options(board=board),
                build_dir=build,
                log_file=build / "build.log",
            )
            (build / "built").touch()
    return runner, build


def run_case(
    top: str,
    test_module: str,
    *,
    generics: Mapping[str, int | bool | str],
    case: Mapping[str, Any] | None = None,
    seed: int | None = None,
    board: bool = False,
) -> None:
    """Run a cocotb module on an entity; fail the calling pytest test if any cocotb test fails.

    Parameters
    ----------
    top
        Entity under test.
    test_module
        Python module with the cocotb tests.
    generics
        Generics of the entity.
    case
        What the testbench is to do; it reads it with `read_case`.
    seed
        Seed of all random choices; drawn and printed if None.
    board
        Whether the entity needs the board's sources and the models of the primitives.
    """
    runner, build = _built(top, board)
    if seed is None:
        seed = draw_seed()
    label = f"{top}-{hashlib.sha256(repr((test_module, generics, case)).encode()).hexdigest()[:10]}"
    scratch = _BUILD / "cases" / f"{label}-{seed}"
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    parameters = {k: str(v).lower() if isinstance(v, bool) else v for k, v in generics.items()}
    work = build
    if board:
        # The pump's files lie in the working directory, so each case has one of its own.
        work = scratch / "work"
        work.mkdir()
        for item in build.iterdir():
            (work / item.name).symlink_to(item)

    standard = (
        find_simulator("ghdl").global_options(board=board) if simulator_name() == "ghdl" else []
    )

    def passes(name: str, waves: bool) -> bool:
        wave_file = scratch / f"{name}.fst"
        options = []
        if waves and simulator_name() == "ghdl":
            options = [f"--fst={wave_file}"]
        elif waves:
            options = [f"--wave={wave_file}", "--format=fst"]
        if simulator_name() == "ghdl":
            options += GHDL_RUN_OPTIONS
        try:
            results = runner.test(
                test_module=test_module,
                hdl_toplevel=top,
                hdl_toplevel_lang="vhdl",
                parameters=parameters,
                build_dir=work,
                test_dir=work,
                test_args=standard,
                plusargs=options,
                seed=seed,
                extra_env={
                    CASE_VARIABLE: json.dumps(
                        {**(case or {}), "pictures": str(scratch / "pictures")}
                    ),
                    "COCOTB_LOG_LEVEL": "INFO",
                    # pytest explains the assertions of benches, not of every module they import,
                    # and needs no plugins for it: a second and a half less for each start.
                    "COCOTB_REWRITE_ASSERTION_FILES": "*bench.py",
                    "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
                    "PYTHONPATH": os.pathsep.join([str(project.root() / "tb"), *_python_path()]),
                },
                results_xml=str(scratch / f"{name}.xml"),
                log_file=scratch / f"{name}.log",
            )
        except (RuntimeError, SystemExit):
            return False
        # A module whose tests were all skipped has tested nothing.
        cases = ElementTree.parse(results).getroot().findall(".//testcase")
        outcomes = [
            case_.find("failure") is None for case_ in cases if case_.find("skipped") is None
        ]
        return bool(outcomes) and all(outcomes)

    if passes("run", waves=False):
        shutil.rmtree(scratch)
        return
    if not board:
        # The board's bits make waveforms of gigabytes.
        passes("waves", waves=True)
    log = scratch / "run.log"
    lines = log.read_text(errors="replace").splitlines() if log.exists() else []
    errors = [line.strip() for line in lines if "error" in line.lower()]
    pytest.fail(
        "\n".join(
            [
                f"{test_module} on {top} failed",
                f"generics {dict(parameters)}",
                f"rerun with SEED={seed}; log, waves and pictures in {scratch}",
                *errors[:10],
            ]
        ),
        pytrace=False,
    )


def _python_path() -> list[str]:
    return [p for p in os.environ.get("PYTHONPATH", "").split(os.pathsep) if p]


def read_case() -> dict[str, Any]:
    """What the running testbench is to do: the `case` given to `run_case`."""
    return json.loads(os.environ[CASE_VARIABLE])
