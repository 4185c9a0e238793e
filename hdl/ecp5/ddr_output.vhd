-- SPDX-License-Identifier: Apache-2.0
-- Output of one TMDS lane: words of ten bits, two bits each clock of clk_x5.
--
-- The I/O standard of the port (constraints) gives its pins a complementary driver.
--
-- No register has a reset, because at clk_x5 it would be the slowest path. Without the mark the last word is repeated,
-- at first 0.
--
-- Latency: about 1 clock of clk. Throughput: ten bits each clock of clk.
-- Equation: the bits of word in order, two each clock of clk_x5.

library ieee;
use ieee.std_logic_1164.all;

library ecp5u;
use ecp5u.components.all;

entity ddr_output is
  port (
    -- Ten bits, in the pixel clock; bit 0 is sent first.
    word : in    std_logic_vector(9 downto 0);
    -- Five times the pixel clock with aligned edges; the mark of word_strobe.
    clk_x5 : in    std_logic;
    strobe : in    std_logic;
    -- To the lane's pins.
    data : out   std_logic
  );
end entity ddr_output;

architecture rtl of ddr_output is

  -- The mark, a clock late, so that its net may be long; bits still to be sent, the next two at the right.
  signal mark : std_logic                    := '0';
  signal rest : std_logic_vector(9 downto 0) := (others => '0');

begin

  shift : process (clk_x5) is
  begin

    if rising_edge(clk_x5) then
      mark <= strobe;
      -- The bits go round: without a mark the word is sent again, and the lane stays balanced.
      rest <= rest(1 downto 0) & rest(9 downto 2);
      if mark = '1' then
        rest <= word;
      end if;
    end if;

  end process shift;

  send : component oddrx1f
    port map (
      d0   => rest(0),
      d1   => rest(1),
      sclk => clk_x5,
      rst  => '0',
      q    => data
    );

end architecture rtl;
