-- SPDX-License-Identifier: Apache-2.0
-- The array of FIR filters: N rows of an image at once, through N row modules and N column modules.
--
-- Row modules filter the rows of a band in step. Skew registers delay row r by r tokens, so that the pixels of a
-- column come one after the other. A pixel counter and demultiplexers hand column k to column module k mod N. The
-- module takes the column's N pixels in N tokens and turns to its next column. Each column module keeps the partial
-- sums of its own columns (every N-th column) in line buffers of its own. row_results puts the rows together again.
--
-- With N = 1 the array filters a raster scan. With N = rows of the frame, a frame is one band.
--
-- Interpolation of order n appends n moving sums over M pixels in each dimension (1: linear).
--
-- A band is N lines of the image. Its columns come as pixel tokens, with or without idle clocks and empty tokens
-- (strobe without pixel) in between. The next band may begin min_steps tokens later, and after a multiple of N
-- tokens; empty tokens fill the time. Behind a frame, bands of zeros without image lines push its last lines out;
-- empty tokens push out the last pixels of a band.
--
-- Output lines are total_delay lines behind: band b gives the lines from N*b - total_delay on, as far as they are
-- image lines. A frame begins at the top of a band.
--
-- Latency: floor(D/N) bands, D + D mod N tokens and sum_clocks clocks, D = total_delay, from the first pixel in to the
-- first sum out.
-- Throughput: N pixels of all channels each clock.
-- Equation: sums(k) = S2(k), the refocusing sums of rows, then of columns; with stored products the pixels as in
--   raster_refocuser.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.count_pkg.all;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.core_pkg.all;
use work.token_pkg.all;

entity fir_array is
  generic (
    -- The core that the filters are built for.
    CORE : core_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token of a band; its field image is not used, see token_rows. line_first and line_last are the ends of
    -- the band.
    token : in    token_t;
    -- Which rows are image lines, constant within a band; and the pixels, row 0 in the low bits.
    token_rows : in    std_logic_vector(CORE.rows - 1 downto 0);
    token_data : in    std_logic_vector(CORE.rows * row_bits(CORE) - 1 downto 0);
    -- The token of each row behind the filters, and its sums, row 0 in the low bits.
    out_token : out   tokens_t(0 to CORE.rows - 1);
    out_sums  : out   std_logic_vector(CORE.rows * row_sums_bits(CORE) - 1 downto 0)
  );
end entity fir_array;

architecture rtl of fir_array is

  constant GEOMETRY   : geometry_t   := CORE.geometry;
  constant ARITHMETIC : arithmetic_t := CORE.arithmetic;

  -- Passes are numbered from 0: rows first, then columns.
  constant PASSES        : positive := ARITHMETIC.passes;
  constant PARALLEL_ROWS : positive := CORE.rows;
  constant CHANNELS      : positive := CORE.channels;
  -- ROW_LANES: filters of a row stage that work in step; DEPTH: columns of a column module.
  constant ROW_LANES : positive := PARALLEL_ROWS * CHANNELS;
  constant DEPTH     : positive := divide_up(CORE.columns, PARALLEL_ROWS);

  constant ROW_SUM_BITS : positive := value_bits(ARITHMETIC, PASSES);

  -- Signals from one stage to the next, in the low bits of each element.
  type row_data_t is array (natural range 0 to PASSES) of std_logic_vector(ROW_LANES * ROW_SUM_BITS - 1 downto 0);

  type row_flags_t is array (natural range 0 to PASSES) of std_logic_vector(PARALLEL_ROWS - 1 downto 0);

  constant COLUMN_WIDTH : positive := widest_bits(ARITHMETIC);

  type column_data_t is array (natural range 0 to PASSES) of std_logic_vector(ROW_LANES * COLUMN_WIDTH - 1 downto 0);

  -- Tokens in the row modules, which rows of their band are image lines, and the pixels.
  signal row_token : tokens_t(0 to PASSES);
  signal row_image : row_flags_t;
  signal row_data  : row_data_t;

  signal skewed_data  : std_logic_vector(ROW_LANES * ROW_SUM_BITS - 1 downto 0);
  signal demuxed_data : std_logic_vector(ROW_LANES * ROW_SUM_BITS - 1 downto 0);
  signal band_starts  : std_logic;
  signal count        : natural range 0 to larger(PARALLEL_ROWS - 1, 1);
  signal count_held   : natural range 0 to larger(PARALLEL_ROWS - 1, 1) := 0;
  -- Slice and image rows of the band whose columns the modules take.
  signal band_slice : slice_t;
  signal band_image : std_logic_vector(PARALLEL_ROWS - 1 downto 0);
  signal slice_held : slice_t;
  signal image_held : std_logic_vector(PARALLEL_ROWS - 1 downto 0);

  -- In the column modules a token is that of module 0. The t-th token of a band carries the fields of the line of
  -- row t.
  signal column_token : tokens_t(0 to PASSES);
  signal column_data  : column_data_t;

