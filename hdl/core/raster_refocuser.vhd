-- Refocuses a raster scan of a light field: one pixel each clock, all channels at once.
--
-- Input FIFO -> frame sequencer -> row gather -> filter array -> row scatter. With PARALLEL_ROWS = 1 the array
-- is one row module and one column module on line buffers, gather and scatter are wires and a
-- FIFO. With more, the gather stores lines until it has as many, and the scatter puts them in order again.
--
-- The a' that can be chosen while video runs are a set: SHIFTS => "-3 0 3". `slice` (0 for the
-- first of the set) takes effect with the next frame. All slices have the same latency.
--
-- Lines and frames may follow each other without a gap. When nothing follows, the core pushes
-- the rest of the frame out by itself; the input FIFO holds what arrives meanwhile (a line at most).
-- Stalls on either side lose and repeat nothing. The sequencer decides each clock whether
-- the stages get a token, so no enable reaches the filters: the output has room for all tokens under way.
--
-- Latency: with PARALLEL_ROWS = 1, D * (max(columns, 4) + 1) + 7 + array_latency clocks from the first pixel in
--   to the first pixel out when nothing stalls, D = total_delay (nearest neighbour: D * (columns + 1) + 16, stored
--   products 15). With more, CoreConfiguration.latency_clocks of the Python package gives it.
-- Throughput: one pixel of all channels each clock. With PARALLEL_ROWS > 1 a line that is a band by itself (the last
--   of a frame) takes as many clocks as its columns, rounded up to a multiple of PARALLEL_ROWS.
-- Ports: AXI4-Stream video, tuser(0) = start of frame, tlast = end of line, tid = slice of the frame
--   that comes out, channel 0 in the low bits of tdata; columns, rows: frame size, read with the first
--   pixel of a frame; slice, sweep, sweep_frames as in slice_select, read with it too; error_flags
--   as in frame_sequencer, set until error_clear.
-- Equation: out(k) = round(S2(k) / M**2), S2 the refocusing sums of rows, then columns (EXACT); or
--   with stored products: product = round(x * 2**F / M), intermediate image with G guard
--   bits, rounded and saturated after each pass.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.moving_sum_pkg.all;

entity raster_refocuser is
  generic (
    -- M: pixels a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- The set of a' = a * M from which a slice is chosen, in pixels, with blanks in between.
    SHIFTS : string;
    -- Whether the picture stays put while focus is stepped.
    CENTRED : boolean := true;
    -- 0: nearest neighbour, 1: linear, n: n moving sums more in each dimension.
    INTERPOLATION_ORDER : natural range 0 to 3 := 0;
    -- For sets of integer a: M taps less, and each output held for a micro image.
    HOLD : boolean := false;
    -- Rows that are filtered at once.
    PARALLEL_ROWS : positive := 1;
    -- Longest line in pixels; line buffers and input FIFO hold as many.
    MAX_COLUMNS : positive range 1 to 8192 := 2048;
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3 := 1;
    -- Width of a channel; stored products take up to 16 - GUARD_BITS.
    PIXEL_BITS : positive range 1 to 16 := 8;
    -- Exact sums and one division at the end, or stored products.
    EXACT : boolean := true;
    -- Stored products only: fraction bits of the products, at least GUARD_BITS.
    FRACTION_BITS : natural range 0 to 12 := 0;
    -- Stored products only: guard bits of the intermediate image.
    GUARD_BITS : natural range 0 to 12 := 0;
    -- "fir" (fir_array) or "moving_sum" (moving_sum_array).
    ENGINE : string := "fir";
    -- Moving sums only: whether frames whose rows are no multiple of M follow each other without a pause, too.
    ANY_ROWS : boolean := false;
    -- Taps that one latch of the broadcast net drives; 0: no latches, all taps from one register.
    BROADCAST_TAPS : natural := 0
  );
  port (
    clk           : in    std_logic;
    reset         : in    std_logic;
    columns       : in    std_logic_vector(15 downto 0);
    rows          : in    std_logic_vector(15 downto 0);
    slice         : in    std_logic_vector(7 downto 0);
    sweep         : in    std_logic;
    sweep_frames  : in    std_logic_vector(7 downto 0);
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tid    : out   std_logic_vector(7 downto 0);
    m_axis_tlast  : out   std_logic;
    error_flags   : out   std_logic_vector(4 downto 0);
    error_clear   : in    std_logic
  );
