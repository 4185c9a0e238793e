-- SPDX-License-Identifier: Apache-2.0
-- Output of one TMDS lane: words of ten bits to a pair of pins.
--
-- Latency: about 2 clocks of clk. Throughput: ten bits each clock of clk.
-- Equation: the bits of word in order, two each clock of clk_x5.

library ieee;
use ieee.std_logic_1164.all;

library gw2a;
use gw2a.components.all;

entity serial_output is
  port (
    -- Pixel clock, and five times that from the same divider (display_clocks).
    clk    : in    std_logic;
    clk_x5 : in    std_logic;
    reset  : in    std_logic;
    -- Ten bits, in clk; bit 0 is sent first.
    word : in    std_logic_vector(9 downto 0);
    -- The lane's pins.
    data_p : out   std_logic;
    data_n : out   std_logic
  );
end entity serial_output;

architecture rtl of serial_output is

  signal bits : std_logic;

begin

  -- The primitive takes a word with the pixel clock and sends two bits each fast clock, so no gearbox is needed.
  serialise : component oser10
    port map (
      d9    => word(9),
      d8    => word(8),
      d7    => word(7),
      d6    => word(6),
      d5    => word(5),
      d4    => word(4),
      d3    => word(3),
      d2    => word(2),
      d1    => word(1),
      d0    => word(0),
      fclk  => clk_x5,
      pclk  => clk,
      reset => reset,
      q     => bits
    );

  drive : component tlvds_obuf
    port map (
      i  => bits,
      o  => data_p,
      ob => data_n
    );

end architecture rtl;
