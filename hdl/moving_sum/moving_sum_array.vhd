-- SPDX-License-Identifier: Apache-2.0
-- The second engine: the refocusing filters of a raster scan as re-orderings and moving sums.
--
-- Ports and results are those of fir_array with one row at a time, bit for bit. This engine needs only an adder or
-- two for each sum, whatever M and the shifts are, and its column memories hold pixels instead of partial sums. With
-- exact arithmetic columns come first, so that the memory holds the input pixels. Stored products round between the
-- passes, so they keep the order that defines the result: rows first.
--
-- A token may hold several neighbouring pixels. Column filters treat them as channels of one wider pixel, and lines
-- are shorter accordingly; row filters combine them (lane_stage). In a line's last token, pixels behind the line's
-- end count as zero and come out as zero.
--
-- Interpolation of order n appends n moving sums over M pixels in each dimension (1: linear). Sharpening may follow.
--
-- Latency: D lines, D + 1 tokens and sum_array_latency clocks with one pixel a token, D = total_delay; D lines, D'
-- tokens and sum_lanes_latency clocks with several, D' = total_lane_delay. Sharpening: M lines, divide_up(M, P)
-- tokens and sharpen_latency clocks more.
-- Throughput: one token each clock. Lines need at least D + 1 tokens (D' + 1 with several pixels); frames need at
-- least D + 1 lines and a multiple of M, with ANY_ROWS at least least_frame lines. Empty tokens and flush lines make
-- up for what is missing.
-- Equation: that of fir_array.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_lanes_pkg.all;
use work.arithmetic_pkg.all;
use work.token_pkg.all;
use work.sharpen_pkg.all;

entity moving_sum_array is
  generic (
    -- M: pixels of a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- The shift of each slice in pixels, with blanks in between.
    SHIFTS : string;
    -- true: the picture stays put from slice to slice.
    CENTRED : boolean := true;
    -- Moving sums that follow in each dimension: 0 none, 1 linear interpolation.
    INTERPOLATION_ORDER : natural range 0 to 3 := 0;
    -- Longest line in pixels.
    MAX_COLUMNS : positive := 2048;
    -- P, pixels of a token; above 1 with exact arithmetic only.
    PIXELS_PER_CLOCK : positive range 1 to 32 := 1;
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3 := 1;
    -- Width of a channel.
    PIXEL_BITS : positive range 1 to 16 := 8;
    -- true: exact sums and one division at the end; false: stored products, which round.
    EXACT : boolean := true;
    -- Stored products only: fraction bits of the products.
    FRACTION_BITS : natural range 0 to 12 := 0;
    -- Stored products only: fraction bits of the image between rows and columns.
    GUARD_BITS : natural range 0 to 12 := 0;
    -- true: frames of any number of lines follow each other without a pause.
    ANY_ROWS : boolean := false;
    -- The weight of each slice's sharpening in 64ths, with blanks in between; an empty text leaves the sharpener out.
    SHARPENING : string := "";
    -- Width of the weights that divide the sums (exact and not sharpened); 0: the sums are divided by M * M.
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
    -- The weight of each pixel (from border_weights), in the clock of its sums.
    weights : in    std_logic_vector(PIXELS_PER_CLOCK * larger(WEIGHT_BITS, 1) - 1 downto 0);
    -- The result of a token, and its pixels.
    result      : out   result_t;
    result_data : out   std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * PIXEL_BITS - 1 downto 0)
  );
end entity moving_sum_array;

architecture rtl of moving_sum_array is

  constant GEOMETRY : geometry_t := geometry_of("moving_sum_array", MICRO_IMAGE_SIZE, SHIFTS, CENTRED);

  constant PASSES     : positive     := INTERPOLATION_ORDER + 1;
  constant ARITHMETIC : arithmetic_t :=
  (
    EXACT            => EXACT,
    MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
    PIXEL_BITS       => PIXEL_BITS,
    FRACTION_BITS    => FRACTION_BITS,
    GUARD_BITS       => GUARD_BITS,
    PASSES           => PASSES
  );

  constant REFUSED : boolean := not (takes_columns("moving_sum_array", MAX_COLUMNS) and
                                     takes_arithmetic("moving_sum_array", ARITHMETIC) and
                                     takes_weights("moving_sum_array", WEIGHT_BITS, ARITHMETIC, 1,
                                                    sharpens(SHARPENING)) and
                                     takes_sharpening("moving_sum_array", SHARPENING, GEOMETRY.slices, EXACT,
                                                       1) and
                                     takes_sums("moving_sum_array", ARITHMETIC, GEOMETRY, ANY_ROWS, PIXELS_PER_CLOCK,
                                                 MAX_COLUMNS, CHANNELS, SHARPENING));

  constant STORED     : boolean  := not EXACT;
  constant P          : positive := PIXELS_PER_CLOCK;
  constant LANES      : positive := P * CHANNELS;
  constant LAST_STAGE : positive := 2 * PASSES - 1;

  -- Whether a stage filters columns: exact sums begin with them, stored products with rows.
  function filters_columns (
    stage : natural
  ) return boolean is
  begin

    return EXACT = (stage < PASSES);

  end function filters_columns;

  constant SUM_BITS : positive := value_bits(ARITHMETIC, 2 * PASSES);
  constant WIDTH    : positive := widest_bits(ARITHMETIC);

  type data_t is array (natural range 0 to 2 * PASSES) of std_logic_vector(LANES * WIDTH - 1 downto 0);

  -- Signals in front of each stage (by its number) and behind the last one.
  signal token_at : tokens_t(0 to 2 * PASSES);
  signal data     : data_t;

  -- Token and sums behind the last stage, or behind the sharpener if there is one.
  signal last_token : token_t;
  signal last_sums  : std_logic_vector(LANES * SUM_BITS - 1 downto 0);
  signal summed     : result_t;