end entity raster_refocuser;

architecture rtl of raster_refocuser is

  constant MOVING_SUM : boolean  := same_text(ENGINE, "moving_sum");
  constant STORED     : boolean  := not EXACT;
  constant DELAY      : natural  := total_delay(MICRO_IMAGE_SIZE, SHIFTS, CENTRED, INTERPOLATION_ORDER);
  constant SLICES     : positive := slice_count(SHIFTS);
  constant SLICE_BITS : positive := bits_for(SLICES - 1);

  -- The input FIFO takes what arrives during a flush line, and 3 words of its own latency.
  constant INPUT_ADDRESS_BITS : positive := bits_for(MAX_COLUMNS + 2 * PARALLEL_ROWS - 1);
  -- Sequencer 2, gather, array.
  constant TOKENS_UNDER_WAY : positive := 2 + choose(PARALLEL_ROWS > 1, 1, 0) +
                                          choose(MOVING_SUM,
                                                  sum_array_latency(STORED, INTERPOLATION_ORDER, MAX_COLUMNS),
                                                  array_latency(STORED, BROADCAST_TAPS, INTERPOLATION_ORDER));

  -- The shortest lines and frames that the engine takes without a pause.
  constant MIN_STEPS : positive := choose(MOVING_SUM and DELAY >= PARTIAL_SUM_LOOP, DELAY + 1,
                                          min_line_steps(PARALLEL_ROWS, MAX_COLUMNS));

  constant DATA_BITS   : positive := CHANNELS * PIXEL_BITS;
  constant STREAM_BITS : positive := DATA_BITS + 2;
  constant LAST_BIT    : natural  := DATA_BITS;
  constant START_BIT   : natural  := DATA_BITS + 1;
  -- A word of the output: slice, start of frame, end of line, pixel.
  constant WORD_BITS : positive := STREAM_BITS + SLICE_BITS;

  signal input_word   : std_logic_vector(STREAM_BITS - 1 downto 0);
  signal stream_word  : std_logic_vector(STREAM_BITS - 1 downto 0);
  signal stream_valid : std_logic;
  signal stream_ready : std_logic;
  signal room         : std_logic;
  signal calm         : std_logic;

  signal frame_start    : std_logic;
  signal slice_selected : unsigned(SLICE_BITS - 1 downto 0);

  signal token_strobe      : std_logic;
  signal token_pixel       : std_logic;
  signal token_line_first  : std_logic;
  signal token_line_last   : std_logic;
  signal token_row         : natural range 0 to PARALLEL_ROWS - 1;
  signal token_band        : std_logic;
  signal token_frame_first : std_logic;
  signal token_slice       : unsigned(SLICE_BITS - 1 downto 0);
  signal token_image       : std_logic;
  signal token_data        : std_logic_vector(DATA_BITS - 1 downto 0);

  signal array_strobe      : std_logic;
  signal array_pixel       : std_logic;
  signal array_band_first  : std_logic;
  signal array_band_last   : std_logic;
  signal array_frame_first : std_logic;
  signal array_slice       : unsigned(SLICE_BITS - 1 downto 0);
  signal array_image       : std_logic_vector(PARALLEL_ROWS - 1 downto 0);
  signal array_data        : std_logic_vector(PARALLEL_ROWS * DATA_BITS - 1 downto 0);

  signal row_valid : std_logic_vector(PARALLEL_ROWS - 1 downto 0);
  signal row_skip  : std_logic_vector(PARALLEL_ROWS - 1 downto 0);
  signal row_start : std_logic_vector(PARALLEL_ROWS - 1 downto 0);
  signal row_last  : std_logic_vector(PARALLEL_ROWS - 1 downto 0);
  signal row_slice : std_logic_vector(PARALLEL_ROWS * SLICE_BITS - 1 downto 0);
  signal row_data  : std_logic_vector(PARALLEL_ROWS * DATA_BITS - 1 downto 0);
  signal row_words : std_logic_vector(PARALLEL_ROWS * WORD_BITS - 1 downto 0);

  signal output_word : std_logic_vector(WORD_BITS - 1 downto 0);

