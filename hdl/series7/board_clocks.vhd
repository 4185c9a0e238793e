-- SPDX-License-Identifier: Apache-2.0
-- From an oscillator of 125 MHz on a 7-series device: clocks of the control, of the delay lines' reference, and a
-- pixel clock of the board's own.
--
-- The MMCM's oscillator runs at 1200 MHz. The entity has the one IDELAYCTRL that the delay lines of all lanes share.
--
-- Equation: f(control_clk) = 100 MHz, f(own_clk) = 600 MHz / OWN_DIVIDE.

library ieee;
use ieee.std_logic_1164.all;

library unisim;
use unisim.vcomponents.all;

entity board_clocks is
  generic (
    -- Divider of 600 MHz. 24: 25 MHz (640x480), 12: 50 MHz (800x600p72).
    OWN_DIVIDE : positive range 8 to 64 := 12
  );
  port (
    -- The oscillator.
    clk_125 : in    std_logic;
    -- The two clocks, on global nets, and whether they run and the delay lines are calibrated.
    control_clk : out   std_logic;
    own_clk     : out   std_logic;
    ready       : out   std_logic
  );
end entity board_clocks;

architecture rtl of board_clocks is

  signal feedback    : std_logic;
  signal control_out : std_logic;
  signal ref_out     : std_logic;
  signal own_out     : std_logic;
  signal locked      : std_logic;
  signal calibrated  : std_logic;
  -- The reference on its net; a reset of the calibration while it does not run.
  signal ref_clk   : std_logic;
  signal unlocked  : std_logic;
  signal ref_reset : std_logic;

begin

  mmcm : component mmcme2_adv
    generic map (
      BANDWIDTH        => "OPTIMIZED",
      CLKFBOUT_MULT_F  => 48.0,
      CLKIN1_PERIOD    => 8.0,
      CLKIN2_PERIOD    => 8.0,
      CLKOUT0_DIVIDE_F => real(2 * OWN_DIVIDE),
      CLKOUT1_DIVIDE   => 12,
      CLKOUT2_DIVIDE   => 6,
      COMPENSATION     => "INTERNAL",
      DIVCLK_DIVIDE    => 5
    )
    port map (
      clkin1   => clk_125,
      clkin2   => '0',
      clkinsel => '1',
      clkfbin  => feedback,
      rst      => '0',
      pwrdwn   => '0',
      daddr    => (others => '0'),
      dclk     => '0',
      den      => '0',
      di       => (others => '0'),
      dwe      => '0',
      psclk    => '0',
      psen     => '0',
      psincdec => '0',
      clkfbout => feedback,
      clkout0  => own_out,
      clkout1  => control_out,
      clkout2  => ref_out,
      locked   => locked
    );

  control_net : component bufg
    port map (
      i => control_out,
      o => control_clk
    );

  own_net : component bufg
    port map (
      i => own_out,
      o => own_clk
    );

  reference_net : component bufg
    port map (
      i => ref_out,
      o => ref_clk
    );

  unlocked <= not locked;

  -- The calibration wants a reset of 52 ns (DS187) while its reference runs.
  reset_of_reference : entity work.reset_filter
    generic map (
      ASSERT_CLOCKS  => 2,
      RELEASE_CLOCKS => 32
    )
    port map (
      clk     => ref_clk,
      request => unlocked,
      reset   => ref_reset
    );

  delay_reference : component idelayctrl
    port map (
      refclk => ref_clk,
      rst    => ref_reset,
      rdy    => calibrated
    );

  ready <= locked and calibrated;

end architecture rtl;
