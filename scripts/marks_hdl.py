# SPDX-License-Identifier: Apache-2.0
"""The VHDL package of the marked first line, from the constants of plenofir.fpga.hdmi.marks."""

from plenofir.fpga.hdmi import marks

MARKS_PACKAGE = "marks_pkg"
"""Name of the VHDL package."""


def marks_package() -> str:
    def colour(values: tuple[int, int, int]) -> str:
        return 'x"' + "".join(f"{value:02X}" for value in values[::-1]) + '"'

    def unsigned(values: tuple[int, int, int]) -> str:
        return ", ".join(f'x"{value:02X}"' for value in values)

    return _TEMPLATE.format(
        begins=unsigned(marks.BEGINS),
        steps=unsigned(marks.STEPS),
        near=marks.NEAR,
        equal=colour(marks.EQUAL_BAR),
        changed=colour(marks.CHANGED_BAR),
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
