# SPDX-License-Identifier: Apache-2.0
"""GHDL's Verilog of ``csi_receiver`` in Verilator: all tests of the VHDL."""

from pathlib import Path

import pytest

from plenofir_tb.tools import run_in_verilator


@pytest.mark.slow
@pytest.mark.parametrize(("lanes", "bits", "pixels"), [(2, 10, 1), (4, 12, 8)])
def test_receiver_in_verilator(tmp_path: Path, lanes: int, bits: int, pixels: int) -> None:
    pytest.importorskip("cocotbext.mipi_csi2", reason="scripts/setup.sh tests brings it")
    generics = {"LANES": lanes, "PIXEL_BITS": bits, "PIXELS_PER_CLOCK": pixels}
    case = {"lanes": lanes, "bits": bits, "pixels": pixels, "widths": 11}
    step = ("1ps", "1ps")
    ran = run_in_verilator("csi_receiver", generics, "csi.alone_bench", case, tmp_path, step)
    assert len(ran) == 6
