-- SPDX-License-Identifier: Apache-2.0
-- Model of ISERDES2 (UG381, XAPP1064): 5:1, SDR, retimed, master and slave cascaded, with the phase
-- detector between them.
--
-- The master shifts D in with each CLK0; with IOCE its bits are taken over, and are at Q with the next CLKDIV: Q4 of
-- the master came last, Q4 of the slave, the fifth bit, first. The slave samples its own D, half a bit further down the
-- delay line: where two bits of the master differ, it has sampled before or behind the edge between them. VALID: there
-- was an edge in this word; INCDEC: the delay should grow, by majority.
--
-- Left out: other widths and rates, BITSLIP, CE0, the networking interfaces, metastability, RST's
-- effect on the phase of words (the word alignment in the fabric takes any).

library ieee;
use ieee.std_logic_1164.all;

entity iserdes2 is
  generic (
    BITSLIP_ENABLE : boolean := false;
    DATA_RATE      : string  := "SDR";
    DATA_WIDTH     : integer := 1;
    INTERFACE_TYPE : string  := "NETWORKING";
    SERDES_MODE    : string  := "NONE"
  );
  port (
    cfb0      : out   std_ulogic;
    cfb1      : out   std_ulogic;
    dfb       : out   std_ulogic;
    fabricout : out   std_ulogic;
    incdec    : out   std_ulogic;
    q1        : out   std_ulogic;
    q2        : out   std_ulogic;
    q3        : out   std_ulogic;
    q4        : out   std_ulogic;
    shiftout  : out   std_ulogic;
    valid     : out   std_ulogic;
    bitslip   : in    std_ulogic;
    ce0       : in    std_ulogic;
    clk0      : in    std_ulogic;
    clk1      : in    std_ulogic;
    clkdiv    : in    std_ulogic;
    d         : in    std_ulogic;
    ioce      : in    std_ulogic;
    rst       : in    std_ulogic;
    shiftin   : in    std_ulogic
  );
end entity iserdes2;

architecture behaviour of iserdes2 is

  signal word    : std_logic_vector(3 downto 0) := "0000";
  signal edges   : natural                      := 0;
  signal balance : integer                      := 0;

begin

  assert data_width = 5 and data_rate = "SDR" and interface_type = "RETIMED" and not bitslip_enable and
         (serdes_mode = "MASTER" or serdes_mode = "SLAVE")
    report "ISERDES2: the model knows 5:1 SDR, RETIMED, without BITSLIP, only"
    severity failure;

  cfb0      <= '0';
  cfb1      <= '0';
  dfb       <= '0';
  fabricout <= '0';

  master : if serdes_mode = "MASTER" generate

    shift : process (clk0) is

      variable bits     : std_logic_vector(4 downto 0) := "00000";
      variable newer    : std_ulogic                   := '0';
      variable older    : std_ulogic                   := '0';
      variable found    : natural                      := 0;
      variable majority : integer                      := 0;

    begin

      if rising_edge(clk0) then
        -- The slave's sample of the edge in front of the bit `newer`, taken with that bit, is present now.
        if newer /= older then
          -- At an edge the slave's sample says which of both bits it saw. If it is the newer one, the slave sampled
          -- behind the edge, and the delay should grow.
          found := found + 1;
          if shiftin = newer then
            majority := majority + 1;
          else
            majority := majority - 1;
          end if;
        end if;
        older := newer;
        newer := d;
        bits  := d & bits(4 downto 1);
        if ioce = '1' then
          word     <= bits(4 downto 1);
          shiftout <= bits(0);
          edges    <= found;
          balance  <= majority;
          found    := 0;
          majority := 0;
        end if;
      end if;

    end process shift;

    retime : process (clkdiv) is
    begin

      if rising_edge(clkdiv) then
        q4     <= word(3);
        q3     <= word(2);
        q2     <= word(1);
        q1     <= word(0);
        valid  <= '0';
        incdec <= '0';
        -- One edge in the word is enough for VALID; INCDEC is decided by majority.
        if edges > 0 then
          valid <= '1';
        end if;
        if balance > 0 then
          incdec <= '1';
        end if;
        if rst = '1' then
          valid <= '0';
        end if;
      end if;

    end process retime;

  end generate master;

  slave : if serdes_mode = "SLAVE" generate

    valid  <= '0';
    incdec <= '0';
    q1     <= '0';
    q2     <= '0';
    q3     <= '0';

    sample : process (clk0) is
    begin

      if rising_edge(clk0) then
        shiftout <= d;
      end if;

    end process sample;

    retime : process (clkdiv) is
    begin

      if rising_edge(clkdiv) then
        q4 <= shiftin;
      end if;

    end process retime;

  end generate slave;

end architecture behaviour;
