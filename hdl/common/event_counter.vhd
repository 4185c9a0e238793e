-- SPDX-License-Identifier: Apache-2.0
-- Counts events up to a limit and stays there.
--
-- Latency: 1 clock. Throughput: one event each clock.
-- Equation: count = min(events since the last clearing, 2 ** WIDTH - 1).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity event_counter is
  generic (
    -- Bits of the count.
    WIDTH : positive
  );
  port (
    clk : in    std_logic;
    -- Begin again at 0; an event in the same clock is not counted.
    clear : in    std_logic;
    -- One event for each clock in which this is high.
    add : in    std_logic;
    -- Events so far.
    count : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity event_counter;

architecture rtl of event_counter is

  -- It stays at the largest count: a count that wrapped around would look like few events.
  signal events : unsigned(WIDTH - 1 downto 0) := (others => '0');

begin

  count <= std_logic_vector(events);

  count_events : process (clk) is
  begin

    if rising_edge(clk) then
      if add = '1' and events /= 2 ** WIDTH - 1 then
        events <= events + 1;
      end if;
      if clear = '1' then
        events <= (others => '0');
      end if;
    end if;

  end process count_events;

end architecture rtl;
