-- SPDX-License-Identifier: Apache-2.0
-- Model of DELAYG (FPGA-TN-02035), a fixed delay of a pin.
--
-- Left out: the delay, which makes up for that of the clock on the device.

library ieee;
use ieee.std_logic_1164.all;

entity delayg is
  generic (
    DEL_MODE  : string  := "USER_DEFINED";
    DEL_VALUE : integer := 0
  );
  port (
    a : in    std_ulogic;
    z : out   std_ulogic
  );
end entity delayg;

architecture behaviour of delayg is

begin

  z <= a;

end architecture behaviour;
