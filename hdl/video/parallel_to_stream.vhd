-- SPDX-License-Identifier: Apache-2.0
-- Makes a stream from the parallel video of a camera (frame valid, line valid, data with a pixel clock).
--
-- A pixel waits until it is known whether another one of its line follows. Lines outside of frames are left out. The
-- state follows the camera even in a reset, so a sink that begins in the middle of a frame gets the rest of it without
-- a start of frame.
--
-- Latency: 2 clocks; a pixel also waits for the next one of its line, or for the end of the line.
-- Throughput: one pixel each clock.
-- Equation: tuser(0) = first pixel while frame_valid, tlast = last pixel while line_valid.

library ieee;
use ieee.std_logic_1164.all;

entity parallel_to_stream is
  generic (
    -- Bits of a pixel.
    WIDTH : positive range 1 to 1024
  );
  port (
    clk : in    std_logic;
    -- The camera's signals; line_valid marks pixels.
    frame_valid : in    std_logic;
    line_valid  : in    std_logic;
    data        : in    std_logic_vector(WIDTH - 1 downto 0);
    -- AXI4-Stream video. The camera cannot wait for tready.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(WIDTH - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tlast  : out   std_logic;
    -- High for one clock: a pixel is lost because the sink did not take it.
    lost : out   std_logic
  );
end entity parallel_to_stream;

architecture rtl of parallel_to_stream is

  -- Two pixels are under way: the one that came last, and the one before, which is held until it is known what follows.
  signal pixel_valid : std_logic                            := '0';
  signal pixel       : std_logic_vector(WIDTH - 1 downto 0) := (others => '0');
  signal pixel_first : std_logic                            := '0';
  signal first       : std_logic                            := '0';
  signal waiting     : std_logic                            := '0';
  signal held        : std_logic_vector(WIDTH - 1 downto 0) := (others => '0');
  signal held_first  : std_logic                            := '0';
  signal valid       : std_logic                            := '0';

begin

  m_axis_tvalid <= valid;
  lost          <= valid and not m_axis_tready;

  collect : process (clk) is
  begin

    if rising_edge(clk) then
      -- The camera's signals come from pins, so they are registered first.
      pixel_valid <= frame_valid and line_valid;
      pixel       <= data;
      if frame_valid = '0' then
        first <= '1';
      elsif line_valid = '1' then
        first <= '0';
      end if;
      pixel_first <= first;

      waiting <= pixel_valid;
      if pixel_valid = '1' then
        held       <= pixel;
        held_first <= pixel_first;
      end if;

      valid        <= waiting;
      m_axis_tdata <= held;

      m_axis_tuser(0) <= held_first;
      -- If no pixel follows in the next clock, this one was the line's last.
      m_axis_tlast <= not pixel_valid;
    end if;

  end process collect;

end architecture rtl;
