# SPDX-License-Identifier: Apache-2.0
"""Error against run time: what is recorded says what was measured, and the page follows from it."""

import numpy as np
import pytest

from plenofir_studies import work_precision
from plenofir_studies.many_pixels import load_placed
from plenofir_studies.precision_report import fields
from plenofir_studies.precision_report import measure as measured_on
from plenofir_studies.work_precision import Point, front, load_recorded, page, picture


def test_errors_are_those_of_the_ways_today() -> None:
    """Times depend on the machine, errors do not."""
    field = fields()[0]
    points = {p.way: p for p in load_recorded().refocusing[field.name]}
    for method in work_precision._ways():
        if method.name.startswith(("refocus", "running", "NumPy")):
            result = measured_on(field, method)
            recorded = points[method.name]
            if recorded.error is None:
                assert np.isnan(result.rms)
            else:
                assert result.rms == pytest.approx(recorded.error, rel=0.05, abs=1e-9)


def test_hardware_takes_what_its_placed_clock_says() -> None:
    for points in load_recorded().refocusing.values():
        cores = {p.way: p for p in points if p.hardware}
        for count, placed in load_placed().items():
            point = cores[f"VHDL, exact, {count} px a clock"]
            assert point.nanoseconds == pytest.approx(1e3 / (count * placed.fmax_mhz))
            assert point.error == 0


def test_front_holds_what_nothing_beats() -> None:
    drawn = {
        "a": (1, 5.0),
        "b": (2, 5.0),
        "c": (3, 1.0),
        "d": (4, None),
        "e": (5, 0.0),
        "f": (9, 0.0),
    }
    points = [Point(way=way, nanoseconds=t, error=error) for way, (t, error) in drawn.items()]
    assert [p.way for p in front(points, lambda p: p.error)] == ["a", "c", "e"]


def test_page_has_every_way() -> None:
    recorded = load_recorded()
    text = page(recorded)
    groups = [*recorded.refocusing.values(), recorded.rays, recorded.calibration, recorded.depth]
    for group in groups:
        for point in group:
            assert f"| {point.way} |" in text
    assert picture(recorded).get_axes()
