# SPDX-License-Identifier: Apache-2.0
"""What GHDL makes of ``refocuser_axi`` in Verilog: the driver on it in Verilator, its size."""

import json
import os
import re
from pathlib import Path
from unittest import mock
from xml.etree import ElementTree

import pytest
from cocotb_tools.runner import get_runner

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.synthesis.spartan6 import synthesise
from plenofir.fpga.tools.simulators import find_simulator
from plenofir.fpga.tools.synthesis import ghdl_version, write_verilog, yosys_version
from plenofir.ground import project
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir_tb.case import CASES_VARIABLE

CORE = CoreConfiguration(micro_image_size=3, shifts=(2, -1, 0), max_columns=15)


@pytest.mark.slow
def test_driver_in_verilator(tmp_path: Path) -> None:
    pytest.importorskip("cocotbext.axi", reason="cocotbext-axi is missing: scripts/setup.sh tests")
    try:
        ghdl_version()
        root = find_simulator("verilator").environment["VERILATOR_ROOT"]
    except InputError as error:
        pytest.skip(str(error))
    verilog = write_verilog(hdl.hdl_sources(), "refocuser_axi", CORE.generics(), tmp_path)
    case = {"kind": "refocuser_axi", "core": CORE.model_dump(mode="json"), "pictures": ""}
    cases = tmp_path / "cases.json"
    cases.write_text(json.dumps([{"case": case}]))
    environment = {
        "VERILATOR_ROOT": root,
        "PATH": f"{root}/bin{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(project.root() / "tb"),
        # For the makefile that cocotb calls; the wheel's compiler was another one.
        "MAKEFLAGS": " -- CFG_CXXFLAGS_PCH_I=-include OPT_FAST=-O0 PYTHON3=python3",
    }
    runner = get_runner("verilator")
    with mock.patch.dict(os.environ, environment):
        runner.build(
            sources=[verilog],
            hdl_toplevel="refocuser_axi",
            build_args=["-Wno-fatal", "-Wno-lint", "-Wno-style", "-CFLAGS", "-std=gnu++20"],
            build_dir=tmp_path / "model",
            log_file=tmp_path / "build.log",
        )
        runner.test(
            test_module="axi.alone_bench",
            hdl_toplevel="refocuser_axi",
            build_dir=tmp_path / "model",
            test_dir=tmp_path,
            extra_env={CASES_VARIABLE: str(cases)},
            results_xml=str(tmp_path / "run.xml"),
            log_file=tmp_path / "run.log",
        )
    tests = ElementTree.parse(tmp_path / "run.xml").getroot().findall(".//testcase")
    ran = [test for test in tests if test.find("skipped") is None]
    assert [test.attrib["name"] for test in ran] == ["refocuser"]
    assert not [test for test in ran if test.find("failure") is not None]


@pytest.mark.slow
def test_what_registers_take(tmp_path: Path) -> None:
    """Not much more or less than docs/registers.md says; no memory, and no longer paths."""
    try:
        ghdl_version()
        yosys_version()
    except InputError as error:
        pytest.skip(str(error))
    generics = make_plan(load_scene("grey-microscope")).core.generics()
    alone, joined = (
        synthesise(hdl.hdl_sources(), top, generics, tmp_path / top).figures
        for top in ("raster_refocuser", "refocuser_axi")
    )
    page = (project.root() / "docs" / "registers.md").read_text()
    said = re.search(r"has (\d+) LUTs, (\d+) flip-flops and (\d+) carry chains more", page)
    assert said is not None
    more = (
        joined.lut - alone.lut,
        joined.flip_flops - alone.flip_flops,
        joined.carry - alone.carry,
    )
    for taken, words in zip(more, said.groups(), strict=True):
        assert abs(taken - int(words)) <= 0.05 * int(words), more
    assert (joined.ramb16, joined.ramb8, joined.dsp) == (alone.ramb16, alone.ramb8, alone.dsp)
    assert joined.path <= alone.path
