-- SPDX-License-Identifier: Apache-2.0
-- Model of ECLKSYNCB (FPGA-TN-02200): an edge clock that can be stopped.
--
-- Left out: the clocks that a stop takes.

library ieee;
use ieee.std_logic_1164.all;

entity eclksyncb is
  port (
    eclki : in    std_ulogic;
    stop  : in    std_ulogic;
    eclko : out   std_ulogic
  );
end entity eclksyncb;

architecture behaviour of eclksyncb is

begin

  eclko <= eclki and not stop;

end architecture behaviour;
