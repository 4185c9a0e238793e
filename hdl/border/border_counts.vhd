-- SPDX-License-Identifier: Apache-2.0
-- Counts the views that reach each output, by refocusing a picture of ones. border_weights turns these counts into
-- weights.
--
--   token -> moving sums of ones over lines -> moving sums of ones over tokens -> product of both counts
--
-- The weight of an output is the product of a count for its line and a count for its place in the line, so each
-- dimension needs one moving sum instead of a picture. The stages are those of the moving sums themselves, fed with
-- ones. Short lines and frames, lines and frames without a gap, and changes of the slice therefore need no cases of
-- their own.
--
-- Latency: total_delay lines, total_delay tokens (with several pixels rows_delay) and border_latency clocks.
-- Throughput: one token each clock. Lines and frames must be longer than the delays; empty tokens and flush lines make
-- up for what is missing.
-- Equation: weight = refocusing sum of a frame of ones.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.core_pkg.all;
use work.token_pkg.all;
use work.border_pkg.all;

entity border_counts is
  generic (
    -- The core whose views are counted.
    CORE : core_t;
    -- The slice, if it is always the same; -1: the slice of the token.
    FIXED_SLICE : integer := -1
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token; and which pixels a line's last token has.
    token    : in    token_t;
    line_end : in    std_logic_vector(CORE.pixels - 1 downto 0);
    -- The weights of a token's pixels, pixel 0 in the low bits; those behind a line's last pixel have no meaning.
    weights : out   std_logic_vector(CORE.pixels * weight_bits(CORE) - 1 downto 0)
  );
end entity border_counts;

architecture rtl of border_counts is

  constant GEOMETRY     : geometry_t                       := CORE.geometry;
  constant M            : positive                         := GEOMETRY.micro_image_size;
  constant P            : positive                         := CORE.pixels;
  constant PASSES       : positive                         := CORE.arithmetic.passes;
  constant COUNT_BITS   : positive                         := bits_for(largest_count(M, PASSES));
  constant PRODUCT_BITS : positive                         := weight_bits(CORE);
  constant ONES         : std_logic_vector(P - 1 downto 0) := (others => '1');

  type down_counts_t is array (natural range 0 to PASSES) of std_logic_vector(COUNT_BITS - 1 downto 0);

  type across_counts_t is array (natural range 0 to PASSES) of std_logic_vector(P * COUNT_BITS - 1 downto 0);

  -- Signals in front of each pass (by its number) and behind the last one. In the passes over tokens, each token
  -- carries the count of its line.
  signal line_token : tokens_t(0 to PASSES);
  signal down       : down_counts_t;
  signal row_token  : tokens_t(0 to PASSES);
  signal row_down   : down_counts_t;
  signal across     : across_counts_t;

begin

  --------------------------------------------------------------------------------------------------
  -- Passes over lines: a line is a step.

  line_token(0) <= token;

  down(0) <= std_logic_vector(to_unsigned(1, COUNT_BITS));

  line_pass : for i in 0 to PASSES - 1 generate

    constant IN_BITS  : positive := bits_for(largest_count(M, i));
    constant OUT_BITS : positive := bits_for(largest_count(M, i + 1));

  begin

    stage : entity work.moving_sum_stage
      generic map (
        GEOMETRY    => pass_geometry(GEOMETRY, i),
        SIZES       => exact_pass(largest_count(M, i), M),
        FIXED_SLICE => choose(i = 0, FIXED_SLICE, - 1),
        -- Each line counts as one; the line's first token carries the count.
        COLUMNS => true
      )
      port map (
        clk       => clk,
        reset     => reset,
        token     => line_token(i),
        data      => down(i)(IN_BITS - 1 downto 0),
        out_token => line_token(i + 1),
        out_data  => down(i + 1)(OUT_BITS - 1 downto 0)
      );

  end generate line_pass;

  --------------------------------------------------------------------------------------------------
  -- Passes over tokens: a token is a step.

  row_token(0) <= line_token(PASSES);
  row_down(0)  <= down(PASSES);

  -- Each pixel of a token counts as one; those behind a line's end do not count.
  across(0)(P - 1 downto 0) <= in_line(ONES, 1, row_token(0), line_end);

  across_pass : for i in 0 to PASSES - 1 generate

    constant SIZES : pass_t := exact_pass(largest_count(M, i), M);

  begin

    stage : entity work.row_pass
      generic map (
        GEOMETRY    => pass_geometry(GEOMETRY, i),
        SIZES       => SIZES,
        FIXED_SLICE => choose(i = 0, FIXED_SLICE, - 1),
        PIXELS      => P,
        TAG_BITS    => COUNT_BITS
      )
      port map (
        clk       => clk,
        reset     => reset,
        token     => row_token(i),
        data      => across(i)(P * SIZES.data_bits - 1 downto 0),
        tag       => row_down(i),
        line_end  => line_end,
        out_token => row_token(i + 1),
        out_data  => across(i + 1)(P * SIZES.result_bits - 1 downto 0),
        out_tag   => row_down(i + 1)
      );

  end generate across_pass;

  multiply : process (clk) is

    variable of_line  : unsigned(COUNT_BITS - 1 downto 0);
    variable of_place : unsigned(COUNT_BITS - 1 downto 0);
    variable weight   : unsigned(PRODUCT_BITS - 1 downto 0);

  begin

    if rising_edge(clk) then
      -- The token carries its line's count, and the last pass gives the count of its place in the line.
      of_line := unsigned(row_down(PASSES));

      for j in 0 to P - 1 loop

        of_place := unsigned(across(PASSES)((j + 1) * COUNT_BITS - 1 downto j * COUNT_BITS));
        weight   := resize(of_line * of_place, PRODUCT_BITS);

        weights((j + 1) * PRODUCT_BITS - 1 downto j * PRODUCT_BITS) <= std_logic_vector(weight);

      end loop;

    end if;

  end process multiply;

end architecture rtl;
