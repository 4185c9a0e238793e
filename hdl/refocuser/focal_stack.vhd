-- SPDX-License-Identifier: Apache-2.0
-- Refocuses a raster scan of a light field to several planes at once: a focal stack in one pass.
--
-- The entity makes the core from its generics; refocuser is a stream shell around stack_array. The slices share one
-- column memory, which holds pixels of the input, and one delay; each slice has its own moving sums. Arithmetic is
-- exact.
--
-- Lines may follow each other without a gap, and so may frames of a multiple of M lines. When nothing follows, the core
-- pushes the rest of the frame out by itself, in lines up to a multiple of M. A frame that arrives meanwhile waits in
-- the input FIFO, which holds INPUT_LINES lines; with M lines a source never has to wait. Stalls on either side neither
-- lose nor repeat pixels.
--
-- Latency: D * (columns + 1) + 7 + clocks of the plan (core_pkg), D = column_lines, from the first pixel in to the
-- first pixel out, when nothing stalls and lines have at least D + 1 pixels. With several pixels a clock, D * tokens +
-- D' + 7 + clocks, D' = row_tokens, for lines of at least D' + 1 tokens.
-- Throughput: PIXELS_PER_CLOCK pixels of all channels and slices each clock.
-- Equation: that of raster_refocuser with EXACT, for each slice.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.number_set_pkg.all;
use work.core_pkg.all;
use work.token_pkg.all;
use work.refocuser_pkg.all;

entity focal_stack is
  generic (
    -- M: pixels a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- The shift of each slice, a' = a * M in pixels, with blanks in between.
    SHIFTS : string;
    -- true: the picture stays put from slice to slice.
    CENTRED : boolean := true;
    -- Longest line in pixels.
    MAX_COLUMNS : positive range 1 to 8192 := 2048;
    -- Neighbouring pixels of a line in one transfer: 1, 2, 4, 8, 16 or 32.
    PIXELS_PER_CLOCK : positive range 1 to 32 := 1;
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3 := 1;
    -- Width of a channel.
    PIXEL_BITS : positive range 1 to 16 := 8;
    -- Lines that the input FIFO holds.
    INPUT_LINES : positive range 1 to 128 := 1;
    -- true: the core pushes the rest of a frame out when nothing follows; false: the next frame does.
    FLUSH : boolean := true;
    -- As in raster_refocuser, for each slice.
    BOX : string := "";
    -- As in raster_refocuser, for each slice; only with one pixel a clock.
    BORDER_NORMALISED : boolean := false;
    -- true: each frame has a chosen slice; its number goes beside all slices, to a depth_index with CHOSEN_TOO.
    CHOSEN_TOO : boolean := false
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Frame size, read with the first pixel of a frame.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- As in raster_refocuser; used with CHOSEN_TOO only.
    slice        : in    std_logic_vector(7 downto 0) := x"00";
    sweep        : in    std_logic                    := '0';
    sweep_frames : in    std_logic_vector(7 downto 0) := x"00";
    -- AXI4-Stream video: tuser(0) = start of frame, tlast = end of line, channel 0 of the first pixel in the low bits
    -- of tdata. Pixels behind a line's last one count as zero and come out as zero.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * PIXEL_BITS - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    -- AXI4-Stream video out. tdata: the slices of a pixel, the first slice in the low bits, then those of the next
    -- pixel. tid: with CHOSEN_TOO the frame's chosen slice.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(PIXELS_PER_CLOCK * slice_count(SHIFTS) * CHANNELS * PIXEL_BITS - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tid    : out   std_logic_vector(7 downto 0);
    m_axis_tlast  : out   std_logic;
    -- Faults of the stream by the bits of fault_pkg; they stay set until error_clear.
    error_flags : out   std_logic_vector(4 downto 0);
    error_clear : in    std_logic
  );
end entity focal_stack;

architecture rtl of focal_stack is

  constant CORE : core_t := stack_of
                            (
                              name              => "focal_stack",
                              micro_image_size  => MICRO_IMAGE_SIZE,
                              shifts            => SHIFTS,
                              centred           => CENTRED,
                              max_columns       => MAX_COLUMNS,
                              pixels_per_clock  => PIXELS_PER_CLOCK,
                              channels          => CHANNELS,
                              pixel_bits        => PIXEL_BITS,
                              border_normalised => BORDER_NORMALISED,
                              box               => BOX
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
      CORE        => CORE,
      INPUT_LINES => INPUT_LINES,
      FLUSH       => FLUSH,
      CHOOSES     => CHOSEN_TOO
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
