-- SPDX-License-Identifier: Apache-2.0
-- Lets whole frames into a core or drops them, and reports to the counters what goes in and comes out.
--
-- A frame goes in if `enable` is high at its first pixel; a mark of start that lasts several pixels is one start.
-- `dropped` reports transfers that belong to no frame: of a frame that was not let in, of a size that the core does not
-- support, in excess of a line, between two frames. Some are dropped here, others by frame_sequencer in the core. Every
-- line that is reported to go in also comes out.
--
-- Latency: 0 clocks for the stream, 1 clock for the reports. Throughput: one transfer each clock.
-- Equation: transfers in = transfers of frames + dropped.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.axi_pkg.all;
use work.token_pkg.marks_t;

entity frame_gate is
  generic (
    -- Longest line of the core in pixels.
    MAX_COLUMNS : positive range 1 to 8192;
    -- Pixels of one transfer.
    PIXELS_PER_CLOCK : positive range 1 to 32
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Frames that begin now are let in.
    enable : in    std_logic;
    -- Frame size of the core.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- The stream in, and the handshake of the core's input.
    s_axis_marks  : in    marks_t;
    s_axis_tready : out   std_logic;
    core_tvalid   : out   std_logic;
    core_tready   : in    std_logic;
    -- The core's output.
    m_axis_watched : in    watched_t;
    -- A frame is under way: its last pixel has not come yet.
    busy : out   std_logic;
    -- Events at input and output.
    traffic : out   traffic_t
  );
end entity frame_gate;

architecture rtl of frame_gate is

  -- let_in: the last frame was let in; lets: the present frame is; then the handshake of the stream, and whether the
  -- core supports the frame size.
  signal let_in    : std_logic := '0';
  signal lets      : std_logic;
  signal new_start : std_logic;
  signal ready     : std_logic;
  signal transfer  : std_logic;
  signal size_good : std_logic;

  -- start_lasts: the last pixel had its mark of start, and its line goes on. frame_open: a frame is under way. excess:
  -- pixels are beyond the line's length. Place of the next pixel, at most 8192 in a line.
  signal start_lasts : std_logic             := '0';
  signal frame_open  : std_logic             := '0';
  signal excess      : std_logic             := '0';
  signal column      : unsigned(13 downto 0) := (others => '0');
  signal row         : unsigned(15 downto 0) := (others => '0');

begin

  -- Decided with the first pixel and kept for the frame: a frame ends even if the gate is switched off meanwhile.
  new_start   <= s_axis_marks.tuser(0) and not start_lasts;
  lets        <= enable when new_start = '1' else
                 let_in;
  core_tvalid <= s_axis_marks.tvalid and lets;
  -- Frames that are not let in are taken and dropped; otherwise a source that cannot wait would stall for ever.
  ready         <= core_tready or not lets;
  s_axis_tready <= ready;
  transfer      <= s_axis_marks.tvalid and ready;
  busy          <= frame_open;

  -- The core drops frames of a size that it does not support; here they are counted as dropped.
  size_good <= '1' when unsigned(columns) /= 0 and unsigned(columns) <= MAX_COLUMNS and unsigned(rows) /= 0 else
               '0';

  follow_frames : process (clk) is

    variable belongs   : boolean;
    variable at_column : unsigned(13 downto 0);
    variable at_row    : unsigned(15 downto 0);
    variable line_ends : boolean;

  begin

    if rising_edge(clk) then
      traffic.frame_in <= '0';
      traffic.line_in  <= '0';
      traffic.dropped  <= '0';

      -- Pixels are counted by the rules of the core's sequencer, whose decisions are not visible here.
      belongs   := frame_open = '1' and excess = '0';
      at_column := column;
      at_row    := row;
      if new_start = '1' then
        belongs   := lets = '1' and size_good = '1';
        at_column := (others => '0');
        at_row    := (others => '0');
      end if;

      -- A pixel that waits is counted once, when it is taken.
      if transfer = '1' then
        if new_start = '1' then
          let_in     <= lets;
          frame_open <= '0';
          excess     <= '0';
          if belongs then
            traffic.frame_in <= '1';
            frame_open       <= '1';
          end if;
        end if;

        column <= at_column + PIXELS_PER_CLOCK;
        -- The last pixel that the line should have, or its last one.
        line_ends   := at_column + PIXELS_PER_CLOCK >= unsigned(columns) or s_axis_marks.tlast = '1';
        start_lasts <= s_axis_marks.tuser(0);
        if line_ends then
          column      <= (others => '0');
          start_lasts <= '0';
        end if;

        if belongs then
          if at_column = 0 then
            traffic.line_in <= '1';
          end if;
          row <= at_row;
          if line_ends then
            row <= at_row + 1;
            -- Pixels beyond the line's length follow until its mark of end; the core drops them.
            excess <= not s_axis_marks.tlast;
            if at_row + 1 = unsigned(rows) then
              frame_open <= '0';
            end if;
          end if;
        else
          traffic.dropped <= '1';
          -- The mark of end ends the excess; the next pixel belongs to the frame again.
          if s_axis_marks.tlast = '1' then
            excess <= '0';
          end if;
        end if;
      end if;

      if reset = '1' then
        let_in           <= '0';
        start_lasts      <= '0';
        frame_open       <= '0';
        excess           <= '0';
        traffic.frame_in <= '0';
        traffic.line_in  <= '0';
        traffic.dropped  <= '0';
      end if;
    end if;

  end process follow_frames;

  watch : process (clk) is
  begin

    if rising_edge(clk) then
      -- The output's events are registered like the input's: counters may be late but must not load the streams' paths.
      traffic.frame_out <= m_axis_watched.tvalid and m_axis_watched.tready and m_axis_watched.tuser(0) and not reset;
      traffic.line_out  <= m_axis_watched.tvalid and m_axis_watched.tready and m_axis_watched.tlast and not reset;
      traffic.stall_in  <= s_axis_marks.tvalid and not ready and not reset;
      traffic.stall_out <= m_axis_watched.tvalid and not m_axis_watched.tready and not reset;
    end if;

  end process watch;

end architecture rtl;
