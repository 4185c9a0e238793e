-- SPDX-License-Identifier: Apache-2.0
-- Model of BUFPLL (UG382): I/O clock and strobe for the serialisers of a bank.
--
-- The strobe is high for one I/O clock in `divide`, so that it is sampled with the last but one edge before the global
-- clock's. LOCK rises with the second strobe after LOCKED. Left out: delays, the alignment without synchronisation
-- (ENABLE_SYNC = FALSE).

library ieee;
use ieee.std_logic_1164.all;

entity bufpll is
  generic (
    DIVIDE      : integer := 1;
    ENABLE_SYNC : boolean := true
  );
  port (
    ioclk        : out   std_ulogic;
    lock         : out   std_ulogic;
    serdesstrobe : out   std_ulogic;
    gclk         : in    std_ulogic;
    locked       : in    std_ulogic;
    pllin        : in    std_ulogic
  );
end entity bufpll;

architecture behaviour of bufpll is

  -- Changes with each rising edge of GCLK, so that the other process sees these between its own edges.
  signal gclk_edge : std_ulogic := '0';

begin

  assert divide >= 4 and enable_sync
    report "BUFPLL: the model knows divide >= 4 with ENABLE_SYNC"
    severity failure;

  ioclk <= pllin;

  mark : process (gclk) is
  begin

    if rising_edge(gclk) then
      gclk_edge <= not gclk_edge;
    end if;

  end process mark;

  strobe : process (pllin, locked) is

    variable seen    : std_ulogic;
    variable count   : natural := 0;
    variable strobes : natural := 0;

  begin

    if locked /= '1' then
      lock         <= '0';
      serdesstrobe <= '0';
      strobes      := 0;
    elsif pllin = '0' and pllin'event then
      -- Nothing changes between edges. The first falling edge behind the global clock's rising edge is number 0.
      count := count + 1;
      if gclk_edge /= seen then
        count := 0;
      end if;
      seen := gclk_edge;
      if count = DIVIDE - 3 then
        serdesstrobe <= '1';
        if strobes = 2 then
          lock <= '1';
        else
          strobes := strobes + 1;
        end if;
      elsif count = DIVIDE - 2 then
        serdesstrobe <= '0';
      end if;
    end if;

  end process strobe;

end architecture behaviour;
