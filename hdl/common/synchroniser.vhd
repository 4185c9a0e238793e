-- SPDX-License-Identifier: Apache-2.0
-- Brings a level from another clock into this one.
--
-- Use it for bits that mean something one by one: flags, toggles, pins, settings that are kept stable. Bits that
-- belong together would arrive in different clocks: use bus_crossing, or gray_crossing for a count. A pulse shorter
-- than a clock is missed: send a toggle. For resets that must act without a clock use reset_bridge.
--
-- Latency: 2 to 3 clocks. Throughput: levels that last longer than that.
-- Equation: synchronous(t) = level(t - 2), give or take a clock. Cost: 2 flip-flops a bit.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.crossing_pkg.all;

entity synchroniser is
  generic (
    -- Independent levels side by side.
    WIDTH : positive := 1
  );
  port (
    clk : in    std_logic;
    -- Levels from any clock, or from none.
    level : in    std_logic_vector(WIDTH - 1 downto 0);
    -- The levels in clk.
    synchronous : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity synchroniser;

architecture rtl of synchroniser is

  -- The timing constraints match these names.
  signal crossing_first  : std_logic_vector(WIDTH - 1 downto 0) := (others => '0');
  signal crossing_second : std_logic_vector(WIDTH - 1 downto 0) := (others => '0');

  -- Both stages stay two flip-flops beside each other in every tool.
  attribute async_reg of crossing_first, crossing_second                   : signal is "TRUE";
  attribute keep of crossing_first, crossing_second                        : signal is "TRUE";
  attribute equivalent_register_removal of crossing_first, crossing_second : signal is "no";
  attribute preserve of crossing_first, crossing_second                    : signal is true;
  attribute dont_merge of crossing_first, crossing_second                  : signal is true;
  attribute syn_preserve of crossing_first, crossing_second                : signal is 1;
  attribute shreg_extract of crossing_first, crossing_second               : signal is "no";
  attribute syn_srlstyle of crossing_first, crossing_second                : signal is "registers";

begin

  synchronous <= crossing_second;

  crossing : process (clk) is
  begin

    if rising_edge(clk) then
      crossing_first  <= level;
      crossing_second <= crossing_first;
    end if;

  end process crossing;

end architecture rtl;
