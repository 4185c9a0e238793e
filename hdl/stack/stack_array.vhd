-- SPDX-License-Identifier: Apache-2.0
-- The arithmetic of a focal stack: all slices of each pixel, from one column memory.
--
-- Columns come first, so that the memory holds the input pixels and all slices share it. Behind the memory each slice
-- has its own moving sums, over columns and then over rows, and one division at the end.
--
-- A token may hold several neighbouring pixels. Column filters treat them as channels of one wider pixel. For rows each
-- slice has a lane_stage, because sums over columns differ from slice to slice. In a line's last token, pixels behind
-- the line's end count as zero and come out as zero.
--
-- Latency: D lines, D + 1 tokens and stack_array_latency clocks with one pixel a token, D = output_delay; D lines, D'
-- tokens and stack_array_latency clocks with several, D' = lane_delay. With weights scaler_latency replaces
-- DIVIDE_LATENCY.
-- Throughput: one token of all slices each clock. Lines need at least D + 1 tokens (D' + 1 with several pixels); frames
-- begin at least D + 1 lines apart, and a multiple of M lines. Empty tokens and flush lines make up for what is
-- missing.
-- Equation: that of fir_array, for each slice.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.delay_pkg.all;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_lanes_pkg.all;
use work.focal_stack_pkg.all;
use work.token_pkg.all;

entity stack_array is
  generic (
    -- M: pixels of a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- The shift of each slice in pixels, with blanks in between.
    SHIFTS : string;
    -- true: the picture stays put from slice to slice.
    CENTRED : boolean := true;
    -- Longest line in pixels.
    MAX_COLUMNS : positive := 2048;
    -- P, pixels of a token.
    PIXELS_PER_CLOCK : positive range 1 to 32 := 1;
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3 := 1;
    -- Width of a channel.
    PIXEL_BITS : positive range 1 to 16 := 8;
    -- Width of the weights that divide the sums (one pixel a token); 0: the sums are divided by M * M.
    WEIGHT_BITS : natural range 0 to 31 := 0
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token and its pixels; pixel 0 and channel 0 in the low bits.
    token      : in    token_t;
    token_data : in    std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * PIXEL_BITS - 1 downto 0);
    -- Which pixels a line's last token has; constant while a frame is under way.
    line_end : in    std_logic_vector(PIXELS_PER_CLOCK - 1 downto 0);
    -- The weight of each slice (from border_weights), in the clock of its sums.
    weights : in    std_logic_vector(slice_count(SHIFTS) * larger(WEIGHT_BITS, 1) - 1 downto 0);
    -- The result of a token and its pixels: all slices of pixel 0 (slice 0, channel 0 in the low bits), then all slices
    -- of pixel 1.
    result      : out   result_t;
    result_data : out   std_logic_vector(PIXELS_PER_CLOCK * slice_count(SHIFTS) * CHANNELS * PIXEL_BITS - 1 downto 0)
  );
end entity stack_array;

architecture rtl of stack_array is

  constant GEOMETRY : geometry_t := geometry_of("stack_array", MICRO_IMAGE_SIZE, SHIFTS, CENTRED);

  constant REFUSED : boolean := not (takes_stack("stack_array", GEOMETRY, PIXELS_PER_CLOCK, MAX_COLUMNS, CHANNELS,
                                                 PIXEL_BITS) and
                                     takes_weights("stack_array", WEIGHT_BITS,
                                                    (
                                                      exact            => true,
                                                      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
                                                      PIXEL_BITS       => PIXEL_BITS,
                                                      fraction_bits    => 0,
                                                      guard_bits       => 0,
                                                      passes           => 1
                                                    ), 1, false));

  constant WEIGHED : boolean := not takes(WEIGHT_BITS = 0 or PIXELS_PER_CLOCK = 1,
                                          "stack_array: WEIGHT_BITS above 0 needs a PIXELS_PER_CLOCK of 1");

  constant M          : positive := MICRO_IMAGE_SIZE;
  constant P          : positive := PIXELS_PER_CLOCK;
  constant LANES      : positive := P * CHANNELS;
  constant SLICES     : positive := GEOMETRY.slices;
  constant DATA_BITS  : positive := CHANNELS * PIXEL_BITS;
  constant PIXEL_MAX  : positive := 2 ** PIXEL_BITS - 1;
  constant COLUMN_MAX : positive := M * PIXEL_MAX;
  constant SUM_MAX    : positive := M * COLUMN_MAX;

  -- Widths of a column sum and of a result of one channel; WIDE_BITS: the column sums of a slice for a whole token.
  constant COLUMN_BITS : positive := bits_for(COLUMN_MAX);
  constant SUM_BITS    : positive := bits_for(SUM_MAX);
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
  signal last_token   : token_t;
  signal summed       : result_t;
  signal sums         : std_logic_vector(SLICES * LANES * SUM_BITS - 1 downto 0);
  -- The pixels of all slices, those of slice 0 in the low bits.
  signal pixels : std_logic_vector(SLICES * LANES * PIXEL_BITS - 1 downto 0);

