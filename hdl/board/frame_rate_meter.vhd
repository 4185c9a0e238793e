-- SPDX-License-Identifier: Apache-2.0
-- Measures the frame rate: clocks from one vertical sync to the next, and their reciprocal.
--
-- The time between two rising edges is counted in units of TICK clocks. The division is done by adding
-- that time up until the sum reaches ten seconds; half of it at the beginning rounds. Edges during
-- a division do not begin another. A time of 65535 units counts as no frames.
--
-- Latency: a frame, and at most 2 ** 15 clocks for the division. Throughput: one rate for each frame or division.
-- Equation: rate = round(10000000 / time), at most 2 ** 15 - 1; in 0.1 Hz if the unit is 1 us.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity frame_rate_meter is
  generic (
    -- Clocks in a unit of time.
    TICK : positive := 100
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Vertical sync of any polarity.
    v_sync : in    std_logic;
    -- Frames in 10000000 units, 0: none.
    rate : out   std_logic_vector(14 downto 0)
  );
end entity frame_rate_meter;

architecture rtl of frame_rate_meter is

  -- Times in units of TICK clocks; FASTEST is what the port holds, and what a time of 0 gives.
  constant NEVER   : natural  := 2 ** 16 - 1;
  constant TEN_S   : positive := 10000000;
  constant FASTEST : positive := 2 ** 15 - 1;

  -- Time since the last edge: clocks of the unit under way, whole units.
  signal former   : std_logic                              := '0';
  signal clocks   : natural range 0 to larger(TICK - 1, 1) := 0;
  signal time_now : unsigned(15 downto 0)                  := to_unsigned(NEVER, 16);
  -- The division that is under way: what is added, the sum, how often it was added.
  signal divisor  : unsigned(15 downto 0) := (others => '0');
  signal sum      : unsigned(23 downto 0) := (others => '0');
  signal quotient : unsigned(14 downto 0) := (others => '0');
  signal divide   : std_logic             := '0';

begin

  measure : process (clk) is
  begin

    if rising_edge(clk) then
      -- The dividend is fixed and one rate a frame is enough, so repeated addition does what a
      -- divider would, with one adder.
      former <= v_sync;

      -- The sum is checked a clock after it was made, as is the count: both belong to the same
      -- addition.
      if divide = '1' then
        sum      <= sum + divisor;
        quotient <= quotient + 1;
        if sum >= TEN_S or quotient = FASTEST then
          rate   <= std_logic_vector(quotient);
          divide <= '0';
        end if;
      end if;

      if clocks /= TICK - 1 then
        clocks <= clocks + 1;
      else
        clocks <= 0;
        if time_now /= NEVER then
          time_now <= time_now + 1;
        else
          -- No edge for so long: there are no frames, and a division of what came before is void.
          rate   <= (others => '0');
          divide <= '0';
        end if;
      end if;

      -- One direction of the edge alone: a frame has one of each, so the polarity does not matter.
      if v_sync = '1' and former = '0' then
        clocks   <= 0;
        time_now <= (others => '0');
        -- A time that has reached NEVER is not one between two frames.
        if divide = '0' and time_now /= NEVER then
          divisor  <= time_now;
          sum      <= shift_right(resize(time_now, 24), 1);
          quotient <= (others => '0');
          divide   <= '1';
        end if;
      end if;

      if reset = '1' then
        time_now <= to_unsigned(NEVER, 16);
        divide   <= '0';
        rate     <= (others => '0');
      end if;
    end if;

  end process measure;

end architecture rtl;