begin

  assert MOVING_SUM or same_text(ENGINE, "fir")
    report "raster_refocuser: unknown ENGINE " & ENGINE & ", expected fir or moving_sum"
    severity failure;

  assert MOVING_SUM or not ANY_ROWS
    report "raster_refocuser: ANY_ROWS requires the engine moving_sum"
    severity failure;

  assert not MOVING_SUM or PARALLEL_ROWS = 1
    report "raster_refocuser: PARALLEL_ROWS above 1 requires the engine fir"
    severity failure;

  -- Stream to tokens.
  input_word <= s_axis_tuser & s_axis_tlast & s_axis_tdata;

  input_fifo : entity work.axis_fifo
    generic map (
      WIDTH        => STREAM_BITS,
      ADDRESS_BITS => INPUT_ADDRESS_BITS
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => s_axis_tvalid,
      s_axis_tready => s_axis_tready,
      s_axis_tdata  => input_word,
      m_axis_tvalid => stream_valid,
      m_axis_tready => stream_ready,
      m_axis_tdata  => stream_word,
      level         => open
    );

  choose_slice : entity work.slice_select
    generic map (
      SLICES     => SLICES,
      SLICE_BITS => SLICE_BITS
    )
    port map (
      clk          => clk,
      reset        => reset,
      frame_start  => frame_start,
      slice        => slice,
      sweep        => sweep,
      sweep_frames => sweep_frames,
      selected     => slice_selected
    );

  sequencer : entity work.frame_sequencer
    generic map (
      MAX_COLUMNS   => MAX_COLUMNS,
      PARALLEL_ROWS => PARALLEL_ROWS,
      DATA_BITS     => DATA_BITS,
      SLICE_BITS    => SLICE_BITS,
      ROW_FLUSH     => DELAY + PARALLEL_ROWS - 1 + choose(PARALLEL_ROWS > 1, TOKENS_UNDER_WAY, 0),
      COLUMN_FLUSH  => divide_up(DELAY, PARALLEL_ROWS),
      MIN_STEPS     => MIN_STEPS,
      MIN_BANDS     => choose(MOVING_SUM,
                               least_frame(MICRO_IMAGE_SIZE, SHIFTS, CENTRED, INTERPOLATION_ORDER, ANY_ROWS), 1),
      BAND_MODULUS  => choose(MOVING_SUM and not ANY_ROWS, MICRO_IMAGE_SIZE, 1)
    )
    port map (
      clk               => clk,
      reset             => reset,
      columns           => columns,
      rows              => rows,
      slice             => slice_selected,
      frame_start       => frame_start,
      s_axis_tvalid     => stream_valid,
      s_axis_tready     => stream_ready,
      s_axis_tdata      => stream_word(DATA_BITS - 1 downto 0),
      s_axis_tuser      => stream_word(START_BIT),
      s_axis_tlast      => stream_word(LAST_BIT),
      room              => room,
      calm              => calm,
      token_strobe      => token_strobe,
      token_pixel       => token_pixel,
      token_line_first  => token_line_first,
      token_line_last   => token_line_last,
      token_row         => token_row,
      token_band        => token_band,
      token_frame_first => token_frame_first,
      token_slice       => token_slice,
      token_image       => token_image,
      token_data        => token_data,
      error_flags       => error_flags,
      error_clear       => error_clear
    );

  gather : entity work.row_gather
    generic map (
      PARALLEL_ROWS => PARALLEL_ROWS,
      MAX_COLUMNS   => MAX_COLUMNS,
      DATA_BITS     => DATA_BITS,
      SLICE_BITS    => SLICE_BITS
    )
    port map (
      clk               => clk,
      reset             => reset,
      token_strobe      => token_strobe,
      token_pixel       => token_pixel,
      token_line_first  => token_line_first,
      token_line_last   => token_line_last,
      token_row         => token_row,
      token_band        => token_band,
      token_frame_first => token_frame_first,
      token_slice       => token_slice,
      token_image       => token_image,
      token_data        => token_data,
      array_strobe      => array_strobe,
      array_pixel       => array_pixel,
      array_band_first  => array_band_first,
      array_band_last   => array_band_last,
      array_frame_first => array_frame_first,
      array_slice       => array_slice,
      array_image       => array_image,
      array_data        => array_data
    );

  -- The engine.
  tap_engine : if not MOVING_SUM generate

    modules : entity work.fir_array
      generic map (
        MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
        SHIFTS              => SHIFTS,
        CENTRED             => CENTRED,
        INTERPOLATION_ORDER => INTERPOLATION_ORDER,
        HOLD                => HOLD,
        PARALLEL_ROWS       => PARALLEL_ROWS,
        MAX_COLUMNS         => MAX_COLUMNS,
        CHANNELS            => CHANNELS,
        PIXEL_BITS          => PIXEL_BITS,
        EXACT               => EXACT,
        FRACTION_BITS       => FRACTION_BITS,
        GUARD_BITS          => GUARD_BITS,
        BROADCAST_TAPS      => BROADCAST_TAPS,
        DESKEW              => false
      )
      port map (
        clk            => clk,
        reset          => reset,
        in_strobe      => array_strobe,
        in_pixel       => array_pixel,
        in_band_first  => array_band_first,
        in_band_last   => array_band_last,
        in_frame_first => array_frame_first,
        in_slice       => array_slice,
        in_image       => array_image,
        in_data        => array_data,
        out_valid      => row_valid,
        out_skip       => row_skip,
        out_start      => row_start,
        out_last       => row_last,
        out_slice      => row_slice,
        out_data       => row_data
      );

  end generate tap_engine;

  sum_engine : if MOVING_SUM generate

    signal sum_slice : unsigned(SLICE_BITS - 1 downto 0);

  begin

    sums : entity work.moving_sum_array
      generic map (
        MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
        SHIFTS              => SHIFTS,
        CENTRED             => CENTRED,
        INTERPOLATION_ORDER => INTERPOLATION_ORDER,
        MAX_COLUMNS         => MAX_COLUMNS,
        CHANNELS            => CHANNELS,
        PIXEL_BITS          => PIXEL_BITS,
        EXACT               => EXACT,
        FRACTION_BITS       => FRACTION_BITS,
        GUARD_BITS          => GUARD_BITS,
        ANY_ROWS            => ANY_ROWS
      )
      port map (
        clk            => clk,
        reset          => reset,
        in_strobe      => array_strobe,
        in_pixel       => array_pixel,
        in_band_first  => array_band_first,
        in_band_last   => array_band_last,
        in_frame_first => array_frame_first,
        in_slice       => array_slice,
        in_image       => array_image(0),
        in_data        => array_data(DATA_BITS - 1 downto 0),
        out_valid      => row_valid(0),
        out_skip       => row_skip(0),
        out_start      => row_start(0),
        out_last       => row_last(0),
        out_slice      => sum_slice,
        out_data       => row_data(DATA_BITS - 1 downto 0)
      );

    row_slice(SLICE_BITS - 1 downto 0) <= std_logic_vector(sum_slice);

  end generate sum_engine;

  row_word : for r in 0 to PARALLEL_ROWS - 1 generate
    row_words((r + 1) * WORD_BITS - 1 downto r * WORD_BITS) <= row_slice((r + 1) * SLICE_BITS - 1 downto
                                                                         r * SLICE_BITS) &
                                                               row_start(r) & row_last(r) &
                                                               row_data((r + 1) * DATA_BITS - 1 downto
                                                                        r * DATA_BITS);
  end generate row_word;

  scatter : entity work.row_scatter
    generic map (
      PARALLEL_ROWS => PARALLEL_ROWS,
      MAX_COLUMNS   => MAX_COLUMNS,
      WIDTH         => WORD_BITS,
      LAST_BIT      => LAST_BIT,
      UNDER_WAY     => TOKENS_UNDER_WAY
    )
    port map (
      clk           => clk,
      reset         => reset,
      row_valid     => row_valid,
      row_skip      => row_skip,
      row_words     => row_words,
      m_axis_tvalid => m_axis_tvalid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => output_word,
      room          => room,
      calm          => calm
    );

  m_axis_tdata    <= output_word(DATA_BITS - 1 downto 0);
  m_axis_tlast    <= output_word(LAST_BIT);
  m_axis_tuser(0) <= output_word(START_BIT);
  m_axis_tid      <= std_logic_vector(resize(unsigned(output_word(WORD_BITS - 1 downto STREAM_BITS)), 8));

end architecture rtl;
