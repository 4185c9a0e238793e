# SPDX-License-Identifier: Apache-2.0
"""What the board reads from a monitor's EDID: the golden model of ``hdl/link/monitor_edid.vhd``.

The preferred mode is the first detailed timing. A mode counts as offered if a detailed timing has
its size and its rate, or if it is one of `MODES` and listed in the established timings, the
standard timings, or the video codes of a CEA-861 extension. Other ways to offer a mode (limits of
rates with formulas, standard timings in descriptors, further extensions) are ignored.
"""

from collections.abc import Iterator
from typing import NamedTuple

from plenofir.fpga.hdmi.edid import (
    BLOCK_BYTES,
    DESCRIPTORS,
    ESTABLISHED,
    HEADER,
    standard_code,
)
from plenofir.fpga.hdmi.modes import MODES

HIGHEST_RATE = 4095
"""In 0.1 Hz; faster timings count as that."""
_TOLERANCE = 10
_DESCRIPTOR_BYTES = 18
_CEA_TAG = 2
_VIDEO_CODES = 2
_CODES = 4


class Mode(NamedTuple):
    """Size in pixels, rate in 0.1 Hz."""

    columns: int
    rows: int
    rate: int


class MonitorReport(NamedTuple):
    """Fields of the status about the monitor."""

    is_edid: bool  # header and checksums are right
    preferred: Mode  # zeros if it has none, or this is no EDID
    offered: bool  # the mode on show is in it


def rate_of(pixel_clock: int, line_length: int, frame_lines: int) -> int:
    """Frame rate in 0.1 Hz, as ``hdl/link/timing_rate.vhd`` computes it, at most `HIGHEST_RATE`.

    The pixel clock is in 10 kHz; length and lines include blanking.
    """
    pixels = line_length * frame_lines
    if not pixels:
        return HIGHEST_RATE
    return min((100_000 * pixel_clock + (pixels + 1) // 2) // pixels, HIGHEST_RATE)


def _detailed(content: bytes, places: range) -> Iterator[Mode]:
    """Detailed timings among the descriptors at the given offsets."""
    for place in places:
        timing = content[place : place + 8].ljust(8, b"\0")
        clock = int.from_bytes(timing[:2], "little")
        if clock:
            columns, rows = timing[2] | timing[4] >> 4 << 8, timing[5] | timing[7] >> 4 << 8
            line = columns + (timing[3] | (timing[4] & 15) << 8)
            lines = rows + (timing[6] | (timing[7] & 15) << 8)
            yield Mode(columns, rows, rate_of(clock, line, lines))


def _video_codes(extension: bytes, end: int) -> Iterator[int]:
    """Codes in the video blocks of a CEA-861 extension."""
    place = _CODES
    while place < end:
        tag, length = extension[place] >> 5, extension[place] & 31
        if tag == _VIDEO_CODES:
            yield from (code & 0x7F for code in extension[place + 1 : min(place + 1 + length, end)])
        place += 1 + length


def _near(a: int, b: int) -> bool:
    return abs(a - b) <= _TOLERANCE


def read_monitor(content: bytes, shown: Mode) -> MonitorReport:
    """Read the 256 bytes that a monitor sends; without an extension the first 128 count."""
    base, extension = content[:BLOCK_BYTES], content[BLOCK_BYTES : 2 * BLOCK_BYTES]
    blocks = [base] if not base[126] else [base, extension]
    if base[:8] != HEADER or any(sum(block) % 256 for block in blocks):
        return MonitorReport(False, Mode(0, 0, 0), False)
    detailed = list(_detailed(base, DESCRIPTORS))
    preferred = next(_detailed(base, DESCRIPTORS[:1]), Mode(0, 0, 0))
    codes = set[int]()
    if base[126] and extension[0] == _CEA_TAG:
        end = extension[2] & 0x7F
        if end >= _CODES:
            codes.update(_video_codes(extension, end))
            detailed += _detailed(extension, range(end, BLOCK_BYTES - 7, _DESCRIPTOR_BYTES))
    established = int.from_bytes(base[35:37], "big")
    standard = {int.from_bytes(base[i : i + 2], "big") for i in range(38, 54, 2)}
    offered = any(
        timing[:2] == shown[:2] and _near(timing.rate, shown.rate) for timing in detailed
    ) or any(
        (mode.h_active, mode.v_active) == shown[:2]
        and _near(round(10 * mode.frame_rate), shown.rate)
        and (
            established & ESTABLISHED.get(mode.name, 0)
            or standard_code(mode) in standard
            or mode.vic in codes
        )
        for mode in MODES
    )
    return MonitorReport(True, preferred, offered)
