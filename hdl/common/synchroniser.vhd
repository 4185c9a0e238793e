-- SPDX-License-Identifier: Apache-2.0
-- Brings a level from another clock into this one.
--
-- For bits that mean something one by one: flags, toggles, pins, settings that are kept stable. Bits that belong
-- together arrive in different clocks: they take bus_crossing, or gray_crossing if they count. A pulse that is shorter
-- than a clock is missed: send a toggle. For resets that must act without a clock there is reset_bridge.
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
    -- From any clock, or from none.
    level : in    std_logic_vector(WIDTH - 1 downto 0);
    -- The same in clk.
    synchronous : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity synchroniser;

architecture rtl of synchroniser is

  -- The names are what the constraints match.
  signal crossing_first  : std_logic_vector(WIDTH - 1 downto 0) := (others => '0');
  signal crossing_second : std_logic_vector(WIDTH - 1 downto 0) := (others => '0');

  -- Two flip-flops beside each other, whatever tool.
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
