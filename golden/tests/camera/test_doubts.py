# SPDX-License-Identifier: Apache-2.0
"""Whether a picture is an aligned raw image of the M that was given."""

import numpy as np
import pytest

from plenofir.camera.calibration import calibrate, decode, largest_odd_size
from plenofir.camera.calibration.resample import odd_size_within
from plenofir.camera.patterns.rasters import coherence
from plenofir.camera.recognise import doubts
from plenofir.ground.images import Picture, bare, read_image
from plenofir.ground.project import DATA

MICROSCOPE = DATA / "microscope"


def doubt(picture: Picture, m: int, name: str) -> doubts.Doubt | None:
    """What speaks against M, by the picture's own joints."""
    raster = doubts.joints(picture.pixels, is_jpeg=False)
    return doubts.doubt(picture, m, name, raster, is_jpeg=False)


@pytest.fixture(scope="module")
def microscope() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return tuple(read_image(MICROSCOPE / f"{name}.png") for name in ("white", "dark", "raw"))


@pytest.mark.parametrize("name", ["flower_5x5", "flower_detail_5x5", "planes_5x5"])
def test_rasters_of_the_project(name: str) -> None:
    picture = bare(read_image(DATA / f"{name}.png"))
    assert doubt(picture, 5, name) is None
    for m in (3, 4, 6, 7, 13):
        found = doubt(picture, m, name)
        assert found is not None
        assert found.certain
        assert found.text == f"its micro images have 5 x 5 pixels, not {m}; give -M 5"
    # Every second joint is one of M = 10 too.
    found = doubt(picture, 10, name)
    assert found is not None
    assert not found.certain


def test_the_microscope(microscope) -> None:
    white, dark, raw = microscope
    calibration = calibrate(white, dark)
    # What inspect advises and the documentation uses.
    assert largest_odd_size(calibration) == 13
    for image, m in ((raw, 5), (raw, 15), (white, 13)):
        found = doubt(bare(image), m, "raw.png")
        assert found is not None
        assert found.certain
        assert "a capture that is not decoded, its micro images are 15.4" in found.text
    for m in (11, 15):
        picture = bare(decode(raw, calibration, m, dark=dark))
        assert doubt(picture, m, "aligned.png") is None
        found = doubt(picture, m - 1, "aligned.png")
        assert found is not None
        assert f"not {m - 1}; give -M {m}" in found.text


@pytest.mark.parametrize(
    ("pitch", "m"),
    [(9.93, 9), (13.889, 13), (14.3, 13), (15.40, 13), (17.2, 15), (27.57, 25), (2.8, 1)],
)
def test_pixels_that_mix_lenses_are_left_out(pitch: float, m: int) -> None:
    """Lytro's cameras, the thesis's, and the three microscopes."""
    assert odd_size_within(pitch) == m


def test_pictures_without_lenses_are_taken() -> None:
    rng = np.random.default_rng(37)
    for image in (
        rng.integers(0, 256, (200, 300), np.uint8),
        np.full((200, 300), 7, np.uint8),
        np.kron(rng.integers(0, 256, (40, 60), np.uint8), np.ones((5, 5), np.uint8)),
        np.zeros((3, 4), np.uint8),
    ):
        for m in (1, 2, 5, 11, 400):
            assert doubt(bare(image), m, "x.png") is None


def test_waves_of_a_pitch_drift_where_it_is_another() -> None:
    y, x = np.mgrid[:300, :400].astype(np.float32)
    for pitch, m, same in ((13.0, 13, True), (13.4, 13, False), (12.6, 13, False)):
        levels = np.cos(2 * np.pi * y / pitch) + np.cos(2 * np.pi * x / pitch)
        assert (coherence(levels, m) > 0.75) == same
    assert coherence(np.zeros((10, 10), np.float32), 5) == 1.0
