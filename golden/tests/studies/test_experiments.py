"""Section 5.3 with the synthetic camera: what is measured is what the ray model predicts."""

from math import inf

import numpy as np
import pytest

from plenofir.studies.experiments import (
    disparity_experiment,
    focus_experiment,
    model_of,
    random_distances,
    range_experiment,
)
from plenofir.studies.thesis_tables import load_table


def placed(part: str) -> list[float]:
    """Focus settings at which the text placed objects (Table 5.10)."""
    rows = load_table("5.10").part(part).rows
    return [row["a"] for row in rows if "object" in row.labels][:4]


@pytest.mark.parametrize(
    ("m", "focus_mm", "settings"),
    [
        (9, inf, placed("a")),
        pytest.param(11, inf, placed("b"), marks=pytest.mark.slow),
        pytest.param(11, 4040.0, [0.0, 4 / 11, 7 / 11, 1.0], marks=pytest.mark.slow),
    ],
)
def test_objects_are_sharpest_where_predicted(m, focus_mm, settings) -> None:
    """Fig. 5.16: objects at predicted distances, least blur in the predicted slice."""
    model = model_of(m, focus_mm)
    distances = [float(d) for d in model.distance(settings).mm]
    for result, a in zip(focus_experiment(model, distances), settings, strict=True):
        assert result.best == pytest.approx(a)
        assert abs(result.found - a) < 0.15 / m
        assert abs(result.error_percent) < 1.5


def test_baselines() -> None:
    """Table 5.11: baselines from disparities at the text's distances."""
    model = model_of(11)
    rows = load_table("5.11").part("a").rows
    depths = [10 * row["distance_cm"] for row in rows]
    results = disparity_experiment(model, depths)
    for result in results:
        assert result.baseline_mm == pytest.approx(float(model.baseline(result.gap)), rel=0.025)
        assert result.found_px == pytest.approx(result.predicted_px, rel=0.025)
    # The text's disparities are those of gap 4.
    for row, result in zip(rows, results, strict=False):
        assert result.predicted_px == pytest.approx(row["disparity_px"], abs=0.02)


@pytest.mark.slow
def test_tilts() -> None:
    """Table 5.12: tilts from disparities at the text's distances, 4 m focus."""
    model = model_of(11, 4040.0)
    depths = [10 * row["distance_cm"] for row in load_table("5.12").part("a").rows]
    for result in disparity_experiment(model, depths):
        want = -float(model.tilt(result.gap, -result.gap // 2))
        assert result.tilt_degrees == pytest.approx(want, abs=0.004)


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
