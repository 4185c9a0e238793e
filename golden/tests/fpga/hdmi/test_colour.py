# SPDX-License-Identifier: Apache-2.0
"""Colours of HDMI sources to full-range RGB, against the equations of the standards."""

import itertools

import numpy as np
import pytest

from plenofir_tb.hdmi import colour
from plenofir_tb.hdmi.packets import AviInfo, Colorimetry, ColourSpace

# Coefficients as BT.601 and BT.709 print them, for Y from 0 to 1 and chroma from -0.5 to 0.5.
PRINTED = {
    "bt709": {"red": 1.5748, "green_red": -0.4681, "green_blue": -0.1873, "blue": 1.8556},
    "bt601": {"red": 1.402, "green_red": -0.7141, "green_blue": -0.3441, "blue": 1.772},
}
YCC = AviInfo(ColourSpace.YCBCR_444)


def all_bytes() -> np.ndarray:
    rng = np.random.default_rng(5)
    ends = np.array(list(itertools.product((0, 1, 16, 128, 235, 240, 254, 255), repeat=3)))
    return np.concatenate([ends, rng.integers(0, 256, (20000, 3))]).astype(np.uint8)


@pytest.mark.parametrize(
    ("info", "way"),
    [
        (AviInfo(), 0),
        (AviInfo(rgb_range=1), 1),
        (AviInfo(ColourSpace.YCBCR_444, ycc_range=1), 2),
        (YCC, 3),
        (AviInfo(ColourSpace.YCBCR_444, Colorimetry.BT601, ycc_range=1), 4),
        (AviInfo(ColourSpace.YCBCR_444, Colorimetry.BT601), 5),
        (AviInfo(ColourSpace.YCBCR_422), 0),
        (AviInfo(ColourSpace.YCBCR_420), 0),
    ],
)
def test_ways(info: AviInfo, way: int) -> None:
    assert colour.way_of(info) == way


def test_full_range_rgb_stays() -> None:
    pixels = all_bytes()
    assert np.array_equal(colour.to_full_range_rgb(pixels, 0), pixels)


@pytest.mark.parametrize("way", range(1, 6))
def test_equations(way: int) -> None:
    pixels = all_bytes()
    limited = way % 2 == 1
    black, white, chroma = (16, 219, 224) if limited else (0, 255, 255)
    if way == 1:
        exact = (pixels.astype(float) - black) / white
    else:
        printed = PRINTED["bt709" if way < 4 else "bt601"]
        cr, y, cb = (pixels[:, i].astype(float) for i in range(3))
        y, cb, cr = (y - black) / white, (cb - 128) / chroma, (cr - 128) / chroma
        exact = np.stack(
            [
                y + printed["red"] * cr,
                y + printed["green_red"] * cr + printed["green_blue"] * cb,
                y + printed["blue"] * cb,
            ],
            axis=1,
        )
    got = colour.to_full_range_rgb(pixels, way)
    # Half a level by rounding, and the error of coefficients of twelve bits.
    assert np.abs(got - np.clip(255 * exact, 0, 255)).max() < 0.6


def test_black_and_white() -> None:
    for way, low, high in ((1, 16, 235), (3, 16, 235), (5, 16, 235), (2, 0, 255), (4, 0, 255)):
        other = [128] if way > 1 else []
        for level, want in ((low, 0), (high, 255)):
            pixel = np.array([*other, level, *other] if way > 1 else [level] * 3, np.uint8)
            assert colour.to_full_range_rgb(pixel, way).tolist() == [want] * 3
