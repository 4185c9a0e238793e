# SPDX-License-Identifier: Apache-2.0
"""Methods for depth against the truth of rendered scenes, and of the HCI benchmark's files."""

from pathlib import Path

import numpy as np
import pytest

from plenofir.camera.lightfield import views
from plenofir.camera.lightfield.disparity import Disparity
from plenofir.camera.lightfield.exports import encode_pfm
from plenofir.ground.errors import InputError
from plenofir.ground.images import write_png
from plenofir_studies.depth_methods import (
    BAD,
    PICTURES,
    PRODUCT,
    WAYS,
    likeness,
    ramp_errors,
    reliability,
    rightness,
    score,
    searched_disparity,
    write_report,
)
from plenofir_studies.depth_scenes import SCENES, M, Truth, hci_folders, hci_truth, ramp, rendered
from plenofir_studies.depth_trials import NEAR_FOCUS, trial, trials


def test_score() -> None:
    truth = rendered("pictures", (24, 26))
    exact = score(truth.a, truth)
    assert (exact.bad, exact.mse) == ((0, 0, 0), 0)
    off = score(truth.a + 0.05, truth)
    assert off.bad == (1, 1, 0)
    assert off.mse == pytest.approx(0.25)
    assert truth.picture is not None
    full = np.rint(truth.picture * 65535).astype(np.uint16)
    assert likeness(full, truth).psnr > 90
    assert likeness(full, truth).detail == pytest.approx(1, abs=1e-3)


def test_depth_between_slices() -> None:
    """Under a tenth of a step on a ramp, where whole slices are off by a quarter."""
    index, _, between = ramp_errors(ramp("gravel", 0.01), 2)
    assert index.size > 2500
    assert np.median(index) > 0.22
    assert np.median(between) < 0.08
    assert np.sqrt((between**2).mean()) < 0.11


def test_hci_report(tmp_path: Path) -> None:
    """A scene in the benchmark's files: a rendered one, its truth as PFM."""
    truth = rendered("faint", (32, 34))
    folder = tmp_path / "training" / "faint"
    folder.mkdir(parents=True)
    for n, view in enumerate(views(truth.raw, M).reshape(M * M, 32, 34)):
        write_png(folder / f"input_Cam{n:03}.png", (view >> 8).astype(np.uint8))
    with pytest.raises(InputError, match=r"no gt_disp_lowres\.pfm"):
        hci_folders(tmp_path)
    (folder / "gt_disp_lowres.pfm").write_bytes(encode_pfm(truth.a))
    assert hci_folders(tmp_path) == hci_folders(folder) == [folder]
    assert hci_truth(folder).a == pytest.approx(truth.a)
    text = write_report(tmp_path / "out", tmp_path).read_text()
    assert "| way | faint |" in text
    assert all(f"| {name} |" in text for name in WAYS)
    assert "rendered" not in text
    assert "PSNR" not in text
    (folder / "gt_disp_lowres.pfm").write_bytes(encode_pfm(truth.a[1:]))
    with pytest.raises(InputError, match="another size"):
        hci_truth(folder)


HARD = {("ramp", 0.02): 0.15, ("twigs", 0.02): 0.06, ("bars", 0.02): 0.08}


@pytest.fixture(scope="module")
def hard() -> dict[tuple[str, float], tuple[Truth, Disparity]]:
    """Hard light fields of few views and lenses, and what is found."""
    truths = {(name, noise): trial(name, noise, size=72, m=5) for name, noise in HARD}
    return {key: (truth, searched_disparity(truth)) for key, truth in truths.items()}


def test_hard_light_fields(hard: dict[tuple[str, float], tuple[Truth, Disparity]]) -> None:
    """Weak texture with noise has no hole at the plane in focus; twigs and bars are there."""
    for key, (truth, found) in hard.items():
        assert score(found.pixels_per_view, truth).bad[-1] < HARD[key], key
    # Between the candidates.
    truth, found = hard["bars", 0.02]
    assert score(found.pixels_per_view, truth).bad[1] < 0.13
    truth, found = hard["ramp", 0.02]
    error, focused = np.abs(found.pixels_per_view - truth.a), np.abs(truth.a) < NEAR_FOCUS
    assert (error[focused] > BAD[-1]).mean() < 0.15
    near = (np.abs(found.pixels_per_view) < 0.1).sum() / (np.abs(truth.a) < 0.1).sum()
    assert near > 0.5


def test_confidence_is_a_probability(
    hard: dict[tuple[str, float], tuple[Truth, Disparity]],
) -> None:
    rows = reliability(rightness(found, truth) for truth, found in hard.values())
    assert rows[-1][1] > 0.9
    assert rows[-1][2] > 0.1
    # It may be more often right than it says, and hardly less often.
    assert all(right > said - 0.1 for said, right, share in rows if share > 0.02)


@pytest.mark.slow
def test_all_hard_light_fields() -> None:
    """The whole set: share of pixels off by more than 0.07, and of these sure ones."""
    most = {"planes": 0.01, "bars": 0.015, "ramp": 0.01, "twigs": 0.05, "tiles": 0.03}
    sure = []
    for name, _, truth in trials(seed=3):
        found = searched_disparity(truth)
        assert score(found.pixels_per_view, truth).bad[-1] < most[name], truth.name
        sure.append(rightness(found, truth))
    assert reliability(sure)[-1][1] > 0.98


@pytest.mark.slow
def test_ways_to_depth() -> None:
    """Disparity is best in the mean of scenes; the picture made with it beats the view."""
    bad, squares = {name: 0.0 for name in WAYS}, {name: 0.0 for name in WAYS}
    for name in SCENES:
        truth = rendered(name)
        assert not np.isnan(truth.a).any()
        found = {way: search(truth) for way, search in WAYS.items()}
        for way, a in found.items():
            bad[way] += score(a, truth).bad[-1] / len(SCENES)
            squares[way] += score(a, truth).mse / len(SCENES)
        sharp = [likeness(make(truth, found[PRODUCT]), truth) for make in PICTURES.values()]
        # Twigs are thinner than what is refocused.
        assert sharp[-1].psnr > sharp[0].psnr - (1 if name == "twigs" else 0)
    assert bad[PRODUCT] < 0.8 * min(bad[way] for way in WAYS if way != PRODUCT)
    assert squares[PRODUCT] < 0.6 * min(squares[way] for way in WAYS if way != PRODUCT)
