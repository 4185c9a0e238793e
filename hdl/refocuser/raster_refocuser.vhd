-- SPDX-License-Identifier: Apache-2.0
-- Refocuses a raster scan of a light field: one pixel with all channels each clock, or PIXELS_PER_CLOCK of them.
--
-- The entity makes the core from its generics; refocuser is a stream shell around an engine: FIR filters (fir_array) or
-- moving sums (moving_sum_array).
--
-- SHIFTS is the set of shifts a' that can be chosen while video runs, such as "-3 0 3". `slice` is a number in the set,
-- from 0, and takes effect with the next frame. All slices have the same latency.
--
-- Lines and frames may follow each other without a gap. When nothing follows, the core pushes the rest of the frame out
-- by itself; the input FIFO holds the pixels that arrive meanwhile (a line at most). Stalls on either side neither lose
-- nor repeat pixels.
--
-- Latency: D * (max(columns, 4) + 1) + 7 + clocks of the plan (core_pkg), D = column_lines, with PARALLEL_ROWS = 1 and
-- one pixel each clock, from the first pixel in to the first pixel out when nothing stalls (nearest neighbour: D *
-- (columns + 1) + 16 clocks, stored products 15). With BORDER_NORMALISED max(columns, D + 1) replaces max(columns, 4).
-- With more rows or pixels, CoreConfiguration.latency_clocks of the Python package computes it.
-- Throughput: PIXELS_PER_CLOCK pixels of all channels each clock. With PARALLEL_ROWS > 1 a line that is a band by
-- itself (the last of a frame) takes as many clocks as its columns, rounded up to a multiple of PARALLEL_ROWS.
-- Equation: out(k) = round(S2(k) / B**2) with EXACT, S2 being the refocusing sums of rows, then of columns. With stored
-- products: product = round(x * 2**F / B), intermediate image with G guard bits, rounded and saturated after each pass.
-- With BORDER_NORMALISED out(k) = round(S2(k) / weight(k)), the weight being S2 of a frame of ones; 0 where the weight
-- is 0.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.core_pkg.all;
use work.token_pkg.all;
use work.refocuser_pkg.all;

