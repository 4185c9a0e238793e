-- SPDX-License-Identifier: Apache-2.0
-- From a board's 25 MHz oscillator: the control's clock, and a pixel clock of the board's own.
--
-- The VCO runs at 600 MHz.
--
-- Equation: f(control_clk) = CONTROL_MHZ, f(own_clk) = 600 MHz / OWN_DIVIDE.

library ieee;
use ieee.std_logic_1164.all;

library ecp5u;
use ecp5u.components.all;

entity oscillator_clocks is
  generic (
    -- A multiple of 25 that divides 600.
    CONTROL_MHZ : positive := 50;
    -- Divider of the VCO. 24: 25 MHz (640x480), 15: 40 MHz (800x600p60), 12: 50 MHz (800x600p72).
    OWN_DIVIDE : positive range 8 to 128 := 24
  );
  port (
    -- The oscillator.
    clk_25 : in    std_logic;
    -- The two clocks, and whether they run.
    control_clk : out   std_logic;
    own_clk     : out   std_logic;
    locked      : out   std_logic
  );
end entity oscillator_clocks;

architecture rtl of oscillator_clocks is

  -- VHDL-93 cannot read outputs, and the control's clock is also the PLL's feedback.
  signal made_clk : std_logic;

begin

  control_clk <= made_clk;

  pll : component ehxplll
    generic map (
      CLKI_DIV        => 1,
      CLKFB_DIV       => CONTROL_MHZ / 25,
      CLKOP_DIV       => 600 / CONTROL_MHZ,
      CLKOP_CPHASE    => 600 / CONTROL_MHZ - 1,
      CLKOS_ENABLE    => "ENABLED",
      CLKOS_DIV       => OWN_DIVIDE,
      CLKOS_CPHASE    => OWN_DIVIDE - 1,
      FEEDBK_PATH     => "CLKOP",
      PLLRST_ENA      => "DISABLED",
      INT_LOCK_STICKY => "DISABLED"
    )
    port map (
      clki         => clk_25,
      clkfb        => made_clk,
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
      clkop        => made_clk,
      clkos        => own_clk,
      lock         => locked
    );

end architecture rtl;
