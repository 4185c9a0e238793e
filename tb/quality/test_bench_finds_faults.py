# SPDX-License-Identifier: Apache-2.0
"""Test of the testbench: faults planted in the core make it fail, and it says where."""

import re
from pathlib import Path

import pytest

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.fir_engine import FirEngine
from plenofir.fpga.core.moving_sum_engine import MovingSumEngine
from plenofir.ground.images import read_image
from plenofir_tb.faults import FOUND, STALE, plant
from plenofir_tb.runner import run_case

CORE = CoreConfiguration(micro_image_size=3, shifts=(-2,), max_columns=20, channels=3)
ARRAY = CoreConfiguration(
    micro_image_size=3, shifts=(2,), max_columns=24, engine=FirEngine(parallel_rows=3)
)
SLICES = CoreConfiguration(micro_image_size=3, shifts=(-2, 1, 3), max_columns=20)
LANES = CoreConfiguration(
    micro_image_size=3,
    shifts=(2, 3),
    max_columns=19,
    engine=MovingSumEngine(pixels_per_clock=4),
)


@pytest.mark.parametrize(
    ("core", "file", "old", "new"),
    [
        (CORE, "switch_control.vhd", "switches and mask when live_held", "switches when live_held"),
        (CORE, "divide_round.vhd", "NUMERATOR_BITS) + HALF;", "NUMERATOR_BITS);"),
        (CORE, "axis_fifo.vhd", "elsif word_moves = '1' then", "elsif m_axis_tready = '1' then"),
        (ARRAY, "lane_exchange.vhd", "source(i) <= earlier(i - 1);", "source(i) <= earlier(i);"),
        (SLICES, "frame_sequencer.vhd", "offered.slice       <= slice;",
         "offered.slice       <= state.frame.slice;"),
        (LANES, "stream_shell.vhd", "if j <= place then", "if j < place then"),
    ],
)  # fmt: skip
def test_planted_fault_is_found(tmp_path, monkeypatch, core, file, old, new) -> None:
    sources = plant(tmp_path, hdl.hdl_sources(), file, old, new)
    monkeypatch.setattr(hdl, "hdl_sources", lambda: sources)
    with pytest.raises(pytest.fail.Exception, match=FOUND) as caught:
        run_case(
            "raster_refocuser",
            "core.raster_bench",
            generics=core.generics(),
            case={"core": core.model_dump(mode="json"), "thorough": True},
        )
    message = str(caught.value)
    assert "rerun with SEED=" in message
    scratch = Path(re.search(r"pictures in (\S+)", message).group(1))
    assert (scratch / "waves.fst").stat().st_size > 0
    place = r"first: frame \d+, line \d+, column \d+, channel \d"
    pixel = re.search(place + r": got \d+, want \d+", message)
    pictures = sorted(scratch.glob("pictures/*.png"))
    assert bool(pixel) == bool(pictures)
    if pictures:
        assert {p.stem.split("_")[1] for p in pictures} == {"got", "want", "diff"}
        assert read_image(next(p for p in pictures if "diff" in p.name)).any()
    if core is CORE and file in ("switch_control.vhd", "divide_round.vhd"):
        assert pixel, message


def test_every_planted_fault_can_be_planted(request: pytest.FixtureRequest) -> None:
    # Most tests that plant faults are long, so a changed source would go unnoticed in short runs.
    assert not request.config.stash[STALE]
