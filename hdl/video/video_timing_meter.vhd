-- SPDX-License-Identifier: Apache-2.0
-- Measures the timing of incoming video: sizes, blanking, places and polarities of the syncs.
--
-- Data enable gives the lines, also a counter that runs on through the vertical blanking; a change of
-- vertical sync since the last active pixel tells the first line of a frame. The levels of the
-- syncs just before an active line are their idle levels. A timing is stable when two frames in a
-- row had it, and no line of them was irregular.
--
-- Latency: 1 clock to frame_start; a timing is known with the first pixel of the next frame.
-- Throughput: one pixel each clock.
-- Equation: see video_pkg for what is counted.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.video_pkg.all;

entity video_timing_meter is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Incoming video.
    active : in    std_logic;
    h_sync : in    std_logic;
    v_sync : in    std_logic;
    -- The pixel was the first one of a frame.
    frame_start : out   std_logic;
    -- Timing of the last whole frame, and whether it was that of the one before; they change one
    -- clock after frame_start.
    timing : out   std_logic_vector(TIMING_BITS - 1 downto 0);
    stable : out   std_logic
  );
end entity video_timing_meter;

architecture rtl of video_timing_meter is

  signal active_before : std_logic := '0';
  signal h_before      : std_logic := '0';
  signal v_before      : std_logic := '0';
  signal v_changed     : std_logic := '0';
  signal h_idle        : std_logic := '0';
  signal v_idle        : std_logic := '0';
  -- Position of the pixel before.
  signal x : count_t := (others => '0');
  signal y : count_t := (others => '0');
  -- Length of the lines of this frame; 0 until its second line has begun.
  signal line_length : count_t := (others => '0');
  -- This frame so far, and the one before.
  signal frame    : timing_t  := NO_TIMING;
  signal previous : timing_t  := NO_TIMING;
  signal regular  : std_logic := '0';

begin

  timing <= to_vector(previous);

  measure : process (clk) is

    variable rise      : boolean;
    variable fall      : boolean;
    variable starts    : boolean;
    variable wraps     : boolean;
    variable next_x    : count_t;
    variable next_y    : count_t;
    variable complete  : timing_t;
    variable irregular : boolean;

  begin

    if rising_edge(clk) then
      active_before <= active;
      h_before      <= h_sync;
      v_before      <= v_sync;
      frame_start   <= '0';

      rise      := active = '1' and active_before = '0';
      fall      := active = '0' and active_before = '1';
      starts    := rise and v_changed = '1';
      wraps     := line_length /= 0 and x = line_length - 1;
      irregular := false;

      -- Position of this pixel.
      next_x := x + 1;
      next_y := y;
      if rise then
        next_x := (others => '0');
        next_y := y + 1;
        if not wraps and not starts then
          if y = 0 and line_length = 0 then
            line_length <= x + 1;
          else
            irregular := true;
          end if;
        elsif starts and not wraps then
          irregular := true;
        end if;
      elsif wraps then
        next_x := (others => '0');
        next_y := y + 1;
      end if;
      if x = 2 ** COUNT_BITS - 1 or y = 2 ** COUNT_BITS - 1 then
        -- No line and no frame is that long: there is no video.
        irregular := true;
        stable    <= '0';
      end if;

      -- A change of vertical sync, and the pulses.
      if v_sync /= v_before and active = '0' then
        v_changed <= '1';
        if v_sync /= v_idle then
          frame.v_sync_begin_line   <= next_y;
          frame.v_sync_begin_column <= next_x;
        else
          frame.v_sync_end_line   <= next_y;
          frame.v_sync_end_column <= next_x;
        end if;
      end if;
      if h_sync /= h_before and active = '0' then
        if h_sync /= h_idle then
          if y /= 0 and frame.h_sync_begin /= next_x then
            irregular := true;
          end if;
          frame.h_sync_begin <= next_x;
        else
          if y /= 0 and frame.h_sync_end /= next_x then
            irregular := true;
          end if;
          frame.h_sync_end <= next_x;
        end if;
      end if;

      -- Active lines.
      if rise then
        h_idle     <= h_before;
        v_idle     <= v_before;
        v_changed  <= '0';
        frame.rows <= frame.rows + 1;
        if not starts and (h_before /= h_idle or v_before /= v_idle or frame.rows /= next_y) then
          irregular := true;
        end if;
      end if;
      if fall then
        if frame.rows /= 1 and frame.columns /= next_x then
          irregular := true;
        end if;
        frame.columns <= next_x;
      end if;

      -- The frame that ends here.
      if starts then
        complete              := frame;
        complete.line_length  := line_length;
        complete.frame_lines  := next_y;
        complete.h_sync_level := not h_before;
        complete.v_sync_level := not v_before;

        frame_start <= '1';
        previous    <= complete;
        stable      <= '0';
        if complete = previous and regular = '1' and not irregular then
          stable <= '1';
        end if;

        next_y      := (others => '0');
        frame       <= NO_TIMING;
        frame.rows  <= to_unsigned(1, COUNT_BITS);
        line_length <= (others => '0');
        regular     <= '1';
      elsif irregular then
        regular <= '0';
      end if;

      x <= next_x;
      y <= next_y;

      if reset = '1' then
        active_before <= '0';
        v_changed     <= '0';
        line_length   <= (others => '0');
        previous      <= NO_TIMING;
        frame         <= NO_TIMING;
        regular       <= '0';
        stable        <= '0';
        frame_start   <= '0';
      end if;
    end if;

  end process measure;

end architecture rtl;
