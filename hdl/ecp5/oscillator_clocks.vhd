-- SPDX-License-Identifier: Apache-2.0
-- From a board's oscillator: the control's clock, and a pixel clock of the board's own.
--
-- The VCO runs at 600 MHz. The PLL compares oscillator and control clock, each divided, at 10 MHz or more
-- (FPGA-DS-02012).
--
-- Equation: f(control_clk) = CONTROL_MHZ, f(own_clk) = 600 MHz / OWN_DIVIDE.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;

library ecp5u;
use ecp5u.components.all;

entity oscillator_clocks is
  generic (
    -- The oscillator, 8 to 400 MHz.
    OSCILLATOR_MHZ : positive range 8 to 400;
    -- A divisor of 600 that has a common divisor of at least 10 with OSCILLATOR_MHZ.
    CONTROL_MHZ : positive := 50;
    -- Divider of the VCO. 24: 25 MHz (640x480), 15: 40 MHz (800x600p60), 12: 50 MHz (800x600p72).
    OWN_DIVIDE : positive range 8 to 128 := 24
  );
  port (
    -- The oscillator.
    oscillator_clk : in    std_logic;
    -- The two clocks, and whether they run.
    control_clk : out   std_logic;
    own_clk     : out   std_logic;
    locked      : out   std_logic
  );
end entity oscillator_clocks;

architecture rtl of oscillator_clocks is

  -- Frequency at which the PLL compares its clocks.
  constant COMPARED_MHZ : positive := common_divisor(OSCILLATOR_MHZ, CONTROL_MHZ);

  constant REFUSED : boolean := not (takes(COMPARED_MHZ >= 10, "oscillator_clocks: OSCILLATOR_MHZ and CONTROL_MHZ " &
                                           "must have a common divisor of at least 10") and
                                     takes(600 mod CONTROL_MHZ = 0, "oscillator_clocks: CONTROL_MHZ must divide 600"));

  -- VHDL-93 cannot read outputs, and the control's clock is also the PLL's feedback.
  signal made_clk : std_logic;

begin

  control_clk <= made_clk;

  pll : component ehxplll
    generic map (
      CLKI_DIV        => OSCILLATOR_MHZ / COMPARED_MHZ,
      CLKFB_DIV       => CONTROL_MHZ / COMPARED_MHZ,
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
      clki         => oscillator_clk,
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
