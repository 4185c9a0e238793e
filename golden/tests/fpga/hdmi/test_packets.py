# SPDX-License-Identifier: Apache-2.0
"""HDMI: words, packets and islands against values of public designs, source against receiver.

The words of `test_terc4` are those of hdl-util/hdmi (SystemVerilog, from HDMI 1.4a), litevideo
(Migen) and fliperama86/pico_hdmi (C). The check bytes of `test_check_bytes` are the table of
pico_hdmi; the shift register of hdl-util/hdmi makes the same ones. Both put the bits of a packet
into the words in the same way.
"""

import itertools
import random

import numpy as np
import pytest

from plenofir.fpga.hdmi import link
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir_tb.hdmi import islands, packets
from plenofir_tb.hdmi.packets import AviInfo, Colorimetry, ColourSpace
from plenofir_tb.hdmi.words import ISLAND_GUARD, TERC4, VIDEO_GUARDS

MODE = VideoMode(
    name="hdmi",
    pixel_clock=25_000,
    h_active=24,
    h_front=20,
    h_sync=30,
    h_back=50,
    v_active=9,
    v_front=1,
    v_sync=2,
    v_back=2,
    h_positive=True,
    v_positive=False,
)


def some_packets(rng: random.Random, count: int) -> list[packets.Packet]:
    samples = [(rng.randrange(1 << 24), rng.randrange(1 << 24)) for _ in range(4)]
    kinds = [
        packets.NULL_PACKET,
        packets.audio_clock_packet(6144, 74250),
        packets.audio_sample_packet(samples[: rng.randint(1, 4)]),
        packets.general_control_packet(mute=False),
        packets.audio_info_packet(),
        AviInfo(format_code=4).packet(),
    ]
    return [rng.choice(kinds) for _ in range(count)]


def test_terc4() -> None:
    assert " ".join(f"{word:010b}" for word in TERC4) == (
        "1010011100 1001100011 1011100100 1011100010 0101110001 0100011110 0110001110 0100111100 "
        "1011001100 0100111001 0110011100 1011000110 1010001110 1001110001 0101100011 1011000011"
    )
    guards = " ".join(f"{word:010b}" for word in VIDEO_GUARDS)
    assert guards == "1011001100 0100110011 1011001100"
    # One wrong bit never makes another word of islands.
    known = [*TERC4, ISLAND_GUARD]
    assert all((a ^ b).bit_count() >= 2 for a, b in itertools.combinations(known, 2))


def test_check_bytes() -> None:
    table = bytes(packets.check_byte(bytes([i])) for i in range(32))
    assert table.hex(" ", 8) == (
        "00d9b56c6db4d801 da036fb6b76e02db b36a06dfde076bb2 69b0dc0504ddb168"
    )
    # Of several bytes the table's entries are chained.
    for data in (b"\x82\x02\x0d", bytes(range(100, 107))):
        check = 0
        for byte in data:
            check = packets.check_byte(bytes([check ^ byte]))
        assert packets.check_byte(data) == check


def test_every_single_bit_error_shows() -> None:
    block = packets.NULL_PACKET.blocks()[1][:-1]
    right = packets.check_byte(block)
    for i in range(56):
        wrong = (int.from_bytes(block, "little") ^ 1 << i).to_bytes(7, "little")
        assert packets.check_byte(wrong) != right