begin

  -- Row modules. Every token is a step.
  row_token(0) <= token;
  row_image(0) <= token_rows;

  row_data(0)(ROW_LANES * ARITHMETIC.pixel_bits - 1 downto 0) <= token_data;

  row_pass : for i in 0 to PASSES - 1 generate

    stage : entity work.fir_stage
      generic map (
        GEOMETRY       => pass_geometry(GEOMETRY, i),
        SIZES          => pass_of(ARITHMETIC, i),
        HOLD           => CORE.hold and i = 0,
        LANES          => ROW_LANES,
        BROADCAST_TAPS => CORE.taps,
        TAG_BITS       => PARALLEL_ROWS
      )
      port map (
        clk       => clk,
        reset     => reset,
        token     => row_token(i),
        data      => row_data(i)(ROW_LANES * value_bits(ARITHMETIC, i) - 1 downto 0),
        tag       => row_image(i),
        out_token => row_token(i + 1),
        out_data  => row_data(i + 1)(ROW_LANES * value_bits(ARITHMETIC, i + 1) - 1 downto 0),
        out_tag   => row_image(i + 1)
      );

  end generate row_pass;

  -- Skew registers, pixel counter, demultiplexers. Without the skew all N pixels of a column would reach one
  -- column module in the same clock.
  skew_rows : entity work.lane_skew
    generic map (
      LANES => PARALLEL_ROWS,
      WIDTH => CHANNELS * ROW_SUM_BITS
    )
    port map (
      clk      => clk,
      enable   => row_token(PASSES).strobe,
      data_in  => row_data(PASSES),
      data_out => skewed_data
    );

  band_starts <= begins_line(row_token(PASSES));

  count <= place_in_turn(count_held, band_starts, PARALLEL_ROWS);

  -- Column k belongs to module k mod N: the demultiplexers rotate the N rows by the count.
  demultiplex : entity work.lane_exchange
    generic map (
      LANES => PARALLEL_ROWS,
      WIDTH => CHANNELS * ROW_SUM_BITS
    )
    port map (
      clk      => clk,
      strobe   => row_token(PASSES).strobe,
      count    => count,
      data_in  => skewed_data,
      data_out => demuxed_data
    );

  -- The first token of a band says which of its rows are image lines. The next N - 1 tokens need that too, because
  -- each carries the fields of the next row.
  band_slice <= row_token(PASSES).slice when band_starts = '1' else
                slice_held;
  band_image <= row_image(PASSES) when band_starts = '1' else
                image_held;

  hold_band : process (clk) is
  begin

    if rising_edge(clk) then
      if row_token(PASSES).strobe = '1' then
        count_held <= count;
        slice_held <= band_slice;
        image_held <= band_image;
      end if;
    end if;

  end process hold_band;

  -- Column modules. Every line is a step.
  hand_over : process (row_token, band_starts, band_slice, band_image, count) is
  begin

    column_token(0)             <= row_token(PASSES);
    column_token(0).image       <= band_image(count);
    column_token(0).frame_first <= band_starts and row_token(PASSES).frame_first;
    column_token(0).slice       <= band_slice;

  end process hand_over;

  column_data(0)(ROW_LANES * ROW_SUM_BITS - 1 downto 0) <= demuxed_data;

  column_pass : for i in 0 to PASSES - 1 generate

    stage : entity work.fir_stage
      generic map (
        GEOMETRY       => pass_geometry(GEOMETRY, i),
        SIZES          => pass_of(ARITHMETIC, PASSES + i),
        HOLD           => CORE.hold and i = 0,
        COLUMNS        => true,
        MODULES        => PARALLEL_ROWS,
        DEPTH          => DEPTH,
        LANES          => CHANNELS,
        BROADCAST_TAPS => CORE.taps
      )
      port map (
        clk       => clk,
        reset     => reset,
        token     => column_token(i),
        data      => column_data(i)(ROW_LANES * value_bits(ARITHMETIC, PASSES + i) - 1 downto 0),
        out_token => column_token(i + 1),
        out_data  => column_data(i + 1)(ROW_LANES * value_bits(ARITHMETIC, PASSES + i + 1) - 1 downto 0)
      );

  end generate column_pass;

  -- From modules back to rows. row_results reads the fields of each row's line with the token that brings them, so
  -- it needs no memory of bands.
  back_to_rows : entity work.row_results
    generic map (
      PARALLEL_ROWS => PARALLEL_ROWS,
      SUM_BITS      => row_sums_bits(CORE)
    )
    port map (
      clk         => clk,
      reset       => reset,
      token       => column_token(PASSES),
      module_sums => column_data(PASSES)(CORE.rows * row_sums_bits(CORE) - 1 downto 0),
      row_token   => out_token,
      row_sums    => out_sums
    );

end architecture rtl;
