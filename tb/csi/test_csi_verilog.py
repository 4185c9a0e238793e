# SPDX-License-Identifier: Apache-2.0
"""What GHDL makes of ``csi_receiver`` in Verilog, in Verilator: all tests of the VHDL."""

import json
import os
from pathlib import Path
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


@pytest.mark.slow
@pytest.mark.parametrize(("lanes", "bits", "pixels"), [(2, 10, 1), (4, 12, 8)])
def test_receiver_in_verilator(tmp_path: Path, lanes: int, bits: int, pixels: int) -> None:
    pytest.importorskip("cocotbext.mipi_csi2", reason="scripts/setup.sh tests brings it")
    try:
        ghdl_version()
        root = find_simulator("verilator").environment["VERILATOR_ROOT"]
    except InputError as error:
        pytest.skip(str(error))
    generics = {"LANES": lanes, "PIXEL_BITS": bits, "PIXELS_PER_CLOCK": pixels}
    verilog = write_verilog(hdl.hdl_sources(), "csi_receiver", generics, tmp_path)
    case = {"lanes": lanes, "bits": bits, "pixels": pixels, "widths": 11}
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
            hdl_toplevel="csi_receiver",
            build_args=["-Wno-fatal", "-Wno-lint", "-Wno-style", "-CFLAGS", "-std=gnu++20"],
            build_dir=tmp_path / "model",
            timescale=("1ps", "1ps"),
            log_file=tmp_path / "build.log",
        )
        runner.test(
            test_module="csi.alone_bench",
            hdl_toplevel="csi_receiver",
            build_dir=tmp_path / "model",
            test_dir=tmp_path,
            timescale=("1ps", "1ps"),
            extra_env={CASES_VARIABLE: str(cases)},
            results_xml=str(tmp_path / "run.xml"),
            log_file=tmp_path / "run.log",
        )
    tests = ElementTree.parse(tmp_path / "run.xml").getroot().findall(".//testcase")
    assert len(tests) == 4
    assert not [test for test in tests if test.find("failure") is not None]
