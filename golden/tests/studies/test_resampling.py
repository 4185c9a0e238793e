# SPDX-License-Identifier: Apache-2.0
"""The chip's resampler beside `decode`: what its report says of refocused pictures."""

import pytest

from plenofir.camera.calibration import calibration_of_grid
from plenofir_studies.resampling_report import (
    microscope,
    refocused_differences,
    rendered,
    write_report,
)

LARGEST, RMS = 2, 0.3


def test_refocused_captures_are_those_of_decode() -> None:
    capture = rendered(13.889, 0.3)
    calibration = calibration_of_grid(capture.grid, capture.raw.shape[:2])
    for a, apart in refocused_differences(capture.raw, calibration, 13):
        assert apart.largest <= LARGEST, a
        assert apart.rms <= RMS, a


@pytest.mark.slow
def test_the_refocused_microscope_capture_is_that_of_decode() -> None:
    for a, apart in refocused_differences(*microscope(), 13):
        assert apart.largest <= LARGEST, a
        assert apart.rms <= RMS, a


@pytest.mark.slow
def test_report(tmp_path) -> None:
    steps: list[tuple[int, int]] = []
    text = write_report(tmp_path, lambda *step: steps.append(step)).read_text()
    assert steps[-1][0] == steps[-1][1]
    assert text.count("\n## ") == 5
