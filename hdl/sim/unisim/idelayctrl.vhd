-- SPDX-License-Identifier: Apache-2.0
-- Model of IDELAYCTRL (UG471): RDY rises a while after RST, while REFCLK runs at 190 to 210 MHz.
--
-- Left out: RDY does not fall when REFCLK stops; delay lines do not depend on it.

library ieee;
use ieee.std_logic_1164.all;

entity idelayctrl is
  port (
    rdy    : out   std_ulogic;
    refclk : in    std_ulogic;
    rst    : in    std_ulogic
  );
end entity idelayctrl;

architecture behaviour of idelayctrl is

  constant CALIBRATION_CLOCKS : natural := 16;

begin

  calibrate : process (refclk, rst) is

    variable last   : time    := 0 fs;
    variable clocks : natural := 0;

  begin

    if rst = '1' then
      clocks := 0;
      rdy    <= '0';
    elsif rising_edge(refclk) then
      assert clocks < 2 or (now - last > 4.7 ns and now - last < 5.3 ns)
        report "IDELAYCTRL: REFCLK is not 190 to 210 MHz"
        severity failure;
      if clocks = CALIBRATION_CLOCKS then
        rdy <= '1';
      else
        clocks := clocks + 1;
      end if;
      last := now;
    end if;

  end process calibrate;

end architecture behaviour;
