-- SPDX-License-Identifier: Apache-2.0
-- The second engine: the refocusing filters of a raster scan as re-orderings and moving sums.
--
-- Sums are those of fir_array with one row at a time, bit for bit. This engine needs only an adder or
-- two for each sum, whatever M and the shifts are, and its column memories hold pixels instead of partial sums. With
-- exact arithmetic columns come first, so that the memory holds the input pixels. Stored products round between the
-- passes, so they keep the order that defines the result: rows first.
--
-- A token may hold several neighbouring pixels. Column filters treat them as channels of one wider pixel, and lines
-- are shorter accordingly; row filters combine them (row_pass). In a line's last token, pixels behind the line's
-- end count as zero and come out as zero.
--
-- Interpolation of order n appends n moving sums over M pixels in each dimension (1: linear).
--
-- Latency: D lines, D + 1 tokens and sum_clocks clocks with one pixel a token, D = total_delay; D lines, row_tokens
-- tokens and sum_clocks clocks with several.
-- Throughput: one token each clock. Lines need at least D + 1 tokens (row_tokens + 1 with several pixels); frames need
-- at least D + 1 lines and a multiple of M, with any_rows at least least_frame lines. Empty tokens and flush lines make
-- up for what is missing.
-- Equation: that of fir_array.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.all;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.core_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_lanes_pkg.all;
use work.token_pkg.all;

entity moving_sum_array is
  generic (
    -- The core that the sums are built for.
    CORE : core_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token and its pixels; pixel 0 and channel 0 in the low bits.
    token      : in    token_t;
    token_data : in    std_logic_vector(row_bits(CORE) - 1 downto 0);
    -- Which pixels a line's last token has; constant while a frame is under way.
    line_end : in    std_logic_vector(CORE.pixels - 1 downto 0);
    -- The token behind the sums, and the sums of its pixels.
    out_token : out   tokens_t(0 to 0);
    out_sums  : out   std_logic_vector(row_sums_bits(CORE) - 1 downto 0)
  );
end entity moving_sum_array;

architecture rtl of moving_sum_array is

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

  constant GEOMETRY   : geometry_t   := CORE.geometry;
  constant ARITHMETIC : arithmetic_t := CORE.arithmetic;
  constant PASSES     : positive     := ARITHMETIC.passes;
  constant LANES      : positive     := CORE.pixels * CORE.channels;
  constant LAST_STAGE : positive     := 2 * PASSES - 1;

  -- Whether a stage filters columns: exact sums begin with them, stored products with rows.
  function filters_columns (
    stage : natural
  ) return boolean is
  begin

    return ARITHMETIC.exact = (stage < PASSES);

  end function filters_columns;

  constant WIDTH : positive := widest_bits(ARITHMETIC);

  type data_t is array (natural range 0 to 2 * PASSES) of std_logic_vector(LANES * WIDTH - 1 downto 0);

  -- Signals in front of each stage (by its number) and behind the last one.
  signal token_at : tokens_t(0 to 2 * PASSES);
  signal data     : data_t;

begin

  token_at(0) <= token;

  -- Pixels behind a line's end are set to zero here, so no stage needs to know the line's length.
  data(0)(row_bits(CORE) - 1 downto 0) <= in_line(token_data, CORE.channels * ARITHMETIC.pixel_bits, token, line_end);

  every_stage : for i in 0 to LAST_STAGE generate

    constant COLUMNS : boolean := filters_columns(i);
    constant SIZES   : pass_t  := pass_of(ARITHMETIC, i);

  begin

    -- Column filters treat the pixels of a token as channels, so a stage of one pixel serves all of them.
    one_pixel : if COLUMNS or CORE.pixels = 1 generate

      stage : entity work.moving_sum_stage
        generic map (
          GEOMETRY => pass_geometry(GEOMETRY, i mod PASSES),
          SIZES    => SIZES,
          COLUMNS  => COLUMNS,
          ANY_ROWS => COLUMNS and CORE.any_rows,
          DEPTH    => choose(COLUMNS, tokens_of(CORE), 1),
          LANES    => LANES
        )
        port map (
          clk       => clk,
          reset     => reset,
          token     => token_at(i),
          data      => data(i)(LANES * SIZES.data_bits - 1 downto 0),
          out_token => token_at(i + 1),
          out_data  => data(i + 1)(LANES * SIZES.result_bits - 1 downto 0)
        );

    end generate one_pixel;

    several_pixels : if not COLUMNS and CORE.pixels > 1 generate

      stage : component lane_stage
        generic map (
          BUILD    => to_lanes(pass_geometry(GEOMETRY, i mod PASSES), CORE.pixels, CORE.channels, SIZES.data_bits),
          SUM_BITS => SIZES.result_bits,
          TAG_BITS => 1
        )
        port map (
          clk       => clk,
          reset     => reset,
          token     => token_at(i),
          data      => data(i)(LANES * SIZES.data_bits - 1 downto 0),
          line_end  => line_end,
          out_token => token_at(i + 1),
          out_data  => data(i + 1)(LANES * SIZES.result_bits - 1 downto 0),
          out_tag   => open
        );

    end generate several_pixels;

  end generate every_stage;

  out_token(0) <= token_at(2 * PASSES);
  out_sums     <= data(2 * PASSES)(row_sums_bits(CORE) - 1 downto 0);

end architecture rtl;
