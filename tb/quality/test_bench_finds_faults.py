# SPDX-License-Identifier: Apache-2.0
"""The testbench itself: faults planted in the core make it fail, and it says where."""

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
# Most of its frames have lines that are shorter than the line buffers' loop.
NARROW = CoreConfiguration(micro_image_size=2, shifts=(-2,), max_columns=4, channels=3)

LINEAR = CoreConfiguration(micro_image_size=3, shifts=(-2,), max_columns=20, order=1)
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
HOLD = CoreConfiguration(
    micro_image_size=3, shifts=(3,), max_columns=20, engine=FirEngine(hold=True)
)


@pytest.mark.drawn(6)
@pytest.mark.parametrize(
    ("core", "file", "old", "new"),
    [
        (CORE, "switch_control.vhd", "switches and mask when live_held", "switches when live_held"),
        (LINEAR, "switch_control.vhd", "when live_held = '1' else", "when true else"),
        (CORE, "switched_fir.vhd", "at_first_step = '1' and", "false and"),
        (NARROW, "refocus_pkg.vhd", "PARTIAL_SUM_LOOP : positive := 4",
         "PARTIAL_SUM_LOOP : positive := 2"),
        (CORE, "axis_fifo.vhd", "elsif word_moves = '1' then", "elsif m_axis_tready = '1' then"),
        (CORE, "sequencer_waits.vhd", "=> SOME_BANDS,", "=> '0',"),
        (CORE, "sequencer_waits.vhd", "=> SOME_TOKENS,", "=> '0',"),
        (CORE, "frame_sequencer.vhd",
         "if line_ends = '1' then\n          column   <= (others => '0');",
         "if line_ends = '1' and s_axis_tlast = '1' then\n          column   <= (others => '0');"),
        (CORE, "row_scatter.vhd", "2 ** ADDRESS_BITS - UNDER_WAY", "2 ** ADDRESS_BITS"),
        (CORE, "raster_refocuser.vhd", "=> TOKENS + 2 * PARALLEL_ROWS - 1,", "=> 3,"),
        (CORE, "divide_round.vhd", "NUMERATOR_BITS) + HALF;", "NUMERATOR_BITS);"),
        (ARRAY, "lane_exchange.vhd", "source(i) <= earlier(i - 1);", "source(i) <= earlier(i);"),
        (ARRAY, "fir_stage.vhd", "when fresh_d2 = '1' else", "when true else"),
        (ARRAY, "fir_stage.vhd", "turn(m) <= turn_held(m - 1);", "turn(m) <= turn(0);"),
        (ARRAY, "switched_fir.vhd", "next_word when resume_now = '1' else",
         "next_word when false else"),
        (ARRAY, "frame_sequencer.vhd", "if frame_open = '0' and band_row /= 0 then",
         "if false then"),
        (SLICES, "frame_sequencer.vhd", "<= slice when starts_frame",
         "<= slice_held when starts_frame"),
        *(
            pytest.param(LANES, *fault, marks=pytest.mark.slow)
            for fault in (
                ("moving_sum_array.vhd", "if is_last = '1' and ends(j) = '0' then",
                 "if false then"),
                ("lane_control.vhd", "ended     <= following;", "null;"),
                ("lane_control.vhd", "due_rows <= 0;", "null;"),
                ("pixel_banks.vhd", "distance := distance + 1;", "null;"),
                ("bank_exchange.vhd", "codes(r) <= CODE_OF(s)(r);", "null;"),
                ("ahead_sum.vhd", "if flags_due(1) = '0' then", "if true then"),
                ("prefix_sums.vhd", "if take = '1' then", "if false then"),
                ("prefix_sums.vhd", "found(j) := found(j) or found(j - 2 ** l);", "null;"),
                ("stream_shell.vhd", "if j <= place then", "if j < place then"),
            )
        ),
        (HOLD, "switched_fir.vhd", "next_word <= packed(next_sums);",
         "next_word <= packed(stepped(held, pixels, closed_now, restart_now));"),
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
    # Most of the tests that plant them are long, so nobody sees at once that a source changed.
    assert not request.config.stash[STALE]
