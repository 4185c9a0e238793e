-- SPDX-License-Identifier: Apache-2.0
-- Three channels from the frames of a sensor with a colour filter mosaic.
--
-- The entity is a stream shell around mosaic_engine. A frame of a single line or column lacks some of the filters, so
-- its own pixels stand in for them. When nothing follows, a flush line pushes the last line of a frame out; a frame
-- that begins meanwhile waits in the source, for a line at most.
--
-- Latency: a line, a pixel and 12 clocks when nothing stalls. Throughput: one pixel each clock.
-- Equation: that of mosaic_engine.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.token_pkg.all;

entity colour_mosaic is
  generic (
    -- Longest line in pixels.
    MAX_COLUMNS : positive range 2 to 8192 := 2048;
    -- Width of a pixel.
    PIXEL_BITS : positive range 1 to 16 := 8
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Size of the frame, set at the latest a clock before its first pixel is on offer; must be constant until the frame
    -- has left.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- Line (bit 1) and column (bit 0) of the red pixel in the first 2 x 2 pixels; must be constant.
    red_place : in    std_logic_vector(1 downto 0);
    -- Raw frames: AXI4-Stream video.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(PIXEL_BITS - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    -- Frames of three channels, red in the low bits.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(3 * PIXEL_BITS - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tlast  : out   std_logic;
    -- Faults of the stream in, by the bits of fault_pkg; they stay set until error_clear.
    error_flags : out   std_logic_vector(4 downto 0);
    error_clear : in    std_logic := '0'
  );
end entity colour_mosaic;

architecture rtl of colour_mosaic is

  signal order       : frame_order_t;
  signal s_marks     : marks_t;
  signal m_marks     : marks_t;
  signal token       : token_t;
  signal token_data  : std_logic_vector(PIXEL_BITS - 1 downto 0);
  signal results     : results_t(0 to 0);
  signal result_data : std_logic_vector(3 * PIXEL_BITS - 1 downto 0);

begin

  -- The mosaic has no slices, so only the size of the order counts.
  order   <=
  (
    columns      => columns,
    rows         => rows,
    slice        => x"00",
    sweep        => '0',
    sweep_frames => x"00"
  );
  s_marks <= (s_axis_tvalid, s_axis_tuser, s_axis_tlast);

  m_axis_tvalid <= m_marks.tvalid;
  m_axis_tuser  <= m_marks.tuser;
  m_axis_tlast  <= m_marks.tlast;

  shell : entity work.stream_shell
    generic map (
      MAX_COLUMNS    => MAX_COLUMNS,
      IN_BITS        => PIXEL_BITS,
      OUT_BITS       => 3 * PIXEL_BITS,
      ROW_DELAY      => 1,
      COLUMN_DELAY   => 1,
      ENGINE_LATENCY => 5,
      MIN_STEPS      => 4
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
      error_flags   => error_flags,
      error_clear   => error_clear,
      token         => token,
      token_data    => token_data,
      results       => results,
      result_data   => result_data
    );

  engine : entity work.mosaic_engine
    generic map (
      MAX_COLUMNS => MAX_COLUMNS,
      PIXEL_BITS  => PIXEL_BITS
    )
    port map (
      clk         => clk,
      reset       => reset,
      red_line    => red_place(1),
      red_column  => red_place(0),
      token       => token,
      token_data  => token_data,
      result      => results(0),
      result_data => result_data
    );

end architecture rtl;
