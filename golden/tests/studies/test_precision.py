# SPDX-License-Identifier: Apache-2.0
"""The reports of error against run time and of stability."""

import numpy as np
import pytest

from plenofir.refocus import ExactArithmetic, StoredProductArithmetic
from plenofir_studies import precision_report as report
from plenofir_studies import refocus_stability as stability
from plenofir_studies.methods import exact_sums, hardware, running_sums, software


@pytest.fixture(autouse=True)
def hasty(monkeypatch):
    """Three runs are enough where times are not looked at."""
    monkeypatch.setattr(report, "_LEAST_SECONDS", 0)


@pytest.mark.parametrize(("m", "shift"), [(5, -3), (4, 2), (6, 6), (11, 7), (1, 3)])
def test_all_ways_agree(m, shift):
    raw = np.random.default_rng(m).integers(0, 256, (9 * m + 1, 8 * m + 2), dtype=np.uint8)
    for method in software():
        if method.order is None:
            continue
        image = method.work(raw, m, shift)
        exact = exact_sums(raw, m, shift, method.order)
        if np.issubdtype(image.dtype, np.integer):
            assert np.array_equal(image, np.floor(exact + 0.5)), method.name
        else:
            assert np.abs(image - exact).max() < 1e-3, method.name
    want = ExactArithmetic().refocus(raw, m, shift=shift)
    assert np.array_equal(running_sums(raw, m, shift, np.int64), want)


def test_what_is_in_focus_is_found_by_every_way():
    field = report.plane_field(5, 3, (40, 44))
    for method in software():
        sharp = report.measure(field, method)
        blurred = report.measure(report.Field(field.name, field.raw, 5, -4, field.truth), method)
        assert sharp.truth_db > 20, method.name
        assert sharp.truth_db > blurred.truth_db + 3, method.name
        assert sharp.seconds > 0


def test_core_rows():
    field = report.plane_field(5, 3, (20, 22))
    methods = hardware()
    assert len(methods) == 1 + 1 + 2 + 3 + 4 + 7 * 5
    rows = [report.measure(field, m) for m in (methods[0], methods[1], methods[-1])]
    exact, coarse, fine = rows
    assert exact.rms == 0
    assert coarse.rms > fine.rms
    assert coarse.largest <= StoredProductArithmetic(fraction_bits=0, guard_bits=0).error_bound(
        5, 8
    )
    assert exact.seconds == pytest.approx(field.raw.size / 74.25e6)
    assert coarse.ram_bits < fine.ram_bits


def test_pareto_front():
    method = software()[0]
    results = [
        report.Result(method, seconds, 0, rms, 0, 0)
        for seconds, rms in ((1, 5), (2, 6), (3, 1), (3, 2), (4, float("nan")), (5, 0))
    ]
    front = report.pareto(results, lambda r: r.rms)
    assert [(r.seconds, r.rms) for r in front] == [(1, 5), (3, 1), (5, 0)]


def test_extreme_frames():
    integers, floats = stability.outcomes()
    for outcome in integers:
        assert outcome.errors["refocus"] == 0, outcome
    floating = {outcome.case: outcome.errors for outcome in floats}
    assert floating["one pixel"]["running sums, float64"] == np.inf
    assert floating["one pixel"]["shift and sum, float64"] < 1e-12
    # The documentation's table is of these cases; floating point may differ between machines.
    for found, kept in zip(
        stability.rows(integers, floats, {}), stability.load_recorded(), strict=True
    ):
        assert found[:2] == kept[:2]
        assert found[0].startswith("a line of") or found[2:5] == kept[2:5]
    assert stability.load_recorded()[-1][2] == "0"
    growth = stability.long_sums((1000, 10**5, 10**6))
    assert growth["refocus"] == [0, 0, 0]
    assert growth["running sums, float32"][-1] > 10 * growth["running sums, float32"][0] > 0


@pytest.mark.slow
def test_reports_are_written(tmp_path):
    text = report.write_report(tmp_path).read_text()
    assert "| core, F = 10, G = 4 |" in text
    assert "exact in every case" in stability.write_report(tmp_path).read_text()
    for name in ("precision_1", "precision_2", "precision_3", "precision_growth"):
        assert (tmp_path / f"{name}.png").stat().st_size > 10000
