# SPDX-License-Identifier: Apache-2.0
"""The marked first line by which a board tells whether a picture arrives as it was made.

A place of the line has the colour ``BEGINS + place * STEPS`` modulo 256: neighbours differ by much,
so a scaler spoils it, and each channel takes all of its 256 values, so that no change of colours is
missed. `mark` writes it, `judge` is the golden model of ``hdl/video/picture_marks.vhd``, and
``scripts/build_hdl.py`` makes ``hdl/video/marks_pkg.vhd`` of the constants.
"""

import numpy as np

from plenofir.refocus.operator import Image

MARKS_PACKAGE = "marks_pkg"
"""Name of the VHDL package."""
BEGINS = (11, 85, 170)
STEPS = (37, 101, 151)
NEAR = 31
"""Largest difference of a channel that counts as a changed colour, not as another place: limited
range is 20 at most."""
EQUAL_BAR = (0, 160, 0)
CHANGED_BAR = (200, 0, 0)
"""Colours of the bar that the board draws."""


def mark_line(columns: int) -> Image:
    """Make the marked line of shape (columns, 3)."""
    places = np.arange(columns)[:, None]
    line: Image = ((np.array(BEGINS) + places * np.array(STEPS)) % 256).astype(np.uint8)
    return line


def mark(picture: Image) -> Image:
    """Copy a picture of shape (rows, columns, 3), its first line marked."""
    marked = picture.copy()
    marked[0] = mark_line(picture.shape[1])
    return marked


def judge(line: Image) -> int:
    """The board's result for a first line: 0 no marks, 1 other colours, 2 as it was made."""
    apart = np.abs(line.astype(int) - mark_line(len(line))).max(axis=1)
    if not apart.any():
        return 2
    return int(2 * int((apart <= NEAR).sum()) > len(line))


def with_bar(picture: Image, marks: int, lines: int) -> Image:
    """Copy a picture that goes out, with the bar over its first lines."""
    drawn = picture.copy()
    if marks:
        drawn[:lines] = (CHANGED_BAR, EQUAL_BAR)[marks - 1]
    return drawn


def marks_package() -> str:
    def colour(values: tuple[int, int, int]) -> str:
        return 'x"' + "".join(f"{value:02X}" for value in values[::-1]) + '"'

    def unsigned(values: tuple[int, int, int]) -> str:
        return ", ".join(f'x"{value:02X}"' for value in values)

    return _TEMPLATE.format(
        begins=unsigned(BEGINS),
        steps=unsigned(STEPS),
        near=NEAR,
        equal=colour(EQUAL_BAR),
        changed=colour(CHANGED_BAR),
    )


_TEMPLATE = """\
-- The marked first line of a picture, see picture_marks; built by scripts/build_hdl.py from
-- plenofir.fpga.hdmi.marks.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.video_pkg.all;

package marks_pkg is

  -- Red, green, blue.
  type mark_colour_t is array (0 to 2) of unsigned(7 downto 0);

  -- Colour of the first place, and what it differs by from place to place.
  constant MARK_BEGINS : mark_colour_t := ({begins});
  constant MARK_STEPS  : mark_colour_t := ({steps});

  -- Largest difference of a channel that is a changed colour.
  constant NEAR : natural := {near};

  -- Colours of the bar: as it was made; with other colours.
  constant EQUAL_BAR   : pixel_t := {equal};
  constant CHANGED_BAR : pixel_t := {changed};

end package marks_pkg;
"""
