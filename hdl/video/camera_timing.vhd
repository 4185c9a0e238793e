-- SPDX-License-Identifier: Apache-2.0
-- Timing of a screen that follows a camera: lines are those of a video mode; frames have more or fewer blank lines, as
-- the camera needs.
--
-- A camera has a clock of its own, so its frames are a little longer or shorter than those of a mode. A frame begins
-- with the first whole line after `due`, wherever the frame before is; without `due` it begins LATE_LINES later than in
-- the mode. The horizontal timing of the screen therefore never changes, its vertical blanking varies by a line now and
-- then, and it goes on without a camera. The camera's first frame cuts off the one on the screen.
--
-- Latency: up to a line from due to the frame. Throughput: one raster place each clock.
-- Equation: frame n begins at the first end of a line with due since frame n - 1 began.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.video_pkg.all;

entity camera_timing is
  generic (
    -- Lines by which a frame may be late.
    LATE_LINES : positive range 1 to 255 := 16
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The mode; must be constant.
    timing : in    timing_t;
    -- High for one clock: enough of the camera's frame has come for the screen's frame to begin.
    due : in    std_logic;
    -- The raster, as stream_to_video takes it.
    following : out   following_t
  );
end entity camera_timing;

architecture rtl of camera_timing is

  signal longest : timing_t;
  signal place   : raster_t;
  signal begun   : std_logic := '0';
  signal waiting : std_logic := '0';
  signal start   : std_logic;

begin

  allow_lines : process (timing) is
  begin

    -- A camera that is late by up to LATE_LINES lines begins each frame itself; if it is later, the raster goes on
    -- without it.
    longest             <= timing;
    longest.frame_lines <= timing.frame_lines + LATE_LINES;

  end process allow_lines;

  raster : entity work.raster_generator
    port map (
      clk    => clk,
      reset  => reset,
      timing => longest,
      start  => start,
      raster => place
    );

  following.timing  <= longest;
  following.column  <= place.column;
  following.row     <= place.row;
  following.running <= place.running;

  -- The first frame begins without a camera, so that a monitor has a signal to lock to.
  start <= not begun or (waiting and to_logic(place.column = timing.line_length - 1));

  follow : process (clk) is
  begin

    if rising_edge(clk) then
      begun <= '1';
      -- A due in the clock of a start is kept and counts for the next line.
      if due = '1' then
        waiting <= '1';
      elsif start = '1' then
        waiting <= '0';
      end if;
      if reset = '1' then
        begun   <= '0';
        waiting <= '0';
      end if;
    end if;

  end process follow;

end architecture rtl;
