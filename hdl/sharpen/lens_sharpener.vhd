-- SPDX-License-Identifier: Apache-2.0
-- Sharpens refocused sums with three taps, one micro lens apart. This removes the blur that the operator adds for
-- values of a between integers.
--
-- The sharpener stands between the sums of an engine and their division, so that the result is rounded only once.
-- Columns come first, because their memory then holds the unchanged sums. A tap outside the picture counts as the
-- pixel itself.
--
-- The sharpened sum is rounded to an integer in such a way that its quotient equals that of the exact sum: round(n /
-- (q * d)) = round(floor((n + h) / q) / d), with h = q / 2 for odd d, else 0.
--
-- Latency: M lines, divide_up(M, pixels of a token) tokens and SHARPEN_LATENCY clocks. Throughput: one token each
-- clock; one column comes at least PARTIAL_SUM_LOOP clocks apart.
-- Equation: t(k) = (2**s + 2 * side) * S(k) - side * (S(k - M) + S(k + M)) along columns, then along rows;
--   out = t / 4**s, rounded as above and limited to 0 .. sum_max.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.core_pkg.all;
use work.token_pkg.all;
use work.sharpen_pkg.all;

entity lens_sharpener is
  generic (
    -- The core whose sums are sharpened.
    CORE : core_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token. Its fields of the line are read with the line's first token.
    token : in    token_t;
    -- Which pixels a line's last token has.
    line_end : in    std_logic_vector(CORE.pixels - 1 downto 0) := (others => '1');
    -- The sums of a token, channel 0 of pixel 0 in the low bits.
    sums : in    std_logic_vector(CORE.pixels * CORE.channels * final_sum_bits(CORE) - 1 downto 0);
    -- Token and sharpened sums. The fields of the line come with each of its tokens.
    out_token : out   token_t;
    out_sums  : out   std_logic_vector(CORE.pixels * CORE.channels * final_sum_bits(CORE) - 1 downto 0)
  );
end entity lens_sharpener;

architecture rtl of lens_sharpener is

  constant BUILD : sharpen_build_t := sharpener_of(CORE);

  signal column_token     : token_t;
  signal column_sharpened : std_logic;
  signal column_values    : std_logic_vector(CORE.pixels * CORE.channels * BUILD.tapped_bits - 1 downto 0);

begin

  columns : entity work.sharpen_columns
    generic map (
      BUILD => BUILD
    )
    port map (
      clk           => clk,
      reset         => reset,
      token         => token,
      sums          => sums,
      out_token     => column_token,
      out_sharpened => column_sharpened,
      out_values    => column_values
    );

  rows : entity work.sharpen_rows
    generic map (
      BUILD => BUILD
    )
    port map (
      clk       => clk,
      reset     => reset,
      token     => column_token,
      line_end  => line_end,
      sharpened => column_sharpened,
      values    => column_values,
      out_token => out_token,
      out_sums  => out_sums
    );

end architecture rtl;