begin

  in_pixels <= in_line(token_data, CHANNELS * PIXEL_BITS, token, line_end);

  -- Column filters treat the pixels of a token as channels.
  columns : entity work.stack_columns
    generic map (
      GEOMETRY  => GEOMETRY,
      COLUMNS   => line_tokens(MAX_COLUMNS, P),
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

    pixel_stage : if P = 1 generate

      rows : entity work.moving_sum_stage
        generic map (
          GEOMETRY    => GEOMETRY,
          SIZES       => exact_pass(COLUMN_MAX, M),
          FIXED_SLICE => s,
          LANES       => CHANNELS
        )
        port map (
          clk       => clk,
          reset     => reset,
          token     => column_token,
          data      => column_data((s + 1) * WIDE_BITS - 1 downto s * WIDE_BITS),
          out_token => row_token(s),
          out_data  => sums((s + 1) * LANES * SUM_BITS - 1 downto s * LANES * SUM_BITS)
        );

    end generate pixel_stage;

    pixels_stage : if P > 1 generate

      constant WAIT_CLOCKS : natural := stack_lanes_latency(GEOMETRY, P) -
                                        lane_stage_latency(slice_geometry(GEOMETRY, s), P);

      signal found   : std_logic_vector(LANES * SUM_BITS - 1 downto 0);
      signal waited  : std_logic_vector(LANES * SUM_BITS - 1 downto 0);
      signal waiting : std_logic_vector(delay_bits(LANES * SUM_BITS, WAIT_CLOCKS) - 1 downto 0) := (others => '0');

    begin

      rows : entity work.lane_stage
        generic map (
          GEOMETRY         => slice_geometry(GEOMETRY, s),
          PIXELS_PER_CLOCK => P,
          CHANNELS         => CHANNELS,
          DATA_BITS        => COLUMN_BITS,
          SUM_BITS         => SUM_BITS
        )
        port map (
          clk       => clk,
          reset     => reset,
          token     => column_token,
          data      => column_data((s + 1) * WIDE_BITS - 1 downto s * WIDE_BITS),
          out_token => row_token(s),
          out_data  => found
        );

      waited <= delayed(waiting, found, WAIT_CLOCKS);

      -- Slices that hold outputs take a clock more.
      wait_for_slowest : process (clk) is
      begin

        if rising_edge(clk) then
          waiting <= moved_on(waiting, found);
        end if;

      end process wait_for_slowest;

      sums((s + 1) * LANES * SUM_BITS - 1 downto s * LANES * SUM_BITS) <= in_line(waited, CHANNELS * SUM_BITS,
                                                                                  last_token, line_end);

    end generate pixels_stage;

  end generate slice;

  -- All slices have the same delay, so one of them provides the token.
  last_token <= row_token(slowest);
  summed     <= result_of(last_token);

  -- All slices are divided alike; with weights each slice has its own, because each slice loses other views at the
  -- border.
  scale : entity work.result_scaler
    generic map (
      LANES        => SLICES * LANES,
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
      pixels  => pixels
    );

  -- The engine has the pixels of a slice side by side, the stream the slices of a pixel.
  all_pixels : for j in 0 to P - 1 generate

    all_slices : for s in 0 to SLICES - 1 generate

      constant TO_LOW   : natural := (j * SLICES + s) * DATA_BITS;
      constant FROM_LOW : natural := (s * P + j) * DATA_BITS;

    begin

      result_data(TO_LOW + DATA_BITS - 1 downto TO_LOW) <= pixels(FROM_LOW + DATA_BITS - 1 downto FROM_LOW);

    end generate all_slices;

  end generate all_pixels;

end architecture rtl;
