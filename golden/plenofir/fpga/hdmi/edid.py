# SPDX-License-Identifier: Apache-2.0
"""The EDID that the board's HDMI input serves to sources (VESA E-EDID 1.3), and how to read others.

The board's own is one block of 128 bytes. There is no CEA extension, so that sources take the board
for a DVI monitor and send no audio and no data islands. Offered are the modes that a build
supports.
"""

import math
from collections.abc import Sequence

from plenofir.fpga.hdmi.modes import (
    CLOCK_RANGES,
    MODES,
    SVGA,
    VGA,
    XGA,
    VideoMode,
    modes_of_range,
)
from plenofir.ground.errors import InputError

EDID_PACKAGE = "edid_pkg"
"""Name of the VHDL package."""
BLOCK_BYTES = 128
HEADER = b"\x00\xff\xff\xff\xff\xff\xff\x00"
NAME = "plenofir"
MANUFACTURER = "PLF"
PRODUCT = 0x0045
YEAR = 2024
"""Year of the model, written instead of a week of manufacture."""

# An unused descriptor (E-EDID 1.3, section 3.10.3).
_NO_DESCRIPTOR = bytes([0, 0, 0, 0x10]).ljust(18, b"\0")
# Bits of the established timings, bytes 35 and 36 as one number (E-EDID 1.3, section 3.8).
ESTABLISHED = {VGA.name: 0x2000, SVGA.name: 0x0100, XGA.name: 0x0008}
DESCRIPTORS = range(54, 126, 18)


def _manufacturer_code(letters: str) -> bytes:
    """Three letters in five bits each."""
    number = 0
    for letter in letters:
        number = number << 5 | ord(letter) - ord("A") + 1
    return number.to_bytes(2, "big")


