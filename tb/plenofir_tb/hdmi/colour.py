# SPDX-License-Identifier: Apache-2.0
"""Full-range RGB from what HDMI sources send: limited range, YCbCr 4:4:4 of BT.601 and BT.709.

The board multiplies with integers; this is the same arithmetic, and the home of its coefficients.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plenofir_tb.hdmi.packets import AviInfo, ColourSpace

Pixels = npt.NDArray[np.uint8]

FRACTION_BITS = 12
"""Bits of the coefficients behind the point."""

_COEFFICIENT_BITS = 15
_OFFSET_BITS = 22
_ONE = 1 << FRACTION_BITS
# Shares of red and blue in luma (BT.601, section 2.5.1; BT.709, section 3.2).
_BT601 = (0.299, 0.114)
_BT709 = (0.2126, 0.0722)


@dataclass(frozen=True)
class Coefficients:
    """One conversion to full-range RGB, in units of 2**-FRACTION_BITS.

    Channels are those of the link: 0 blue or Cb, 1 green or Y, 2 red or Cr.
    """

    luma: int  # channel 1 in green and, where `shared`, in red and blue too
    red: int  # channel 2 in red
    green_red: int  # channel 2 in green
    green_blue: int  # channel 0 in green
    blue: int  # channel 0 in blue
    offsets: tuple[int, int, int]  # added to red, green and blue; with the half that rounds
    shared: bool  # channel 1 is luma


def _fixed(value: float) -> int:
    return round(value * _ONE)


def _rgb(*, limited: bool) -> Coefficients:
    scale = _fixed(255 / 219) if limited else _ONE
    offset = _ONE // 2 - (16 * scale if limited else 0)
    return Coefficients(scale, scale, 0, 0, scale, (offset,) * 3, shared=False)


def _ycbcr(shares: tuple[float, float], *, limited: bool) -> Coefficients:
    share_red, share_blue = shares
    share_green = 1 - share_red - share_blue
    chroma = 255 / 224 if limited else 1.0
    luma = _fixed(255 / 219) if limited else _ONE
    red = _fixed(2 * (1 - share_red) * chroma)
    blue = _fixed(2 * (1 - share_blue) * chroma)
    green_red = _fixed(-2 * (1 - share_red) * share_red / share_green * chroma)
    green_blue = _fixed(-2 * (1 - share_blue) * share_blue / share_green * chroma)
    black = _ONE // 2 - (16 * luma if limited else 0)
    offsets = (black - 128 * red, black - 128 * (green_red + green_blue), black - 128 * blue)
    return Coefficients(luma, red, green_red, green_blue, blue, offsets, shared=True)


WAYS = (
    _rgb(limited=False),
    _rgb(limited=True),
    _ycbcr(_BT709, limited=False),
    _ycbcr(_BT709, limited=True),
    _ycbcr(_BT601, limited=False),
    _ycbcr(_BT601, limited=True),
)
"""RGB, YCbCr of BT.709, of BT.601; of each the full and the limited range."""


def way_of(info: AviInfo) -> int:
    """Index into `WAYS` for a source's InfoFrame (``AviInfo()`` if it sends none).

    4:2:2 and 4:2:0 have 0, no conversion.
    """
    if info.colour_space == ColourSpace.RGB:
        return int(info.limited)
    if info.colour_space == ColourSpace.YCBCR_444:
        return 2 + 2 * info.bt601 + info.limited
    return 0


def to_full_range_rgb(pixels: Pixels, way: int) -> Pixels:
    """Convert pixels as the board does.

    Shape (..., 3) of channels 2, 1, 0 of the link (red, green, blue or Cr, Y, Cb) to the same
    shape of red, green, blue, 0 to 255.
    """
    c = WAYS[way]
    high, middle, low = (pixels[..., i].astype(np.int64) for i in range(3))
    luma = c.luma * middle
    shared = luma if c.shared else 0
    sums = (
        c.red * high + shared,
        c.green_red * high + luma + c.green_blue * low,
        c.blue * low + shared,
    )
    rgb = [(part + offset) >> FRACTION_BITS for part, offset in zip(sums, c.offsets, strict=True)]
    return np.clip(np.stack(rgb, axis=-1), 0, 255).astype(np.uint8)


def colour_package() -> str:
    rows = []
    for c in WAYS:
        numbers = (c.luma, c.red, c.green_red, c.green_blue, c.blue)
        parts = [f"to_signed({number}, {_COEFFICIENT_BITS})" for number in numbers]
        parts += [f"to_signed({offset}, {_OFFSET_BITS})" for offset in c.offsets]
        parts.append(f"'{int(c.shared)}'")
        fields = [f"{name:12} => {part}" for name, part in zip(_FIELDS, parts, strict=True)]
        rows.append("    (\n      " + ",\n      ".join(fields) + "\n    )")
    return _TEMPLATE.format(
        fraction_bits=FRACTION_BITS,
        coefficient_msb=_COEFFICIENT_BITS - 1,
        offset_msb=_OFFSET_BITS - 1,
        last=len(WAYS) - 1,
        rows=",\n".join(rows),
    )


_FIELDS = (
    *("luma", "red", "green_red", "green_blue", "blue"),
    *("red_offset", "green_offset", "blue_offset", "shared_luma"),
)
_TEMPLATE = """\
-- Coefficients of full_range_rgb; built by scripts/build_hdl.py.
--
-- Conversions to full-range RGB: from RGB, YCbCr of BT.709 and YCbCr of BT.601, each with full
-- and with limited range.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package colour_pkg is

  -- Fraction bits of the coefficients.
  constant COLOUR_FRACTION : positive := {fraction_bits};

  subtype coefficient_t is signed({coefficient_msb} downto 0);

  subtype offset_t is signed({offset_msb} downto 0);

  -- luma: channel 1 (green or Y) in green, and with shared_luma in red and blue. red, green_red:
  -- channel 2 (red or Cr) in red and green. blue, green_blue: channel 0 (blue or Cb) in blue and
  -- green. Then the offsets of the sums.

  type coefficients_t is record
    luma         : coefficient_t;
    red          : coefficient_t;
    green_red    : coefficient_t;
    green_blue   : coefficient_t;
    blue         : coefficient_t;
    red_offset   : offset_t;
    green_offset : offset_t;
    blue_offset  : offset_t;
    shared_luma  : std_logic;
  end record coefficients_t;

  subtype way_t is natural range 0 to {last};

  type ways_t is array (way_t) of coefficients_t;

  -- 0 and 1: RGB of full range, which is unchanged, and of limited range. 2 and 3: YCbCr of BT.709
  -- of full and of limited range. 4 and 5: YCbCr of BT.601, likewise. The offsets include the half
  -- that rounds.
  constant WAYS : ways_t :=
  (
{rows}
  );

end package colour_pkg;
"""
