-- SPDX-License-Identifier: Apache-2.0
-- One line of pixels of a character of the overlay. The texts and the font are in ROMs, made at elaboration.
--
-- Latency: 2 clocks; for the errors 1 clock. Throughput: one line of pixels each clock.
-- Equation: line = FONT[character, row]; the character is that of TEXTS, LABELS and ERROR_TEXT (one text behind the
-- other), or a decimal digit of the number of errors.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.hex_pkg.all;
use work.math_pkg.all;
use work.overlay_pkg.all;

entity glyph_lines is
  generic (
    -- For each character from the blank to the tilde: 16 lines of 8 pixels in hexadecimal.
    FONT : string;
    -- All texts, and all labels.
    TEXTS  : string;
    LABELS : string;
    -- Characters in front of the first label, and in front of the text of the errors; the largest are for 64 slices.
    FIRST_LABEL : positive range 1 to 4288;
    FIRST_ERROR : positive range 1 to 5312
  );
  port (
    clk : in    std_logic;
    -- Number of errors; must be constant while it is shown.
    errors : in    std_logic_vector(4 downto 0);
    -- The place of a character; a bit of digit selects the tens or the ones of the errors instead; the line within the
    -- character from the top.
    place : in    unsigned(bits_for(FIRST_ERROR + ERROR_COLUMNS - 1) - 1 downto 0);
    digit : in    std_logic_vector(1 downto 0);
    row   : in    unsigned(3 downto 0);
    -- The line of pixels, the first pixel in the highest bit.
    line : out   std_logic_vector(7 downto 0)
  );
end entity glyph_lines;

architecture rtl of glyph_lines is

  -- The ROMs are as long as their addresses allow, so that no address is out of range; unused words are zeros.
  subtype code_t is std_logic_vector(6 downto 0);

  type codes_t is array (natural range 0 to 2 ** place'length - 1) of code_t;

  type font_t is array (natural range 0 to 2047) of std_logic_vector(7 downto 0);

  type digits_t is array (natural range 0 to 31) of code_t;

  -- Number of a character's glyph.

  function code_of (
    text  : string;
    place : natural
  ) return std_logic_vector is
  begin

    return std_logic_vector(to_unsigned(character'pos(text(text'left + place)) - FIRST_GLYPH, 7));

  end function code_of;

  -- The content of the ROM of texts.

  function make_codes return codes_t is

    variable made : codes_t;

  begin

    -- The texts lie one behind the other, so one sum gives a place; a two-dimensional table would need a
    -- multiplication.
    made := (others => (others => '0'));

    for i in 0 to FIRST_LABEL - 1 loop

      made(i) := code_of(TEXTS, i);

    end loop;

    for i in 0 to FIRST_ERROR - FIRST_LABEL - 1 loop

      made(FIRST_LABEL + i) := code_of(LABELS, i);

    end loop;

    for i in 0 to ERROR_LETTERS - 1 loop

      made(FIRST_ERROR + i) := code_of(ERROR_TEXT, i);

    end loop;

    return made;

  end function make_codes;

  function make_font return font_t is

    variable made : font_t;

  begin

    made := (others => (others => '0'));

    -- The glyphs lie one behind the other, each with its lines from the top, so that character and line side by side
    -- are the address.
    for i in 0 to GLYPHS * GLYPH_ROWS - 1 loop

      made(i) := hex_byte(FONT, 2 * i);

    end loop;

    return made;

  end function make_font;

  -- The tens, or the ones, of each number of errors.

  function make_digits (
    of_tens : boolean
  ) return digits_t is

    variable made  : digits_t;
    variable digit : natural range 0 to 9;

  begin

    -- The table has all values of five bits, so no division is left in the logic: two digits hold 0 to 31.
    for i in 0 to 31 loop

      digit := i mod 10;

      if of_tens then
        digit := i / 10;
      end if;

      made(i) := std_logic_vector(to_unsigned(character'pos('0') - FIRST_GLYPH + digit, 7));

    end loop;

    return made;

  end function make_digits;

  constant CODE_ROM : codes_t  := make_codes;
  constant FONT_ROM : font_t   := make_font;
  constant TENS_OF  : digits_t := make_digits(true);
  constant ONES_OF  : digits_t := make_digits(false);

  -- Digits of the errors, one of which may replace the character that was read.
  signal tens    : code_t                       := (others => '0');
  signal ones    : code_t                       := (others => '0');
  signal read_1  : code_t                       := (others => '0');
  signal digit_1 : std_logic_vector(1 downto 0) := "00";
  signal row_1   : unsigned(3 downto 0)         := (others => '0');
  signal code_1  : code_t;

begin

  -- Each ROM has a register.
  read_code : process (clk) is
  begin

    if rising_edge(clk) then
      read_1 <= CODE_ROM(to_integer(place));
    end if;

  end process read_code;

  -- The digits wait as long as the character that they replace.
  follow : process (clk) is
  begin

    if rising_edge(clk) then
      tens    <= TENS_OF(to_integer(unsigned(errors)));
      ones    <= ONES_OF(to_integer(unsigned(errors)));
      digit_1 <= digit;
      row_1   <= row;
    end if;

  end process follow;

  code_1 <= tens when digit_1(1) = '1' else
            ones when digit_1(0) = '1' else
            read_1;

  read_line : process (clk) is
  begin

    if rising_edge(clk) then
      line <= FONT_ROM(to_integer(unsigned(code_1) & row_1));
    end if;

  end process read_line;

end architecture rtl;
