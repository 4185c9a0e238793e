# SPDX-License-Identifier: Apache-2.0
"""The signal of a camera with MIPI CSI-2: raw frames as packets, packets on a D-PHY's lanes."""

from binascii import crc_hqx
from collections.abc import Sequence
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from plenofir.ground.errors import InputError

_GROUP = {8: 1, 10: 4, 12: 2}
RAW_BITS = tuple(_GROUP)
LANES = (1, 2, 4)

_CODES = (
    *(0x07, 0x0B, 0x0D, 0x0E, 0x13, 0x15, 0x16, 0x19, 0x1A, 0x1C, 0x23, 0x25),
    *(0x26, 0x29, 0x2A, 0x2C, 0x31, 0x32, 0x34, 0x38, 0x1F, 0x2F, 0x37, 0x3B),
)
_REVERSED = bytes(int(f"{n:08b}"[::-1], 2) for n in range(256))


class Kind(IntEnum):
    """Types of packets."""

    FRAME_START = 0x00
    FRAME_END = 0x01
    LINE_START = 0x02
    LINE_END = 0x03
    EMBEDDED = 0x12
    RAW8 = 0x2A
    RAW10 = 0x2B
    RAW12 = 0x2C


def raw_kind(bits: int) -> Kind:
    """Type of a line of raw pixels of 8, 10 or 12 bits."""
    return Kind[f"RAW{bits}"]


def header(channel: int, kind: int, value: int) -> bytes:
    """Header: data identifier, word count or data of a short packet, error correcting code."""
    data = channel << 6 | kind | value << 8
    code = 0
    for bit, column in enumerate(_CODES):
        if data >> bit & 1:
            code ^= column
    return (data | code << 24).to_bytes(4, "little")


def checksum(payload: bytes) -> int:
    """CRC-16 of a payload: x^16 + x^12 + x^5 + 1, low bits first, from all ones on."""
    mirrored = crc_hqx(payload.translate(_REVERSED), 0xFFFF)
    return int(f"{mirrored:016b}"[::-1], 2)


def long_packet(channel: int, kind: int, payload: bytes) -> bytes:
    """Header, payload, checksum."""
    crc = checksum(payload).to_bytes(2, "little")
    return header(channel, kind, len(payload)) + payload + crc


def word_pixels(lanes: int, bits: int, pixels_per_clock: int) -> int:
    """Pixels in a word between the lanes' clock and the core's (csi_pkg.pixels_of_word)."""
    pixels = _GROUP[bits]
    while pixels * bits < 8 * lanes:
        pixels *= 2
    return max(pixels, pixels_per_clock)


def packed(pixels: npt.NDArray[np.integer], bits: int) -> bytes:
    """Bytes of a line: the high bits of 1, 4 or 2 pixels, then a byte with the low bits of all.

    InputError for a line that does not end with such a group.
    """
    together = _GROUP[bits]
    if pixels.size % together:
        raise InputError(
            f"a line has {pixels.size} pixels; RAW{bits} packs a multiple of {together}",
            where="columns",
        )
    groups = pixels.reshape(-1, together).astype(np.uint16)
    high = groups >> (bits - 8)
    if bits == 8:
        return high.astype(np.uint8).tobytes()
    low = groups & ((1 << (bits - 8)) - 1)
    last = (low << np.arange(together) * (bits - 8)).sum(axis=1, keepdims=True)
    return np.hstack([high, last]).astype(np.uint8).tobytes()


def frame_packets(
    picture: npt.NDArray[np.integer], bits: int, *, channel: int = 0, number: int = 0
) -> list[bytes]:
    """Packets of a frame (rows, columns): its start, its lines, its end."""
    lines = [long_packet(channel, raw_kind(bits), packed(line, bits)) for line in picture]
    start, end = (header(channel, k, number) for k in (Kind.FRAME_START, Kind.FRAME_END))
    return [start, *lines, end]


def lane_bytes(packet: bytes, lanes: int) -> list[bytes]:
    """Bytes of each lane, distributed in turn."""
    return [packet[lane::lanes] for lane in range(lanes)]


def lane_clocks(
    packets: Sequence[bytes], lanes: int, *, skews: Sequence[int] = (), gap: int = 8
) -> npt.NDArray[np.uint16]:
    """Clocks (clocks, lanes) of the lanes, a burst for each packet, `gap` clocks after each.

    The low byte of an entry is the lane's byte, bit 8 tells that there is one, bit 9 that it is the
    first one after the sync. Lane n is `skews[n]` clocks late. After its last byte, a lane repeats
    the opposite of its last bit until all have ended, as a D-PHY's trail.
    """
    late = list(skews) or [0] * lanes
    parts = []
    for packet in packets:
        length = -(-len(packet) // lanes)
        burst = np.zeros((length + max(late) + gap, lanes), np.uint16)
        for lane, data in enumerate(lane_bytes(packet, lanes)):
            trail = 0 if (data or packet)[-1] & 0x80 else 0xFF
            filled = data + bytes([trail] * (length - len(data)))
            begin = late[lane]
            burst[begin : begin + length, lane] = np.frombuffer(filled, np.uint8) + np.uint16(0x100)
            burst[begin, lane] |= 0x200
        parts.append(burst)
    return np.vstack(parts)


def settle_clocks(lane_mbits: float) -> int:
    """SETTLE of `dphy_lane` for the bit rate of a lane.

    In the middle of what D-PHY allows (85 ns plus 6 bits to 145 ns plus 10 bits), less the clocks
    that a level takes to be registered.
    """
    clock_ns = 8000 / lane_mbits
    return max(round((115 / clock_ns) + 1 - 3), 0)
