-- The light field that is kept on the chip, two colours a micro image; built by
-- scripts/build_hdl.py from plenofir.fpga.screen.chip_light_field.

library ieee;
use ieee.std_logic_1164.all;

package stored_pkg is

  -- Whether a light field is stored; pixels of a micro image in each dimension; micro
  -- images in each dimension.
  constant WITH_STORED      : boolean  := false;
  constant STORED_SIZE      : positive := 1;
  constant STORED_LENSES    : positive := 1;
  constant STORED_LENS_ROWS : positive := 1;

  -- A micro image: a bit for each pixel, the first one lowest, that selects its colour;
  -- then both colours, each of 5 bits red, 5 bits green, 4 bits blue.
  subtype stored_word_t is std_logic_vector(28 downto 0);

  type stored_words_t is array (natural range 0 to 0) of stored_word_t;

  constant STORED_WORDS : stored_words_t :=
  (
    0 => "00000000000000000000000000000"
  );

end package stored_pkg;
