-- The outputs that the screen shows besides the refocused slice, and the text over them;
-- built by scripts/build_hdl.py from plenofir.fpga.screen.board_screen.

library ieee;
use ieee.std_logic_1164.all;

package screen_pkg is

  -- Generics of picture_core: the possible outputs, and how depth is found.
  constant OUTPUTS          : string  := "r";
  constant SHARPNESS_RADIUS : natural := 1;
  constant CONFIDENCE       : natural := 0;
  constant VOTE_RADIUS      : natural := 0;
  constant COLOURS          : string  := "";
  constant SHARP_TOO        : boolean := false;

  -- Generics of text_overlay: the text over the picture.
  constant WITH_TEXT     : boolean := false;
  constant TEXTS         : string  := "";
  constant TEXT_COLUMNS  : natural := 1;
  constant LABELS        : string  := "";
  constant LABEL_COLUMNS : natural := 2;
  constant FONT          : string  := "";

end package screen_pkg;
