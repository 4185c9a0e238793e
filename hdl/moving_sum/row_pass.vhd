-- SPDX-License-Identifier: Apache-2.0
-- A pass of moving sums over rows, for any number of pixels a token: moving_sum_stage for one, lane_stage for several.
--
-- Pixels behind the end of a line must be zero; sums behind it come out as zero, because the next pass goes on there.
-- lane_stage is a component, so that a project of one pixel a token needs no file of it.
--
-- Latency: output_delay steps and sum_stage_latency clocks with one pixel, lane_delay tokens and lane_stage_latency
-- clocks with several. Throughput: one token each clock.
-- Equation: out_data(k) = S(k), the refocusing sums of a row.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.token_pkg.all;

entity row_pass is
  generic (
    -- Geometry of the slices.
    GEOMETRY : geometry_t;
    -- Widths and largest values of the input and the sums.
    SIZES : pass_t;
    -- The slice, if it is always the same; -1: the slice of the token.
    FIXED_SLICE : integer := -1;
    -- Pixels of a token, and channels of a pixel.
    PIXELS   : positive range 1 to 32;
    CHANNELS : positive := 1;
    -- Width of the tag that goes with a token.
    TAG_BITS : positive := 1
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token, its pixels (pixel 0 and channel 0 in the low bits), and a tag.
    token : in    token_t;
    data  : in    std_logic_vector(PIXELS * CHANNELS * SIZES.data_bits - 1 downto 0);
    tag   : in    std_logic_vector(TAG_BITS - 1 downto 0) := (others => '0');
    -- Which pixels a line's last token has; constant while a frame is under way.
    line_end : in    std_logic_vector(PIXELS - 1 downto 0);
    -- The token behind the pass, its sums, and its tag.
    out_token : out   token_t;
    out_data  : out   std_logic_vector(PIXELS * CHANNELS * SIZES.result_bits - 1 downto 0);
    out_tag   : out   std_logic_vector(TAG_BITS - 1 downto 0)
  );
end entity row_pass;

architecture rtl of row_pass is

  component lane_stage is
    generic (
      GEOMETRY         : geometry_t;
      PIXELS_PER_CLOCK : positive range 2 to 32;
      CHANNELS         : positive;
      DATA_BITS        : positive;
      SUM_BITS         : positive;
      TAG_BITS         : positive
    );
    port (
      clk       : in    std_logic;
      reset     : in    std_logic;
      token     : in    token_t;
      data      : in    std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * DATA_BITS - 1 downto 0);
      tag       : in    std_logic_vector(TAG_BITS - 1 downto 0);
      out_token : out   token_t;
      out_data  : out   std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * SUM_BITS - 1 downto 0);
      out_tag   : out   std_logic_vector(TAG_BITS - 1 downto 0)
    );
  end component lane_stage;

begin

  one_pixel : if PIXELS = 1 generate

    stage : entity work.moving_sum_stage
      generic map (
        GEOMETRY    => GEOMETRY,
        SIZES       => SIZES,
        FIXED_SLICE => FIXED_SLICE,
        LANES       => CHANNELS,
        TAG_BITS    => TAG_BITS
      )
      port map (
        clk       => clk,
        reset     => reset,
        token     => token,
        data      => data,
        tag       => tag,
        out_token => out_token,
        out_data  => out_data,
        out_tag   => out_tag
      );

  end generate one_pixel;

  several_pixels : if PIXELS > 1 generate

    signal sum_token : token_t;
    signal sums      : std_logic_vector(PIXELS * CHANNELS * SIZES.result_bits - 1 downto 0);

  begin

    stage : component lane_stage
      generic map (
        GEOMETRY         => slice_geometry(GEOMETRY, FIXED_SLICE),
        PIXELS_PER_CLOCK => PIXELS,
        CHANNELS         => CHANNELS,
        DATA_BITS        => SIZES.data_bits,
        SUM_BITS         => SIZES.result_bits,
        TAG_BITS         => TAG_BITS
      )
      port map (
        clk       => clk,
        reset     => reset,
        token     => token,
        data      => data,
        tag       => tag,
        out_token => sum_token,
        out_data  => sums,
        out_tag   => out_tag
      );

    out_token <= sum_token;
    out_data  <= in_line(sums, CHANNELS * SIZES.result_bits, sum_token, line_end);

  end generate several_pixels;

end architecture rtl;
