-- SPDX-License-Identifier: Apache-2.0
-- Detects faults in the stream that frame_sequencer takes, and marks excess pixels.
--
-- A short line is detected at its early end. A long line is detected at its last pixel that belongs to the frame;
-- all pixels behind it are excess, up to the end of the line or the next frame.
--
-- Latency: 1 clock. Throughput: one pixel each clock.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.fault_pkg.all;

entity stream_faults is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The pixel on offer; new_start: it starts a frame; credit: it can be handled in this clock.
    s_axis_tvalid : in    std_logic;
    new_start     : in    std_logic;
    s_axis_tlast  : in    std_logic;
    credit        : in    std_logic;
    -- take: the pixel on offer is taken; takes_pixel: it belongs to the frame; starts_frame: it is the frame's
    -- first; line_ends: it is the last of its line.
    take         : in    std_logic;
    takes_pixel  : in    std_logic;
    starts_frame : in    std_logic;
    line_ends    : in    std_logic;
    -- A frame starts inside a frame.
    frame_broken : in    std_logic;
    -- The pixel on offer is excess.
    excess : out   std_logic;
    -- The faults of fault_pkg; bits stay set until error_clear.
    error_flags : out   std_logic_vector(STREAM_FAULT_BITS - 1 downto 0) := (others => '0');
    error_clear : in    std_logic
  );
end entity stream_faults;

architecture rtl of stream_faults is

  -- The last start of frame was accepted. Without one, pixels are no fault of their own: after a reset the stream
  -- may be in the middle of a frame, and a frame of a wrong size was reported with its start.
  signal synchronised : std_logic := '0';
  signal in_excess    : std_logic := '0';

begin

  excess <= in_excess;

  find_faults : process (clk) is
  begin

    if rising_edge(clk) then
      -- Clearing comes first, so that a fault in the same clock is kept.
      if error_clear = '1' then
        error_flags <= (others => '0');
      end if;
      if starts_frame = '1' then
        synchronised <= '1';
      end if;
      if takes_pixel = '1' then
        -- The last pixel that belongs to the frame should have tlast; without it the line is too long.
        in_excess <= line_ends and not s_axis_tlast;
        if s_axis_tlast = '1' and line_ends = '0' then
          error_flags(LINE_EARLY) <= '1';
        elsif s_axis_tlast = '0' and line_ends = '1' then
          error_flags(LINE_LATE) <= '1';
        end if;
      elsif credit = '1' and s_axis_tvalid = '1' then
        -- A new frame also ends the excess: a source that lost its tlast would otherwise lose the next frame too.
        if new_start = '1' or s_axis_tlast = '1' then
          in_excess <= '0';
        end if;
        if frame_broken = '1' then
          error_flags(FRAME_EARLY) <= '1';
        -- The pixel is dropped because it belongs to no frame. A start of frame is dropped only if the frame
        -- size is not supported.
        elsif take = '1' and new_start = '1' then
          error_flags(FRAME_SIZE) <= '1';
          synchronised            <= '0';
        elsif take = '1' and synchronised = '1' and in_excess = '0' then
          error_flags(STRAY_PIXELS) <= '1';
        end if;
      end if;
      if reset = '1' then
        synchronised <= '0';
        in_excess    <= '0';
        error_flags  <= (others => '0');
      end if;
    end if;

  end process find_faults;

end architecture rtl;
