-- SPDX-License-Identifier: Apache-2.0
-- From a board's oscillator of 25 MHz the control's clock of 100 MHz and a pixel clock of the board's own.
--
-- The VCO runs at 600 MHz.
--
-- Latency: the lock time. Throughput: not applicable.
-- Equation: f(clk_100) = 100 MHz, f(own_clk) = 600 MHz / OWN_DIVIDE.

library ieee;
use ieee.std_logic_1164.all;

library ecp5u;
use ecp5u.components.all;

entity oscillator_clocks is
  generic (
    -- 24: 25 MHz (640x480), 15: 40 MHz (800x600p60), 12: 50 MHz (800x600p72).
    OWN_DIVIDE : positive range 8 to 128 := 24
  );
  port (
    -- The oscillator.
    clk_25 : in    std_logic;
    -- The clocks made of it, and whether they run.
    clk_100 : out   std_logic;
    own_clk : out   std_logic;
    locked  : out   std_logic
  );
end entity oscillator_clocks;

architecture rtl of oscillator_clocks is

  signal made_100 : std_logic;

begin

  clk_100 <= made_100;

  pll : component ehxplll
    generic map (
      CLKI_DIV        => 1,
      CLKFB_DIV       => 4,
      CLKOP_DIV       => 6,
      CLKOP_CPHASE    => 5,
      CLKOS_ENABLE    => "ENABLED",
      CLKOS_DIV       => OWN_DIVIDE,
      CLKOS_CPHASE    => OWN_DIVIDE - 1,
      FEEDBK_PATH     => "CLKOP",
      PLLRST_ENA      => "DISABLED",
      INT_LOCK_STICKY => "DISABLED"
    )
    port map (
      clki         => clk_25,
      clkfb        => made_100,
      phasesel1    => '0',
      phasesel0    => '0',
      phasedir     => '0',
      phasestep    => '0',
      phaseloadreg => '0',
      stdby        => '0',
      pllwakesync  => '0',
      rst          => '0',
      enclkop      => '0',
      enclkos      => '0',
      enclkos2     => '0',
      enclkos3     => '0',
      clkop        => made_100,
      clkos        => own_clk,
      clkos2       => open,
      clkos3       => open,
      lock         => locked,
      intlock      => open,
      refclk       => open,
      clkintfb     => open
    );

end architecture rtl;
