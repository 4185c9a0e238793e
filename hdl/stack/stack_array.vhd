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
  constant SLICE_BITS : positive := bits_for(SLICES - 1);
  constant PIXEL_MAX  : positive := 2 ** PIXEL_BITS - 1;
  constant COLUMN_MAX : positive := M * PIXEL_MAX;
  constant SUM_MAX    : positive := M * COLUMN_MAX;

  -- Lanes of all channels: column sums, results, pixels.
  constant COLUMN_BITS : positive := CHANNELS * bits_for(COLUMN_MAX);
  constant SUM_BITS    : positive := bits_for(SUM_MAX);

  constant NO_SLICE : unsigned(SLICE_BITS - 1 downto 0) := (others => '0');

  -- Side information of a token and of a line; bit 0 is the one that reset clears.
  constant PIXEL       : natural := 0;
  constant LINE_FIRST  : natural := 1;
  constant LINE_LAST   : natural := 2;
  constant IMAGE       : natural := 0;
  constant FRAME_FIRST : natural := 1;

  subtype token_tag_t is std_logic_vector(2 downto 0);

  subtype line_tag_t is std_logic_vector(1 downto 0);

  subtype row_tag_t is std_logic_vector(4 downto 0);

  type row_tags_t is array (natural range 0 to SLICES - 1) of row_tag_t;

  signal token_tag     : token_tag_t;
  signal line_tag      : line_tag_t;
  signal column_strobe : std_logic;
  signal column_data   : std_logic_vector(SLICES * COLUMN_BITS - 1 downto 0);
  signal column_token  : token_tag_t;
  signal column_line   : line_tag_t;
  signal row_first     : std_logic;
  signal row_tag       : row_tag_t;
  signal row_strobe    : std_logic_vector(SLICES - 1 downto 0);
  signal row_due       : row_tags_t;
  signal row_line      : line_tag_t;
  signal row_token     : token_tag_t;
  signal summed        : result_t;
  signal sums          : std_logic_vector(SLICES * CHANNELS * SUM_BITS - 1 downto 0);

begin

  token_tag <= token.line_last & token.line_first & token.pixel;
  line_tag  <= token.frame_first & token.image;

  columns : entity work.stack_columns
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFTS           => SHIFTS,
      CENTRED          => CENTRED,
      COLUMNS          => MAX_COLUMNS,
      LANES            => CHANNELS,
      LANE_BITS        => PIXEL_BITS,
      STEP_TAG_BITS    => line_tag_t'length,
      TOKEN_TAG_BITS   => token_tag_t'length
    )
    port map (
      clk           => clk,
      reset         => reset,
      strobe        => token.strobe,
      pixel         => token.pixel,
      line_first    => token.line_first,
      first         => token.frame_first,
      data          => token_data,
      step_tag      => line_tag,
      token_tag     => token_tag,
      out_strobe    => column_strobe,
      out_data      => column_data,
      out_step_tag  => column_line,
      out_token_tag => column_token
    );

  -- Rows: every token is a step.
  row_first <= column_token(PIXEL) and column_token(LINE_FIRST);
  row_tag   <= column_line & column_token;

  slice : for s in 0 to SLICES - 1 generate

    rows : entity work.moving_sum_stage
      generic map (
        MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
        SHIFTS           => SHIFTS,
        CENTRED          => CENTRED,
        FIXED_SLICE      => s,
        DEPTH            => 1,
        LANES            => CHANNELS,
        DATA_BITS        => bits_for(COLUMN_MAX),
        STORED           => false,
        SCALE_BITS       => 0,
        PRODUCT_MAX      => COLUMN_MAX,
        SUM_MAX          => SUM_MAX,
        DROP_BITS        => 0,
        RESULT_BITS      => SUM_BITS,
        STEP_TAG_BITS    => row_tag_t'length,
        TOKEN_TAG_BITS   => 1
      )
      port map (
        clk           => clk,
        reset         => reset,
        strobe        => column_strobe,
        pixel         => '1',
        advance       => '1',
        first         => row_first,
        slice         => NO_SLICE,
        data          => column_data((s + 1) * COLUMN_BITS - 1 downto s * COLUMN_BITS),
        step_tag      => row_tag,
        token_tag     => "0",
        out_strobe    => row_strobe(s),
        out_data      => sums((s + 1) * CHANNELS * SUM_BITS - 1 downto s * CHANNELS * SUM_BITS),
        out_step_tag  => row_due(s),
        out_token_tag => open
      );

  end generate slice;

  -- All slices have the same delay.
  row_token <= row_due(0)(token_tag_t'length - 1 downto 0);
  row_line  <= row_due(0)(row_tag_t'length - 1 downto token_tag_t'length);

  summed.valid <= row_strobe(0) and row_token(PIXEL) and row_line(IMAGE);
  summed.skip  <= '0';
  summed.last  <= row_token(LINE_LAST);
  summed.start <= row_token(LINE_FIRST) and row_line(FRAME_FIRST);
  summed.slice <= (others => '0');

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
