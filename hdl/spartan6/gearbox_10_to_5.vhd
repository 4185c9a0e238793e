-- SPDX-License-Identifier: Apache-2.0
-- Sends words of ten bits as two halves of five bits.
--
-- The two clocks come from one PLL with their rising edges aligned, so this is a synchronous crossing with half a clock
-- of clk to spare. A bit that toggles with each word tells the fast side when a word begins.
--
-- Latency: 1 clock of clk, then 1 clock of clk_x2 to the first half.
-- Throughput: ten bits each clock of clk, five bits each clock of clk_x2.
-- Equation: half = bits 4..0, then bits 9..5.

library ieee;
use ieee.std_logic_1164.all;

entity gearbox_10_to_5 is
  port (
    -- Word clock, and twice that from the same PLL.
    clk    : in    std_logic;
    clk_x2 : in    std_logic;
    -- Word, in clk; bit 0 is sent first.
    bits : in    std_logic_vector(9 downto 0);
    -- Five bits, in clk_x2; bit 0 is sent first.
    half : out   std_logic_vector(4 downto 0)
  );
end entity gearbox_10_to_5;

architecture rtl of gearbox_10_to_5 is

  -- In clk: the word, and a bit that toggles with each word. In clk_x2: that bit a clock of clk_x2 ago, and the half
  -- that is still to be sent.
  signal word      : std_logic_vector(9 downto 0) := (others => '0');
  signal even      : std_logic                    := '0';
  signal even_seen : std_logic                    := '0';
  signal rest      : std_logic_vector(4 downto 0) := (others => '0');

begin

  hold : process (clk) is
  begin

    if rising_edge(clk) then
      word <= bits;
      even <= not even;
    end if;

  end process hold;

  split : process (clk_x2) is
  begin

    if rising_edge(clk_x2) then
      even_seen <= even;
      half      <= rest;
      -- The first half of a word.
      if even_seen /= even then
        half <= word(4 downto 0);
        rest <= word(9 downto 5);
      end if;
    end if;

  end process split;

end architecture rtl;
