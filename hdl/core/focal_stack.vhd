-- Refocuses a raster scan of a light field to several planes at once: a focal stack in one pass.
--
-- Input FIFO -> frame sequencer -> stack array -> output FIFO. The slices share the column memory, which holds
-- pixels of the input, and the delay; each has moving sums of its own. Arithmetic is exact.
--
-- Lines may follow each other without a gap, and so may frames of a multiple of M lines. When nothing follows, the core
-- pushes the rest of the frame out by itself, in lines up to a multiple of M. A frame that comes meanwhile waits
-- in the input FIFO, which holds INPUT_LINES lines: with M a source that cannot wait is never refused.
-- Stalls on either side lose and repeat nothing.
--
-- Latency: D * (columns + 1) + 7 + stack_array_latency clocks from the first pixel in to the first pixel out
--   when nothing stalls and lines have D + 1 pixels, D = output_delay.
-- Throughput: one pixel of all channels and slices each clock.
-- Ports: AXI4-Stream video as in raster_refocuser; m_axis_tdata: the slices of a pixel, the first in the low bits;
--   columns, rows, error_flags, error_clear as there.
-- Equation: as raster_refocuser with EXACT, for each slice.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.focal_stack_pkg.all;

entity focal_stack is
  generic (
    -- M: pixels a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- The slices: a' = a * M in pixels, with blanks in between.
    SHIFTS : string;
    -- Whether the picture stays put from slice to slice.
    CENTRED : boolean := true;
    -- Longest line in pixels.
    MAX_COLUMNS : positive range 1 to 8192 := 2048;
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3 := 1;
    -- Width of a channel.
    PIXEL_BITS : positive range 1 to 16 := 8;
    -- Lines that the input FIFO holds.
    INPUT_LINES : positive := 1
  );
  port (
    clk           : in    std_logic;
    reset         : in    std_logic;
    columns       : in    std_logic_vector(15 downto 0);
    rows          : in    std_logic_vector(15 downto 0);
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(slice_count(SHIFTS) * CHANNELS * PIXEL_BITS - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tlast  : out   std_logic;
    error_flags   : out   std_logic_vector(4 downto 0);
    error_clear   : in    std_logic
  );
end entity focal_stack;

architecture rtl of focal_stack is

  constant DELAY : natural := output_delay(MICRO_IMAGE_SIZE, SHIFTS, CENTRED);

  -- What arrives meanwhile, and 3 words of the FIFO's own latency.
  constant INPUT_ADDRESS_BITS : positive := bits_for(INPUT_LINES * MAX_COLUMNS + 1);
  -- Sequencer 2, array.
  constant TOKENS_UNDER_WAY : positive := 2 + stack_array_latency;

  constant MIN_STEPS : positive := choose(DELAY >= PARTIAL_SUM_LOOP, DELAY + 1, min_line_steps(1, MAX_COLUMNS));

  constant IN_BITS  : positive := CHANNELS * PIXEL_BITS;
  constant OUT_BITS : positive := slice_count(SHIFTS) * IN_BITS;

  signal input_word   : std_logic_vector(IN_BITS + 1 downto 0);
  signal stream_word  : std_logic_vector(IN_BITS + 1 downto 0);
  signal stream_valid : std_logic;
  signal stream_ready : std_logic;
  signal room         : std_logic;
  signal calm         : std_logic;

  signal token_strobe      : std_logic;
  signal token_pixel       : std_logic;
  signal token_line_first  : std_logic;
  signal token_line_last   : std_logic;
  signal token_frame_first : std_logic;
  signal token_image       : std_logic;
  signal token_data        : std_logic_vector(IN_BITS - 1 downto 0);

  signal stack_valid : std_logic_vector(0 downto 0);
  signal stack_start : std_logic;
  signal stack_last  : std_logic;
  signal stack_data  : std_logic_vector(OUT_BITS - 1 downto 0);
  signal stack_word  : std_logic_vector(OUT_BITS + 1 downto 0);
  signal output_word : std_logic_vector(OUT_BITS + 1 downto 0);

begin

  assert slice_count(SHIFTS) >= 1
    report "focal_stack: SHIFTS names no slice"
    severity failure;

  input_word <= s_axis_tuser & s_axis_tlast & s_axis_tdata;

  input_fifo : entity work.axis_fifo
    generic map (
      WIDTH        => IN_BITS + 2,
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

  sequencer : entity work.frame_sequencer
    generic map (
      MAX_COLUMNS   => MAX_COLUMNS,
      PARALLEL_ROWS => 1,
      DATA_BITS     => IN_BITS,
      SLICE_BITS    => 1,
      ROW_FLUSH     => DELAY,
      COLUMN_FLUSH  => DELAY,
      MIN_STEPS     => MIN_STEPS,
      MIN_BANDS     => DELAY + 1,
      BAND_MODULUS  => MICRO_IMAGE_SIZE,
      KEEP_MODULUS  => true
    )
    port map (
      clk               => clk,
      reset             => reset,
      columns           => columns,
      rows              => rows,
      slice             => "0",
      frame_start       => open,
      s_axis_tvalid     => stream_valid,
      s_axis_tready     => stream_ready,
      s_axis_tdata      => stream_word(IN_BITS - 1 downto 0),
      s_axis_tuser      => stream_word(IN_BITS + 1),
      s_axis_tlast      => stream_word(IN_BITS),
      room              => room,
      calm              => calm,
      token_strobe      => token_strobe,
      token_pixel       => token_pixel,
      token_line_first  => token_line_first,
      token_line_last   => token_line_last,
      token_row         => open,
      token_band        => open,
      token_frame_first => token_frame_first,
      token_slice       => open,
      token_image       => token_image,
      token_data        => token_data,
      error_flags       => error_flags,
      error_clear       => error_clear
    );

  stack : entity work.stack_array
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFTS           => SHIFTS,
      CENTRED          => CENTRED,
      MAX_COLUMNS      => MAX_COLUMNS,
      CHANNELS         => CHANNELS,
      PIXEL_BITS       => PIXEL_BITS
    )
    port map (
      clk            => clk,
      reset          => reset,
      in_strobe      => token_strobe,
      in_pixel       => token_pixel,
      in_band_first  => token_line_first,
      in_band_last   => token_line_last,
      in_frame_first => token_frame_first,
      in_image       => token_image,
      in_data        => token_data,
      out_valid      => stack_valid(0),
      out_start      => stack_start,
      out_last       => stack_last,
      out_data       => stack_data
    );

  stack_word <= stack_start & stack_last & stack_data;

  -- With one row at once a FIFO that tells the sequencer of its room.
  scatter : entity work.row_scatter
    generic map (
      PARALLEL_ROWS => 1,
      MAX_COLUMNS   => MAX_COLUMNS,
      WIDTH         => OUT_BITS + 2,
      LAST_BIT      => OUT_BITS,
      UNDER_WAY     => TOKENS_UNDER_WAY
    )
    port map (
      clk           => clk,
      reset         => reset,
      row_valid     => stack_valid,
      row_skip      => "0",
      row_words     => stack_word,
      m_axis_tvalid => m_axis_tvalid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => output_word,
      room          => room,
      calm          => calm
    );

  m_axis_tdata    <= output_word(OUT_BITS - 1 downto 0);
  m_axis_tlast    <= output_word(OUT_BITS);
  m_axis_tuser(0) <= output_word(OUT_BITS + 1);

end architecture rtl;
