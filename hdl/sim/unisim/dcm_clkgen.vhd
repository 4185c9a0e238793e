-- SPDX-License-Identifier: Apache-2.0
-- Model of DCM_CLKGEN (UG382) with a fixed ratio: CLKFX = CLKIN * CLKFX_MULTIPLY / CLKFX_DIVIDE.
--
-- Left out: the programming port, spread spectrum, FREEZEDCM, jitter; the phase is arbitrary.

library ieee;
use ieee.std_logic_1164.all;

entity dcm_clkgen is
  generic (
    CLKFX_DIVIDE   : integer := 1;
    CLKFX_MD_MAX   : real    := 0.0;
    CLKFX_MULTIPLY : integer := 4;
    CLKIN_PERIOD   : real    := 0.0
  );
  port (
    clkfx     : out   std_ulogic;
    clkfx180  : out   std_ulogic;
    clkfxdv   : out   std_ulogic;
    locked    : out   std_ulogic;
    progdone  : out   std_ulogic;
    status    : out   std_logic_vector(2 downto 1);
    clkin     : in    std_ulogic;
    freezedcm : in    std_ulogic;
    progclk   : in    std_ulogic;
    progdata  : in    std_ulogic;
    progen    : in    std_ulogic;
    rst       : in    std_ulogic
  );
end entity dcm_clkgen;

architecture behaviour of dcm_clkgen is

  -- Time without an edge after which the input counts as stopped.
  constant STOPPED : time := 1 us;

  signal period : time       := 0 fs;
  signal clock  : std_ulogic := '0';

begin

  assert clkfx_multiply >= 2 and clkfx_multiply <= 256 and clkfx_divide >= 1 and clkfx_divide <= 256
    report "DCM_CLKGEN: ratio out of range"
    severity failure;

  clkfx    <= clock;
  clkfx180 <= not clock;
  clkfxdv  <= '0';
  progdone <= '1';
  status   <= "00";

  measure : process is

    variable last : time;

  begin

    locked <= '0';
    period <= 0 fs;
    wait until rst = '0' and rising_edge(clkin);

    -- The real DCM takes some cycles to lock; the last of them gives the period.
    for i in 1 to 16 loop

      last := now;
      wait until rising_edge(clkin) or rst = '1';

    end loop;

    period <= now - last;
    locked <= '1';
    -- Once locked the model stays so until a reset: effects of another input are left out.
    wait until rst = '1';

  end process measure;

  oscillate : process is
  begin

    -- The output stops with its input, as far as a simulation can tell, so that it does not keep a simulation alive.
    if period = 0 fs or clkin'last_event > STOPPED then
      wait until period /= 0 fs and clkin'event;
    end if;

    wait for period * CLKFX_DIVIDE / (2 * CLKFX_MULTIPLY);
    clock <= not clock;

  end process oscillate;

end architecture behaviour;
