-- SPDX-License-Identifier: Apache-2.0
-- Makes parallel video from a stream: frame valid, line valid without gaps, data.
--
-- A line goes out when all of it has arrived. A frame ends after ROWS lines, with the next start of frame, or when it
-- has waited STALL clocks for a line, so that frames cut short stay apart. Pixels between this end and the next start
-- of frame are left out. A line ends with tlast, with its pixel number MAX_COLUMNS (the rest up to tlast is left out),
-- or, incomplete, with a start of frame.
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
    WIDTH : positive range 1 to 1024;
    -- Longest line in pixels, and lines of a frame.
    MAX_COLUMNS : positive range 2 to 8192;
    ROWS        : positive range 1 to 65535;
    -- The least number of clocks without line_valid between two lines.
    GAP : positive range 2 to 255 := 4;
    -- Clocks that a frame waits for the end of a line: at least as many as the stream takes for a line with its stalls.
    STALL : positive range 2 to 1048575 := 65535
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
    -- Parallel video.
    frame_valid : out   std_logic;
    line_valid  : out   std_logic;
    data        : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity stream_to_parallel;

architecture rtl of stream_to_parallel is

  -- Room for two lines: one comes in while another goes out.
  constant ADDRESS_BITS : positive := bits_for(2 * MAX_COLUMNS - 1);
  constant MOST_LINES   : positive := 2 ** ADDRESS_BITS;

  -- A word of the FIFO: pixel, start of frame, end of line. Events of a clock: a word arrives, is stored, ends its
  -- line; a word is on offer, begins another frame (cut), leaves; the line is out.
  signal word_in  : std_logic_vector(WIDTH + 1 downto 0);
  signal word_out : std_logic_vector(WIDTH + 1 downto 0);
  signal ready    : std_logic;
  signal arrives  : std_logic;
  signal stored   : std_logic;
  signal ends     : std_logic;
  signal offered  : std_logic;
  signal cut      : std_logic;
  signal taken    : std_logic;
  signal line_out : std_logic;
  -- columns_in: pixels of the incoming line; lines: lines whose end has come in; begun: the outgoing line has begun;
  -- then clocks left of the gap, lines left of the frame, clocks left of STALL; and the present line and frame.
  signal columns_in  : natural range 0 to MAX_COLUMNS    := 0;
  signal lines       : natural range 0 to MOST_LINES + 2 := 0;
  signal begun       : std_logic                         := '0';
  signal gap_left    : natural range 0 to GAP            := GAP;
  signal rows_left   : natural range 0 to ROWS           := 0;
  signal patience    : natural range 0 to STALL          := 0;
  signal in_line     : std_logic                         := '0';
  signal in_frame    : std_logic                         := '0';
  signal pixel_valid : std_logic                         := '0';

begin

  frame_valid   <= in_frame;
  line_valid    <= pixel_valid;
  s_axis_tready <= ready;

  -- Beyond the longest line, pixels are taken but not stored. The receiver of a camera cannot pause within a line, so a
  -- line is sent only when all of it is in the FIFO.
  arrives <= s_axis_tvalid and ready;
  stored  <= s_axis_tvalid when s_axis_tuser(0) = '1' or columns_in /= MAX_COLUMNS else
             '0';
  ends    <= '1' when s_axis_tlast = '1' or (s_axis_tuser(0) = '0' and columns_in = MAX_COLUMNS - 1) else
             '0';
  word_in <= ends & s_axis_tuser(0) & s_axis_tdata;

  fifo : entity work.axis_fifo
    generic map (
      WIDTH        => WIDTH + 2,
      ADDRESS_BITS => ADDRESS_BITS
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => stored,
      s_axis_tready => ready,
      s_axis_tdata  => word_in,
      m_axis_tvalid => offered,
      m_axis_tready => taken,
      m_axis_tdata  => word_out
    );

  -- A start of frame that ends a line waits as the first word of its own line.
  cut      <= begun and word_out(WIDTH);
  taken    <= in_line and not cut;
  line_out <= in_line and offered and (cut or word_out(WIDTH + 1));

  send : process (clk) is

    -- Lines completed in this clock: two if a frame starts within a line and its own line has one pixel.
    variable more : natural range 0 to 2;
    variable less : natural range 0 to 1;

  begin

    if rising_edge(clk) then
      more := 0;
      less := 0;
      if arrives = '1' then
        -- A frame that starts within a line ends it: the pixels that have come are sent as a short line.
        if s_axis_tuser(0) = '1' then
          if columns_in /= 0 and columns_in /= MAX_COLUMNS then
            more := 1;
          end if;
          columns_in <= 1;
        elsif columns_in /= MAX_COLUMNS then
          columns_in <= columns_in + 1;
        end if;
        if s_axis_tlast = '1' then
          columns_in <= 0;
        end if;
        if ends = '1' and stored = '1' then
          more := more + 1;
        end if;
      end if;
      if line_out = '1' then
        less := 1;
      end if;
      -- Lines may come in in the clock in which one leaves.
      lines <= lines + more - less;

      pixel_valid <= '0';
      patience    <= STALL;
      if in_line = '1' then
        pixel_valid <= offered and taken and in_frame;
        data        <= word_out(WIDTH - 1 downto 0);
        if offered = '1' then
          begun <= '1';
        end if;
        if line_out = '1' then
          begun    <= '0';
          in_line  <= '0';
          gap_left <= GAP;
          if rows_left /= 0 then
            rows_left <= rows_left - 1;
          end if;
        end if;
      elsif gap_left /= 0 then
        -- The gap is the receiver's blanking, and gives the frame its end.
        gap_left <= gap_left - 1;
        if rows_left = 0 and gap_left = 1 then
          in_frame <= '0';
        end if;
      elsif lines /= 0 and offered = '1' then
        -- A frame begins a clock ahead of its first line, and a clock behind the frame before.
        if word_out(WIDTH) = '1' and in_frame = '0' then
          in_frame  <= '1';
          rows_left <= ROWS;
        elsif word_out(WIDTH) = '1' and rows_left /= ROWS then
          in_frame <= '0';
        else
          in_line <= '1';
        end if;
      -- No more pixels arrive: the frame is closed, so that a receiver waiting for its end is released.
      elsif patience = 0 then
        in_frame <= '0';
      else
        patience <= patience - 1;
      end if;

      if reset = '1' then
        columns_in  <= 0;
        lines       <= 0;
        begun       <= '0';
        in_line     <= '0';
        in_frame    <= '0';
        pixel_valid <= '0';
      end if;
    end if;

  end process send;

end architecture rtl;
