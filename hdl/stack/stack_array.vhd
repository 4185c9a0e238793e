-- The arithmetic of a focal stack: all slices of each pixel, from one column memory.
--
-- Columns come first, so that the memory holds the pixels as they come and the slices share it. Behind it each slice
-- has moving sums of its own, over columns and then over rows, and one division at the end.
--
-- Latency: D lines, D + 1 tokens and stack_array_latency clocks, D = output_delay. Throughput: one pixel of all
--   channels and slices each clock, in lines of D + 1 tokens at least; frames begin D + 1 lines apart at least, and a
--   multiple of M lines; empty tokens and lines must make up for what is missing.
-- Ports: as moving_sum_array; out_data: the pixels, slice 0 and channel 0 in the low bits.
-- Equation: as fir_array, for each slice.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.moving_sum_pkg.all;
use work.focal_stack_pkg.all;

entity stack_array is
  generic (
    -- As in focal_stack.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- As in focal_stack.
    SHIFTS : string;
    -- As in raster_refocuser.
    CENTRED : boolean := true;
    -- Longest line in pixels.
    MAX_COLUMNS : positive := 2048;
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3 := 1;
    -- Width of a channel.
    PIXEL_BITS : positive range 1 to 16 := 8
  );
  port (
    clk            : in    std_logic;
    reset          : in    std_logic;
    in_strobe      : in    std_logic;
    in_pixel       : in    std_logic;
    in_band_first  : in    std_logic;
    in_band_last   : in    std_logic;
    in_frame_first : in    std_logic;
    in_image       : in    std_logic;
    in_data        : in    std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
    out_valid      : out   std_logic;
    out_start      : out   std_logic;
    out_last       : out   std_logic;
    out_data       : out   std_logic_vector(slice_count(SHIFTS) * CHANNELS * PIXEL_BITS - 1 downto 0)
  );
end entity stack_array;

architecture rtl of stack_array is

  constant M          : positive := MICRO_IMAGE_SIZE;
  constant SLICES     : positive := slice_count(SHIFTS);
  constant SLICE_BITS : positive := bits_for(SLICES - 1);
  constant PIXEL_MAX  : positive := 2 ** PIXEL_BITS - 1;
  constant COLUMN_MAX : positive := M * PIXEL_MAX;
  constant SUM_MAX    : positive := M * COLUMN_MAX;

  -- Lanes of all channels: column sums, results, pixels.
  constant COLUMN_BITS : positive := CHANNELS * bits_for(COLUMN_MAX);
  constant SUM_BITS    : positive := bits_for(SUM_MAX);
  constant DATA_BITS   : positive := CHANNELS * PIXEL_BITS;

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

  -- A result's: valid, last, start.
  subtype result_t is std_logic_vector(2 downto 0);

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
  signal result        : result_t;
  signal scaled        : result_t;

begin

  token_tag <= in_band_last & in_band_first & in_pixel;
  line_tag  <= in_frame_first & in_image;

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
      strobe        => in_strobe,
      pixel         => in_pixel,
      line_first    => in_band_first,
      first         => in_frame_first,
      data          => in_data,
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

    signal sums : std_logic_vector(CHANNELS * SUM_BITS - 1 downto 0);

  begin

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
        out_data      => sums,
        out_step_tag  => row_due(s),
        out_token_tag => open
      );

    channel : for c in 0 to CHANNELS - 1 generate

      divide : entity work.divide_round
        generic map (
          VALUE_MAX     => SUM_MAX,
          DIVISOR       => M * M,
          QUOTIENT_BITS => PIXEL_BITS
        )
        port map (
          clk      => clk,
          value    => sums((c + 1) * SUM_BITS - 1 downto c * SUM_BITS),
          quotient => out_data(s * DATA_BITS + (c + 1) * PIXEL_BITS - 1 downto s * DATA_BITS + c * PIXEL_BITS)
        );

    end generate channel;

  end generate slice;

  -- All slices have the same delay.
  row_token <= row_due(0)(token_tag_t'length - 1 downto 0);
  row_line  <= row_due(0)(row_tag_t'length - 1 downto token_tag_t'length);

  result(0) <= row_strobe(0) and row_token(PIXEL) and row_line(IMAGE);
  result(1) <= row_token(LINE_LAST);
  result(2) <= row_token(LINE_FIRST) and row_line(FRAME_FIRST);

  delay_result : entity work.tag_delay
    generic map (
      WIDTH  => result_t'length,
      LENGTH => DIVIDE_LATENCY
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => result,
      delayed => scaled
    );

  out_valid <= scaled(0);
  out_last  <= scaled(1);
  out_start <= scaled(2);

end architecture rtl;
