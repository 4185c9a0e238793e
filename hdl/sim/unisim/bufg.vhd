-- SPDX-License-Identifier: Apache-2.0
-- Model of BUFG (UG382): a buffer. Left out: delay.

library ieee;
use ieee.std_logic_1164.all;

entity bufg is
  port (
    o : out   std_ulogic;
    i : in    std_ulogic
  );
end entity bufg;

architecture behaviour of bufg is

begin

  o <= i;

end architecture behaviour;
