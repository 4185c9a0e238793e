-- SPDX-License-Identifier: Apache-2.0
-- Model of rPLL (Gowin UG286): CLKOUT = CLKIN * (FBDIV_SEL + 1) / (IDIV_SEL + 1).
--
-- The oscillator runs at CLKOUT * ODIV_SEL, which must be within 500 and 1250 MHz. LOCK rises LOCK_CYCLES regular input
-- cycles after reset; it falls when an input cycle is missing, and the output stops.
--
-- Left out: CLKOUTP, CLKOUTD, CLKOUTD3, dynamic dividers, phase, duty cycle, delay, external feedback, jitter; edges of
-- the output have no fixed place to those of the input.

library ieee;
use ieee.std_logic_1164.all;

entity rpll is
  generic (
    FCLKIN    : string  := "100.0";
    IDIV_SEL  : integer := 0;
    FBDIV_SEL : integer := 0;
    ODIV_SEL  : integer := 8;
    DEVICE    : string  := "GW2A-18C"
  );
  port (
    clkin    : in    std_ulogic;
    clkfb    : in    std_ulogic;
    reset    : in    std_ulogic;
    reset_p  : in    std_ulogic;
    fbdsel   : in    std_ulogic_vector(5 downto 0);
    idsel    : in    std_ulogic_vector(5 downto 0);
    odsel    : in    std_ulogic_vector(5 downto 0);
    dutyda   : in    std_ulogic_vector(3 downto 0);
    psda     : in    std_ulogic_vector(3 downto 0);
    fdly     : in    std_ulogic_vector(3 downto 0);
    clkout   : out   std_ulogic;
    clkoutp  : out   std_ulogic;
    clkoutd  : out   std_ulogic;
    clkoutd3 : out   std_ulogic;
    lock     : out   std_ulogic
  );
end entity rpll;

architecture behaviour of rpll is

  constant LOCK_CYCLES : natural := 32;
  constant VCO_SLOWEST : time    := 2000 ps;
  constant VCO_FASTEST : time    := 800 ps;

  signal half : time       := 0 fs;
  signal made : std_ulogic := '0';

begin

  clkout   <= made;
  clkoutp  <= '0';
  clkoutd  <= '0';
  clkoutd3 <= '0';

  watch : process is

    variable period : time;
    variable last   : time;
    variable cycles : natural;

  begin

    lock <= '0';
    half <= 0 fs;

    if (reset or reset_p) = '1' then
      wait until (reset or reset_p) = '0';
    end if;

    wait until rising_edge(clkin) or (reset or reset_p) = '1';
    last   := now;
    cycles := 0;

    while (reset or reset_p) /= '1' loop

      -- The length of a cycle is known from the second edge on; a missing cycle is twice as long.
      if cycles = 0 then
        wait until rising_edge(clkin) or (reset or reset_p) = '1' for 1 us;
      else
        wait until rising_edge(clkin) or (reset or reset_p) = '1' for 2 * period;
      end if;

      exit when (reset or reset_p) = '1' or not rising_edge(clkin);

      period := now - last;
      last   := now;
      cycles := cycles + 1;

      -- With two cycles the output can begin; LOCK waits for more.
      if cycles = 2 then
        assert period * (IDIV_SEL + 1) / (FBDIV_SEL + 1) / ODIV_SEL <= VCO_SLOWEST and
               period * (IDIV_SEL + 1) / (FBDIV_SEL + 1) / ODIV_SEL >= VCO_FASTEST
          report "rPLL: the oscillator is not within 500 and 1250 MHz"
          severity failure;
        half <= period * (IDIV_SEL + 1) / (2 * (FBDIV_SEL + 1));
      elsif cycles = LOCK_CYCLES then
        lock <= '1';
      end if;

    end loop;

  end process watch;

  oscillate : process is
  begin

    if half = 0 fs then
      made <= '0';
      wait until half /= 0 fs;
    end if;

    wait for half;
    made <= not made;

  end process oscillate;

end architecture behaviour;
