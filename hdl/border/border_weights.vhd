-- SPDX-License-Identifier: Apache-2.0
-- The weights that divide the sums of an engine, so that a picture does not get darker towards its border.
--
--   token -> moving sums of ones over lines -> moving sums of ones over tokens -> product of both counts
--
-- The weight of an output is the number of views that reach it: the product of a count for its line and a count for its
-- place in the line, so each dimension needs one moving sum instead of a picture. The stages are those of the moving
-- sums themselves, fed with ones. Short lines and frames, lines and frames without a gap, and changes of the slice
-- therefore need no cases of their own.
--
-- The entity stands beside an engine. Tokens pass through it to the engine, delayed so that the weights meet the sums.
--
-- Latency: border_wait clocks for tokens; weights come sum_clocks behind the tokens that the engine gets, in the
-- clock of the sums of the same pixels. Counting takes total_delay lines, total_delay tokens (with several pixels
-- rows_delay) and border_latency clocks.
-- Throughput: one token each clock. Lines and frames must be longer than the delays; empty tokens and flush lines make
-- up for what is missing.
-- Equation: weight = refocusing sum of a frame of ones: the product of the numbers of views that reach the output along
-- rows and along columns, each view weighted by the interpolation.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.all;
use work.delay_pkg.all;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.core_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_lanes_pkg.all;
use work.token_pkg.all;
use work.border_pkg.all;

entity border_weights is
  generic (
    -- The core whose sums are divided.
    CORE : core_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token, its data; and which pixels a line's last token has.
    token      : in    token_t;
    token_data : in    std_logic_vector(row_bits(CORE) - 1 downto 0);
    line_end   : in    std_logic_vector(CORE.pixels - 1 downto 0);
    -- Token and data for the engine.
    engine_token : out   token_t;
    engine_data  : out   std_logic_vector(row_bits(CORE) - 1 downto 0);
    -- The weights, pixel 0 in the low bits; all pixels of slice 0, then those of the other slices.
    weights : out   std_logic_vector(weights_bits(CORE) - 1 downto 0)
  );
end entity border_weights;

architecture rtl of border_weights is

  -- Projects of one pixel a token need no file of lane_stage, so it is a component.
  component lane_stage is
    generic (
      BUILD    : lanes_build_t;
      SUM_BITS : positive;
      TAG_BITS : positive
    );
    port (
      clk       : in    std_logic;
      reset     : in    std_logic;
      token     : in    token_t;
      data      : in    std_logic_vector(BUILD.pixels * BUILD.channels * BUILD.pixel_bits - 1 downto 0);
      tag       : in    std_logic_vector(TAG_BITS - 1 downto 0) := (others => '0');
      line_end  : in    std_logic_vector(BUILD.pixels - 1 downto 0);
      out_token : out   token_t;
      out_data  : out   std_logic_vector(BUILD.pixels * BUILD.channels * SUM_BITS - 1 downto 0);
      out_tag   : out   std_logic_vector(TAG_BITS - 1 downto 0)
    );
  end component lane_stage;

  constant GEOMETRY     : geometry_t                       := CORE.geometry;
  constant BOX          : positive                         := CORE.arithmetic.box;
  constant P            : positive                         := CORE.pixels;
  constant PASSES       : positive                         := CORE.arithmetic.passes;
  constant COUNT_BITS   : positive                         := bits_for(largest_count(BOX, PASSES));
  constant PRODUCT_BITS : positive                         := weight_bits(CORE);
  constant ONES         : std_logic_vector(P - 1 downto 0) := (others => '1');

  -- Slices that come out side by side; the weights of a token for one of them; clocks that tokens and weights wait.
  constant SLICES : positive := slices_at_once(CORE);
  constant BITS   : positive := P * PRODUCT_BITS;
  constant AHEAD  : natural  := border_wait(CORE);
  constant BEHIND : natural  := AHEAD + CORE.plan.sum_clocks - border_latency(CORE);

  type down_counts_t is array (natural range 0 to PASSES) of std_logic_vector(COUNT_BITS - 1 downto 0);

  type across_counts_t is array (natural range 0 to PASSES) of std_logic_vector(P * COUNT_BITS - 1 downto 0);

  -- The weights as they are counted, and on their way to the sums.
  signal counted : std_logic_vector(SLICES * BITS - 1 downto 0);
  signal waiting : std_logic_vector(delay_bits(SLICES * BITS, BEHIND) - 1 downto 0) := (others => '0');

