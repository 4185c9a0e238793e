# SPDX-License-Identifier: Apache-2.0
"""TMDS coding against DVI 1.0, exhaustively."""

import numpy as np
import pytest

from plenofir.fpga.hdmi import link, tmds
from plenofir.fpga.hdmi.modes import HD720, HD720_50, MODES, SVGA, VGA, XGA, VideoMode
from plenofir.fpga.simulate.chain import mode_for
from plenofir_tb.hdmi.words import is_data_word

MINI = VideoMode(
    name="mini",
    pixel_clock=25_000,
    h_active=20,
    h_front=3,
    h_sync=5,
    h_back=4,
    v_active=9,
    v_front=2,
    v_sync=2,
    v_back=1,
    h_positive=True,
    v_positive=False,
)


def transitions(word: int, bits: int) -> int:
    return ((word ^ word >> 1) & ((1 << bits - 1) - 1)).bit_count()


def test_tokens() -> None:
    assert [f"{token:03x}" for token in tmds.TOKENS] == ["354", "0ab", "154", "2ab"]
    # Seven or more transitions: no data word has as many, whatever the phase within a run.
    assert all(transitions(token, 10) >= 7 for token in tmds.TOKENS)


def test_every_byte_at_every_disparity() -> None:
    reached = {0}
    todo = [0]
    seen = set()
    while todo:
        disparity = todo.pop()
        for byte in range(256):
            word, behind = tmds.encode_byte(byte, disparity)
            seen.add(word)
            assert tmds.decode_word(word) == byte
            assert word not in tmds.TOKENS
            assert behind - disparity == 2 * word.bit_count() - 10
            # The transition-minimised byte has five transitions at most, its flag included.
            assert transitions(tmds.minimise_transitions(byte), 8) <= 4
            assert transitions(word & 0xFF, 8) <= 4
            # A word never takes the disparity further from zero, but from zero itself.
            assert disparity == 0 or abs(behind) <= max(abs(disparity), 8)
            if behind not in reached:
                reached.add(behind)
                todo.append(behind)
    assert reached == set(tmds.DISPARITIES)
    assert len(seen) == 460
    assert {w for w in range(1024) if is_data_word(w)} == seen


def test_bytes_are_minimised() -> None:
    for byte in range(256):
        low = tmds.minimise_transitions(byte)
        xor = xnor = byte & 1
        for i in range(1, 8):
            bit = byte >> i & 1
            xor |= (xor >> (i - 1) & 1 ^ bit) << i
            xnor |= (1 ^ xnor >> (i - 1) & 1 ^ bit) << i
        assert low & 0xFF == (xor if low >> 8 else xnor)
        assert transitions(low & 0xFF, 8) == min(transitions(xor, 8), transitions(xnor, 8))


def test_channel() -> None:
    rng = np.random.default_rng(1)
    data = rng.integers(0, 256, 5000, np.uint8)
    active = rng.random(5000) < 0.9
    control = rng.integers(0, 4, 5000, np.uint8)
    words = tmds.encode_channel(data, active, control)
    balance = 0
    for i, word in enumerate(words.tolist()):
        balance = balance + 2 * word.bit_count() - 10 if active[i] else 0
        assert abs(balance) <= 8
    got_active, got_data, got_control = tmds.decode_channel(words)
    assert np.array_equal(got_active, active)
    assert np.array_equal(got_data, np.where(active, data, 0))
    assert np.array_equal(got_control, np.where(active, 0, control))


@pytest.mark.parametrize("phases", [(0, 0, 0), (3, 9, 6), (1, 17, 31)])
def test_link(phases: tuple[int, int, int]) -> None:
    rng = np.random.default_rng(2)
    frames = list(rng.integers(0, 256, (4, 9, 20, 3), np.uint8))
    mode = MINI.model_copy(update={"vic": 1})
    packed = link.encode_frames(mode, frames)
    late = np.zeros_like(packed)
    for channel, phase in enumerate(phases):
        bits = np.roll(link._bits(packed, channel), phase)
        late |= link._words(bits, 0).astype(np.uint32) << np.uint32(10 * channel)
    got = link.decode_frames(late)
    assert len(got) == 2
    for i, frame in enumerate(got):
        assert np.array_equal(frame.pixels, frames[i + 1])
        assert frame.mode == mode.as_measured()


def test_no_picture_is_an_error() -> None:
    rng = np.random.default_rng(3)
    with pytest.raises(link.LinkError):
        link.decode_frames(rng.integers(0, 1 << 30, 2000, np.uint32))
    with pytest.raises(link.LinkError):
        link.decode_frames(np.full(2000, tmds.TOKENS[0] * 0x100401, np.uint32))


def test_a_burst_longer_than_a_line_is_an_error() -> None:
    lines = [True] * 5 + [False] * 5
    active = np.array([False, *lines * 3, *[False] * 20, *[True] * 50, *[False] * 30, *lines * 3])
    nothing = np.zeros(len(active), bool)
    signals = link.RasterSignals(active, nothing, nothing, np.zeros((len(active), 3), np.uint8))
    with pytest.raises(link.LinkError, match="no blanking"):
        link.split_frames(signals)


def test_modes() -> None:
    assert (VGA.h_total, VGA.v_total) == (800, 525)
    assert (SVGA.h_total, SVGA.v_total) == (1056, 628)
    assert (XGA.h_total, XGA.v_total) == (1344, 806)
    assert (HD720.h_total, HD720.v_total) == (1650, 750)
    assert (HD720_50.h_total, HD720_50.v_total) == (1980, 750)
    for mode in (VGA, SVGA, XGA, HD720):
        assert mode_for(mode.h_active, mode.v_active) == mode
    assert all(abs(m.frame_rate - (50 if m is HD720_50 else 60)) < 0.4 for m in MODES)
