-- SPDX-License-Identifier: Apache-2.0
-- A camera with parallel output in, refocused parallel video out: for an evaluation board of any kind.
--
-- The camera's pixel clock is the only clock. Lines and frames must have as much blanking as the refocuser needs; a
-- pixel that it cannot take is reported.
--
-- Latency: that of raster_refocuser, and a line. Throughput: one pixel each clock.
-- Equation: out picture = refocus(in picture).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity parallel_top is
  generic (
    -- Generics of raster_refocuser.
    MICRO_IMAGE_SIZE    : positive range 1 to 128  := 5;
    SHIFTS              : string                   := "-3";
    INTERPOLATION_ORDER : natural range 0 to 3     := 0;
    HOLD                : boolean                  := false;
    MAX_COLUMNS         : positive range 2 to 8192 := 640;
    EXACT               : boolean                  := true;
    FRACTION_BITS       : natural range 0 to 12    := 0;
    GUARD_BITS          : natural range 0 to 12    := 0;
    BROADCAST_TAPS      : natural                  := 0;
    ENGINE              : string                   := "moving_sum";
    BOX                 : string                   := "";
    PIXEL_BITS          : positive range 8 to 12   := 10;
    -- Lines of a frame; each line has MAX_COLUMNS pixels.
    ROWS : positive range 1 to 65535 := 480
  );
  port (
    -- The camera's pixel clock, and a reset (low).
    clk     : in    std_logic;
    reset_n : in    std_logic;
    -- Grey pixels of the camera.
    in_frame_valid : in    std_logic;
    in_line_valid  : in    std_logic;
    in_data        : in    std_logic_vector(PIXEL_BITS - 1 downto 0);
    -- Slice, as in slice_select.
    slice : in    std_logic_vector(7 downto 0);
    -- Refocused pixels.
    out_frame_valid : out   std_logic;
    out_line_valid  : out   std_logic;
    out_data        : out   std_logic_vector(PIXEL_BITS - 1 downto 0);
    -- A pixel was lost, or a frame was torn, since the reset.
    error : out   std_logic
  );
end entity parallel_top;

architecture rtl of parallel_top is

  -- A camera has one size, so the core's size ports are constants and synthesis removes their logic.
  constant COLUMNS_PORT : std_logic_vector(15 downto 0) := std_logic_vector(to_unsigned(MAX_COLUMNS, 16));
  constant ROWS_PORT    : std_logic_vector(15 downto 0) := std_logic_vector(to_unsigned(ROWS, 16));

  signal reset_request : std_logic;
  signal reset         : std_logic;
  -- Streams from the camera to the core, and from the core to the output.
  signal raw_valid : std_logic;
  signal raw_ready : std_logic;
  signal raw_data  : std_logic_vector(PIXEL_BITS - 1 downto 0);
  signal raw_first : std_logic_vector(0 downto 0);
  signal raw_last  : std_logic;
  signal new_valid : std_logic;
  signal new_ready : std_logic;
  signal new_data  : std_logic_vector(PIXEL_BITS - 1 downto 0);
  signal new_first : std_logic_vector(0 downto 0);
  signal new_last  : std_logic;
  signal lost      : std_logic;
  signal flags     : std_logic_vector(4 downto 0);

begin

  reset_request <= not reset_n;

  -- The button is asynchronous; the reset ends in step with the clock.
  bridge : entity work.reset_bridge
    port map (
      clk     => clk,
      request => reset_request,
      reset   => reset
    );

  -- A camera cannot wait: a pixel that the core does not take at once is lost and reported.
  camera : entity work.parallel_to_stream
    generic map (
      WIDTH => PIXEL_BITS
    )
    port map (
      clk           => clk,
      frame_valid   => in_frame_valid,
      line_valid    => in_line_valid,
      data          => in_data,
      m_axis_tvalid => raw_valid,
      m_axis_tready => raw_ready,
      m_axis_tdata  => raw_data,
      m_axis_tuser  => raw_first,
      m_axis_tlast  => raw_last,
      lost          => lost
    );

  -- The camera gives grey pixels, one each clock.
  refocuser : entity work.raster_refocuser
    generic map (
      MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
      SHIFTS              => SHIFTS,
      INTERPOLATION_ORDER => INTERPOLATION_ORDER,
      HOLD                => HOLD,
      MAX_COLUMNS         => MAX_COLUMNS,
      PIXEL_BITS          => PIXEL_BITS,
      EXACT               => EXACT,
      FRACTION_BITS       => FRACTION_BITS,
      GUARD_BITS          => GUARD_BITS,
      ENGINE              => ENGINE,
      BOX                 => BOX,
      BROADCAST_TAPS      => BROADCAST_TAPS
    )
    port map (
      clk           => clk,
      reset         => reset,
      columns       => COLUMNS_PORT,
      rows          => ROWS_PORT,
      slice         => slice,
      s_axis_tvalid => raw_valid,
      s_axis_tready => raw_ready,
      s_axis_tdata  => raw_data,
      s_axis_tuser  => raw_first,
      s_axis_tlast  => raw_last,
      m_axis_tvalid => new_valid,
      m_axis_tready => new_ready,
      m_axis_tdata  => new_data,
      m_axis_tuser  => new_first,
      m_axis_tlast  => new_last,
      error_flags   => flags
    );

  -- stream_to_parallel waits for whole lines, so that lines go out without gaps.
  monitor : entity work.stream_to_parallel
    generic map (
      WIDTH       => PIXEL_BITS,
      MAX_COLUMNS => MAX_COLUMNS,
      ROWS        => ROWS
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => new_valid,
      s_axis_tready => new_ready,
      s_axis_tdata  => new_data,
      s_axis_tuser  => new_first,
      s_axis_tlast  => new_last,
      frame_valid   => out_frame_valid,
      line_valid    => out_line_valid,
      data          => out_data
    );

  report_errors : process (clk) is
  begin

    if rising_edge(clk) then
      -- Faults stay until the reset, because the LED that shows them is looked at now and then.
      if lost = '1' or flags /= "00000" then
        error <= '1';
      end if;
      if reset = '1' then
        error <= '0';
      end if;
    end if;

  end process report_errors;

end architecture rtl;
