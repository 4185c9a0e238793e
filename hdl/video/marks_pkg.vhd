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
  constant MARK_BEGINS : mark_colour_t := (x"0B", x"55", x"AA");
  constant MARK_STEPS  : mark_colour_t := (x"25", x"65", x"97");

  -- Largest difference of a channel that is a changed colour.
  constant NEAR : natural := 31;

  -- Colours of the bar: as it was made; with other colours.
  constant EQUAL_BAR   : pixel_t := x"00A000";
  constant CHANGED_BAR : pixel_t := x"0000C8";

end package marks_pkg;
