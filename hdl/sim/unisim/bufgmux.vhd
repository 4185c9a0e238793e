-- SPDX-License-Identifier: Apache-2.0
-- Model of BUFGMUX (UG382) with asynchronous select: a multiplexer.
--
-- Left out: delay, the synchronous select, which never leaves a clock that has stopped.

library ieee;
use ieee.std_logic_1164.all;

entity bufgmux is
  generic (
    CLK_SEL_TYPE : string := "SYNC"
  );
  port (
    o  : out   std_ulogic;
    i0 : in    std_ulogic;
    i1 : in    std_ulogic;
    s  : in    std_ulogic
  );
end entity bufgmux;

architecture behaviour of bufgmux is

begin

  assert clk_sel_type = "ASYNC"
    report "BUFGMUX: the model knows ASYNC only"
    severity failure;

  o <= i1 when s = '1' else
       i0;

end architecture behaviour;
