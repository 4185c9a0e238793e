-- SPDX-License-Identifier: Apache-2.0
-- From an oscillator of 27 MHz: the serialisers' clock, and the pixel clock, a fifth of it.
--
-- A PLL, then a divider by five that is held until the PLL has locked. The defaults give 126 MHz and 25.2 MHz, for
-- 640x480 at 60 Hz; the PLL's oscillator then runs at 504 MHz (500 to 1250 are allowed).
--
-- Equation: f(clk_x5) = 27 MHz * MULTIPLY / DIVIDE, f(clk) = f(clk_x5) / 5.

library ieee;
use ieee.std_logic_1164.all;

library gw2a;
use gw2a.components.all;

entity display_clocks is
  port (
    -- The oscillator.
    clk_27 : in    std_logic;
    -- The clocks, and whether they run.
    clk    : out   std_logic;
    clk_x5 : out   std_logic;
    locked : out   std_logic
  );
end entity display_clocks;

architecture rtl of display_clocks is

  constant MULTIPLY : positive range 1 to 64 := 14;
  constant DIVIDE   : positive range 1 to 64 := 3;
  -- Cycles of the PLL's oscillator in one of clk_x5: 2, 4, 8, 16, 32, 48, 64, 80, 96, 112 or 128.
  constant VCO_DIVIDE : positive range 2 to 128 := 4;

  -- VHDL-93 cannot read outputs: the divider takes the fast clock and waits for the lock.
  signal fast_clk : std_logic;
  signal lock_now : std_logic;

begin

  clk_x5 <= fast_clk;
  locked <= lock_now;

  pll : component rpll
    generic map (
      FCLKIN    => "27",
      IDIV_SEL  => DIVIDE - 1,
      FBDIV_SEL => MULTIPLY - 1,
      ODIV_SEL  => VCO_DIVIDE,
      DEVICE    => "GW2A-18C"
    )
    port map (
      clkin   => clk_27,
      clkfb   => '0',
      reset   => '0',
      reset_p => '0',
      fbdsel  => "000000",
      idsel   => "000000",
      odsel   => "000000",
      dutyda  => "0000",
      psda    => "0000",
      fdly    => "0000",
      clkout  => fast_clk,
      lock    => lock_now
    );

  -- The serialisers need both clocks with aligned edges, as this divider makes them. It is held until the clock in
  -- front of it is good.
  divider : component clkdiv
    generic map (
      DIV_MODE => "5"
    )
    port map (
      hclkin => fast_clk,
      resetn => lock_now,
      calib  => '0',
      clkout => clk
    );

end architecture rtl;
