-- SPDX-License-Identifier: Apache-2.0
-- Model of BUFIO2 (UG382), divider bypassed: a buffer.
--
-- Left out: delay, division, the I/O clock and its strobe.

library ieee;
use ieee.std_logic_1164.all;

entity bufio2 is
  generic (
    DIVIDE        : integer := 1;
    DIVIDE_BYPASS : boolean := true;
    I_INVERT      : boolean := false;
    USE_DOUBLER   : boolean := false
  );
  port (
    divclk       : out   std_ulogic;
    ioclk        : out   std_ulogic;
    serdesstrobe : out   std_ulogic;
    i            : in    std_ulogic
  );
end entity bufio2;

architecture behaviour of bufio2 is

begin

  assert divide_bypass and divide = 1 and not i_invert and not use_doubler
    report "BUFIO2: the model knows the bypassed divider only"
    severity failure;

  divclk       <= i;
  ioclk        <= '0';
  serdesstrobe <= '0';

end architecture behaviour;
