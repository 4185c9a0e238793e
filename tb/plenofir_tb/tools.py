# SPDX-License-Identifier: Apache-2.0
"""Skips tests of missing tools with a reason; runs benches in Verilator."""

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock
from xml.etree import ElementTree

import pytest
from cocotb_tools.runner import get_runner

from plenofir.fpga import hdl
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.fpga.tools.synthesis import ghdl_version, write_verilog
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir_tb.case import CASES_VARIABLE


@contextmanager
def or_skip() -> Iterator[None]:
    """Skip the test if the block finds that a tool is missing."""
    try:
        yield
    except InputError as error:
        pytest.skip(str(error))


def run_in_verilator(
    top: str,
    generics: Mapping[str, int | bool | str],
    bench: str,
    case: Mapping[str, Any],
    folder: Path,
    timescale: tuple[str, str] | None = None,
) -> list[str]:
    """Run a cocotb bench on GHDL's Verilog of an entity; result: names of the tests that ran.

    Fails the calling test if one of them does.
    """
    with or_skip():
        ghdl_version()
        root = find_simulator("verilator").environment["VERILATOR_ROOT"]
    verilog = write_verilog(hdl.hdl_sources(), top, generics, folder)
    cases = folder / "cases.json"
    cases.write_text(json.dumps([{"case": case}]))
    environment = {
        "VERILATOR_ROOT": root,
        "PATH": f"{root}/bin{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(project.root() / "tb"),
        # For the makefile that cocotb calls; the wheel was built with another compiler.
        "MAKEFLAGS": " -- CFG_CXXFLAGS_PCH_I=-include OPT_FAST=-O0 PYTHON3=python3",
    }
    runner = get_runner("verilator")
    common: dict[str, Any] = {"hdl_toplevel": top, "build_dir": folder / "model"}
    common |= {} if timescale is None else {"timescale": timescale}
    with mock.patch.dict(os.environ, environment):
        runner.build(
            sources=[verilog],
            build_args=["-Wno-fatal", "-Wno-lint", "-Wno-style", "-CFLAGS", "-std=gnu++20"],
            log_file=folder / "build.log",
            **common,
        )
        runner.test(
            test_module=bench,
            test_dir=folder,
            extra_env={CASES_VARIABLE: str(cases)},
            results_xml=str(folder / "run.xml"),
            log_file=folder / "run.log",
            **common,
        )
    tests = ElementTree.parse(folder / "run.xml").getroot().findall(".//testcase")
    ran = [test for test in tests if test.find("skipped") is None]
    assert not [test for test in ran if test.find("failure") is not None]
    return [test.attrib["name"] for test in ran]
