-- SPDX-License-Identifier: Apache-2.0
-- The clocks of a serial link: pixel clock, twice that, and ten times that on an I/O clock network.
--
-- One PLL makes all three, so that their edges are aligned. It has two settings (pll_settings_pkg); after configuration
-- it is set for 40 to 100 MHz.
--
-- Equation: f(io_clk) = 10 f(clk_in), f(clk_x2) = 2 f(clk_in), f(clk) = f(clk_in).

library ieee;
use ieee.std_logic_1164.all;

library unisim;
use unisim.vcomponents.all;

entity serial_clocks is
  port (
    -- Pixel clock.
    clk_in : in    std_logic;
    -- Reset of the PLL.
    pll_reset : in    std_logic;
    -- Ports of pll_configure, with its clock. The PLL must be in reset while it is configured.
    control_clk   : in    std_logic;
    control_reset : in    std_logic;
    configure     : in    std_logic;
    high          : in    std_logic;
    configured    : out   std_logic;
    -- Pixel clock and twice that, on global buffers.
    clk    : out   std_logic;
    clk_x2 : out   std_logic;
    -- Ten times the pixel clock and its strobe, to the serialisers of one bank.
    io_clk    : out   std_logic;
    io_strobe : out   std_logic;
    -- All clocks run.
    locked : out   std_logic
  );
end entity serial_clocks;

architecture rtl of serial_clocks is

  -- The PLL's port for its registers.
  signal drp_enable  : std_logic;
  signal drp_write   : std_logic;
  signal drp_address : std_logic_vector(4 downto 0);
  signal drp_in      : std_logic_vector(15 downto 0);
  signal drp_out     : std_logic_vector(15 downto 0);
  signal drp_ready   : std_logic;
  -- The PLL's outputs in front of their buffers: bits, pixels, half words. The PLL's lock does not include the I/O
  -- clock.
  signal feedback   : std_logic;
  signal pll_bit    : std_logic;
  signal pll_pixel  : std_logic;
  signal pll_half   : std_logic;
  signal pll_locked : std_logic;
  -- VHDL-93 cannot read outputs, and the buffer of the I/O clock needs the clock of half words.
  signal half_clk : std_logic;

begin

  configurator : entity work.pll_configure
    port map (
      clk         => control_clk,
      reset       => control_reset,
      start       => configure,
      high        => high,
      done        => configured,
      drp_enable  => drp_enable,
      drp_write   => drp_write,
      drp_address => drp_address,
      drp_in      => drp_in,
      drp_out     => drp_out,
      drp_ready   => drp_ready
    );

  pll : component pll_adv
    generic map (
      BANDWIDTH      => "OPTIMIZED",
      CLK_FEEDBACK   => "CLKFBOUT",
      CLKFBOUT_MULT  => 10,
      CLKIN1_PERIOD  => 13.468,
      CLKOUT0_DIVIDE => 1,
      CLKOUT1_DIVIDE => 10,
      CLKOUT2_DIVIDE => 5,
      COMPENSATION   => "INTERNAL",
      DIVCLK_DIVIDE  => 1,
      SIM_DEVICE     => "SPARTAN6"
    )
    port map (
      clkin1   => clk_in,
      clkin2   => '0',
      clkinsel => '1',
      clkfbin  => feedback,
      rst      => pll_reset,
      rel      => '0',
      daddr    => drp_address,
      dclk     => control_clk,
      den      => drp_enable,
      di       => drp_in,
      dwe      => drp_write,
      do       => drp_out,
      drdy     => drp_ready,
      clkfbout => feedback,
      clkout0  => pll_bit,
      clkout1  => pll_pixel,
      clkout2  => pll_half,
      locked   => pll_locked
    );

  -- The feedback stays inside the PLL: equal buffers keep the clocks aligned to each other, and nothing needs them
  -- aligned to the input.
  pixel_buffer : component bufg
    port map (
      i => pll_pixel,
      o => clk
    );

  half_buffer : component bufg
    port map (
      i => pll_half,
      o => half_clk
    );

  clk_x2 <= half_clk;

  -- BUFPLL makes the strobe, which says where in the I/O clock a word of five bits begins, and reports lock when the
  -- strobe is at its place.
  bit_buffer : component bufpll
    generic map (
      DIVIDE      => 5,
      ENABLE_SYNC => true
    )
    port map (
      pllin        => pll_bit,
      gclk         => half_clk,
      locked       => pll_locked,
      ioclk        => io_clk,
      serdesstrobe => io_strobe,
      lock         => locked
    );

end architecture rtl;
