-- Chooses the slice of the next frame: the one asked for, or in a sweep the next of the set once
-- every so many frames, the first again after the last.
--
-- A sweep goes on from the slice of the last frame. Slices beyond the set give its last one.
--
-- Latency: 0 clocks from slice, 1 clock from frame_start. Throughput: one frame each clock.
-- Ports: frame_start marks the clock in which a frame reads selected; slice is the index of the
--   slice asked for; sweep turns the sweep on; sweep_frames is the number of frames for each slice
--   (0 counts as 1).
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
    clk          : in    std_logic;
    reset        : in    std_logic;
    frame_start  : in    std_logic;
    slice        : in    std_logic_vector(7 downto 0);
    sweep        : in    std_logic;
    sweep_frames : in    std_logic_vector(7 downto 0);
    selected     : out   unsigned(SLICE_BITS - 1 downto 0)
  );
end entity slice_select;

architecture rtl of slice_select is

  subtype slice_t is unsigned(SLICE_BITS - 1 downto 0);

  constant LAST : slice_t := to_unsigned(SLICES - 1, SLICE_BITS);

  signal asked  : slice_t;
  signal swept  : slice_t              := (others => '0');
  signal frames : unsigned(7 downto 0) := (others => '0');

begin

  asked <= LAST when unsigned(slice) >= SLICES - 1 else
           unsigned(slice(SLICE_BITS - 1 downto 0));

  selected <= swept when sweep = '1' else
              asked;

  follow : process (clk) is
  begin

    if rising_edge(clk) then
      if frame_start = '1' then
        frames <= (others => '0');
        if sweep = '0' then
          swept <= asked;
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
