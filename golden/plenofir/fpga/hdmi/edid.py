"""The EDID block that the board's HDMI input serves to sources (VESA E-EDID 1.3, 128 bytes).

There is no CEA extension, so that sources take the board for a DVI monitor and send no audio and
no data islands. Offered are the modes that a build supports, as detailed timings, the first being
the preferred one.
"""

from collections.abc import Sequence

from plenofir.fpga.hdmi.modes import HD720, MODES, SVGA, VGA, VideoMode

EDID_BYTES = 128
NAME = "plenofir"
MANUFACTURER = "PLF"
PRODUCT = 0x0045
YEAR = 2024
"""Year of the model, written instead of a week of manufacture."""

# An unused descriptor (E-EDID 1.3, section 3.10.3).
_NO_DESCRIPTOR = bytes([0, 0, 0, 0x10]).ljust(18, b"\0")
# Bits of the established timings, bytes 35 to 37 (E-EDID 1.3, section 3.8).
_ESTABLISHED = {VGA.name: (0, 0x20), SVGA.name: (0, 0x01)}


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
    limits = [
        int(min(frames)),
        int(max(frames)) + 1,
        int(min(lines)),
        int(max(lines)) + 1,
        -(-fastest // 10_000),
    ]
    return bytes([0, 0, 0, 0xFD, 0, *limits, 0, 0x0A]) + b" " * 6


def make_edid(modes: Sequence[VideoMode] = MODES, *, preferred: VideoMode = HD720) -> bytes:
    """Make the EDID block.

    Parameters
    ----------
    modes
        Modes to offer, one to three.
    preferred
        The one to use if the source has no other wish; one of `modes`.

    Returns
    -------
    bytes
        128 bytes, the last one making the sum 0 modulo 256.

    Raises
    ------
    ValueError
        If the preferred mode is not offered, or there are no or too many modes.
    """
    if preferred not in modes or len(modes) > 3:
        raise ValueError("one to three modes, the preferred one among them")
    # Behind the preferred mode those that have no other place in the block.
    others = [mode for mode in modes if mode != preferred]
    ordered = [preferred, *sorted(others, key=lambda mode: mode.name in _ESTABLISHED)]
    established = [0, 0, 0]
    for mode in modes:
        byte, bit = _ESTABLISHED.get(mode.name, (0, 0))
        established[byte] |= bit
    # Two descriptors are timings, one the name, one the limits.
    detailed = ordered[:2]
    if any(mode.name not in _ESTABLISHED for mode in ordered[2:]):
        raise ValueError("of three modes, one must be 640x480p60 or 800x600p60, not preferred")
    block = b"".join(
        [
            b"\x00\xff\xff\xff\xff\xff\xff\x00",
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
            bytes(established),
            # No standard timings.
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


def offered_modes(max_columns: int) -> tuple[VideoMode, ...]:
    """Modes that a build for a longest line can take.

    Parameters
    ----------
    max_columns
        Longest line of the build in pixels.

    Returns
    -------
    tuple of VideoMode
        Smallest first; at least 640x480p60, which every source must be able to send (a build for
        shorter lines passes it through).
    """
    return tuple(mode for mode in MODES if mode.h_active <= max(max_columns, VGA.h_active))


def edid_package() -> str:
    """Make the VHDL package with the blocks.

    Returns
    -------
    str
        ``hdl/board/edid_pkg.vhd``.
    """
    offers = [MODES[: count + 1] for count in range(len(MODES))]
    blocks = []
    for offer in offers:
        block = make_edid(offer, preferred=offer[-1])
        rows = [f'x"{block[i : i + 16].hex().upper()}"' for i in range(0, EDID_BYTES, 16)]
        blocks.append("    " + " &\n    ".join(rows))
    return _TEMPLATE.format(
        modes=", ".join(mode.name for mode in MODES),
        columns=", ".join(str(offer[-1].h_active) for offer in offers),
        blocks=",\n".join(blocks),
        last_bit=8 * EDID_BYTES - 1,
        last_offer=len(offers) - 1,
    )


_TEMPLATE = """\
-- The EDID blocks of the HDMI input; built by scripts/build_hdl.py.
--
-- DVI only, {modes}: each block has one mode more. A build
-- serves the block whose modes fit its longest line.

library ieee;
use ieee.std_logic_1164.all;

package edid_pkg is

  -- The bytes of a block one after the other, the first one at the left.
  subtype edid_t is std_logic_vector(0 to {last_bit});

  type edids_t is array (0 to {last_offer}) of edid_t;

  type edid_columns_t is array (0 to {last_offer}) of positive;

  -- Longest line of each block.
  constant EDID_COLUMNS : edid_columns_t := ({columns});

  constant EDIDS : edids_t :=
  (
{blocks}
  );

end package edid_pkg;
"""
