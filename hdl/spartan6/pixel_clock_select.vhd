-- SPDX-License-Identifier: Apache-2.0
-- Chooses where the pixel clock comes from: the TMDS clock lane, or a clock made on the board.
--
-- The board's own clock is 25.175 MHz (640x480p60), made from 100 MHz: 100 * 36 / 143 = 25.1748 MHz. The choice is
-- asynchronous, because the clock that is left may have stopped: everything behind it is in reset meanwhile.
--
-- Latency: 0 clocks, the delay of the buffer. Throughput: one clock.
-- Equation: clk = own clock if use_own, else tmds_clk.

library ieee;
use ieee.std_logic_1164.all;

library unisim;
use unisim.vcomponents.all;

entity pixel_clock_select is
  port (
    -- The board's oscillator.
    clk_100 : in    std_logic;
    reset   : in    std_logic;
    -- Clock of the HDMI input.
    tmds_clk : in    std_logic;
    -- High: choose the clock made on the board.
    use_own : in    std_logic;
    -- The chosen clock, to the PLL.
    clk : out   std_logic;
    -- The clock made on the board runs.
    own_ready : out   std_logic
  );
end entity pixel_clock_select;

architecture rtl of pixel_clock_select is

  -- Own clock in units of clk_100 / DIVIDE.
  constant MULTIPLY : positive := 36;
  constant DIVIDE   : positive := 143;

  signal own_clk : std_logic;

begin

  synthesizer : component dcm_clkgen
    generic map (
      CLKFX_MULTIPLY => MULTIPLY,
      CLKFX_DIVIDE   => DIVIDE,
      CLKIN_PERIOD   => 10.0
    )
    port map (
      clkin     => clk_100,
      rst       => reset,
      freezedcm => '0',
      progclk   => '0',
      progdata  => '0',
      progen    => '0',
      clkfx     => own_clk,
      locked    => own_ready
    );

  choose : component bufgmux
    generic map (
      CLK_SEL_TYPE => "ASYNC"
    )
    port map (
      i0 => tmds_clk,
      i1 => own_clk,
      s  => use_own,
      o  => clk
    );

end architecture rtl;
