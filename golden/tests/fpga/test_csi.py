# SPDX-License-Identifier: Apache-2.0
"""Packets of MIPI CSI-2, and the set-up of sensors."""

import numpy as np
import pytest

from camera_tables import KNOWN_SENSORS
from plenofir.fpga.csi import (
    Kind,
    checksum,
    frame_packets,
    header,
    lane_clocks,
    packed,
    settle_clocks,
)
from plenofir.fpga.sensors import (
    IMX219_MODES,
    PAUSE,
    imx219,
    imx219_mode,
    registers_text,
)
from plenofir.ground.errors import InputError

# Bits of a header's 24 that each bit of its code is the parity of, from bit 5 down: as in
# mipi-csi-rx/csi_rx_hdr_ecc.vhd of gatecat/CSI2Rx, a receiver that ran with cameras.
PARITIES = (
    (10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 21, 22, 23),
    (4, 5, 6, 7, 8, 9, 16, 17, 18, 19, 20, 22, 23),
    (1, 2, 3, 7, 8, 9, 13, 14, 15, 19, 20, 21, 23),
    (0, 2, 3, 5, 6, 9, 11, 12, 15, 18, 20, 21, 22),
    (0, 1, 3, 4, 6, 8, 10, 12, 14, 17, 20, 21, 22, 23),
    (0, 1, 2, 4, 5, 7, 10, 11, 13, 16, 20, 21, 22, 23),
)


def test_code_of_a_header_as_in_another_receiver() -> None:
    for bit in range(24):
        code = header(1 << bit >> 6 & 3, 1 << bit & 0x3F, 1 << bit >> 8)[3]
        assert code == sum((bit in places) << 5 - n for n, places in enumerate(PARITIES))


def test_checksums_as_others_quote_them() -> None:
    # Public test benches give these two as the standard's examples, whose text is not public.
    for payload, crc in (
        ("FF 00 00 02 B9 DC F3 72 BB D4 B8 5A C8 75 C2 7C 81 F8 05 DF FF 00 00 01", 0x00F0),
        ("FF 00 00 00 1E F0 1E C7 4F 82 78 C5 82 E0 8C 70 D2 3C 78 E9 FF 00 00 01", 0xE569),
    ):
        assert checksum(bytes.fromhex(payload)) == crc


@pytest.mark.parametrize(
    ("bits", "pixels", "wanted"),
    [
        (8, [1, 2, 255], [1, 2, 255]),
        (10, [0x3FF, 0x001, 0x156, 0x200], [0xFF, 0x00, 0x55, 0x80, 0b00_10_01_11]),
        (12, [0xABC, 0x123], [0xAB, 0x12, 0x3C]),
    ],
)
def test_packing(bits: int, pixels: list[int], wanted: list[int]) -> None:
    assert list(packed(np.array(pixels, np.uint16), bits)) == wanted


def test_lines_that_end_inside_a_group_are_refused() -> None:
    with pytest.raises(InputError, match="multiple of 4"):
        packed(np.zeros(6, np.uint16), 10)


def test_frames_on_lanes() -> None:
    picture = np.arange(12, dtype=np.uint16).reshape(2, 6)
    packets = frame_packets(picture, 8, channel=1, number=3)
    assert [packet[0] for packet in packets] == [0x40, 0x40 | Kind.RAW8, 0x40 | Kind.RAW8, 0x41]
    assert packets[1][4:10] == bytes(range(6))
    clocks = lane_clocks(packets[:2], 2, skews=(0, 1), gap=3)
    # Two and six bytes on each lane, a clock of skew and three of gap after each packet.
    assert clocks.shape == (2 + 1 + 3 + 6 + 1 + 3, 2)
    assert (clocks[:, 0] >> 8 == [3, 1, 0, 0, 0, 0, 3, 1, 1, 1, 1, 1, 0, 0, 0, 0]).all()
    assert (clocks[:-1, 0] >> 8 == clocks[1:, 1] >> 8).all()
    assert bytes((clocks[6:12, 0] & 255).astype(np.uint8)) == packets[1][::2]


