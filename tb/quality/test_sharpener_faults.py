# SPDX-License-Identifier: Apache-2.0
"""Faults planted in the sharpener make its bench fail."""

import pytest

from plenofir.fpga import hdl
from plenofir_tb.faults import FOUND, plant
from plenofir_tb.runner import run_cases
from plenofir_tb.sharpener import sharpener_case

SIMPLE = sharpener_case(3, (4, 4, 0), columns=12, turns=12)
ODD = sharpener_case(3, (3, 4), columns=9, channels=3, turns=12)
LANES = sharpener_case(3, (4,), pixels=2, columns=13, turns=12)


@pytest.mark.parametrize(
    ("case", "file", "old", "new"),
    [
        (SIMPLE, "sharpen_columns.vhd", "not frame_first when", "'1' when"),
        pytest.param(
            SIMPLE,
            "sharpen_columns.vhd",
            "when lines_before = M - 1 else",
            "when true else",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            SIMPLE, "sharpen_columns.vhd", "table(i) := '0';", "null;", marks=pytest.mark.slow
        ),
        (SIMPLE, "lens_sharpener.vhd", "choose(DIVISOR mod 2 = 1,", "choose(false,"),
        pytest.param(
            ODD,
            "three_taps.vhd",
            "SIDE_OF(to_integer(slice_2))",
            "SIDE_OF(0)",
            marks=pytest.mark.slow,
        ),
        (LANES, "sharpen_rows.vhd", "(line_end(i) or not line_last)", "'1'"),
        pytest.param(
            LANES,
            "sharpen_rows.vhd",
            "left_there <= tag_due(NEARLY_BIT);",
            "left_there <= '1';",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            SIMPLE,
            "sharpen_rows.vhd",
            "if whole > SUM_MAX then",
            "if false then",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_planted_fault_is_found(tmp_path, monkeypatch, case, file, old, new) -> None:
    sources = plant(tmp_path, hdl.hdl_sources(), file, old, new)
    monkeypatch.setattr(hdl, "hdl_sources", lambda: sources)
    with pytest.raises(pytest.fail.Exception, match=FOUND):
        run_cases([case])
