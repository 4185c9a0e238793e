-- SPDX-License-Identifier: Apache-2.0
-- The clocks of the video path: pixel clock, and five times that, at which a lane carries two bits each clock.
--
-- The source is the TMDS clock lane or a clock made on the board. The choice changes only while the PLL is in reset,
-- and is made by logic, which works even if the lane stands still.
--
-- The PLL's ratios are fixed when the FPGA is configured. The VCO, 5 * BIT_DIVIDE times the pixel clock, must lie
-- within 400 and 800 MHz (FPGA-TN-02200): pixel clocks of 80 / BIT_DIVIDE to 160 / BIT_DIVIDE MHz.
--
-- Equation: f(clk) = f(chosen clock), f(clk_x5) = 5 f(clk), rising edges aligned.

library ieee;
use ieee.std_logic_1164.all;

library ecp5u;
use ecp5u.components.all;

entity pixel_clocks is
  generic (
    -- Cycles of the VCO in one of clk_x5.
    BIT_DIVIDE : positive range 2 to 4 := 4
  );
  port (
    -- The TMDS clock lane; the board's own clock; use_own chooses the latter.
    tmds_clk : in    std_logic := '0';
    own_clk  : in    std_logic;
    use_own  : in    std_logic := '1';
    -- Reset of the PLL.
    pll_reset : in    std_logic;
    -- The clocks, and whether they run.
    clk    : out   std_logic;
    clk_x5 : out   std_logic;
    locked : out   std_logic
  );
end entity pixel_clocks;

architecture rtl of pixel_clocks is

  -- The chosen clock; and the clock made from it, which the PLL compares with it.
  signal source_clk : std_logic;
  signal made_clk   : std_logic;

begin

  -- A multiplexer of logic may glitch when it switches, so the PLL is in reset then.
  source_clk <= own_clk when use_own = '1' else
                tmds_clk;

  clk <= made_clk;

  pll : component ehxplll
    generic map (
      CLKI_DIV        => 1,
      CLKFB_DIV       => 1,
      CLKOP_DIV       => 5 * BIT_DIVIDE,
      CLKOP_CPHASE    => 5 * BIT_DIVIDE - 1,
      CLKOS_ENABLE    => "ENABLED",
      CLKOS_DIV       => BIT_DIVIDE,
      CLKOS_CPHASE    => BIT_DIVIDE - 1,
      FEEDBK_PATH     => "CLKOP",
      PLLRST_ENA      => "ENABLED",
      INT_LOCK_STICKY => "DISABLED"
    )
    port map (
      clki         => source_clk,
      clkfb        => made_clk,
      phasesel1    => '0',
      phasesel0    => '0',
      phasedir     => '0',
      phasestep    => '0',
      phaseloadreg => '0',
      stdby        => '0',
      pllwakesync  => '0',
      rst          => pll_reset,
      enclkop      => '0',
      enclkos      => '0',
      enclkos2     => '0',
      enclkos3     => '0',
      clkop        => made_clk,
      clkos        => clk_x5,
      lock         => locked
    );

end architecture rtl;
