# SPDX-License-Identifier: Apache-2.0
"""Light fields kept on the chip: two colours a micro image."""

import re

import numpy as np
import pytest

from plenofir.fpga.screen.chip_light_field import COLOUR_BITS, move_focus, store, stored_package
from plenofir.ground import project
from plenofir.ground.images import read_image
from plenofir.refocus import refocus

FLOWER = read_image(project.DATA / "flower_5x5.png")


def decoded(words: list[str], m: int, columns: int) -> np.ndarray:
    """The raster for stored words, by the VHDL's description of them."""
    out = np.zeros((len(words) // columns * m, columns * m, 3), np.uint8)
    for number, word in enumerate(words):
        bits = word[::-1]
        colours = []
        for begin in (m * m, m * m + sum(COLOUR_BITS)):
            channels, place = [], begin
            for width in COLOUR_BITS:
                text = bits[place : place + width][::-1]
                # As to_pixel of stored_light_field: the high bits once more after the low ones.
                channels.append(int((text + text)[:8], 2))
                place += width
            colours.append(channels)
        i, j = divmod(number, columns)
        for pixel in range(m * m):
            out[i * m + pixel // m, j * m + pixel % m] = colours[int(bits[pixel])]
    return out


@pytest.mark.parametrize(("m", "rows", "columns"), [(5, 3, 4), (2, 4, 3), (1, 2, 3)])
def test_words_are_the_raster(m: int, rows: int, columns: int) -> None:
    rng = np.random.default_rng(1)
    raw = rng.integers(0, 256, (rows * m, columns * m, 3), np.uint8)
    light_field = store(raw, m)
    assert light_field.size == raw.shape[:2]
    assert light_field.lenses == (rows, columns)
    words = light_field.words()
    assert {len(word) for word in words} == {light_field.word_bits}
    assert np.array_equal(decoded(words, m, columns), light_field.raster())
    text = stored_package(light_field)
    assert re.findall(r'"([01]+)"', text) == words
    assert f"STORED_LENSES    : positive := {columns};" in text


def test_two_colours_are_kept() -> None:
    # Values that the bits hold: 8 bits with the high ones repeated after the low ones.
    rng = np.random.default_rng(2)
    values = np.stack(
        [v << (8 - b) | v >> (2 * b - 8) for b in COLOUR_BITS for v in [rng.integers(0, 2**b, 24)]],
        axis=-1,
    ).reshape(12, 2, 3)
    mask = rng.integers(0, 2, (12, 25))
    pixels = np.take_along_axis(values, mask[..., None], axis=1)
    raw = pixels.reshape(3, 4, 5, 5, 3).transpose(0, 2, 1, 3, 4).reshape(15, 20, 3).astype(np.uint8)
    assert np.array_equal(store(raw, 5).raster(), raw)


def test_grey_is_kept_near() -> None:
    raw = np.full((10, 10, 3), 100, np.uint8)
    assert np.abs(store(raw, 5).raster().astype(int) - raw).max() <= 8


@pytest.mark.parametrize("a", ["-2/5", "0", "2/5", "4/5"])
def test_refocused_flower_is_near(a: str) -> None:
    raw = move_focus(FLOWER, 5, 1)[150:605, 145:595]
    inner = (slice(25, -25), slice(25, -25))
    error = refocus(store(raw, 5).raster(), 5, a).astype(float) - refocus(raw, 5, a)
    # In dB of the peak signal; 38 and more.
    assert 10 * np.log10(255**2 / np.mean(error[inner] ** 2)) > 37


@pytest.mark.parametrize(("a", "moved", "lenses"), [("-3/5", "2/5", 1), ("1/5", "-9/5", -2)])
def test_moved_focus(a: str, moved: str, lenses: int) -> None:
    raw = FLOWER[:200, :150]
    inner = (slice(60, -60), slice(60, -60))
    want = refocus(raw, 5, a)[inner]
    got = refocus(move_focus(raw, 5, lenses), 5, moved)[inner]
    assert np.array_equal(got, want)


def test_room() -> None:
    light_field = store(np.zeros((455, 450, 3), np.uint8), 5)
    # 8190 words of 53 bits: 8 x 3 blocks of 1024 x 18.
    assert light_field.block_rams == 24
