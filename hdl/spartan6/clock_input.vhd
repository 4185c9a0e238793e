-- SPDX-License-Identifier: Apache-2.0
-- Differential input of the TMDS clock lane.
--
-- Each of the two outputs has a BUFIO2 of its own: a BUFIO2 reaches one input of one clock multiplexer, and the pin
-- reaches four BUFIO2s (UG382).
--
-- Latency: 0 clocks, the delay of the buffers. Throughput: one clock.
-- Equation: clk = clk_p.

library ieee;
use ieee.std_logic_1164.all;

library unisim;
use unisim.vcomponents.all;

entity clock_input is
  port (
    -- Pins.
    clk_p : in    std_logic;
    clk_n : in    std_logic;
    -- For a clock multiplexer or PLL.
    clk : out   std_logic;
    -- The clock on a global buffer, for logic that counts it.
    clk_global : out   std_logic
  );
end entity clock_input;

architecture rtl of clock_input is

  signal from_pins : std_logic;
  signal counted   : std_logic;

begin

  pins : component ibufds
    generic map (
      DIFF_TERM  => false,
      IOSTANDARD => "TMDS_33"
    )
    port map (
      i  => clk_p,
      ib => clk_n,
      o  => from_pins
    );

  chosen_way : component bufio2
    generic map (
      DIVIDE_BYPASS => true
    )
    port map (
      i      => from_pins,
      divclk => clk
    );

  counted_way : component bufio2
    generic map (
      DIVIDE_BYPASS => true
    )
    port map (
      i      => from_pins,
      divclk => counted
    );

  net : component bufg
    port map (
      i => counted,
      o => clk_global
    );

end architecture rtl;
