"""The testbench itself: faults planted in the core make it fail, and it says where."""

import re
from pathlib import Path

import pytest

from plenofir import project
from plenofir.core import CoreConfiguration
from plenofir.images import read_image
from plenofir_tb import runner
from plenofir_tb.faults import plant

CORE = CoreConfiguration(micro_image_size=3, shift=-2, max_columns=20, channels=3)
# Most of its frames have lines of fewer than MIN_LINE_STEPS pixels.
NARROW = CoreConfiguration(micro_image_size=2, shift=-2, max_columns=4, channels=3)


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("switch_control.vhd", "closed <= switches and mask;", "closed <= switches;"),
        ("switched_fir.vhd", "at_first_step = '1' and", "false and"),
        ("refocus_pkg.vhd", "MIN_LINE_STEPS : positive := 4", "MIN_LINE_STEPS : positive := 2"),
        ("axis_fifo.vhd", "if read_next /= write_pointer then", "if stored /= 0 then"),
        ("frame_sequencer.vhd", "lines_to_flush <= FILTER_DELAY;", "lines_to_flush <= 0;"),
        ("frame_sequencer.vhd", "pixels_to_flush <= FILTER_DELAY;", "pixels_to_flush <= 0;"),
        ("frame_sequencer.vhd", "if line_ends = '1' then\n          column <= (others => '0');",
         "if line_ends = '1' and s_axis_tlast = '1' then\n          column <= (others => '0');"),
        ("raster_refocuser.vhd", "2 ** OUTPUT_ADDRESS_BITS - TOKENS_UNDER_WAY",
         "2 ** OUTPUT_ADDRESS_BITS"),
        ("raster_refocuser.vhd", "bits_for(MAX_COLUMNS + 1)", "2"),
        ("divide_round.vhd", "NUMERATOR_BITS) + HALF;", "NUMERATOR_BITS);"),
    ],
)  # fmt: skip
def test_planted_fault_is_found(tmp_path, monkeypatch, file, old, new) -> None:
    core = NARROW if "MIN_LINE_STEPS" in old else CORE
    sources = plant(tmp_path, project.hdl_sources(), file, old, new)
    monkeypatch.setattr(project, "hdl_sources", lambda: sources)
    runner._built.cache_clear()
    try:
        with pytest.raises(pytest.fail.Exception) as caught:
            runner.run_case(
                "raster_refocuser",
                "refocus.raster_bench",
                generics=core.generics(),
                case={"core": core.model_dump(mode="json"), "thorough": True},
            )
    finally:
        runner._built.cache_clear()
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
    if file in ("switch_control.vhd", "divide_round.vhd"):
        assert pixel, message
