-- SPDX-License-Identifier: Apache-2.0
-- Rotates words by a multiple of a step.
--
-- Latency: 0 clocks. Throughput: every clock.
-- Equation: rotated word i = word (i + STEP * amount) mod WORDS.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity rotate_words is
  generic (
    -- Number of words.
    WORDS : positive;
    -- A divisor of it.
    STEP : positive;
    -- Bits of a word.
    WIDTH : positive
  );
  port (
    -- How many steps.
    amount : in    natural range 0 to larger(WORDS / STEP - 1, 1);
    -- The words, word 0 in the low bits.
    words_in : in    std_logic_vector(WORDS * WIDTH - 1 downto 0);
    rotated  : out   std_logic_vector(WORDS * WIDTH - 1 downto 0)
  );
end entity rotate_words;

architecture rtl of rotate_words is

  -- A multiplexer of two for each bit of the amount, so log2 levels instead of one choice of all.
  constant AMOUNT_BITS : positive := bits_for(larger(WORDS / STEP - 1, 1));

  type levels_t is array (natural range 0 to AMOUNT_BITS) of std_logic_vector(WORDS * WIDTH - 1 downto 0);

  signal bits   : unsigned(AMOUNT_BITS - 1 downto 0);
  signal levels : levels_t;

begin

  bits      <= to_unsigned(amount, AMOUNT_BITS);
  levels(0) <= words_in;

  level : for l in 0 to AMOUNT_BITS - 1 generate

    -- By 2 ** l steps or not.
    word : for i in 0 to WORDS - 1 generate

      constant FROM : natural := (i + STEP * 2 ** l) mod WORDS;

    begin

      levels(l + 1)((i + 1) * WIDTH - 1 downto i * WIDTH) <= levels(l)((FROM + 1) * WIDTH - 1 downto FROM * WIDTH)
                                                             when bits(l) = '1' else
                                                             levels(l)((i + 1) * WIDTH - 1 downto i * WIDTH);

    end generate word;

  end generate level;

  rotated <= levels(AMOUNT_BITS);

end architecture rtl;
