-- SPDX-License-Identifier: Apache-2.0
-- Makes the raster of a video mode: place, data enable, syncs.
--
-- Latency: 1 clock from start to the first active pixel. Throughput: one pixel each clock.
-- Equation: position(t + 1) = position(t) + 1 pixel, modulo line_length and frame_lines.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.video_pkg.all;

entity raster_generator is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The mode; must be constant while running.
    timing : in    timing_t;
    -- The next pixel is the first one of a frame, whatever the place is now.
    start : in    std_logic;
    -- The place; it runs from the first start until a reset. Syncs have the polarity of the timing.
    raster : out   raster_t
  );
end entity raster_generator;

architecture rtl of raster_generator is

  signal on_now : std_logic := '0';
  signal x      : count_t   := (others => '0');
  signal y      : count_t   := (others => '0');
  -- Inside a sync pulse.
  signal h_pulse : std_logic := '0';
  signal v_pulse : std_logic := '0';
  -- The flags of the place. Each is a register that is decided with the next place, so that no comparator stands
  -- between the counters and the output.
  signal in_columns     : std_logic := '0';
  signal in_rows        : std_logic := '0';
  signal at_first       : std_logic := '0';
  signal at_line_last   : std_logic := '0';
  signal last_in_line   : std_logic;
  signal last_in_column : std_logic;

begin

  raster.running     <= on_now;
  raster.column      <= x;
  raster.row         <= y;
  raster.active      <= in_columns and in_rows;
  raster.frame_first <= at_first;
  raster.line_last   <= at_line_last and in_rows;
  -- Inside a pulse the signal is '1'; xor gives it the polarity.
  raster.h_sync <= h_pulse xor not timing.h_sync_level;
  raster.v_sync <= v_pulse xor not timing.v_sync_level;

  -- Compared with the present place, a clock before the next place is needed.
  last_in_line   <= '1' when x = timing.line_length - 1 else
                    '0';
  last_in_column <= '1' when y = timing.frame_lines - 1 else
                    '0';

  advance : process (clk) is

    variable next_x : count_t;
    variable next_y : count_t;

  begin

    if rising_edge(clk) then
      -- All flags are decided with the next place and registered with it.
      next_x := x + 1;
      next_y := y;
      if last_in_line = '1' then
        next_x := (others => '0');
        next_y := y + 1;
        if last_in_column = '1' then
          next_y := (others => '0');
        end if;
      end if;
      -- A start may come at any time: the place then jumps to the first pixel.
      if start = '1' then
        next_x := (others => '0');
        next_y := (others => '0');
        on_now <= '1';
      end if;
      if start = '1' or on_now = '1' then
        x <= next_x;
        y <= next_y;

        -- Flags change only where the next place meets a border, so each needs comparisons for equality only.
        at_first     <= '0';
        at_line_last <= '0';
        if next_x = 0 then
          in_columns <= '1';
          if next_y = 0 then
            in_rows  <= '1';
            at_first <= '1';
          elsif next_y = timing.rows then
            in_rows <= '0';
          end if;
        elsif next_x = timing.columns then
          in_columns <= '0';
        end if;
        if next_x = timing.columns - 1 then
          at_line_last <= '1';
        end if;
        -- Pulses are set and cleared where they begin and end, wherever the blanking is.
        if next_x = timing.h_sync_begin then
          h_pulse <= '1';
        -- A start in the middle of a pulse ends the pulse; otherwise it would last until the same place of the next
        -- line.
        elsif next_x = timing.h_sync_end or start = '1' then
          h_pulse <= '0';
        end if;
        if next_y = timing.v_sync_begin_line and next_x = timing.v_sync_begin_column then
          v_pulse <= '1';
        elsif (next_y = timing.v_sync_end_line and next_x = timing.v_sync_end_column) or start = '1' then
          v_pulse <= '0';
        end if;
      end if;

      if reset = '1' then
        -- Only the flags are cleared: x and y have no meaning until the raster runs.
        on_now       <= '0';
        in_rows      <= '0';
        at_first     <= '0';
        at_line_last <= '0';
        h_pulse      <= '0';
        v_pulse      <= '0';
      end if;
    end if;

  end process advance;

end architecture rtl;
