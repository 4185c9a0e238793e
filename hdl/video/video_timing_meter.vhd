-- SPDX-License-Identifier: Apache-2.0
-- Measures the timing of incoming video: sizes, blanking, places and polarities of the syncs.
--
-- Lines are counted by data enable, and in the vertical blanking by the measured line length. A change of vertical sync
-- since the last active pixel marks the first line of a frame. The levels of the syncs just before an active line are
-- their idle levels. A timing is stable when two frames in a row had it and neither had an irregular line.
--
-- Latency: 1 clock to frame_start; a timing is known with the first pixel of the next frame.
-- Throughput: one pixel each clock.
-- Equation: the counts of timing_t in video_pkg.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.video_pkg.all;

entity video_timing_meter is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Incoming video; its pixels are not used.
    video : in    video_t;
    -- The pixel before was the first one of a frame.
    frame_start : out   std_logic;
    -- Timing of the last whole frame, and whether the frame before had the same; both change one clock after
    -- frame_start.
    timing : out   timing_t;
    stable : out   std_logic := '0'
  );
end entity video_timing_meter;

architecture rtl of video_timing_meter is

  -- The pixel before this one.
  signal former : video_t := NO_VIDEO;
  -- Vertical sync has changed since the last active pixel, so the next active pixel begins a frame.
  signal v_changed : std_logic := '0';
  -- Levels of the syncs before the last active line.
  signal h_idle : std_logic := '0';
  signal v_idle : std_logic := '0';
  -- Position of the pixel before. The column counts on through lines without active pixels, modulo the length of the
  -- frame's first line, and so counts the lines of the vertical blanking.
  signal x : count_t := (others => '0');
  signal y : count_t := (others => '0');
  -- Length of the lines of this frame; 0 until its second line has begun.
  signal line_length : count_t := (others => '0');
  -- Timing of this frame so far, and of the frame before; whether that one was regular.
  signal frame    : timing_t  := NO_TIMING;
  signal previous : timing_t  := NO_TIMING;
  signal regular  : std_logic := '0';

  -- Position of this pixel, unless it begins a frame.
  signal next_x : count_t;
  signal next_y : count_t;
  -- Data enable rises, falls, begins a frame; wraps: the column count ends a line; a sync changes in the blanking.
  signal rise    : std_logic;
  signal fall    : std_logic;
  signal starts  : std_logic;
  signal wraps   : std_logic;
  signal h_moves : std_logic;
  signal v_moves : std_logic;
  -- Reasons for an irregular frame: no line or frame ends (endless); a line has another length (torn), another
  -- horizontal sync, a begin at an unexpected column, or another number of pixels (cut).
  signal endless    : std_logic;
  signal torn       : std_logic;
  signal h_strays   : std_logic;
  signal row_strays : std_logic;
  signal cut        : std_logic;
  signal irregular  : std_logic;

begin

  timing <= previous;

  rise   <= video.active and not former.active;
  fall   <= former.active and not video.active;
  starts <= rise and v_changed;
  wraps  <= to_logic(line_length /= 0 and x = line_length - 1);
  -- Edges of syncs inside the picture do not count, because some sources have no syncs there.
  h_moves <= (video.h_sync xor former.h_sync) and not video.active;
  v_moves <= (video.v_sync xor former.v_sync) and not video.active;

  -- Lines without pixels are counted too, once a line's length is known.
  next_x <= (others => '0') when rise = '1' or wraps = '1' else
            x + 1;
  next_y <= y + 1 when rise = '1' or wraps = '1' else
            y;

  endless    <= to_logic(x = 2 ** COUNT_BITS - 1 or y = 2 ** COUNT_BITS - 1);
  torn       <= rise and not wraps and (starts or to_logic(y /= 0 or line_length /= 0));
  h_strays   <= h_moves and to_logic(y /= 0) and
                ((to_logic(frame.h_sync_begin /= next_x) and (video.h_sync xor h_idle)) or
                 (to_logic(frame.h_sync_end /= next_x) and not (video.h_sync xor h_idle)));
  row_strays <= rise and not starts and
                to_logic(former.h_sync /= h_idle or former.v_sync /= v_idle or frame.rows /= next_y);
  cut        <= fall and to_logic(frame.rows /= 1 and frame.columns /= next_x);
  -- Any of these makes the frame one that cannot be followed.
  irregular <= endless or torn or h_strays or row_strays or cut;

  follow_levels : process (clk) is
  begin

    if rising_edge(clk) then
      former <= video;
      if rise = '1' then
        h_idle    <= former.h_sync;
        v_idle    <= former.v_sync;
        v_changed <= '0';
      elsif v_moves = '1' then
        v_changed <= '1';
      end if;
      if reset = '1' then
        former.active <= '0';
        v_changed     <= '0';
      end if;
    end if;

  end process follow_levels;

  follow_place : process (clk) is
  begin

    if rising_edge(clk) then
      x <= next_x;
      y <= next_y;
      if starts = '1' then
        y           <= (others => '0');
        line_length <= (others => '0');
      elsif rise = '1' and wraps = '0' and y = 0 and line_length = 0 then
        -- The second line begins, which gives the length of the first.
        line_length <= x + 1;
      end if;
      if reset = '1' then
        line_length <= (others => '0');
      end if;
    end if;

  end process follow_place;

  measure : process (clk) is
  begin

    if rising_edge(clk) then
      if v_moves = '1' and video.v_sync /= v_idle then
        frame.v_sync_begin_line   <= next_y;
        frame.v_sync_begin_column <= next_x;
      elsif v_moves = '1' then
        frame.v_sync_end_line   <= next_y;
        frame.v_sync_end_column <= next_x;
      end if;
      if h_moves = '1' and video.h_sync /= h_idle then
        frame.h_sync_begin <= next_x;
      elsif h_moves = '1' then
        frame.h_sync_end <= next_x;
      end if;
      if rise = '1' then
        frame.rows <= frame.rows + 1;
      end if;
      if fall = '1' then
        frame.columns <= next_x;
      end if;
      if starts = '1' then
        -- Each frame is measured from the start, so that nothing of another mode remains.
        frame      <= NO_TIMING;
        frame.rows <= to_unsigned(1, COUNT_BITS);
      end if;
      if reset = '1' then
        frame <= NO_TIMING;
      end if;
    end if;

  end process measure;

  -- The frame that ends here, compared with the frame before.
  compare : process (clk) is

    variable complete : timing_t;

  begin

    if rising_edge(clk) then
      frame_start <= starts;
      if starts = '1' then
        complete             := frame;
        complete.line_length := line_length;
        complete.frame_lines := next_y;
        -- Just before an active line the syncs are idle; their pulses have the other level.
        complete.h_sync_level := not former.h_sync;
        complete.v_sync_level := not former.v_sync;

        previous <= complete;
        -- Two equal frames are needed, because the first one behind a change of mode may be half of each.
        stable  <= to_logic(complete = previous) and regular and not irregular;
        regular <= '1';
      elsif irregular = '1' then
        regular <= '0';
      end if;
      if endless = '1' then
        -- There is no video.
        stable <= '0';
      end if;

      if reset = '1' then
        previous    <= NO_TIMING;
        regular     <= '0';
        stable      <= '0';
        frame_start <= '0';
      end if;
    end if;

  end process compare;

end architecture rtl;
