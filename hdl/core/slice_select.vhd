-- SPDX-License-Identifier: Apache-2.0
-- Chooses the slice of the next frame: the slice asked for, or the one that a sweep has reached.
--
-- A sweep goes through the set, some frames for each slice, and starts again behind the last slice. The sweep begins
-- with the slice of the last frame. Numbers beyond the set mean its last slice.
--
-- Latency: 0 clocks from slice, 1 clock from frame_start. Throughput: one frame each clock.
-- Equation: selected = min(slice, SLICES-1); in a sweep (first + floor(frame / sweep_frames)) mod SLICES.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity slice_select is
  generic (
    -- Size of the set.
    SLICES : positive range 1 to 256;
    -- Width of an index.
    SLICE_BITS : positive range 1 to 8
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A frame begins and reads `selected` in this clock.
    frame_start : in    std_logic;
    -- The slice asked for.
    slice : in    std_logic_vector(7 downto 0);
    -- Turns the sweep on.
    sweep : in    std_logic;
    -- Frames for each slice of a sweep; 0 counts as 1.
    sweep_frames : in    std_logic_vector(7 downto 0);
    -- The slice of the frame.
    selected : out   unsigned(SLICE_BITS - 1 downto 0)
  );
end entity slice_select;

architecture rtl of slice_select is

  subtype slice_t is unsigned(SLICE_BITS - 1 downto 0);

  constant LAST : slice_t := to_unsigned(SLICES - 1, SLICE_BITS);

  -- asked: the slice at the port, limited to the set; swept: the slice that the sweep has reached; frames: its
  -- frames so far.
  signal asked  : slice_t;
  signal swept  : slice_t              := (others => '0');
  signal frames : unsigned(7 downto 0) := (others => '0');

begin

  -- Software may write any byte; limiting it keeps every table's index in range.
  asked <= LAST when unsigned(slice) >= SLICES else
           unsigned(slice(SLICE_BITS - 1 downto 0));

  selected <= swept when sweep = '1' else
              asked;

  follow : process (clk) is
  begin

    if rising_edge(clk) then
      -- The slice changes only between frames.
      if frame_start = '1' then
        frames <= (others => '0');
        -- A sweep starts from the slice that was shown last, without a jump.
        if sweep = '0' then
          swept <= asked;
        -- sweep_frames = 0 acts like 1, because no number of frames is below it.
        elsif frames + 1 < unsigned(sweep_frames) then
          frames <= frames + 1;
        elsif swept = LAST then
          swept <= (others => '0');
        else
          swept <= swept + 1;
        end if;
      end if;
      if reset = '1' then
        swept  <= (others => '0');
        frames <= (others => '0');
      end if;
    end if;

  end process follow;

end architecture rtl;
