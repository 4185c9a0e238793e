# SPDX-License-Identifier: Apache-2.0
"""GHDL's Verilog of ``refocuser_axi``: the driver on it in Verilator, and its size."""

import re
from pathlib import Path

import pytest

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.synthesis.spartan6 import synthesise
from plenofir.fpga.tools.synthesis import ghdl_version, yosys_version
from plenofir.ground import project
from plenofir.plan import load_scene, make_plan
from plenofir_tb.tools import or_skip, run_in_verilator

CORE = CoreConfiguration(micro_image_size=3, shifts=(2, -1, 0), max_columns=15)


@pytest.mark.slow
def test_driver_in_verilator(tmp_path: Path) -> None:
    pytest.importorskip("cocotbext.axi", reason="cocotbext-axi is missing: scripts/setup.sh tests")
    case = {"kind": "refocuser_axi", "core": CORE.model_dump(mode="json"), "pictures": ""}
    ran = run_in_verilator("refocuser_axi", CORE.generics(), "axi.alone_bench", case, tmp_path)
    assert ran == ["refocuser"]


@pytest.mark.slow
def test_what_registers_take(tmp_path: Path) -> None:
    """About the size in docs/registers.md; no memory, and no longer paths."""
    with or_skip():
        ghdl_version()
        yosys_version()
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
