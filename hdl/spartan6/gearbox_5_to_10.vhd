-- SPDX-License-Identifier: Apache-2.0
-- Collects words of ten bits from halves of five bits.
--
-- The two clocks come from one PLL with their rising edges aligned, so this is a synchronous crossing with half a clock
-- of clk to spare. Either half may come first: the word alignment behind finds the phase.
--
-- Latency: 1 clock of clk_x2, then 1 clock of clk.
-- Throughput: five bits each clock of clk_x2, ten bits each clock of clk.
-- Equation: bits = the last two halves, the older one in the low bits.

library ieee;
use ieee.std_logic_1164.all;

entity gearbox_5_to_10 is
  port (
    -- Word clock, and twice that from the same PLL.
    clk    : in    std_logic;
    clk_x2 : in    std_logic;
    -- Five bits, in clk_x2; bit 0 came first.
    half : in    std_logic_vector(4 downto 0);
    -- Ten bits, in clk; bit 0 came first.
    bits : out   std_logic_vector(9 downto 0)
  );
end entity gearbox_5_to_10;

architecture rtl of gearbox_5_to_10 is

  signal halves : std_logic_vector(9 downto 0) := (others => '0');

begin

  collect : process (clk_x2) is
  begin

    if rising_edge(clk_x2) then
      halves <= half & halves(9 downto 5);
    end if;

  end process collect;

  take : process (clk) is
  begin

    if rising_edge(clk) then
      bits <= halves;
    end if;

  end process take;

end architecture rtl;