begin

  token_at(0) <= token;

  -- Pixels behind a line's end are set to zero here, so no stage needs to know the line's length.
  data(0)(LANES * PIXEL_BITS - 1 downto 0) <= in_line(token_data, CHANNELS * PIXEL_BITS, token, line_end);

  every_stage : for i in 0 to LAST_STAGE generate

    constant COLUMNS  : boolean  := filters_columns(i);
    constant IN_BITS  : positive := value_bits(ARITHMETIC, i);
    constant OUT_BITS : positive := value_bits(ARITHMETIC, i + 1);

  begin

    -- Column filters treat the pixels of a token as channels, so a stage of one pixel serves all of them.
    pixel_stage : if COLUMNS or P = 1 generate

      stage : entity work.moving_sum_stage
        generic map (
          GEOMETRY => pass_geometry(GEOMETRY, i mod PASSES),
          SIZES    => pass_of(ARITHMETIC, i),
          COLUMNS  => COLUMNS,
          ANY_ROWS => ANY_ROWS,
          DEPTH    => choose(COLUMNS, line_tokens(MAX_COLUMNS, P), 1),
          LANES    => LANES
        )
        port map (
          clk       => clk,
          reset     => reset,
          token     => token_at(i),
          data      => data(i)(LANES * IN_BITS - 1 downto 0),
          out_token => token_at(i + 1),
          out_data  => data(i + 1)(LANES * OUT_BITS - 1 downto 0)
        );

    end generate pixel_stage;

    pixels_stage : if not COLUMNS and P > 1 generate

      signal sums : std_logic_vector(LANES * OUT_BITS - 1 downto 0);

    begin

      -- Behind each stage pixels beyond the line's end are cleared again, because sums go on there.
      data(i + 1)(LANES * OUT_BITS - 1 downto 0) <= in_line(sums, CHANNELS * OUT_BITS, token_at(i + 1), line_end);

      stage : entity work.lane_stage
        generic map (
          GEOMETRY         => pass_geometry(GEOMETRY, i mod PASSES),
          PIXELS_PER_CLOCK => P,
          CHANNELS         => CHANNELS,
          DATA_BITS        => IN_BITS,
          SUM_BITS         => OUT_BITS
        )
        port map (
          clk       => clk,
          reset     => reset,
          token     => token_at(i),
          data      => data(i)(LANES * IN_BITS - 1 downto 0),
          out_token => token_at(i + 1),
          out_data  => sums
        );

    end generate pixels_stage;

  end generate every_stage;

  plain : if not sharpens(SHARPENING) generate
    last_token <= token_at(2 * PASSES);
    last_sums  <= data(2 * PASSES)(LANES * SUM_BITS - 1 downto 0);
  end generate plain;

  sharp : if sharpens(SHARPENING) generate

    sharpener : entity work.lens_sharpener
      generic map (
        MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
        SHARPENING       => SHARPENING,
        PIXELS_PER_CLOCK => P,
        TOKENS           => line_tokens(MAX_COLUMNS, P),
        CHANNELS         => CHANNELS,
        SUM_MAX          => product_max(ARITHMETIC, 2 * PASSES),
        DIVISOR          => final_divisor(ARITHMETIC)
      )
      port map (
        clk       => clk,
        reset     => reset,
        token     => token_at(2 * PASSES),
        line_end  => line_end,
        sums      => data(2 * PASSES)(LANES * SUM_BITS - 1 downto 0),
        out_token => last_token,
        out_sums  => last_sums
      );

  end generate sharp;

  -- The fields of the token that result_scaler needs.
  summed <= result_of(last_token);

  scale : entity work.result_scaler
    generic map (
      EXACT        => EXACT,
      LANES        => LANES,
      PIXEL_BITS   => PIXEL_BITS,
      DIVISOR      => final_divisor(ARITHMETIC),
      WEIGHT_COUNT => P,
      WEIGHT_BITS  => WEIGHT_BITS
    )
    port map (
      clk     => clk,
      reset   => reset,
      result  => summed,
      sums    => last_sums,
      weights => weights,
      scaled  => result,
      pixels  => result_data
    );

end architecture rtl;
