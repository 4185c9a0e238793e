-- SPDX-License-Identifier: Apache-2.0
-- The arithmetic of a focal stack: all slices of each pixel, from one column memory.
--
-- Columns come first, so that the memory holds the pixels as they come and the slices share it. Behind it each slice
-- has moving sums of its own, over columns and then over rows, and one division at the end.
--
-- Latency: D lines, D + 1 tokens and stack_array_latency clocks, D = output_delay. Throughput: one pixel of all
--   channels and slices each clock, in lines of D + 1 tokens at least; frames begin D + 1 lines apart at least, and a
--   multiple of M lines; empty tokens and lines must make up for what is missing.
-- Equation: as fir_array, for each slice; latency with weights: scaler_latency for DIVIDE_LATENCY.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.moving_sum_pkg.all;
use work.focal_stack_pkg.all;
use work.token_pkg.all;

entity stack_array is
  generic (
    -- M: pixels of a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- The slices: a' of each in pixels, with blanks in between.
    SHIFTS : string;
    -- Whether the picture stays put from slice to slice.
    CENTRED : boolean := true;
    -- Longest line in pixels.
    MAX_COLUMNS : positive := 2048;
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3 := 1;
    -- Width of a channel.
    PIXEL_BITS : positive range 1 to 16 := 8;
    -- Width of the weights that divide the sums, exact ones; 0: M * M divides them.
    WEIGHT_BITS : natural range 0 to 31 := 0
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token, and the pixel of its channels.
    token      : in    token_t;
    token_data : in    std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
    -- The weight of each slice (border_weights), with its sums.
    weights : in    std_logic_vector(slice_count(SHIFTS) * larger(WEIGHT_BITS, 1) - 1 downto 0);
    -- The result of a pixel, and its pixels, slice 0 and channel 0 in the low bits.
    result      : out   result_t;
    result_data : out   std_logic_vector(slice_count(SHIFTS) * CHANNELS * PIXEL_BITS - 1 downto 0)
  );
end entity stack_array;

architecture rtl of stack_array is

  constant GEOMETRY : geometry_t := geometry_of("stack_array", MICRO_IMAGE_SIZE, SHIFTS, CENTRED);

  constant REFUSED : boolean := not (takes_stack("stack_array", GEOMETRY, MAX_COLUMNS, CHANNELS, PIXEL_BITS) and
                                     takes_weights("stack_array", WEIGHT_BITS,
                                                    (true, MICRO_IMAGE_SIZE, PIXEL_BITS, 0, 0, 1), 1, false));

  constant M          : positive := MICRO_IMAGE_SIZE;
  constant SLICES     : positive := GEOMETRY.slices;
  constant PIXEL_MAX  : positive := 2 ** PIXEL_BITS - 1;
  constant COLUMN_MAX : positive := M * PIXEL_MAX;
  constant SUM_MAX    : positive := M * COLUMN_MAX;

  -- Lanes of all channels: column sums, results, pixels.
  constant COLUMN_BITS : positive := CHANNELS * bits_for(COLUMN_MAX);
  constant SUM_BITS    : positive := bits_for(SUM_MAX);

  signal column_token : token_t;
  signal column_data  : std_logic_vector(SLICES * COLUMN_BITS - 1 downto 0);
  signal row_token    : tokens_t(0 to SLICES - 1);
  signal summed       : result_t;
  signal sums         : std_logic_vector(SLICES * CHANNELS * SUM_BITS - 1 downto 0);

begin

  columns : entity work.stack_columns
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFTS           => SHIFTS,
      CENTRED          => CENTRED,
      COLUMNS          => MAX_COLUMNS,
      LANES            => CHANNELS,
      LANE_BITS        => PIXEL_BITS
    )
    port map (
      clk       => clk,
      reset     => reset,
      token     => token,
      data      => token_data,
      out_token => column_token,
      out_data  => column_data
    );

  slice : for s in 0 to SLICES - 1 generate

    rows : entity work.moving_sum_stage
      generic map (
        MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
        SHIFTS           => SHIFTS,
        CENTRED          => CENTRED,
        FIXED_SLICE      => s,
        LANES            => CHANNELS,
        DATA_BITS        => bits_for(COLUMN_MAX),
        PRODUCT_MAX      => COLUMN_MAX,
        SUM_MAX          => SUM_MAX,
        RESULT_BITS      => SUM_BITS
      )
      port map (
        clk       => clk,
        reset     => reset,
        token     => column_token,
        data      => column_data((s + 1) * COLUMN_BITS - 1 downto s * COLUMN_BITS),
        out_token => row_token(s),
        out_data  => sums((s + 1) * CHANNELS * SUM_BITS - 1 downto s * CHANNELS * SUM_BITS)
      );

  end generate slice;

  -- All slices have the same delay, so one of them says what the results are.
  summed <= result_of(row_token(0));

  -- All slices are divided alike; with weights each slice has its own, as its views leave the border elsewhere.
  scale : entity work.result_scaler
    generic map (
      EXACT        => true,
      LANES        => SLICES * CHANNELS,
      SUM_BITS     => SUM_BITS,
      PIXEL_BITS   => PIXEL_BITS,
      DIVISOR      => M * M,
      WEIGHT_COUNT => SLICES,
      WEIGHT_BITS  => WEIGHT_BITS
    )
    port map (
      clk     => clk,
      reset   => reset,
      result  => summed,
      sums    => sums,
      weights => weights,
      scaled  => result,
      pixels  => result_data
    );

end architecture rtl;