@pytest.mark.parametrize("mode", IMX219_MODES, ids=lambda mode: str(mode.columns))
def test_registers_of_the_imx219(mode) -> None:
    entries = imx219(mode.columns, mode.rows, bits=8, pattern="bars", exposure_lines=100)
    last = dict(entries)
    assert entries[0][0] == PAUSE
    assert entries[-1] == (0x0100, 1)
    assert all(0 <= a <= 0xFFFF and 0 <= v <= 0xFF for a, v in entries)

    def word(address: int) -> int:
        return last[address] << 8 | last[address + 1]

    assert (word(0x016C), word(0x016E), word(0x0600)) == (mode.columns, mode.rows, 2)
    read = word(0x0166) - word(0x0164) + 1, word(0x016A) - word(0x0168) + 1
    binned = 2 if mode.binning else 1
    assert read == (mode.columns * binned, mode.rows * binned)
    assert last[0x018C] == last[0x0309] == 8
    assert mode.frames_per_second == pytest.approx(15 if mode.columns == 3280 else 30, rel=1e-3)
    assert [len(text) for text in registers_text(entries).split(" ")] == [6] * len(entries)


@pytest.mark.parametrize(
    ("wrong", "what"),
    [
        ({"columns": 1920, "rows": 1080}, "3280 x 2464"),
        ({"bits": 12}, "8 or 10"),
        ({"bits": 9}, "8 or 10"),
        ({"exposure_lines": 1760}, "4 to 1759"),
        ({"gain": 233}, "0 to 232"),
        ({"pattern": "cat"}, "grey-bars"),
    ],
)
def test_what_the_imx219_has_not_is_refused(wrong: dict, what: str) -> None:
    with pytest.raises(InputError, match=what):
        imx219(**{"columns": 640, "rows": 480, **wrong})


def test_what_known_sensors_ask_for() -> None:
    sensors = {sensor.name: sensor for sensor in KNOWN_SENSORS}
    imx219, fastest = sensors["IMX219"], KNOWN_SENSORS[-1]
    assert imx219.lane_pixels == pytest.approx(IMX219_MODES[-1].pixel_rate)
    assert imx219.byte_mhz == 114
    assert (imx219.pixels_per_clock(100e6), imx219.pixels_per_clock(200e6)) == (2, 1)
    # Four lanes of 900 Mb/s bring 360 million pixels of 10 bits a second.
    assert fastest.lane_pixels == 360e6
    assert fastest.pixels_per_clock(100e6) == 4
    assert fastest.pixels_per_clock(10e6) is None
    assert all(sensor.mean_pixels < sensor.lane_pixels for sensor in KNOWN_SENSORS)


@pytest.mark.parametrize(
    ("wrong", "what"),
    [
        ({"line_pixels": 3447}, "3448 to 65535"),
        ({"frame_lines": 511}, "512 to 65535"),
    ],
)
def test_less_blanking_than_the_driver_has_is_refused(wrong: dict, what: str) -> None:
    with pytest.raises(InputError, match=what):
        imx219_mode(640, 480, **wrong)


@pytest.mark.parametrize("lane_mbits", [448, 460, 920])
def test_rates_of_lanes_that_no_pll_makes_are_refused(lane_mbits: int) -> None:
    with pytest.raises(InputError, match="multiple of 8 from 456 to 912"):
        imx219(640, 480, lane_mbits=lane_mbits)


def test_settling_is_within_what_d_phy_allows() -> None:
    for mbits in (80, 200, 456, 912, 1500):
        clock, bit = 8000 / mbits, 1000 / mbits
        # A level takes two to three clocks to be registered.
        least, most = ((settle_clocks(mbits) + late) * clock for late in (2, 3))
        assert most >= 85 + 6 * bit
        if mbits >= 200:
            assert least <= 145 + 10 * bit