entity raster_refocuser is
  generic (
    -- M: pixels a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- The slices that can be chosen while video runs: the focus setting a' = a * M of each in pixels, with blanks in
    -- between.
    SHIFTS : string;
    -- true: the picture stays in place while the focus changes.
    CENTRED : boolean := true;
    -- 0: nearest neighbour, 1: linear, n: B-spline of order n, by n more moving sums in each dimension.
    INTERPOLATION_ORDER : natural range 0 to 3 := 0;
    -- For integer a only: one output for each micro image is computed and held, which saves M taps.
    HOLD : boolean := false;
    -- Rows filtered at once (iota in the thesis).
    PARALLEL_ROWS : positive range 1 to 64 := 1;
    -- Neighbouring pixels of a line in one transfer: 1, 2, 4, 8, 16 or 32. Above 1 only for moving sums with exact
    -- arithmetic.
    PIXELS_PER_CLOCK : positive range 1 to 32 := 1;
    -- Longest line in pixels, at least 2 with moving sums. Line buffers and the input FIFO are as long.
    MAX_COLUMNS : positive range 1 to 8192 := 2048;
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3 := 1;
    -- Bits of a channel; with stored products up to 16 - GUARD_BITS.
    PIXEL_BITS : positive range 1 to 16 := 8;
    -- true: exact sums and one division at the end; false: stored products.
    EXACT : boolean := true;
    -- Stored products only: fraction bits of the products, at least GUARD_BITS.
    FRACTION_BITS : natural range 0 to 12 := 0;
    -- Stored products only: guard bits of the intermediate image.
    GUARD_BITS : natural range 0 to 12 := 0;
    -- "fir" (fir_array) takes frames and lines of any size without a pause; "moving_sum" (moving_sum_array) is smaller,
    -- so the planner nearly always takes it.
    ENGINE : string := "fir";
    -- Moving sums only; true: frames with any number of rows follow each other without a pause; false: a multiple of M.
    ANY_ROWS : boolean := false;
    -- The weight of each slice's sharpening (lens_sharpener) in 64ths, 0 to 16, such as "4 0 4". The sharpener is only
    -- built for a weight above 0; it needs exact arithmetic and one row at a time.
    SHARPENING : string := "";
    -- The box B of each slice in samples, such as "3 5 3", or one for all; "" for M. A smaller box averages B of the M
    -- views at an output, so the picture is less blurred where the slice is in focus. B is 1 to M and a multiple of
    -- gcd(a', M); all are equal with stored products or sharpening.
    BOX : string := "";
    -- Near the border some views are missing. true: divide by the number of existing views; false: divide by B * B, as
    -- if missing views were black. true needs exact arithmetic, one row at a time, no sharpening.
    BORDER_NORMALISED : boolean := false;
    -- Taps that each latch of the broadcast net drives; 0: no latches, one register drives all taps.
    BROADCAST_TAPS : natural := 0
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Frame size, read with the first pixel of a frame; must be constant until the frame has come out.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- Slice of the next frame, as a number in the set from 0; numbers beyond the set mean its last slice. With sweep
    -- all slices come in turn, each for sweep_frames frames (0 counts as 1). All three are read in the clock in which
    -- the first pixel of a frame is taken.
    slice        : in    std_logic_vector(7 downto 0);
    sweep        : in    std_logic                    := '0';
    sweep_frames : in    std_logic_vector(7 downto 0) := x"00";
    -- AXI4-Stream video: tuser(0) = start of frame, tlast = end of line, channel 0 of the first pixel in the low bits
    -- of tdata. In the last beat of a line, pixels behind the line's end count as zero and come out as zero.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * PIXEL_BITS - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    -- AXI4-Stream video out, packed like the input; tid = slice of the frame.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * PIXEL_BITS - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tid    : out   std_logic_vector(7 downto 0);
    m_axis_tlast  : out   std_logic;
    -- Faults of the stream by the bits of fault_pkg; they stay set until error_clear.
    error_flags : out   std_logic_vector(4 downto 0);
    error_clear : in    std_logic := '0'
  );
end entity raster_refocuser;

architecture rtl of raster_refocuser is

  constant CORE : core_t := core_of
                            (
                              name                => "raster_refocuser",
                              micro_image_size    => MICRO_IMAGE_SIZE,
                              shifts              => SHIFTS,
                              centred             => CENTRED,
                              interpolation_order => INTERPOLATION_ORDER,
                              hold                => HOLD,
                              parallel_rows       => PARALLEL_ROWS,
                              pixels_per_clock    => PIXELS_PER_CLOCK,
                              max_columns         => MAX_COLUMNS,
                              channels            => CHANNELS,
                              pixel_bits          => PIXEL_BITS,
                              exact               => EXACT,
                              fraction_bits       => FRACTION_BITS,
                              guard_bits          => GUARD_BITS,
                              engine              => ENGINE,
                              any_rows            => ANY_ROWS,
                              sharpening          => SHARPENING,
                              border_normalised   => BORDER_NORMALISED,
                              broadcast_taps      => BROADCAST_TAPS,
                              box                 => BOX
                            );

  signal order   : frame_order_t;
  signal s_marks : marks_t;
  signal m_marks : marks_t;

begin

  order   <=
  (
    columns      => columns,
    rows         => rows,
    slice        => slice,
    sweep        => sweep,
    sweep_frames => sweep_frames
  );
  s_marks <= (s_axis_tvalid, s_axis_tuser, s_axis_tlast);

  m_axis_tvalid <= m_marks.tvalid;
  m_axis_tuser  <= m_marks.tuser;
  m_axis_tlast  <= m_marks.tlast;

  planned : entity work.refocuser
    generic map (
      CORE => CORE
    )
    port map (
      clk           => clk,
      reset         => reset,
      order         => order,
      s_axis_marks  => s_marks,
      s_axis_tready => s_axis_tready,
      s_axis_tdata  => s_axis_tdata,
      m_axis_marks  => m_marks,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tid    => m_axis_tid,
      error_flags   => error_flags,
      error_clear   => error_clear
    );

end architecture rtl;
