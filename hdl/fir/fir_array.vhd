-- SPDX-License-Identifier: Apache-2.0
-- The array of FIR filters: N rows of an image at once through N row modules and N column modules.
--
-- Row modules filter the rows of a band in step. Skew registers delay row r by r tokens, so that the pixels of
-- a column come one after the other. A pixel counter and demultiplexers hand column k to column module k mod N,
-- which takes its N pixels in N tokens and turns to its next column. Each column module keeps the partial sums
-- of its own columns, a column in N, in line buffers of its own. row_results puts the rows together again.
--
-- With N = 1 this is the filter of a raster scan. With N = rows of the frame, a frame is one band.
--
-- Interpolation of order n appends n moving sums over M pixels in each dimension (1: linear). With one row at a time
-- sharpening may follow the sums.
--
-- A band is N lines of the image. Its columns come as pixel tokens, one after the other or with idle clocks and
-- empty tokens (strobe without pixel) in between. The next band may begin min_line_steps tokens later, and after
-- a multiple of N; empty tokens fill the time. Behind a frame, bands of zeros without image lines push its last
-- lines out, and empty tokens the last pixels of a band.
--
-- Output lines are total_delay lines behind: band b gives the lines from N*b - total_delay on, as far as they are
-- image lines. A frame begins at the top of a band.
--
-- Latency: floor(D/N) bands and D + D mod N tokens (with DESKEW D + N - 1), D = total_delay, and array_latency
--   clocks, from the first pixel in to the first pixel out; with sharpening M lines, M tokens and sharpen_latency
--   clocks more.
-- Throughput: N pixels of all channels each clock.
-- Equation: out(k) = round(S2(k) / M**(2 + 2n)) of rows, then columns (EXACT), or stored products as
--   in raster_refocuser.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.fir_pkg.all;
use work.arithmetic_pkg.all;
use work.token_pkg.all;
use work.sharpen_pkg.all;

entity fir_array is
  generic (
    -- M: pixels of a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- The slices: a' of each in pixels, with blanks in between.
    SHIFTS : string;
    -- Whether the picture stays put from slice to slice.
    CENTRED : boolean := true;
    -- Moving sums that follow in each dimension: 0 none, 1 for linear interpolation.
    INTERPOLATION_ORDER : natural range 0 to 3 := 0;
    -- Whether the first output of a micro image is held for its others, which are equal.
    HOLD : boolean := false;
    -- N: rows that are filtered at once.
    PARALLEL_ROWS : positive range 1 to 64 := 1;
    -- Longest line in pixels.
    MAX_COLUMNS : positive := 2048;
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3 := 1;
    -- Width of a channel.
    PIXEL_BITS : positive range 1 to 16 := 8;
    -- Exact sums and one division at the end, or stored products, which round.
    EXACT : boolean := true;
    -- Stored products only: fraction bits of the products.
    FRACTION_BITS : natural range 0 to 12 := 0;
    -- Stored products only: fraction bits of the image between rows and columns.
    GUARD_BITS : natural range 0 to 12 := 0;
    -- Taps that one latch of the broadcast net drives; 0: one register drives all.
    BROADCAST_TAPS : natural := 0;
    -- The weight of each slice's sharpening in 64ths, with blanks in between; without one there is no sharpener.
    SHARPENING : string := "";
    -- Width of the weights that divide the sums, exact ones of one row at a time, not sharpened; 0: M * M divides them.
    WEIGHT_BITS : natural range 0 to 31 := 0;
    -- Whether all rows of a column come out with the same token.
    DESKEW : boolean := false
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token of a band; image counts row by row. line_first and line_last are the ends of the band.
    token : in    token_t;
    -- The rows that are image lines, held through a band, and the pixels, row 0 in the low bits.
    token_rows : in    std_logic_vector(PARALLEL_ROWS - 1 downto 0);
    token_data : in    std_logic_vector(PARALLEL_ROWS * CHANNELS * PIXEL_BITS - 1 downto 0);
    -- The weight of a pixel (border_weights), with its sums; of no account without WEIGHT_BITS.
    weights : in    std_logic_vector(larger(WEIGHT_BITS, 1) - 1 downto 0) := (others => '0');
    -- The results of each row, and the pixels, row 0 in the low bits.
    results     : out   results_t(0 to PARALLEL_ROWS - 1);
    result_data : out   std_logic_vector(PARALLEL_ROWS * CHANNELS * PIXEL_BITS - 1 downto 0)
  );
