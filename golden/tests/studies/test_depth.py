# SPDX-License-Identifier: Apache-2.0
"""Methods for depth against the truth of rendered scenes, and of the HCI benchmark's files."""

from pathlib import Path

import numpy as np
import pytest

from plenofir.camera.lightfield import views
from plenofir.camera.lightfield.exports import encode_pfm
from plenofir.ground.errors import InputError
from plenofir.ground.images import write_png
from plenofir_studies.depth_methods import (
    GUIDED,
    PICTURES,
    WAYS,
    likeness,
    ramp_errors,
    score,
    write_report,
)
from plenofir_studies.depth_scenes import SCENES, M, hci_folders, hci_truth, ramp, rendered


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


@pytest.mark.slow
def test_ways_to_depth() -> None:
    """Guided depth is best in the mean of scenes; the picture made with it beats the view."""
    bad, squares = {name: 0.0 for name in WAYS}, {name: 0.0 for name in WAYS}
    for name in SCENES:
        truth = rendered(name)
        assert not np.isnan(truth.a).any()
        found = {way: search(truth) for way, search in WAYS.items()}
        for way, a in found.items():
            bad[way] += score(a, truth).bad[-1] / len(SCENES)
            squares[way] += score(a, truth).mse / len(SCENES)
        sharp = [likeness(make(truth, found[GUIDED]), truth) for make in PICTURES.values()]
        # Twigs are thinner than what is refocused.
        assert sharp[-1].psnr > sharp[0].psnr - (1 if name == "twigs" else 0)
    assert bad[GUIDED] < 0.8 * min(bad[way] for way in WAYS if way != GUIDED)
    assert squares[GUIDED] < 0.6 * min(squares[way] for way in WAYS if way != GUIDED)
