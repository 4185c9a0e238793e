-- SPDX-License-Identifier: Apache-2.0
-- The arithmetic of a focal stack: all slices of each pixel, from one column memory.
--
-- Columns come first, so that the memory holds the input pixels and all slices share it. Behind the memory each slice
-- has its own moving sums, over columns and then over rows, and one division at the end.
--
-- A token may hold several neighbouring pixels. Column filters treat them as channels of one wider pixel. For rows each
-- slice has a row stage, because sums over columns differ from slice to slice. In a line's last token, pixels behind
-- the line's end count as zero and come out as zero.
--
-- Latency: D lines, D + 1 tokens and sum_clocks clocks with one pixel a token, D = output_delay; D lines, D' tokens and
-- sum_clocks clocks with several, D' = lane_delay.
-- Throughput: one token of all slices each clock. Lines need at least D + 1 tokens (D' + 1 with several pixels); frames
-- begin at least D + 1 lines apart, and a multiple of M lines. Empty tokens and flush lines make up for what is
-- missing.
-- Equation: that of fir_array, for each slice.

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
use work.focal_stack_pkg.all;
use work.token_pkg.all;

entity stack_array is
  generic (
    -- The core that the stack is built for.
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
    -- The token behind the sums; and its sums: all slices of pixel 0 (slice 0, channel 0 in the low bits), then all
    -- slices of pixel 1.
    out_token : out   tokens_t(0 to 0);
    out_sums  : out   std_logic_vector(row_sums_bits(CORE) - 1 downto 0)
  );
end entity stack_array;

architecture rtl of stack_array is

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

  constant GEOMETRY   : geometry_t := CORE.geometry;
  constant P          : positive   := CORE.pixels;
  constant CHANNELS   : positive   := CORE.channels;
  constant PIXEL_BITS : positive   := CORE.arithmetic.pixel_bits;
  constant LANES      : positive   := P * CHANNELS;
  constant SLICES     : positive   := GEOMETRY.slices;
  constant BOX        : positive   := CORE.arithmetic.box;
  constant COLUMN_MAX : positive   := BOX * (2 ** PIXEL_BITS - 1);
  constant SIZES      : pass_t     := exact_pass(COLUMN_MAX, BOX);

  -- Widths of a column sum and of a sum over columns and rows of one channel; WIDE_BITS: the column sums of a slice for
  -- a whole token.
  constant COLUMN_BITS : positive := bits_for(COLUMN_MAX);
  constant SUM_BITS    : positive := final_sum_bits(CORE);
  constant WIDE_BITS   : positive := LANES * COLUMN_BITS;

  -- The slice whose row stage takes longest; the sums of other slices wait for it.
  function slowest return natural is
  begin

    for s in 0 to SLICES - 1 loop

      if P > 1 and lane_stage_latency(slice_geometry(GEOMETRY, s), P) = stack_lanes_latency(GEOMETRY, P) then
        return s;
      end if;

    end loop;

    return 0;

  end function slowest;

  -- The token's pixels within its line; then token and sums behind the columns, and behind the rows of each slice.
  signal in_pixels    : std_logic_vector(LANES * PIXEL_BITS - 1 downto 0);
  signal column_token : token_t;
  signal column_data  : std_logic_vector(SLICES * WIDE_BITS - 1 downto 0);
  signal row_token    : tokens_t(0 to SLICES - 1);
  signal sums         : std_logic_vector(SLICES * LANES * SUM_BITS - 1 downto 0);

begin

  in_pixels <= in_line(token_data, CHANNELS * PIXEL_BITS, token, line_end);

  -- Column filters treat the pixels of a token as channels.
  columns : entity work.stack_columns
    generic map (
      GEOMETRY  => GEOMETRY,
      COLUMNS   => tokens_of(CORE),
      LANES     => LANES,
      LANE_BITS => PIXEL_BITS
    )
    port map (
      clk       => clk,
      reset     => reset,
      token     => token,
      data      => in_pixels,
      out_token => column_token,
      out_data  => column_data
    );

  slice : for s in 0 to SLICES - 1 generate

    constant WAIT_CLOCKS : natural := choose(P > 1, stack_lanes_latency(GEOMETRY, P) -
                                             lane_stage_latency(slice_geometry(GEOMETRY, s), P), 0);

    signal row_sums : std_logic_vector(LANES * SUM_BITS - 1 downto 0);
    signal waiting  : std_logic_vector(delay_bits(LANES * SUM_BITS, WAIT_CLOCKS) - 1 downto 0) := (others => '0');

  begin

    one_pixel : if P = 1 generate

      stage : entity work.moving_sum_stage
        generic map (
          GEOMETRY    => GEOMETRY,
          SIZES       => SIZES,
          FIXED_SLICE => s,
          LANES       => CHANNELS
        )
        port map (
          clk       => clk,
          reset     => reset,
          token     => column_token,
          data      => column_data((s + 1) * WIDE_BITS - 1 downto s * WIDE_BITS),
          out_token => row_token(s),
          out_data  => row_sums
        );

    end generate one_pixel;

    several_pixels : if P > 1 generate

      stage : component lane_stage
        generic map (
          BUILD    => to_lanes(slice_geometry(GEOMETRY, s), P, CHANNELS, SIZES.data_bits),
          SUM_BITS => SIZES.result_bits,
          TAG_BITS => 1
        )
        port map (
          clk       => clk,
          reset     => reset,
          token     => column_token,
          data      => column_data((s + 1) * WIDE_BITS - 1 downto s * WIDE_BITS),
          line_end  => line_end,
          out_token => row_token(s),
          out_data  => row_sums,
          out_tag   => open
        );

    end generate several_pixels;

    -- With several pixels slices that hold outputs take a clock more.
    wait_for_slowest : process (clk) is
    begin

      if rising_edge(clk) then
        waiting <= moved_on(waiting, row_sums);
      end if;

    end process wait_for_slowest;

    sums((s + 1) * LANES * SUM_BITS - 1 downto s * LANES * SUM_BITS) <= delayed(waiting, row_sums, WAIT_CLOCKS);

  end generate slice;

  -- All slices have the same delay, so one of them provides the token.
  out_token(0) <= row_token(slowest);

  -- The rows have the pixels of a slice side by side, the stream the slices of a pixel.
  all_pixels : for j in 0 to P - 1 generate

    all_slices : for s in 0 to SLICES - 1 generate

      constant BITS     : positive := CHANNELS * SUM_BITS;
      constant TO_LOW   : natural  := (j * SLICES + s) * BITS;
      constant FROM_LOW : natural  := (s * P + j) * BITS;

    begin

      out_sums(TO_LOW + BITS - 1 downto TO_LOW) <= sums(FROM_LOW + BITS - 1 downto FROM_LOW);

    end generate all_slices;

  end generate all_pixels;

end architecture rtl;