end entity fir_array;

architecture rtl of fir_array is

  constant GEOMETRY : geometry_t := geometry_of("fir_array", MICRO_IMAGE_SIZE, SHIFTS, CENTRED);

  -- Passes are numbered from 0, rows first, then columns.
  constant PASSES     : positive     := INTERPOLATION_ORDER + 1;
  constant ARITHMETIC : arithmetic_t := (EXACT, MICRO_IMAGE_SIZE, PIXEL_BITS, FRACTION_BITS, GUARD_BITS, PASSES);

  constant REFUSED : boolean := not (takes_columns("fir_array", MAX_COLUMNS) and
                                     takes_arithmetic("fir_array", ARITHMETIC) and
                                     takes_weights("fir_array", WEIGHT_BITS, ARITHMETIC, PARALLEL_ROWS,
                                                    sharpens(SHARPENING)) and
                                     takes_sharpening("fir_array", SHARPENING, GEOMETRY.slices, EXACT,
                                                       PARALLEL_ROWS) and
                                     takes_filters("fir_array", ARITHMETIC, GEOMETRY, HOLD, PARALLEL_ROWS, MAX_COLUMNS,
                                                    CHANNELS, SHARPENING));

  constant STORED     : boolean  := not EXACT;
  constant SLICE_BITS : positive := bits_for(GEOMETRY.slices - 1);
  -- Filters that work in step in a row stage, and streams of a column module.
  constant ROW_LANES : positive := PARALLEL_ROWS * CHANNELS;
  constant DEPTH     : positive := divide_up(MAX_COLUMNS, PARALLEL_ROWS);

  constant ROW_SUM_BITS    : positive := value_bits(ARITHMETIC, PASSES);
  constant RESULT_SUM_BITS : positive := value_bits(ARITHMETIC, 2 * PASSES);

  -- Side information of a token; bit 0 is the one that reset clears.
  constant PIXEL       : natural := 0;
  constant BAND_FIRST  : natural := 1;
  constant BAND_LAST   : natural := 2;
  constant FRAME_FIRST : natural := 3;
  constant SLICE_LOW   : natural := 4;
  constant IMAGE_LOW   : natural := SLICE_LOW + SLICE_BITS;

  subtype token_tag_t is std_logic_vector(IMAGE_LOW + PARALLEL_ROWS - 1 downto 0);

  -- Side information of a column.
  subtype column_tag_t is std_logic_vector(BAND_LAST downto 0);

  -- Side information of a line.
  constant LINE_IMAGE       : natural := 0;
  constant LINE_FRAME_FIRST : natural := 1;
  constant LINE_SLICE_LOW   : natural := 2;

  subtype line_tag_t is std_logic_vector(LINE_SLICE_LOW + SLICE_BITS - 1 downto 0);

  -- What passes from one stage to the next; lanes take the low bits.
  type row_data_t is array (natural range 0 to PASSES) of std_logic_vector(ROW_LANES * ROW_SUM_BITS - 1 downto 0);

  type row_tags_t is array (natural range 0 to PASSES) of token_tag_t;

  constant COLUMN_WIDTH : positive := widest_bits(ARITHMETIC);

  type column_data_t is array (natural range 0 to PASSES) of std_logic_vector(ROW_LANES * COLUMN_WIDTH - 1 downto 0);

  type column_tags_t is array (natural range 0 to PASSES) of column_tag_t;

  type line_tags_t is array (natural range 0 to PASSES) of line_tag_t;

  signal row_strobe : std_logic_vector(0 to PASSES);
  signal row_data   : row_data_t;
  signal row_tags   : row_tags_t;

  signal skewed_data  : std_logic_vector(ROW_LANES * ROW_SUM_BITS - 1 downto 0);
  signal demuxed_data : std_logic_vector(ROW_LANES * ROW_SUM_BITS - 1 downto 0);
  signal band_starts  : std_logic;
  signal count        : natural range 0 to larger(PARALLEL_ROWS - 1, 1);
  signal band_tag     : token_tag_t;
  signal band_held    : token_tag_t;
  signal image_rows   : std_logic_vector(PARALLEL_ROWS - 1 downto 0);

  signal column_strobe : std_logic_vector(0 to PASSES);
  signal column_data   : column_data_t;
  signal column_tags   : column_tags_t;
  signal line_tags     : line_tags_t;

  -- Behind the column modules, and the sharpener where there is one.
  signal last_strobe : std_logic;
  signal last_column : column_tag_t;
  signal last_line   : line_tag_t;
  signal last_sums   : std_logic_vector(ROW_LANES * RESULT_SUM_BITS - 1 downto 0);

  signal summed : results_t(0 to PARALLEL_ROWS - 1);
  signal sums   : std_logic_vector(ROW_LANES * RESULT_SUM_BITS - 1 downto 0);

