-- SPDX-License-Identifier: Apache-2.0
-- Model of OSERDESE2 (UG471): 10:1, DDR, master and slave cascaded.
--
-- CLKDIV takes D1 to D8 of the master and D3 and D4 of the slave; they leave at OQ of the master with both edges of
-- CLK, D1 first.
--
-- Left out: other widths and rates, the tristate path, the clock enables.

library ieee;
use ieee.std_logic_1164.all;

entity oserdese2 is
  generic (
    DATA_RATE_OQ   : string  := "DDR";
    DATA_RATE_TQ   : string  := "DDR";
    DATA_WIDTH     : integer := 4;
    SERDES_MODE    : string  := "MASTER";
    TBYTE_CTL      : string  := "FALSE";
    TBYTE_SRC      : string  := "FALSE";
    TRISTATE_WIDTH : integer := 4
  );
  port (
    ofb       : out   std_ulogic;
    oq        : out   std_ulogic;
    shiftout1 : out   std_ulogic;
    shiftout2 : out   std_ulogic;
    tbyteout  : out   std_ulogic;
    tfb       : out   std_ulogic;
    tq        : out   std_ulogic;
    clk       : in    std_ulogic;
    clkdiv    : in    std_ulogic;
    d1        : in    std_ulogic;
    d2        : in    std_ulogic;
    d3        : in    std_ulogic;
    d4        : in    std_ulogic;
    d5        : in    std_ulogic;
    d6        : in    std_ulogic;
    d7        : in    std_ulogic;
    d8        : in    std_ulogic;
    oce       : in    std_ulogic;
    rst       : in    std_ulogic;
    shiftin1  : in    std_ulogic;
    shiftin2  : in    std_ulogic;
    t1        : in    std_ulogic;
    t2        : in    std_ulogic;
    t3        : in    std_ulogic;
    t4        : in    std_ulogic;
    tbytein   : in    std_ulogic;
    tce       : in    std_ulogic
  );
end entity oserdese2;

architecture behaviour of oserdese2 is

  -- The word that CLKDIV took, D1 at the right; a bit that changes with each word; both a little later, so that the
  -- first edge of CLK behind that of CLKDIV sees them, not one that comes with it.
  signal word       : std_logic_vector(9 downto 0) := (others => '0');
  signal late_word  : std_logic_vector(9 downto 0) := (others => '0');
  signal turns      : std_ulogic                   := '0';
  signal late_turns : std_ulogic                   := '0';

begin

  assert DATA_WIDTH = 10 and DATA_RATE_OQ = "DDR" and DATA_RATE_TQ = "SDR" and TRISTATE_WIDTH = 1 and
         (SERDES_MODE = "MASTER" or SERDES_MODE = "SLAVE")
    report "OSERDESE2: the model knows 10:1 DDR without tristate only"
    severity failure;

  ofb       <= '0';
  tbyteout  <= '0';
  tfb       <= '0';
  tq        <= '0';
  shiftout1 <= d3;
  shiftout2 <= d4;

  late_word  <= transport word after 100 ps;
  late_turns <= transport turns after 100 ps;

  take : process (clkdiv) is
  begin

    if rising_edge(clkdiv) then
      word  <= shiftin2 & shiftin1 & d8 & d7 & d6 & d5 & d4 & d3 & d2 & d1;
      turns <= not turns;
      if rst = '1' then
        word <= (others => '0');
      end if;
    end if;

  end process take;

  send : process (clk) is

    variable bits : std_logic_vector(9 downto 0) := (others => '0');
    variable seen : std_ulogic                   := '0';

  begin

    if clk'event then
      if rising_edge(clk) and seen /= late_turns then
        bits := late_word;
        seen := late_turns;
      else
        bits := '0' & bits(9 downto 1);
      end if;
      oq <= bits(0);
    end if;

  end process send;

end architecture behaviour;
