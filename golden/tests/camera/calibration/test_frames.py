# SPDX-License-Identifier: Apache-2.0
"""White, dark and clipped frames: levels and refusals, just inside and just outside."""

import numpy as np
import pytest

from plenofir.camera.calibration.evidence import Evidence
from plenofir.camera.calibration.frames import (
    clipped_level,
    clipped_share,
    equalised,
    grey,
    median_of,
    white_signal,
)
from plenofir.ground.errors import InputError

RNG = np.random.default_rng(12)


def signal(white: np.ndarray, dark: np.ndarray | None = None, **how) -> np.ndarray:
    return white_signal(white, dark, where="white.tif", dark_where="dark.tif", **how)


def test_grey_is_the_luminance_of_television() -> None:
    """Rec. 709, also of images of more lines than are taken at a time."""
    colours = RNG.integers(0, 255, (300, 4, 3)).astype(np.uint8)
    expected = colours @ np.array([0.2125, 0.7154, 0.0721])
    assert grey(colours) == pytest.approx(expected, rel=1e-5)
    assert grey(colours[..., 0]) == pytest.approx(colours[..., 0])
    assert median_of(colours) == pytest.approx(np.median(expected), rel=1e-5)
    assert median_of(colours[..., 0]) == np.median(colours[..., 0])
    assert grey(colours).dtype == grey(colours[..., 0]).dtype == np.float32


def test_signals_are_levels_above_the_dark_frame() -> None:
    white = RNG.integers(200, 900, (12, 14)).astype(np.uint16)
    dark = np.full((12, 14), 100, np.uint16)
    assert signal(white) == pytest.approx(white)
    assert signal(white, dark) == pytest.approx(white - 100.0)
    colours = np.stack([white] * 3, axis=2)
    assert signal(colours, np.stack([dark] * 3, axis=2)) == pytest.approx(white - 100.0, rel=1e-4)


def test_levels_and_sizes_that_a_white_image_needs() -> None:
    """12 pixels a side, 16 grey levels, at most three quarters at full scale."""
    good = np.full((12, 12), 16, np.uint8)
    signal(good)
    for image in (good[:11], good[:, :11]):
        with pytest.raises(InputError, match=r"white.tif: has \d+ x \d+ pixels, too few"):
            signal(image)
    with pytest.raises(InputError, match=r"too dark: 15.0 grey levels of the brightest parts, 16"):
        signal(good - 1)
    signal(good + 5, np.full_like(good, 5))
    with pytest.raises(InputError, match=r"too dark: 15.0 grey levels above the dark frame"):
        signal(good + 5, np.full_like(good, 6))
    with pytest.raises(InputError, match=r"too dark: 0.0 grey levels above the dark frame"):
        signal(good, good + 2)
    # Few bright pixels are no light: the level is that of the brightest half percent.
    lone = np.zeros((20, 20), np.uint8)
    lone[0, :1] = 200
    with pytest.raises(InputError, match="too dark"):
        signal(lone)
    full = good.copy()
    full.ravel()[:108] = 255
    signal(full)
    full.ravel()[108] = 255
    with pytest.raises(InputError, match=r"too bright: 76 % .* at full scale \(255\), 75 % may"):
        signal(full)
    with pytest.raises(InputError, match=r"dark.tif: .* the white image white.tif has 12 x 12"):
        signal(good, good[:, :11])


def test_the_level_at_which_many_pixels_clip() -> None:
    """From 0.2 % of the pixels on: the fifth percentile of their signal."""
    white = np.zeros((50, 100), np.uint8)
    above = np.arange(5000, dtype=np.float32).reshape(50, 100)
    white.ravel()[:9] = 255
    assert clipped_level(white, above) is None
    white.ravel()[:10] = 255
    assert clipped_level(white, above) == pytest.approx(0.45)
    assert clipped_share(white) == pytest.approx(0.002)
    # One channel suffices; each size of words that cameras fill has its full scale.
    assert clipped_share(np.stack([white, 0 * white, 0 * white], axis=2)) == pytest.approx(0.002)
    for bits, known in ((10, True), (11, False), (12, True), (13, False), (14, True), (16, True)):
        words = np.where(white == 255, (1 << bits) - 1, 0).astype(np.uint16)
        assert clipped_share(words) == (pytest.approx(0.002) if known else 0)
        assert clipped_share(words, (1 << bits) - 1) == pytest.approx(0.002)
        assert clipped_share(words, (1 << 16) - 1) == (pytest.approx(0.002) if known else 0)


def drawn() -> np.ndarray:
    y, x = np.indices((60, 64))
    return 400 + 300 * np.sin(y / 5) * np.cos(x / 6)


@pytest.mark.parametrize("gains", [(0.5, 1.0, 1.1, 0.4), (1.0, 1.0, 1.0, 0.88)])
def test_the_pattern_of_a_colour_filter_goes(gains) -> None:
    """Kinds of pixels of 2 x 2 get the same contrast and level."""
    y, x = np.indices((60, 64))
    kind = 2 * (y % 2) + x % 2
    level = np.array([30.0, 0.0, 10.0, 60.0])[kind]
    mosaic = (drawn() * np.array(gains)[kind] + level).astype(np.float32)
    found = equalised(mosaic)
    usual = np.polyfit(drawn().ravel(), found.ravel(), 1)
    assert usual[0] == pytest.approx(np.mean(gains), rel=0.05)
    left = found - np.polyval(usual, drawn())
    assert np.abs(left).max() < 0.05 * found.mean()
    assert np.abs(left).mean() < 0.02 * np.abs(mosaic - np.polyval(usual, drawn())).mean() + 3


def test_kinds_of_pixels_without_light_become_their_surroundings() -> None:
    y, x = np.indices((60, 64))
    for blind in (0.0, 0.03):
        mosaic = drawn() * np.where((y % 2 == 0) & (x % 2 == 1), blind, 1.0)
        found = equalised(mosaic.astype(np.float32))
        line = np.polyfit(drawn().ravel(), found.ravel(), 1)
        assert np.abs(found - np.polyval(line, drawn())).max() < 0.06 * found.max()


def test_images_without_a_mosaic_stay() -> None:
    """Kinds of pixels differ by 5 % or more in a mosaic."""
    y, x = np.indices((60, 64))
    second = (y % 2 == 1) & (x % 2 == 1)
    for gain, stays in ((1.0, True), (0.96, True), (0.92, False)):
        image = (drawn() * np.where(second, gain, 1.0)).astype(np.float32)
        assert (equalised(image) is image) == stays
    flat = np.full((60, 64), 7.0, np.float32)
    assert equalised(flat) is flat


def test_evidence_in_words() -> None:
    known = {
        "missing_share": 0.034, "scatter_share": 0.0012, "centre_error_px": 0.01239,
        "periodicity": 0.957, "next_periodicity": 0.51, "layout_margin": 0.493, "cell_margin": 0.9,
    }  # fmt: skip
    lines = Evidence(**known, order_gains_px=(0.0021, -0.0004), untried_orders=(2, 3)).lines()
    assert lines == [
        "missing       3.4 % of the lit lenses",
        "evidence      scatter 0.12 % of the pitch, centres within 0.0124 pixels (standard error)",
        "              periodicity 0.96, of the next best lattice 0.51; the other layout 0.49 "
        "pitches off",
        "              pixels gained at lenses left out of the fit by order 2: 0.0021, "
        "order 3: -0.0004",
        "note          of order 2 and 3 only tilt and radial distortion were tried: too few lenses",
    ]
    assert Evidence(**known).lines()[-1].endswith("by higher orders: not tried")
