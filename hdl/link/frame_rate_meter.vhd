-- SPDX-License-Identifier: Apache-2.0
-- Measures the frame rate: clocks from one vertical sync to the next, and their reciprocal.
--
-- The time between two rising edges is counted in units of TICK clocks. The division adds up that time until the sum
-- reaches ten seconds; half of it at the beginning rounds. Edges during a division start no other one. A time of 65535
-- units counts as no frames.
--
-- Latency: a frame, and at most 2**15 clocks for the division. Throughput: one rate for each frame or division.
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

  -- Times in units of TICK clocks. FASTEST is the most that the port holds; a time of 0 gives it, too.
  constant NEVER   : natural  := 2 ** 16 - 1;
  constant TEN_S   : positive := 10000000;
  constant FASTEST : positive := 2 ** 15 - 1;

  -- Time since the last edge: clocks of the unit under way, and whole units.
  signal former   : std_logic                              := '0';
  signal clocks   : natural range 0 to larger(TICK - 1, 1) := 0;
  signal time_now : unsigned(15 downto 0)                  := to_unsigned(NEVER, 16);
  -- The division under way: the addend, the sum, and the number of additions.
  signal divisor  : unsigned(15 downto 0) := (others => '0');
  signal sum      : unsigned(23 downto 0) := (others => '0');
  signal quotient : unsigned(14 downto 0) := (others => '0');
  signal divide   : std_logic             := '0';

begin

  measure : process (clk) is
  begin

    if rising_edge(clk) then
      -- The dividend is constant and one rate a frame is enough, so repeated addition replaces a divider.
      former <= v_sync;

      -- Sum and count are checked a clock after they changed, so both belong to one addition.
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
          -- No edge for so long means no frames; a division under way is void.
          rate   <= (others => '0');
          divide <= '0';
        end if;
      end if;

      -- Only rising edges are used: a frame has one, so the polarity does not matter.
      if v_sync = '1' and former = '0' then
        clocks   <= 0;
        time_now <= (others => '0');
        -- A time that has reached NEVER does not lie between two frames.
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
