# SPDX-License-Identifier: Apache-2.0
"""The benchmark of the thesis: its own numbers follow from its formulas, ours from ours."""

import numpy as np
import pytest

from plenofir.refocus import refocus
from plenofir_studies import thesis_benchmark as benchmark
from plenofir_studies.clock_counts import ClockCase


def test_numbers_of_the_thesis_follow_from_each_other() -> None:
    case = ClockCase(3201, 3201, benchmark.raster_core(benchmark.FirEngine(parallel_rows=3201)))
    assert case.thesis_first_frame / 100e6 == pytest.approx(benchmark.THESIS_FIRST_S)
    assert case.thesis_next_frame / 100e6 == pytest.approx(benchmark.THESIS_NEXT_S)
    saved = 100 * (1 - benchmark.THESIS_FIRST_S / benchmark.PEREZ_S)
    assert round(saved, 2) == benchmark.THESIS_SAVED_PERCENT


def test_all_software_gives_the_same_picture() -> None:
    # Asserted where they are timed.
    steps = []
    seconds = benchmark.time_software(66, step=lambda: steps.append(1))
    assert len(seconds) == len(steps) == 4
    assert all(value > 0 for value in seconds.values())
    raw = np.random.default_rng(1).integers(0, 256, (40, 37), np.uint8)
    assert np.array_equal(benchmark.as_printed(raw, 5, -3), refocus(raw, 5, "-3/5"))


def test_page_holds_what_was_recorded() -> None:
    recorded = benchmark.load_recorded()
    text = benchmark.page(recorded)
    for printed in ("96.24 us", "64 us", "12.1369 s", "99.91 %", "105.9 ms", "9624", "6400"):
        assert printed in text
    for found in recorded.simulated.values():
        # A pixel each clock: further frames take as many clocks as pixels.
        assert found.next_frame == 3201 * 3201
        assert str(found.first_frame) in text
    slower = recorded.model_copy(update={"seconds": {n: 7.0 for n in recorded.seconds}})
    assert "| 7 s |" in benchmark.page(slower)
