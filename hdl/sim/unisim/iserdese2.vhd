-- SPDX-License-Identifier: Apache-2.0
-- Model of ISERDESE2 (UG471): 10:1, DDR, NETWORKING, master and slave cascaded, behind an IDELAYE2.
--
-- Both edges of CLK take a bit of DDLY in; each edge of CLKDIV gives the last ten: Q1 of the master came last, Q8 and
-- then Q3 and Q4 of the slave came before. Which bit of a word is the first depends on the phase of CLKDIV alone.
--
-- Left out: other widths, rates and interfaces, BITSLIP, the clock enables, the latency of two clocks of CLKDIV.

library ieee;
use ieee.std_logic_1164.all;

entity iserdese2 is
  generic (
    DATA_RATE         : string  := "DDR";
    DATA_WIDTH        : integer := 4;
    DYN_CLKDIV_INV_EN : string  := "FALSE";
    DYN_CLK_INV_EN    : string  := "FALSE";
    INTERFACE_TYPE    : string  := "MEMORY";
    IOBDELAY          : string  := "NONE";
    NUM_CE            : integer := 2;
    OFB_USED          : string  := "FALSE";
    SERDES_MODE       : string  := "MASTER"
  );
  port (
    o            : out   std_ulogic;
    q1           : out   std_ulogic;
    q2           : out   std_ulogic;
    q3           : out   std_ulogic;
    q4           : out   std_ulogic;
    q5           : out   std_ulogic;
    q6           : out   std_ulogic;
    q7           : out   std_ulogic;
    q8           : out   std_ulogic;
    shiftout1    : out   std_ulogic;
    shiftout2    : out   std_ulogic;
    bitslip      : in    std_ulogic;
    ce1          : in    std_ulogic;
    ce2          : in    std_ulogic;
    clk          : in    std_ulogic;
    clkb         : in    std_ulogic;
    clkdiv       : in    std_ulogic;
    clkdivp      : in    std_ulogic;
    d            : in    std_ulogic;
    ddly         : in    std_ulogic;
    dynclkdivsel : in    std_ulogic;
    dynclksel    : in    std_ulogic;
    oclk         : in    std_ulogic;
    oclkb        : in    std_ulogic;
    ofb          : in    std_ulogic;
    rst          : in    std_ulogic;
    shiftin1     : in    std_ulogic;
    shiftin2     : in    std_ulogic
  );
end entity iserdese2;

architecture behaviour of iserdese2 is

  -- The last ten bits, the newest at the right; the same a little later, for an edge of CLKDIV that comes with one of
  -- CLK.
  signal bits : std_logic_vector(9 downto 0) := (others => '0');
  signal late : std_logic_vector(9 downto 0) := (others => '0');
  signal word : std_logic_vector(9 downto 0) := (others => '0');

begin

  assert DATA_WIDTH = 10 and DATA_RATE = "DDR" and INTERFACE_TYPE = "NETWORKING" and IOBDELAY = "IFD" and
         (SERDES_MODE = "MASTER" or SERDES_MODE = "SLAVE")
    report "ISERDESE2: the model knows 10:1 DDR, NETWORKING, IFD only"
    severity failure;

  o         <= d;
  late      <= transport bits after 100 ps;
  shiftout1 <= late(8);
  shiftout2 <= late(9);

  shift : process (clk, clkb) is
  begin

    if rising_edge(clk) or rising_edge(clkb) then
      bits <= bits(8 downto 0) & ddly;
    end if;

  end process shift;

  give : process (clkdiv) is
  begin

    if rising_edge(clkdiv) then
      word <= late;
      if SERDES_MODE = "SLAVE" then
        word(3 downto 2) <= shiftin2 & shiftin1;
      end if;
      if rst = '1' then
        word <= (others => '0');
      end if;
    end if;

  end process give;

  q1 <= word(0);
  q2 <= word(1);
  q3 <= word(2);
  q4 <= word(3);
  q5 <= word(4);
  q6 <= word(5);
  q7 <= word(6);
  q8 <= word(7);

end architecture behaviour;
