-- SPDX-License-Identifier: Apache-2.0
-- Lets whole frames into a core or drops them, and reports what goes in and comes out to the counters.
--
-- A frame goes in if `enable` is high at its first pixel; a mark of start that lasts several pixels is one start.
-- `dropped` reports transfers that belong to no frame (of a
-- frame that was not let in, of a size that the core does not support, in excess of a line, between two frames),
-- whether they are dropped here or by frame_sequencer in the core. So every line that is reported to go in also comes
-- out.
--
-- Latency: none for the stream, 1 clock for what is told. Throughput: one transfer each clock.
-- Equation: transfers in = those of frames + dropped.

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
    -- Pixels that come together.
    PIXELS_PER_CLOCK : positive range 1 to 32
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Frames that begin are let in.
    enable : in    std_logic;
    -- Frame size of the core.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- The stream that comes, and the handshake of the core's input.
    s_axis_marks  : in    marks_t;
    s_axis_tready : out   std_logic;
    core_tvalid   : out   std_logic;
    core_tready   : in    std_logic;
    -- The core's output.
    m_axis_watched : in    watched_t;
    -- A frame is under way: its last pixel has not come.
    busy : out   std_logic;
    -- What goes in and comes out.
    traffic : out   traffic_t
  );
end entity frame_gate;

architecture rtl of frame_gate is

  -- The frame that began last was let in.
  signal let_in    : std_logic := '0';
  signal lets      : std_logic;
  signal new_start : std_logic;
  signal ready     : std_logic;
  signal transfer  : std_logic;
  signal size_good : std_logic;

  -- The last pixel had its mark of start, and its line goes on; a frame is under way; pixels are the excess of a line;
  -- place of the next pixel, of 8192 in a line at most.
  signal start_lasts : std_logic             := '0';
  signal frame_open  : std_logic             := '0';
  signal excess      : std_logic             := '0';
  signal column      : unsigned(13 downto 0) := (others => '0');
  signal row         : unsigned(15 downto 0) := (others => '0');

begin

  -- Decided with the first pixel, and kept for the frame: switching off in its middle lets it end.
  new_start   <= s_axis_marks.tuser(0) and not start_lasts;
  lets        <= enable when new_start = '1' else
                 let_in;
  core_tvalid <= s_axis_marks.tvalid and lets;
  -- Frames that are not let in are taken and dropped; otherwise a source that cannot wait would stall for ever.
  ready         <= core_tready or not lets;
  s_axis_tready <= ready;
  transfer      <= s_axis_marks.tvalid and ready;
  busy          <= frame_open;

  -- The core drops frames of a size that it cannot build; here they only count as dropped.
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

      -- Counted as the core's sequencer does it, by the same rules, as its decision is not to be seen from here.
      belongs   := frame_open = '1' and excess = '0';
      at_column := column;
      at_row    := row;
      if new_start = '1' then
        belongs   := lets = '1' and size_good = '1';
        at_column := (others => '0');
        at_row    := (others => '0');
      end if;

      -- A pixel that waits counts once, when it is taken.
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
        -- The last pixel that the line should have, or the last one that it has.
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
            -- Pixels beyond the line's length follow until its mark of the end; the core cuts them
            -- off, too.
            excess <= not s_axis_marks.tlast;
            if at_row + 1 = unsigned(rows) then
              frame_open <= '0';
            end if;
          end if;
        else
          traffic.dropped <= '1';
          -- With the mark the line is over, and what follows belongs to the frame again.
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
      -- Registered like the input's: what is counted may be late, but must not lie in the streams'
      -- paths.
      traffic.frame_out <= m_axis_watched.tvalid and m_axis_watched.tready and m_axis_watched.tuser(0) and not reset;
      traffic.line_out  <= m_axis_watched.tvalid and m_axis_watched.tready and m_axis_watched.tlast and not reset;
      traffic.stall_in  <= s_axis_marks.tvalid and not ready and not reset;
      traffic.stall_out <= m_axis_watched.tvalid and not m_axis_watched.tready and not reset;
    end if;

  end process watch;

end architecture rtl;