def _detailed_timing(mode: VideoMode) -> bytes:
    """Detailed timing descriptor of 18 bytes (E-EDID 1.3, section 3.10.2)."""
    h_blank, v_blank = mode.h_total - mode.h_active, mode.v_total - mode.v_active
    flags = 0x18 | mode.v_positive << 2 | mode.h_positive << 1
    return bytes(
        [
            *(mode.pixel_clock // 10).to_bytes(2, "little"),
            mode.h_active & 0xFF,
            h_blank & 0xFF,
            mode.h_active >> 8 << 4 | h_blank >> 8,
            mode.v_active & 0xFF,
            v_blank & 0xFF,
            mode.v_active >> 8 << 4 | v_blank >> 8,
            mode.h_front & 0xFF,
            mode.h_sync & 0xFF,
            (mode.v_front & 0xF) << 4 | mode.v_sync & 0xF,
            mode.h_front >> 8 << 6
            | mode.h_sync >> 8 << 4
            | mode.v_front >> 4 << 2
            | mode.v_sync >> 4,
            # The size of the picture is unknown, as of a projector; borders are none.
            *(0, 0, 0, 0, 0),
            flags,
        ]
    )


def _text_descriptor(tag: int, text: str) -> bytes:
    content = text.encode("ascii") + b"\n"
    return bytes([0, 0, 0, tag, 0]) + content[:13].ljust(13, b" ")


def _range_descriptor(modes: Sequence[VideoMode]) -> bytes:
    """Limits of the rates (E-EDID 1.3, section 3.10.3)."""
    lines = [mode.pixel_clock / mode.h_total for mode in modes]
    frames = [mode.frame_rate for mode in modes]
    fastest = max(mode.pixel_clock for mode in modes)
    # Whole Hz and kHz around them; the pixel clock in steps of 10 MHz, rounded up.
    limits = [
        math.floor(min(frames)),
        math.ceil(max(frames)),
        math.floor(min(lines)),
        math.ceil(max(lines)),
        math.ceil(fastest / 10_000),
    ]
    return bytes([0, 0, 0, 0xFD, 0, *limits, 0, 0x0A]) + b" " * 6


def make_edid(modes: Sequence[VideoMode] = MODES) -> bytes:
    """Make the EDID block of 128 bytes; the last one makes the sum 0 modulo 256.

    The last mode is preferred. Besides it, one may be none of the established timings; ValueError
    if there are no modes, or not all find a place.
    """
    if not modes:
        raise ValueError("at least one mode")
    # Two descriptors are timings, one is the name, one has the limits. The second timing is the
    # mode that has no other place in the block, or else the smallest.
    preferred, others = modes[-1], sorted(modes[:-1], key=lambda mode: mode.name in ESTABLISHED)
    if any(mode.name not in ESTABLISHED for mode in others[1:]):
        raise ValueError("a place for each mode that is no established timing")
    detailed = [preferred, *others[:1]]
    block = b"".join(
        [
            HEADER,
            _manufacturer_code(MANUFACTURER),
            PRODUCT.to_bytes(2, "little"),
            (0).to_bytes(4, "little"),
            # Week 0: not stated; year of manufacture; version 1.3.
            bytes([0, YEAR - 1990, 1, 3]),
            # Digital input, DVI 1.0 compatible; size unknown; gamma 2.2; RGB, sRGB colours,
            # preferred timing first.
            bytes([0x81, 0, 0, 120, 0x0E]),
            # Chromaticities of sRGB (IEC 61966-2-1), ten bits each.
            bytes([0xEE, 0x91, 0xA3, 0x54, 0x4C, 0x99, 0x26, 0x0F, 0x50, 0x54]),
            sum(ESTABLISHED.get(mode.name, 0) for mode in modes).to_bytes(2, "big"),
            # No timings of the manufacturer's, no standard timings.
            b"\x00",
            b"\x01\x01" * 8,
            *(_detailed_timing(mode) for mode in detailed),
            *[_NO_DESCRIPTOR] * (2 - len(detailed)),
            _text_descriptor(0xFC, NAME),
            _range_descriptor(modes),
            # No extensions.
            b"\x00",
        ]
    )
    return block + bytes([-sum(block) % 256])


def offered_modes(max_columns: int, clock_range: int = 0) -> tuple[VideoMode, ...]:
    """Modes that a build for a longest line and a range of clocks can take, smallest first.

    At least the smallest one of the range, for all clocks 640x480p60, which every source must be
    able to send (a build for shorter lines passes it through).
    """
    modes = modes_of_range(clock_range)
    return tuple(mode for mode in modes if mode.h_active <= max(max_columns, modes[0].h_active))


def check_edid(content: bytes, *, where: str) -> None:
    """Refuse bytes that no source would accept as an EDID of one or two blocks.

    Length, header, number of extensions and checksums are checked.
    """
    if len(content) not in (BLOCK_BYTES, 2 * BLOCK_BYTES):
        raise InputError(f"has {len(content)} bytes; an EDID has 128 or 256", where=where)
    if content[:8] != HEADER:
        raise InputError(
            f"begins with {content[:8].hex(' ')}; an EDID begins with {HEADER.hex(' ')}",
            where=where,
        )
    extensions = len(content) // BLOCK_BYTES - 1
    if content[126] != extensions:
        raise InputError(
            f"byte 126 tells of {content[126]} extension blocks, but {len(content)} "
            f"bytes hold {extensions}",
            where=where,
        )
    for begin in range(0, len(content), BLOCK_BYTES):
        remainder = sum(content[begin : begin + BLOCK_BYTES]) % 256
        if remainder:
            raise InputError(
                f"the checksum is wrong: bytes {begin} to {begin + 127} have the sum "
                f"{remainder} modulo 256, not 0",
                where=where,
            )


def timing_of(descriptor: bytes) -> tuple[int, int, float] | None:
    """Columns, rows and frames a second of a detailed timing; None if it describes something else.

    Of interlaced timings rows and rate are those of a field. Eight bytes are enough.
    """
    clock = int.from_bytes(descriptor[:2], "little") * 10_000
    columns, h_blank, v_active, v_blank = (
        low | high << 8
        for low, high in zip(
            (descriptor[2], descriptor[3], descriptor[5], descriptor[6]),
            (descriptor[4] >> 4, descriptor[4] & 15, descriptor[7] >> 4, descriptor[7] & 15),
            strict=True,
        )
    )
    pixels = (columns + h_blank) * (v_active + v_blank)
    if not clock or not pixels:
        return None
    return columns, v_active, clock / pixels


def describe_edid(content: bytes) -> str:
    """Facts of an EDID for sources: the preferred mode, and whether they may send HDMI."""
    timing = timing_of(content[DESCRIPTORS.start :])
    preferred = "no preferred mode"
    if timing is not None:
        preferred = f"{timing[0]} x {timing[1]} at {timing[2]:.2f} Hz preferred"
    if len(content) == BLOCK_BYTES:
        return f"{preferred}; no extension, so sources send DVI"
    return f"{preferred}; an extension, so sources may send HDMI: islands, audio, other colours"


def standard_code(mode: VideoMode) -> int:
    """Code of a mode as a standard timing (E-EDID 1.3, section 3.9), first byte high; 0: none."""
    aspects = {(16, 10): 0, (4, 3): 1, (5, 4): 2, (16, 9): 3}
    rate = round(mode.frame_rate) - 60
    for (width, height), aspect in aspects.items():
        if mode.h_active * height == mode.v_active * width and 0 <= rate < 64:
            return (mode.h_active // 8 - 31) << 8 | aspect << 6 | rate
    return 0


def edid_package(custom: bytes | None = None) -> str:
    """VHDL of ``hdl/link/edid_pkg.vhd``: the blocks, and what the modes are called in other EDIDs.

    `custom` is an EDID to serve instead of the board's, whatever the longest line of the build.
    """
    edids = {
        (clocks, mode.h_active): make_edid(offered_modes(mode.h_active, clocks))
        for clocks in (0, *CLOCK_RANGES)
        for mode in modes_of_range(clocks)
    }
    if custom is not None:
        # Entry 0 serves every clock range without an EDID of its own.
        edids = {(0, 1): custom}
    size = len(next(iter(edids.values())))
    content = b"".join(edids.values())
    rows = [f'x"{content[i : i + 16].hex().upper()}"' for i in range(0, len(content), 16)]
    entries = [
        f"    {number} => ({mode.h_active}, {mode.v_active}, {round(10 * mode.frame_rate)}, "
        f'x"{ESTABLISHED.get(mode.name, 0):04X}", x"{standard_code(mode):04X}", '
        f'"{mode.vic:07b}")'
        for number, mode in enumerate(MODES)
    ]
    return _TEMPLATE.format(
        offered=(
            f"{', '.join(mode.name for mode in MODES)};\n"
            "-- with a fixed PLL those of its range, 1280x720p30 besides.\n"
            "-- A build serves the block whose modes fit its longest line and its PLL; no\n"
            "-- extension, so sources send DVI."
            if custom is None
            else "an EDID of the user's own."
        ),
        bytes=size,
        columns=",\n    ".join(
            f"{number} => {columns}" for number, (_, columns) in enumerate(edids)
        ),
        ranges=",\n    ".join(f"{number} => {clocks}" for number, (clocks, _) in enumerate(edids)),
        rows=(" &\n" + 30 * " ").join(rows),
        last_bit=8 * len(content) - 1,
        last_offer=len(edids) - 1,
        modes=",\n".join(entries),
        last_mode=len(MODES) - 1,
    )


_TEMPLATE = """\
-- The EDID of the HDMI input, and the known modes in a monitor's; built by scripts/build_hdl.py.
--
-- Offered: {offered}

library ieee;
use ieee.std_logic_1164.all;

package edid_pkg is

  constant EDID_BYTES : positive := {bytes};

  type edid_columns_t is array (0 to {last_offer}) of positive;

  -- Longest line of each EDID.
  constant EDID_COLUMNS : edid_columns_t :=
  (
    {columns}
  );

  type edid_ranges_t is array (0 to {last_offer}) of natural;

  -- Pixel clocks of each EDID, see CLOCK_RANGE of hdmi_control.
  constant EDID_RANGES : edid_ranges_t :=
  (
    {ranges}
  );

  -- The bytes of all of them one after the other, the first one at the left.
  subtype edids_t is std_logic_vector(0 to {last_bit});

  constant EDIDS : edids_t := {rows};

  -- A mode as an EDID names it: bits of bytes 35 and 36 (established timings), both bytes of a
  -- standard timing, code of CEA-861; 0: it has none.

  type known_mode_t is record
    columns     : positive;
    rows        : positive;
    rate        : positive;
    established : std_logic_vector(15 downto 0);
    standard    : std_logic_vector(15 downto 0);
    vic         : std_logic_vector(6 downto 0);
  end record known_mode_t;

  type known_modes_t is array (0 to {last_mode}) of known_mode_t;

  -- Rates in 0.1 Hz.
  constant KNOWN_MODES : known_modes_t :=
  (
{modes}
  );

end package edid_pkg;
"""
