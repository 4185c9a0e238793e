# SPDX-License-Identifier: Apache-2.0
"""Proofs of row filter, division and stream buffer, and that planted faults are found."""

import re
from pathlib import Path

import pytest

from formal import (
    LONG_PROOFS,
    PROOFS,
    TRACE,
    BusProof,
    DivideProof,
    EventProof,
    FifoProof,
    FirProof,
    HeaderProof,
    LaneProof,
    MergeProof,
    Proof,
    RingProof,
    RoundProof,
)
from plenofir.fpga import hdl
from plenofir.fpga.tools.dumps import Dump
from plenofir.fpga.tools.synthesis import ghdl_version, yosys_version
from plenofir.ground.errors import ToolError
from plenofir_tb.faults import plant
from plenofir_tb.tools import or_skip


@pytest.fixture(scope="module", autouse=True)
def tools() -> None:
    with or_skip():
        ghdl_version()
        yosys_version()


@pytest.mark.parametrize(
    "proof",
    [*PROOFS, *(pytest.param(proof, marks=pytest.mark.slow) for proof in LONG_PROOFS)],
    ids=lambda proof: proof.name,
)
def test_proof(tmp_path: Path, proof: Proof) -> None:
    proof.prove(tmp_path)


@pytest.mark.drawn(8)
@pytest.mark.parametrize(
    ("proof", "file", "old", "new"),
    [
        (FirProof(3, 2), "switch_control.vhd", "next_mask(0) <= '1'", "next_mask(0) <= '0'"),
        (FirProof(3, 2), "switch_control.vhd", "switches and mask when", "switches when"),
        (FirProof(3, 2), "switched_fir.vhd", "at_first_step = '1' and", "false and"),
        (LaneProof(3, 2, 2), "prefix_sums.vhd", "before + partial(LEVELS)", "before + partial(0)"),
        (
            LaneProof(3, 2, 2, box=2),
            "sum_lanes_pkg.vhd",
            "place - geometry.boxes(slice))",
            "place - geometry.micro_image_size)",
        ),
        (LaneProof(3, 2, 2), "lane_control.vhd", "ended    <= following;", "null;"),
        (DivideProof(3, 4), "divide_weighted.vhd", "if unsigned(weight) = 0", "if false"),
        (DivideProof(3, 4), "divide_weighted.vhd", "if taken = '1' then", "if taken = '0' then"),
        # Sums of an even M x M that lie between two grey levels.
        (RoundProof(36), "divide_round.vhd", ":= DIVISOR / 2;", ":= (DIVISOR - 1) / 2;"),
        (RoundProof(16), "divide_round.vhd", ":= DIVISOR / 2;", ":= (DIVISOR - 1) / 2;"),
        pytest.param(
            RingProof(3, 4),
            "lens_rows.vhd",
            "if needed - kept >= LINES then",
            "if needed - kept > LINES then",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            RingProof(3, 4),
            "lens_rows.vhd",
            "if ring.lines_in > needed then",
            "if ring.lines_in >= needed then",
            marks=pytest.mark.slow,
        ),
        (HeaderProof(), "csi_pkg.vhd", '"111011"', '"110011"'),
        (HeaderProof(), "header_ecc.vhd", 'header_1(31 downto 30) = "00" and', ""),
        (MergeProof(2, 1), "lane_merge.vhd", "place := place + taps(i);", "place := place;"),
        (FifoProof(2), "axis_fifo.vhd", "elsif word_moves = '1'", "elsif m_axis_tready = '1'"),
        (BusProof(4), "axi_lite_slave.vhd", "has_read and not answers_read", "has_read"),
        (BusProof(4), "axi_lite_slave.vhd", "<= takes_write and writes_bytes", "<= takes_write"),
        (
            EventProof(),
            "event_registers.vhd",
            "(held_happened and not clear_happened) or new_happened",
            "(held_happened or new_happened) and not clear_happened",
        ),
        (
            EventProof(),
            "event_registers.vhd",
            "(held_errors and not clear_errors) or new_errors",
            "(held_errors or new_errors) and not clear_errors",
        ),
        (
            BusProof(4, "wishbone_bridge"),
            "wishbone_bridge.vhd",
            "if wanted = '1' and request = '1' then",
            "if request = '1' then",
        ),
        (
            BusProof(4, "wishbone_bridge"),
            "wishbone_bridge.vhd",
            "request = '1' and ack = '0' and err = '0' then",
            "request = '1' and ack = '0' then",
        ),
    ],
)
def test_planted_fault_is_found(
    tmp_path: Path,
    proof: Proof,
    file: str,
    old: str,
    new: str,
) -> None:
    sources = plant(tmp_path / "hdl", hdl.hdl_sources(), file, old, new)
    with pytest.raises(ToolError, match=r"not proved; the last step of .* fails") as found:
        proof.prove(tmp_path, sources)
    # Steps of the failure, and values of its last one.
    _, *values = str(found.value).splitlines()
    assert len(Dump(tmp_path / TRACE).signals) > len(values) > 2
    assert all(re.fullmatch(r"  \S+ = [0-9a-z]+", value) for value in values)
    if isinstance(proof, RoundProof):
        assert "  numerator = " in str(found.value)
        assert "fails at round_properties.sv:" in str(found.value)
