-- SPDX-License-Identifier: Apache-2.0
-- Model of CLKDIVF (FPGA-TN-02200) with DIV 2.0: half of an edge clock.
--
-- Left out: the ratio 3.5, ALIGNWD, delays.

library ieee;
use ieee.std_logic_1164.all;

entity clkdivf is
  generic (
    GSR : string := "DISABLED";
    DIV : string := "2.0"
  );
  port (
    clki    : in    std_ulogic;
    rst     : in    std_ulogic;
    alignwd : in    std_ulogic;
    cdivx   : out   std_ulogic
  );
end entity clkdivf;

architecture behaviour of clkdivf is

  signal half : std_ulogic := '0';

begin

  assert DIV = "2.0"
    report "CLKDIVF: the model knows DIV 2.0 only"
    severity failure;

  cdivx <= half;

  divide : process (clki, rst) is
  begin

    if rst = '1' then
      half <= '0';
    elsif rising_edge(clki) then
      half <= not half;
    end if;

  end process divide;

end architecture behaviour;