begin

  slice : for s in 0 to SLICES - 1 generate

    -- The slice, if it is always the same; -1: the slice of the token.
    constant FIXED_SLICE : integer := choose(SLICES > 1, s, - 1);

    -- Signals in front of each pass (by its number) and behind the last one. In the passes over tokens, each token
    -- carries the count of its line.
    signal line_token : tokens_t(0 to PASSES);
    signal down       : down_counts_t;
    signal row_token  : tokens_t(0 to PASSES);
    signal row_down   : down_counts_t;
    signal across     : across_counts_t;
    signal products   : std_logic_vector(BITS - 1 downto 0);

  begin

    -- Passes over lines: a line is a step.
    line_token(0) <= token;

    down(0) <= std_logic_vector(to_unsigned(1, COUNT_BITS));

    line_pass : for i in 0 to PASSES - 1 generate

      constant IN_BITS  : positive := bits_for(largest_count(BOX, i));
      constant OUT_BITS : positive := bits_for(largest_count(BOX, i + 1));

    begin

      stage : entity work.moving_sum_stage
        generic map (
          GEOMETRY    => pass_geometry(GEOMETRY, i),
          SIZES       => exact_pass(largest_count(BOX, i), BOX),
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

    -- Passes over tokens: a token is a step.
    row_token(0) <= line_token(PASSES);
    row_down(0)  <= down(PASSES);

    -- Each pixel of a token counts as one; those behind a line's end do not count.
    across(0)(P - 1 downto 0) <= in_line(ONES, 1, row_token(0), line_end);

    across_pass : for i in 0 to PASSES - 1 generate

      constant SIZES      : pass_t  := exact_pass(largest_count(BOX, i), BOX);
      constant PASS_SLICE : integer := choose(i = 0, FIXED_SLICE, - 1);

    begin

      one_pixel : if P = 1 generate

        stage : entity work.moving_sum_stage
          generic map (
            GEOMETRY    => pass_geometry(GEOMETRY, i),
            SIZES       => SIZES,
            FIXED_SLICE => PASS_SLICE,
            TAG_BITS    => COUNT_BITS
          )
          port map (
            clk       => clk,
            reset     => reset,
            token     => row_token(i),
            data      => across(i)(SIZES.data_bits - 1 downto 0),
            tag       => row_down(i),
            out_token => row_token(i + 1),
            out_data  => across(i + 1)(SIZES.result_bits - 1 downto 0),
            out_tag   => row_down(i + 1)
          );

      end generate one_pixel;

      several_pixels : if P > 1 generate

        stage : component lane_stage
          generic map (
            BUILD    => to_lanes(slice_geometry(pass_geometry(GEOMETRY, i), PASS_SLICE), P, 1, SIZES.data_bits),
            SUM_BITS => SIZES.result_bits,
            TAG_BITS => COUNT_BITS
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

      end generate several_pixels;

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

          products((j + 1) * PRODUCT_BITS - 1 downto j * PRODUCT_BITS) <= std_logic_vector(weight);

        end loop;

      end if;

    end process multiply;

    counted((s + 1) * BITS - 1 downto s * BITS) <= products;

  end generate slice;

  -- Either AHEAD or BEHIND is zero.
  weights <= delayed(waiting, counted, BEHIND);

  delay_weights : process (clk) is
  begin

    if rising_edge(clk) then
      waiting <= moved_on(waiting, counted);
    end if;

  end process delay_weights;

  -- If the engine is slower than the weights, weights wait (BEHIND); otherwise tokens wait (AHEAD).
  pass : if AHEAD = 0 generate
    engine_token <= token;
    engine_data  <= token_data;
  end generate pass;

  wait_for_weights : if AHEAD > 0 generate

    type data_t is array (natural range <>) of std_logic_vector(row_bits(CORE) - 1 downto 0);

    signal token_at : tokens_t(1 to AHEAD) := (others => NO_TOKEN);
    signal data_at  : data_t(1 to AHEAD)   := (others => (others => '0'));

  begin

    move : process (clk) is
    begin

      if rising_edge(clk) then
        token_at(1) <= token;
        data_at(1)  <= token_data;

        for i in 2 to AHEAD loop

          token_at(i) <= token_at(i - 1);
          data_at(i)  <= data_at(i - 1);

        end loop;

        if reset = '1' then

          for i in 1 to AHEAD loop

            -- Only strobe needs a reset, because it validates the other bits and the pixels.
            token_at(i).strobe <= '0';

          end loop;

        end if;
      end if;

    end process move;

    engine_token <= token_at(AHEAD);
    engine_data  <= data_at(AHEAD);

  end generate wait_for_weights;

end architecture rtl;
