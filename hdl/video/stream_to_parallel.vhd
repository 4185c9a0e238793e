-- SPDX-License-Identifier: Apache-2.0
-- A stream as parallel video: frame valid, line valid without gaps, data.
--
-- A line goes out when all of it is there.
--
-- Latency: a line and about 6 clocks. Throughput: one pixel each clock, less GAP clocks for each line.
-- Equation: a pixel for each clock of line_valid, in the order of the stream.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity stream_to_parallel is
  generic (
    -- Bits of a pixel.
    WIDTH : positive;
    -- Longest line in pixels, and lines of a frame.
    MAX_COLUMNS : positive range 2 to 8192;
    ROWS        : positive range 1 to 65535;
    -- Clocks without line_valid between two lines, at least.
    GAP : positive range 2 to 255 := 4
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- AXI4-Stream video.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(WIDTH - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    -- Video.
    frame_valid : out   std_logic;
    line_valid  : out   std_logic;
    data        : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity stream_to_parallel;

architecture rtl of stream_to_parallel is

  -- Two lines: one comes in while another goes out.
  constant ADDRESS_BITS : positive := bits_for(2 * MAX_COLUMNS - 1);
  constant MOST_LINES   : positive := 2 ** ADDRESS_BITS;

  signal word_in     : std_logic_vector(WIDTH + 1 downto 0);
  signal word_out    : std_logic_vector(WIDTH + 1 downto 0);
  signal ready       : std_logic;
  signal offered     : std_logic;
  signal taken       : std_logic;
  signal line_in     : std_logic;
  signal line_out    : std_logic;
  signal lines       : natural range 0 to MOST_LINES + 2 := 0;
  signal gap_left    : natural range 0 to GAP            := GAP;
  signal rows_left   : natural range 0 to ROWS           := 0;
  signal in_line     : std_logic                         := '0';
  signal in_frame    : std_logic                         := '0';
  signal pixel_valid : std_logic                         := '0';

begin

  frame_valid   <= in_frame;
  line_valid    <= pixel_valid;
  s_axis_tready <= ready;

  word_in <= s_axis_tlast & s_axis_tuser(0) & s_axis_tdata;

  fifo : entity work.axis_fifo
    generic map (
      WIDTH        => WIDTH + 2,
      ADDRESS_BITS => ADDRESS_BITS
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => s_axis_tvalid,
      s_axis_tready => ready,
      s_axis_tdata  => word_in,
      m_axis_tvalid => offered,
      m_axis_tready => taken,
      m_axis_tdata  => word_out,
      level         => open
    );

  line_in  <= s_axis_tvalid and ready and s_axis_tlast;
  line_out <= offered and taken and word_out(WIDTH + 1);
  taken    <= in_line;

  send : process (clk) is
  begin

    if rising_edge(clk) then
      if line_in = '1' and line_out = '0' then
        lines <= lines + 1;
      elsif line_in = '0' and line_out = '1' then
        lines <= lines - 1;
      end if;

      pixel_valid <= '0';
      if in_line = '1' then
        pixel_valid <= offered;
        data        <= word_out(WIDTH - 1 downto 0);
        if line_out = '1' then
          in_line  <= '0';
          gap_left <= GAP;
          if rows_left /= 0 then
            rows_left <= rows_left - 1;
          end if;
        end if;
      elsif gap_left /= 0 then
        gap_left <= gap_left - 1;
        if rows_left = 0 and gap_left = 1 then
          in_frame <= '0';
        end if;
      elsif lines /= 0 and offered = '1' then
        -- A frame begins a clock ahead of its first line.
        if word_out(WIDTH) = '1' and (in_frame = '0' or rows_left /= ROWS) then
          in_frame  <= '1';
          rows_left <= ROWS;
        else
          in_line <= '1';
        end if;
      end if;

      if reset = '1' then
        lines       <= 0;
        in_line     <= '0';
        in_frame    <= '0';
        pixel_valid <= '0';
      end if;
    end if;

  end process send;

end architecture rtl;