@pytest.mark.parametrize(
    ("info", "limited", "bt601"),
    [
        (AviInfo(), False, False),
        # RGB of a TV format is limited if nothing is said, but that of VIC 1.
        (AviInfo(format_code=4), True, False),
        (AviInfo(format_code=1), False, True),
        (AviInfo(format_code=4, rgb_range=2), False, False),
        (AviInfo(rgb_range=1), True, False),
        (AviInfo(ColourSpace.YCBCR_444, Colorimetry.BT709, format_code=1), True, False),
        (AviInfo(ColourSpace.YCBCR_444, Colorimetry.BT601, format_code=4), True, True),
        (AviInfo(ColourSpace.YCBCR_444, ycc_range=1, format_code=17), False, True),
        (AviInfo(ColourSpace.YCBCR_444, format_code=60), True, False),
        (AviInfo(ColourSpace.YCBCR_422, Colorimetry.EXTENDED, extended=1), True, False),
        (AviInfo(ColourSpace.YCBCR_444, Colorimetry.EXTENDED, extended=2), True, True),
    ],
)
def test_avi(info: AviInfo, *, limited: bool, bt601: bool) -> None:
    packet = info.packet()
    assert packet.sum_is_right
    assert packets.read_avi(packet) == info
    assert (info.limited, info.bt601) == (limited, bt601)
    torn = packets.Packet(packet.header, bytes([packet.body[0] ^ 1]) + packet.body[1:])
    assert packets.read_avi(torn) is None
    assert packets.read_avi(packets.audio_info_packet()) is None


def send(rng: random.Random, frames: int) -> tuple[link.Packed, list, list[packets.Packet]]:
    pictures = list(np.random.default_rng(rng.randrange(99)).integers(0, 256, (frames, 9, 24, 3)))
    pictures = [picture.astype(np.uint8) for picture in pictures]
    sent = some_packets(rng, 500)
    rest = iter(sent)
    packed = islands.encode_hdmi(MODE, pictures, rest)
    return packed, pictures, sent[: 500 - len(list(rest))]


def test_source_and_receiver() -> None:
    packed, pictures, sent = send(random.Random(1), 3)
    got = islands.receive(packed)
    plain = link.raster_signals(MODE, pictures)
    # The first line comes without what is in front of it.
    behind = slice(MODE.h_total, None)
    assert np.array_equal(got.signals.active[behind], plain.active[behind])
    blank = ~plain.active
    blank[: MODE.h_total] = False
    for name in ("h_sync", "v_sync"):
        assert np.array_equal(getattr(got.signals, name)[blank], getattr(plain, name)[blank])
    assert np.array_equal(got.signals.pixels, plain.pixels)
    assert not got.errors.any()
    assert got.hdmi[MODE.h_total :].all()
    assert [packet.packet for packet in got.packets] == sent
    # Between the lines and in the vertical blanking, where more fit.
    assert all(packet.intact for packet in got.packets)
    assert len(sent) == 3 * (9 * 2 + 5 * 2)
    frames = link.split_frames(got.signals, from_start=True)
    assert [frame.mode.name for frame in frames] == ["measured"] * 2


def test_dvi_is_received_as_before() -> None:
    pictures = [np.full((9, 24, 3), 7, np.uint8)] * 2
    got = islands.receive(link.encode_frames(MODE, pictures))
    plain = link.raster_signals(MODE, pictures)
    assert np.array_equal(got.signals.active, plain.active)
    assert np.array_equal(got.signals.pixels, plain.pixels)
    assert not got.hdmi.any()
    assert not got.errors.any()
    assert not got.packets


def test_single_wrong_bits_do_no_harm() -> None:
    rng = random.Random(2)
    packed, _, sent = send(rng, 2)
    right = islands.receive(packed)
    for _ in range(60):
        at = rng.randrange(MODE.h_total, len(packed))
        torn = packed.copy()
        torn[at] ^= np.uint32(1 << rng.randrange(30))
        got = islands.receive(torn)
        assert np.array_equal(got.signals.active, right.signals.active)
        assert set(np.flatnonzero(got.errors.any(axis=1))) <= {at}
        wrong = [i for i, packet in enumerate(got.packets) if packet.packet != sent[i]]
        assert len(wrong) <= 1
        assert not any(got.packets[i].intact for i in wrong)
        others = np.arange(len(packed)) != at
        assert np.array_equal(got.signals.pixels[others], right.signals.pixels[others])
