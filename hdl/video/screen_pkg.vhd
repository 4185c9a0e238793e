-- The outputs that the screen shows besides the refocused slice, and the text over them;
-- built by scripts/build_hdl.py from plenofir.fpga.screen.board_screen.

library ieee;
use ieee.std_logic_1164.all;

package screen_pkg is

  -- What can be shown, and how depth is found; see picture_core.
  constant OUTPUTS          : string  := "r";
  constant SHARPNESS_RADIUS : natural := 1;
  constant CONFIDENCE       : natural := 0;
  constant VOTE_RADIUS      : natural := 0;
  constant COLOURS          : string  := "";

  -- The text over the picture, see text_overlay.
  constant WITH_TEXT     : boolean := false;
  constant TEXTS         : string  := "";
  constant TEXT_COLUMNS  : natural := 1;
  constant LABELS        : string  := "";
  constant LABEL_COLUMNS : natural := 2;
  constant FONT          : string  := "";

end package screen_pkg;