begin

  -- Row modules: every token is a step.
  row_strobe(0)                                  <= token.strobe;
  row_tags(0)(PIXEL)                             <= token.pixel;
  row_tags(0)(BAND_FIRST)                        <= token.line_first;
  row_tags(0)(BAND_LAST)                         <= token.line_last;
  row_tags(0)(FRAME_FIRST)                       <= token.frame_first;
  row_tags(0)(IMAGE_LOW - 1 downto SLICE_LOW)    <= std_logic_vector(token.slice(SLICE_BITS - 1 downto 0));
  row_tags(0)(token_tag_t'high downto IMAGE_LOW) <= token_rows;

  row_data(0)(ROW_LANES * PIXEL_BITS - 1 downto 0) <= token_data;

  row_pass : for i in 0 to PASSES - 1 generate

    constant STAGE_SHIFTS : string := pass_shifts(SHIFTS, i);

    signal slice : unsigned(bits_for(slice_count(STAGE_SHIFTS) - 1) - 1 downto 0);

  begin

    first_pass : if i = 0 generate
      slice <= unsigned(row_tags(i)(IMAGE_LOW - 1 downto SLICE_LOW));
    end generate first_pass;

    later_pass : if i > 0 generate
      slice <= (others => '0');
    end generate later_pass;

    stage : entity work.fir_stage
      generic map (
        MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
        SHIFTS           => STAGE_SHIFTS,
        CENTRED          => CENTRED,
        HOLD             => HOLD and i = 0,
        MODULES          => 1,
        DEPTH            => 1,
        LANES            => ROW_LANES,
        DATA_BITS        => value_bits(ARITHMETIC, i),
        STORED           => STORED,
        SCALE_BITS       => scale_bits(ARITHMETIC, i),
        PRODUCT_MAX      => product_max(ARITHMETIC, i),
        DROP_BITS        => drop_bits(ARITHMETIC, i),
        RESULT_BITS      => value_bits(ARITHMETIC, i + 1),
        BROADCAST_TAPS   => BROADCAST_TAPS,
        STEP_TAG_BITS    => token_tag_t'length,
        TOKEN_TAG_BITS   => 1
      )
      port map (
        clk           => clk,
        reset         => reset,
        strobe        => row_strobe(i),
        pixel         => '1',
        advance       => '1',
        first         => row_tags(i)(BAND_FIRST),
        slice         => slice,
        data          => row_data(i)(ROW_LANES * value_bits(ARITHMETIC, i) - 1 downto 0),
        step_tag      => row_tags(i),
        token_tag     => "0",
        out_strobe    => row_strobe(i + 1),
        out_data      => row_data(i + 1)(ROW_LANES * value_bits(ARITHMETIC, i + 1) - 1 downto 0),
        out_step_tag  => row_tags(i + 1),
        out_token_tag => open
      );

  end generate row_pass;

  -- Skew registers, pixel counter, demultiplexers.
  skew_rows : entity work.lane_skew
    generic map (
      LANES    => PARALLEL_ROWS,
      WIDTH    => CHANNELS * ROW_SUM_BITS,
      REVERSED => false
    )
    port map (
      clk      => clk,
      reset    => '0',
      enable   => row_strobe(PASSES),
      data_in  => row_data(PASSES),
      data_out => skewed_data
    );

  band_starts <= row_tags(PASSES)(PIXEL) and row_tags(PASSES)(BAND_FIRST);

  count_pixels : entity work.pixel_counter
    generic map (
      MODULUS => PARALLEL_ROWS
    )
    port map (
      clk     => clk,
      strobe  => row_strobe(PASSES),
      restart => band_starts,
      count   => count
    );

  demultiplex : entity work.lane_exchange
    generic map (
      LANES => PARALLEL_ROWS,
      WIDTH => CHANNELS * ROW_SUM_BITS
    )
    port map (
      clk      => clk,
      strobe   => row_strobe(PASSES),
      count    => count,
      data_in  => skewed_data,
      data_out => demuxed_data
    );

  -- The lines of a band, one with each of its first tokens.
  band_tag <= row_tags(PASSES) when band_starts = '1' else
              band_held;

  hold_band : process (clk) is
  begin

    if rising_edge(clk) then
      if row_strobe(PASSES) = '1' then
        band_held <= band_tag;
      end if;
    end if;

  end process hold_band;

  image_rows <= band_tag(token_tag_t'high downto IMAGE_LOW);

  line_tags(0)(LINE_IMAGE)       <= image_rows(count);
  line_tags(0)(LINE_FRAME_FIRST) <= band_starts and row_tags(PASSES)(FRAME_FIRST);

  line_tags(0)(LINE_SLICE_LOW + SLICE_BITS - 1 downto LINE_SLICE_LOW) <= band_tag(IMAGE_LOW - 1 downto SLICE_LOW);

  -- Column modules: every line is a step.
  column_strobe(0) <= row_strobe(PASSES);
  column_tags(0)   <= row_tags(PASSES)(BAND_LAST downto 0);

  column_data(0)(ROW_LANES * ROW_SUM_BITS - 1 downto 0) <= demuxed_data;

  column_pass : for i in 0 to PASSES - 1 generate

    constant STAGE_SHIFTS : string := pass_shifts(SHIFTS, i);

    signal slice   : unsigned(bits_for(slice_count(STAGE_SHIFTS) - 1) - 1 downto 0);
    signal advance : std_logic;

  begin

    first_pass : if i = 0 generate
      slice <= unsigned(line_tags(i)(LINE_SLICE_LOW + SLICE_BITS - 1 downto LINE_SLICE_LOW));
    end generate first_pass;

    later_pass : if i > 0 generate
      slice <= (others => '0');
    end generate later_pass;

    advance <= column_tags(i)(PIXEL) and column_tags(i)(BAND_FIRST);

    stage : entity work.fir_stage
      generic map (
        MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
        SHIFTS           => STAGE_SHIFTS,
        CENTRED          => CENTRED,
        HOLD             => HOLD and i = 0,
        MODULES          => PARALLEL_ROWS,
        DEPTH            => DEPTH,
        LANES            => CHANNELS,
        DATA_BITS        => value_bits(ARITHMETIC, PASSES + i),
        STORED           => STORED,
        SCALE_BITS       => scale_bits(ARITHMETIC, PASSES + i),
        PRODUCT_MAX      => product_max(ARITHMETIC, PASSES + i),
        DROP_BITS        => drop_bits(ARITHMETIC, PASSES + i),
        RESULT_BITS      => value_bits(ARITHMETIC, PASSES + i + 1),
        BROADCAST_TAPS   => BROADCAST_TAPS,
        STEP_TAG_BITS    => line_tag_t'length,
        TOKEN_TAG_BITS   => column_tag_t'length
      )
      port map (
        clk           => clk,
        reset         => reset,
        strobe        => column_strobe(i),
        pixel         => column_tags(i)(PIXEL),
        advance       => advance,
        first         => line_tags(i)(LINE_FRAME_FIRST),
        slice         => slice,
        data          => column_data(i)(ROW_LANES * value_bits(ARITHMETIC, PASSES + i) - 1 downto 0),
        step_tag      => line_tags(i),
        token_tag     => column_tags(i),
        out_strobe    => column_strobe(i + 1),
        out_data      => column_data(i + 1)(ROW_LANES * value_bits(ARITHMETIC, PASSES + i + 1) - 1 downto 0),
        out_step_tag  => line_tags(i + 1),
        out_token_tag => column_tags(i + 1)
      );

  end generate column_pass;

  plain : if not sharpens(SHARPENING) generate
    last_strobe <= column_strobe(PASSES);
    last_column <= column_tags(PASSES);
    last_line   <= line_tags(PASSES);
    last_sums   <= column_data(PASSES)(ROW_LANES * RESULT_SUM_BITS - 1 downto 0);
  end generate plain;

  sharp : if sharpens(SHARPENING) generate

    signal slice     : unsigned(SLICE_BITS - 1 downto 0);
    signal slice_due : unsigned(SLICE_BITS - 1 downto 0);

  begin

    slice <= unsigned(line_tags(PASSES)(line_tag_t'high downto LINE_SLICE_LOW));

    last_line(line_tag_t'high downto LINE_SLICE_LOW) <= std_logic_vector(slice_due);

    sharpener : entity work.lens_sharpener
      generic map (
        MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
        SHARPENING       => SHARPENING,
        PIXELS_PER_CLOCK => 1,
        TOKENS           => MAX_COLUMNS,
        CHANNELS         => CHANNELS,
        SUM_MAX          => product_max(ARITHMETIC, 2 * PASSES),
        DIVISOR          => final_divisor(ARITHMETIC)
      )
      port map (
        clk             => clk,
        reset           => reset,
        strobe          => column_strobe(PASSES),
        pixel           => column_tags(PASSES)(PIXEL),
        line_first      => column_tags(PASSES)(BAND_FIRST),
        line_last       => column_tags(PASSES)(BAND_LAST),
        line_end        => "1",
        image           => line_tags(PASSES)(LINE_IMAGE),
        frame_first     => line_tags(PASSES)(LINE_FRAME_FIRST),
        slice           => slice,
        sums            => column_data(PASSES)(CHANNELS * RESULT_SUM_BITS - 1 downto 0),
        out_strobe      => last_strobe,
        out_pixel       => last_column(PIXEL),
        out_line_first  => last_column(BAND_FIRST),
        out_line_last   => last_column(BAND_LAST),
        out_image       => last_line(LINE_IMAGE),
        out_frame_first => last_line(LINE_FRAME_FIRST),
        out_slice       => slice_due,
        out_sums        => last_sums(CHANNELS * RESULT_SUM_BITS - 1 downto 0)
      );

  end generate sharp;

  -- From modules back to rows.
  back_to_rows : entity work.row_results
    generic map (
      PARALLEL_ROWS => PARALLEL_ROWS,
      SLICE_BITS    => SLICE_BITS,
      SUM_BITS      => CHANNELS * RESULT_SUM_BITS,
      DESKEW        => DESKEW
    )
    port map (
      clk         => clk,
      reset       => reset,
      strobe      => last_strobe,
      pixel       => last_column(PIXEL),
      band_first  => last_column(BAND_FIRST),
      band_last   => last_column(BAND_LAST),
      image       => last_line(LINE_IMAGE),
      frame_first => last_line(LINE_FRAME_FIRST),
      slice       => last_line(line_tag_t'high downto LINE_SLICE_LOW),
      module_sums => last_sums,
      results     => summed,
      row_sums    => sums
    );

  -- Scaling to pixels.
  scale_row : for r in 0 to PARALLEL_ROWS - 1 generate

    scale : entity work.result_scaler
      generic map (
        EXACT       => EXACT,
        LANES       => CHANNELS,
        SUM_BITS    => RESULT_SUM_BITS,
        PIXEL_BITS  => PIXEL_BITS,
        DIVISOR     => final_divisor(ARITHMETIC),
        WEIGHT_BITS => WEIGHT_BITS
      )
      port map (
        clk     => clk,
        reset   => reset,
        result  => summed(r),
        sums    => sums((r + 1) * CHANNELS * RESULT_SUM_BITS - 1 downto r * CHANNELS * RESULT_SUM_BITS),
        weights => weights,
        scaled  => results(r),
        pixels  => result_data((r + 1) * CHANNELS * PIXEL_BITS - 1 downto r * CHANNELS * PIXEL_BITS)
      );

  end generate scale_row;

end architecture rtl;
