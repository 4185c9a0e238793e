-- SPDX-License-Identifier: Apache-2.0
-- From the sums of an engine to pixels, for every engine: sharpening if a slice has a weight, then the division.
--
-- The sharpener is a component, so that a project without one needs no file of it. Slices with boxes that differ have
-- divisors that differ, so each sum is divided by a weight, that of its slice.
--
-- Latency: that of lens_sharpener with sharpening, and scaler_latency clocks with exact arithmetic. Throughput: one
-- token each clock.
-- Equation: that of lens_sharpener, then that of result_scaler.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.all;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.core_pkg.all;
use work.token_pkg.all;

entity sum_tail is
  generic (
    -- The core whose sums become pixels.
    CORE : core_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The token of each row behind an engine, and its sums: row 0, then pixel 0, slice 0, channel 0 in the low bits.
    tokens : in    tokens_t(0 to CORE.rows - 1);
    sums   : in    std_logic_vector(CORE.rows * row_sums_bits(CORE) - 1 downto 0);
    -- Which pixels a line's last token has; constant while a frame is under way.
    line_end : in    std_logic_vector(CORE.pixels - 1 downto 0);
    -- The weights of a token's pixels (from border_weights), in the clock of their sums.
    weights : in    std_logic_vector(weights_bits(CORE) - 1 downto 0);
    -- The result of each row, and its pixels, in the order of the sums.
    results     : out   results_t(0 to CORE.rows - 1);
    result_data : out   std_logic_vector(CORE.rows * result_bits(CORE) - 1 downto 0)
  );
end entity sum_tail;

architecture rtl of sum_tail is

  component lens_sharpener is
    generic (
      CORE : core_t
    );
    port (
      clk       : in    std_logic;
      reset     : in    std_logic;
      token     : in    token_t;
      line_end  : in    std_logic_vector(CORE.pixels - 1 downto 0);
      sums      : in    std_logic_vector(CORE.pixels * CORE.channels * final_sum_bits(CORE) - 1 downto 0);
      out_token : out   token_t;
      out_sums  : out   std_logic_vector(CORE.pixels * CORE.channels * final_sum_bits(CORE) - 1 downto 0)
    );
  end component lens_sharpener;

  constant SUMS_BITS   : positive := row_sums_bits(CORE);
  constant PIXELS_BITS : positive := result_bits(CORE);

  -- Number of a slice in bits, and bits of a weight.
  constant SLICE_BITS   : positive := bits_for(CORE.geometry.slices - 1);
  constant DIVISOR_BITS : positive := larger(weight_bits(CORE), 1);

  type divisors_t is array (natural range 0 to 2 ** SLICE_BITS - 1) of std_logic_vector(DIVISOR_BITS - 1 downto 0);

  -- The divisor of each slice.
  function all_divisors return divisors_t is

    variable divisors : divisors_t;
    variable divisor  : positive;

  begin

    for s in divisors_t'range loop

      divisor := final_divisor(CORE.arithmetic);

      if s < CORE.geometry.slices then
        divisor := CORE.geometry.boxes(s) ** (2 * CORE.arithmetic.passes);
      end if;

      divisors(s) := std_logic_vector(to_unsigned(divisor, DIVISOR_BITS));

    end loop;

    return divisors;

  end function all_divisors;

  -- Tokens and sums in front of the division.
  signal last_tokens : tokens_t(0 to CORE.rows - 1);
  signal last_sums   : std_logic_vector(CORE.rows * SUMS_BITS - 1 downto 0);

begin

  plain : if not CORE.sharpens generate
    last_tokens <= tokens;
    last_sums   <= sums;
  end generate plain;

  sharp : if CORE.sharpens generate

    sharpener : component lens_sharpener
      generic map (
        CORE => CORE
      )
      port map (
        clk       => clk,
        reset     => reset,
        token     => tokens(0),
        line_end  => line_end,
        sums      => sums,
        out_token => last_tokens(0),
        out_sums  => last_sums
      );

  end generate sharp;

  row : for r in 0 to CORE.rows - 1 generate

    signal summed  : result_t;
    signal divisor : std_logic_vector(weights_bits(CORE) - 1 downto 0);

  begin

    summed <= result_of(last_tokens(r));

    given : if CORE.normalised or not weighted(CORE) generate
      divisor <= weights;
    end generate given;

    own_divisor : if not CORE.normalised and weighted(CORE) generate

      constant DIVISORS : divisors_t := all_divisors;

    begin

      choose_divisor : process (last_tokens) is

        variable slice : unsigned(SLICE_BITS - 1 downto 0);

      begin

        for i in 0 to slices_at_once(CORE) * CORE.pixels - 1 loop

          slice := last_tokens(r).slice(SLICE_BITS - 1 downto 0);

          -- If all slices come at once, the token has none, and those of each pixel lie side by side.
          if slices_at_once(CORE) > 1 then
            slice := to_unsigned(i mod CORE.geometry.slices, SLICE_BITS);
          end if;

          divisor((i + 1) * DIVISOR_BITS - 1 downto i * DIVISOR_BITS) <= DIVISORS(to_integer(slice));

        end loop;

      end process choose_divisor;

    end generate own_divisor;

    scale : entity work.result_scaler
      generic map (
        EXACT        => CORE.arithmetic.exact,
        LANES        => slices_at_once(CORE) * CORE.pixels * CORE.channels,
        PIXEL_BITS   => CORE.arithmetic.pixel_bits,
        DIVISOR      => final_divisor(CORE.arithmetic),
        WEIGHT_COUNT => slices_at_once(CORE) * CORE.pixels,
        WEIGHT_BITS  => weight_bits(CORE)
      )
      port map (
        clk     => clk,
        reset   => reset,
        result  => summed,
        sums    => last_sums((r + 1) * SUMS_BITS - 1 downto r * SUMS_BITS),
        weights => divisor,
        scaled  => results(r),
        pixels  => result_data((r + 1) * PIXELS_BITS - 1 downto r * PIXELS_BITS)
      );

  end generate row;

end architecture rtl;
