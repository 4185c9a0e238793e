-- SPDX-License-Identifier: Apache-2.0
-- Model of OSERDES2 (UG381): SDR, master and slave cascaded.
--
-- D1 to D4 are taken with CLKDIV, loaded with IOCE, and shifted with CLK0: the slave's D1 first. The
-- master's bits run through the slave, the slave's output through the master to OQ.
--
-- Left out: other modes and rates, the tristate path, OCE, training.

library ieee;
use ieee.std_logic_1164.all;

entity oserdes2 is
  generic (
    BYPASS_GCLK_FF : boolean := false;
    DATA_RATE_OQ   : string  := "DDR";
    DATA_RATE_OT   : string  := "DDR";
    DATA_WIDTH     : integer := 2;
    OUTPUT_MODE    : string  := "SINGLE_ENDED";
    SERDES_MODE    : string  := "NONE";
    TRAIN_PATTERN  : integer := 0
  );
  port (
    oq        : out   std_ulogic;
    shiftout1 : out   std_ulogic;
    shiftout2 : out   std_ulogic;
    shiftout3 : out   std_ulogic;
    shiftout4 : out   std_ulogic;
    tq        : out   std_ulogic;
    clk0      : in    std_ulogic;
    clk1      : in    std_ulogic;
    clkdiv    : in    std_ulogic;
    d1        : in    std_ulogic;
    d2        : in    std_ulogic;
    d3        : in    std_ulogic;
    d4        : in    std_ulogic;
    ioce      : in    std_ulogic;
    oce       : in    std_ulogic;
    rst       : in    std_ulogic;
    shiftin1  : in    std_ulogic;
    shiftin2  : in    std_ulogic;
    shiftin3  : in    std_ulogic;
    shiftin4  : in    std_ulogic;
    t1        : in    std_ulogic;
    t2        : in    std_ulogic;
    t3        : in    std_ulogic;
    t4        : in    std_ulogic;
    tce       : in    std_ulogic;
    train     : in    std_ulogic
  );
end entity oserdes2;

architecture behaviour of oserdes2 is

  signal taken : std_logic_vector(3 downto 0) := "0000";

begin

  assert data_rate_oq = "SDR" and data_width > 4 and data_width <= 8 and output_mode = "DIFFERENTIAL" and
         (serdes_mode = "MASTER" or serdes_mode = "SLAVE")
    report "OSERDES2: the model knows cascaded SDR, differential, only"
    severity failure;

  tq        <= '0';
  shiftout2 <= '0';
  shiftout4 <= '0';

  take : process (clkdiv) is
  begin

    if rising_edge(clkdiv) then
      taken <= d4 & d3 & d2 & d1;
      if rst = '1' then
        taken <= "0000";
      end if;
    end if;

  end process take;

  shift : process (clk0) is

    variable bits : std_logic_vector(3 downto 0) := "0000";

  begin

    if rising_edge(clk0) then
      -- The word that CLKDIV took is loaded with the strobe, far from CLKDIV's edge.
      if ioce = '1' then
        bits := taken;
      else
        bits := shiftin1 & bits(3 downto 1);
      end if;
      -- The cascade: the slave's bits go through the master to the pin.
      if SERDES_MODE = "MASTER" then
        shiftout1 <= bits(0);
        oq        <= shiftin3;
      else
        shiftout3 <= bits(0);
      end if;
    end if;

  end process shift;

end architecture behaviour;
