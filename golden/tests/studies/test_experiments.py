# SPDX-License-Identifier: Apache-2.0
"""Section 5.3 with the synthetic camera: measurements agree with the ray model."""

import numpy as np
import pytest

from plenofir_studies.experiments import (
    FIGURE_OBJECT_LENSES,
    FIGURES,
    FOCUS_MM,
    disparity_experiment,
    focus_experiment,
    model_of,
    placed,
    random_distances,
    range_experiment,
)
from plenofir_studies.thesis_tables import load_table


@pytest.mark.parametrize(
    ("part", "m", "ends"),
    [
        ("a", 9, True),
        pytest.param("a", 9, False, marks=pytest.mark.slow),
        pytest.param("b", 11, False, marks=pytest.mark.slow),
        pytest.param("c", 11, False, marks=pytest.mark.slow),
    ],
)
def test_objects_are_sharpest_where_predicted(part: str, m: int, ends: bool) -> None:
    """Fig. 5.16: objects at predicted distances, least blur in the predicted slice."""
    model = model_of(m, FOCUS_MM[part])
    settings = placed(part)
    settings = [settings[0], settings[-1]] if ends else settings
    distances = [float(d) for d in model.distance(settings).mm]
    for result, a in zip(focus_experiment(model, distances), settings, strict=True):
        assert result.best == pytest.approx(a)
        assert abs(result.found - a) < 0.1 / m
        assert abs(result.error_percent) < 1


def test_objects_and_focus_of_the_text() -> None:
    """Table 5.10: objects and markers; (c) is focused to 4 m, as Table 5.2 says."""
    ninths, elevenths = [3, 5, 7, 9, 12], [4, 6, 8, 10, 13]
    assert placed("a") == pytest.approx([a / 9 for a in ninths])
    assert placed("b") == pytest.approx([a / 11 for a in elevenths])
    assert placed("c") == pytest.approx([a / 11 for a in (0, 2, 4, 6, 8, 11)])
    assert model_of(11, FOCUS_MM["c"]).image_distance_mm == pytest.approx(208.3930, abs=5e-5)


def test_baselines() -> None:
    """Table 5.11: baselines from disparities at the thesis's distances, small objects."""
    model = model_of(11)
    rows = load_table("5.11").part("a").rows
    objects = disparity_experiment(model, [10 * row["distance_cm"] for row in rows]).objects
    assert len(objects) == 8
    for found in objects:
        want = float(model.baseline(found.pair.gap))
        assert found.baseline_mm == pytest.approx(want, rel=0.025)
        assert found.found_px == pytest.approx(found.predicted_px, rel=0.025)
    # The thesis's disparities are those of gap 4.
    for row, found in zip(rows, objects[:4], strict=True):
        assert found.predicted_px == pytest.approx(row["disparity_px"], abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "figure", "part"), [("5.11", "5.17", "b"), ("5.12", "5.18", "c")]
)
def test_disparity_maps(number: str, figure: str, part: str) -> None:
    """Figs. 5.17, 5.18: the thesis's windows, gap 4 at two positions, gap 8."""
    model = model_of(11, FOCUS_MM[part])
    table = load_table(number)
    depths = [10 * row["distance_cm"] for row in table.part("a").rows]
    found = disparity_experiment(model, depths, FIGURES[figure], object_lenses=FIGURE_OBJECT_LENSES)
    by_pair = {pair: [r for r in found.objects if r.pair == pair] for pair in FIGURES[figure]}
    for pair, objects in by_pair.items():
        rows = table.part("a" if pair.gap == 4 else "b").rows
        for row, result in zip(rows, objects, strict=True):
            assert result.found_px == pytest.approx(row["disparity_px"], abs=0.08)
            want = float(model.baseline(pair.gap))
            assert result.baseline_mm == pytest.approx(want, rel=0.012)
            want = -float(model.tilt(pair.gap, pair.first))
            assert result.tilt_degrees == pytest.approx(want, abs=0.002)
    # The virtual cameras are evenly spaced: both positions say the same.
    first, _, second = by_pair.values()
    for one, other in zip(first, second, strict=True):
        assert one.baseline_mm == pytest.approx(other.baseline_mm, rel=0.012)


def test_objects_anywhere() -> None:
    """Objects at random distances: what the camera resolves."""
    seed = 7
    print(f"seed {seed}")
    model = model_of(11)
    results = range_experiment(model, random_distances(model, 4, seed), seed=seed)
    for result in results:
        assert result.by_disparity_mm == pytest.approx(result.distance_mm, rel=0.05)
        assert result.by_focus_mm == pytest.approx(result.distance_mm, rel=0.05)
    errors = [abs(r.by_disparity_mm / r.distance_mm - 1) for r in results]
    assert np.median(errors) < 0.02
