-- SPDX-License-Identifier: Apache-2.0
-- Brings a level from another clock into this one.
--
-- Latency: 2 to 3 clocks. Throughput: levels that last longer than that.
-- Equation: synchronous(t) = level(t - 2), give or take a clock.

library ieee;
use ieee.std_logic_1164.all;

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

  -- No shift register LUTs, no merging of equal registers.
  attribute shreg_extract : string;
  attribute shreg_extract of crossing_first               : signal is "no";
  attribute shreg_extract of crossing_second              : signal is "no";
  attribute equivalent_register_removal : string;
  attribute equivalent_register_removal of crossing_first : signal is "no";

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
