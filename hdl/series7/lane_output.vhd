-- SPDX-License-Identifier: Apache-2.0
-- Output of one TMDS lane on a 7-series device: serialiser 10:1 and pins.
--
-- Latency: that of the serialiser, about a clock of clk. Throughput: ten bits each clock of clk.
-- Equation: the bits of word, two each clock of clk_x5.

library ieee;
use ieee.std_logic_1164.all;

library unisim;
use unisim.vcomponents.all;

entity lane_output is
  port (
    -- Ten bits, in clk; bit 0 is sent first.
    word : in    std_logic_vector(9 downto 0);
    -- Pixel clock, and five times that with aligned edges.
    clk    : in    std_logic;
    clk_x5 : in    std_logic;
    -- Reset in clk.
    reset : in    std_logic;
    -- Pins of the lane.
    data_p : out   std_logic;
    data_n : out   std_logic
  );
end entity lane_output;

architecture rtl of lane_output is

  -- The serialisers of the pair's two sites: the slave has the last two of the ten bits, the pins are at the master.
  constant MASTER : natural := 0;
  constant SLAVE  : natural := 1;

  subtype sites_t is std_logic_vector(MASTER to SLAVE);

  type words_t is array (MASTER to SLAVE) of std_logic_vector(8 downto 1);

  function mode (
    site : natural
  ) return string is
  begin

    if site = MASTER then
      return "MASTER";
    end if;

    return "SLAVE";

  end function mode;

  signal words    : words_t;
  signal sent     : sites_t;
  signal shifted1 : sites_t;
  signal shifted2 : sites_t;
  signal enters1  : sites_t;
  signal enters2  : sites_t;

begin

  -- A cascade has the ninth and tenth bit at the slave's third and fourth input.
  words(MASTER)   <= word(7 downto 0);
  words(SLAVE)    <= "0000" & word(9 downto 8) & "00";
  enters1(MASTER) <= shifted1(SLAVE);
  enters2(MASTER) <= shifted2(SLAVE);
  enters1(SLAVE)  <= '0';
  enters2(SLAVE)  <= '0';

  site : for i in MASTER to SLAVE generate

    serialiser : component oserdese2
      generic map (
        DATA_RATE_OQ   => "DDR",
        DATA_RATE_TQ   => "SDR",
        DATA_WIDTH     => 10,
        SERDES_MODE    => mode(i),
        TBYTE_CTL      => "FALSE",
        TBYTE_SRC      => "FALSE",
        TRISTATE_WIDTH => 1
      )
      port map (
        clk       => clk_x5,
        clkdiv    => clk,
        d1        => words(i)(1),
        d2        => words(i)(2),
        d3        => words(i)(3),
        d4        => words(i)(4),
        d5        => words(i)(5),
        d6        => words(i)(6),
        d7        => words(i)(7),
        d8        => words(i)(8),
        oce       => '1',
        rst       => reset,
        shiftin1  => enters1(i),
        shiftin2  => enters2(i),
        t1        => '0',
        t2        => '0',
        t3        => '0',
        t4        => '0',
        tbytein   => '0',
        tce       => '0',
        oq        => sent(i),
        shiftout1 => shifted1(i),
        shiftout2 => shifted2(i)
      );

  end generate site;

  -- TMDS draws its current through the terminators of the sink, so the standard has no other setting.
  pins : component obufds
    generic map (
      IOSTANDARD => "TMDS_33"
    )
    port map (
      i  => sent(MASTER),
      o  => data_p,
      ob => data_n
    );

end architecture rtl;
