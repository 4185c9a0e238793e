# SPDX-License-Identifier: Apache-2.0
"""A core behind few pins: nothing of it is left out."""

from pathlib import Path

import pytest

from plenofir.fpga.tools.synthesis import run_yosys
from plenofir_studies.few_pins import NAME, few_pins

CORE = """
module core
  (input  clk,
   input  [3:0] mode,
   input  [31:0] data,
   input  valid,
   output reg [31:0] result,
   output reg ready);
  always @(posedge clk) begin
    result <= data + mode;
    ready <= valid;
  end
endmodule
"""


def test_every_bit_is_kept(tmp_path: Path) -> None:
    (tmp_path / "core.v").write_text(CORE + few_pins(CORE, "core"))
    run_yosys(
        [
            "read_verilog core.v",
            f"hierarchy -check -top {NAME}; proc; flatten; simplemap; opt -full; clean",
            # The shift register, the sum, ready.
            f"select -assert-count {32 + 32 + 1} t:$_DFF_P_",
        ],
        tmp_path / "yosys.log",
    )


def test_what_is_narrow_has_its_pins() -> None:
    text = few_pins(CORE, "core")
    for line in ("  input clk,", "  input [3:0] mode,", "  input data,", "  output result,"):
        assert line in text
    with pytest.raises(ValueError, match="no module other"):
        few_pins(CORE, "other")
