-- SPDX-License-Identifier: Apache-2.0
-- The clocks of the video path on a 7-series device: pixel clock, and five times that, at which lanes carry two bits
-- each clock.
--
-- The source is the TMDS clock lane or a clock made on the board; the choice changes only while the MMCM is in reset.
-- The MMCM's ratios are fixed by the build. Its oscillator, at 7.5 * CLOCK_RANGE times the pixel clock, must lie
-- within 600 and 1200 MHz (DS187, grade -1). The pixel clocks that hdmi_control accepts make 615 to 1185 MHz of it.
--
-- Equation: f(clk) = f(chosen clock), f(clk_x5) = 5 f(clk), rising edges aligned.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;

library unisim;
use unisim.vcomponents.all;

entity link_clocks is
  generic (
    -- Range of pixel clocks, see hdmi_control: 2 or 4.
    CLOCK_RANGE : positive range 2 to 4 := 2
  );
  port (
    -- Pins of the TMDS clock lane; the board's own clock, on a global net; use_own chooses the latter.
    tmds_p  : in    std_logic;
    tmds_n  : in    std_logic;
    own_clk : in    std_logic;
    use_own : in    std_logic;
    -- Reset of the MMCM.
    mmcm_reset : in    std_logic;
    -- The TMDS clock on a global net, for logic that counts it.
    tmds_clk : out   std_logic;
    -- The clocks, and whether they run.
    clk    : out   std_logic;
    clk_x5 : out   std_logic;
    locked : out   std_logic
  );
end entity link_clocks;

architecture rtl of link_clocks is

  constant REFUSED : boolean := not takes(CLOCK_RANGE /= 3, "link_clocks: CLOCK_RANGE is not 2 or 4");

  -- Cycles of the oscillator in a pixel.
  constant PIXEL_CYCLES : positive := 15 * CLOCK_RANGE / 2;

  signal from_pins : std_logic;
  signal use_tmds  : std_logic;
  -- The MMCM's outputs in front of their buffers.
  signal feedback  : std_logic;
  signal pixel_clk : std_logic;
  signal pair_clk  : std_logic;

begin

  pins : component ibufds
    generic map (
      DIFF_TERM  => false,
      IOSTANDARD => "TMDS_33"
    )
    port map (
      i  => tmds_p,
      ib => tmds_n,
      o  => from_pins
    );

  counted : component bufg
    port map (
      i => from_pins,
      o => tmds_clk
    );

  use_tmds <= not use_own;

  -- The feedback stays inside: equal buffers keep the clocks aligned to each other, and nothing needs them aligned to
  -- the lane.
  mmcm : component mmcme2_adv
    generic map (
      BANDWIDTH        => "OPTIMIZED",
      CLKFBOUT_MULT_F  => real(PIXEL_CYCLES),
      CLKIN1_PERIOD    => 6.734 * real(CLOCK_RANGE),
      CLKIN2_PERIOD    => 10.0 * real(CLOCK_RANGE),
      CLKOUT0_DIVIDE_F => real(PIXEL_CYCLES),
      CLKOUT1_DIVIDE   => PIXEL_CYCLES / 5,
      CLKOUT2_DIVIDE   => PIXEL_CYCLES,
      COMPENSATION     => "INTERNAL",
      DIVCLK_DIVIDE    => 1
    )
    port map (
      clkin1   => from_pins,
      clkin2   => own_clk,
      clkinsel => use_tmds,
      clkfbin  => feedback,
      rst      => mmcm_reset,
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
      clkout0  => pixel_clk,
      clkout1  => pair_clk,
      locked   => locked
    );

  pixels : component bufg
    port map (
      i => pixel_clk,
      o => clk
    );

  pairs : component bufg
    port map (
      i => pair_clk,
      o => clk_x5
    );

end architecture rtl;
