# SPDX-License-Identifier: Apache-2.0
"""Packets of HDMI data islands: their check bits, InfoFrames, and what the AVI InfoFrame tells.

A packet has a header of 3 bytes and a body of 28 bytes (HDMI 1.4, section 5.2.3.4). The header and
each quarter of the body (a subpacket of 7 bytes) have a check byte of their own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

HEADER_BYTES = 3
BODY_BYTES = 28
SUBPACKET_BYTES = 7
PACKET_WORDS = 32
"""TMDS words of a packet: one bit of the header, two of each subpacket in each."""

_AVI_TYPE = 0x82
_AVI_LENGTH = 13
_AUDIO_TYPE = 0x84
_AUDIO_LENGTH = 10


def check_byte(data: bytes) -> int:
    """Check bits of a header (3 bytes) or a subpacket (7 bytes); the first byte's bit 0 leads.

    HDMI 1.4, section 5.2.3.5: a shortened BCH code with the generator 1 + x^6 + x^7 + x^8. Of the
    eight bits, sent after the data, bit 0 leads, too.
    """
    check = 0
    for byte in data:
        for i in range(8):
            feedback = (check ^ byte >> i) & 1
            check = check >> 1 ^ (0x83 if feedback else 0)
    return check


@dataclass(frozen=True)
class Packet:
    """A packet."""

    header: bytes  # 3 bytes, the type first
    body: bytes = bytes(BODY_BYTES)  # 28 bytes, four subpackets of 7

    def __post_init__(self) -> None:
        """Refuse other sizes."""
        if len(self.header) != HEADER_BYTES or len(self.body) != BODY_BYTES:
            raise ValueError(f"packet of {len(self.header)} and {len(self.body)} bytes")

    def blocks(self) -> list[bytes]:
        """Header and subpackets, each with its check byte after it."""
        parts = [self.body[i : i + SUBPACKET_BYTES] for i in range(0, BODY_BYTES, SUBPACKET_BYTES)]
        return [part + bytes([check_byte(part)]) for part in (self.header, *parts)]

    @property
    def is_info_frame(self) -> bool:
        """Whether it has the type of an InfoFrame."""
        return self.header[0] >= 0x80

    @property
    def sum_is_right(self) -> bool:
        """Whether the sum of all bytes is that of an InfoFrame: 0 modulo 256."""
        return sum(self.header + self.body) % 256 == 0


NULL_PACKET = Packet(bytes(HEADER_BYTES))
"""What a source sends where it has nothing to say."""


def _info_frame(kind: int, version: int, data: bytes) -> Packet:
    """InfoFrame with its checksum (CEA-861-D, section 6)."""
    header = bytes([kind, version, len(data)])
    body = bytes([-sum(header + data) % 256]) + data
    return Packet(header, body.ljust(BODY_BYTES, b"\0"))


class ColourSpace(IntEnum):
    """Y1 and Y0 of the AVI InfoFrame; 4:2:0 came with HDMI 2.0."""

    RGB = 0
    YCBCR_422 = 1
    YCBCR_444 = 2
    YCBCR_420 = 3


class Colorimetry(IntEnum):
    """C1 and C0 of the AVI InfoFrame."""

    NONE = 0
    BT601 = 1
    BT709 = 2
    EXTENDED = 3


_HD_FORMATS = frozenset({0, 4, 5, 16, 19, 20, *range(31, 35), *range(39, 42), 46, 47})
_FIRST_NEW_HD_FORMAT = 60
_EXTENDED_601 = frozenset({0, 2, 3})


@dataclass(frozen=True)
class AviInfo:
    """Description of the picture in an AVI InfoFrame (CEA-861-D, section 6.4)."""

    colour_space: ColourSpace = ColourSpace.RGB  # Y1, Y0
    colorimetry: Colorimetry = Colorimetry.NONE  # C1, C0
    extended: int = 0  # EC2 to EC0, where `colorimetry` is `Colorimetry.EXTENDED`
    rgb_range: int = 0  # Q1, Q0: 0 default of the format, 1 limited, 2 full
    ycc_range: int = 0  # YQ1, YQ0: 0 limited, 1 full
    format_code: int = 0  # VIC, 0 for formats without one

    def packet(self) -> Packet:
        """AVI InfoFrame, version 2."""
        data = [
            self.colour_space << 5,
            self.colorimetry << 6,
            self.extended << 4 | self.rgb_range << 2,
            self.format_code,
            self.ycc_range << 6,
        ]
        return _info_frame(_AVI_TYPE, 2, bytes(data).ljust(_AVI_LENGTH, b"\0"))

    @property
    def limited(self) -> bool:
        """Whether black is 16 and white 235, which is the default of TV formats (VIC > 1)."""
        if self.colour_space != ColourSpace.RGB:
            return self.ycc_range == 0
        return self.rgb_range == 1 or (self.rgb_range == 0 and self.format_code > 1)

    @property
    def bt601(self) -> bool:
        """Whether YCbCr is coded by BT.601, not BT.709; by the format's size if not stated."""
        if self.colorimetry == Colorimetry.NONE:
            code = self.format_code
            return code not in _HD_FORMATS and code < _FIRST_NEW_HD_FORMAT
        if self.colorimetry == Colorimetry.EXTENDED:
            return self.extended in _EXTENDED_601
        return self.colorimetry == Colorimetry.BT601


def read_avi(packet: Packet) -> AviInfo | None:
    """Read an AVI InfoFrame from an intact packet; None for others and for a wrong checksum."""
    if packet.header[0] != _AVI_TYPE or not packet.sum_is_right:
        return None
    body = packet.body
    return AviInfo(
        colour_space=ColourSpace(body[1] >> 5 & 3),
        colorimetry=Colorimetry(body[2] >> 6),
        extended=body[3] >> 4 & 7,
        rgb_range=body[3] >> 2 & 3,
        ycc_range=body[5] >> 6,
        format_code=body[4],
    )


def audio_clock_packet(n: int, cycles: int) -> Packet:
    """Audio clock regeneration (HDMI 1.4, section 5.3.3): the clock is pixel clock * N / (128 CTS).

    N and CTS (`cycles`) have 20 bits; all four subpackets are the same.
    """
    part = bytes([0]) + cycles.to_bytes(3, "big") + n.to_bytes(3, "big")
    return Packet(bytes([1, 0, 0]), part * 4)


def audio_sample_packet(samples: Sequence[tuple[int, int]]) -> Packet:
    """Audio samples in two channels (HDMI 1.4, section 5.3.4): one to four pairs of 24 bits each.

    They are valid, with even parity and channel status 0.
    """
    parts = []
    for left, right in samples:
        parity = left.bit_count() % 2 << 3 | right.bit_count() % 2 << 7
        parts.append(left.to_bytes(3, "little") + right.to_bytes(3, "little") + bytes([parity]))
    body = b"".join(parts).ljust(BODY_BYTES, b"\0")
    return Packet(bytes([2, (1 << len(samples)) - 1, 0]), body)


def general_control_packet(*, mute: bool) -> Packet:
    """General control (HDMI 1.4, section 5.3.6): AVMUTE set or cleared, four times alike."""
    part = bytes([0x01 if mute else 0x10]).ljust(SUBPACKET_BYTES, b"\0")
    return Packet(bytes([3, 0, 0]), part * 4)


def audio_info_packet() -> Packet:
    """Audio InfoFrame of two channels; everything else is told by the stream."""
    return _info_frame(_AUDIO_TYPE, 1, bytes([1]).ljust(_AUDIO_LENGTH, b"\0"))
