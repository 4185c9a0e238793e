-- SPDX-License-Identifier: Apache-2.0
-- Model of EHXPLLL (FPGA-TN-02200) with feedback from CLKOP: CLKOP = CLKI * CLKFB_DIV / CLKI_DIV.
--
-- The VCO runs at CLKOP * CLKOP_DIV, CLKOS at VCO / CLKOS_DIV; rising edges of both meet the input's where their
-- ratios to it are whole numbers. LOCK rises LOCK_CYCLES regular input cycles after reset, if the VCO is within its 400
-- to 800 MHz, and not before the slow_lock of model_faults; it falls when an input cycle is missing or is another one,
-- and the outputs stop.
--
-- Left out: CLKOS2, CLKOS3, phases other than 0, CLKI_DIV other than 1, jitter, other feedback, enables and standby.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.model_faults.all;

entity ehxplll is
  generic (
    CLKI_DIV        : integer := 1;
    CLKFB_DIV       : integer := 1;
    CLKOP_DIV       : integer := 8;
    CLKOS_DIV       : integer := 8;
    CLKOP_CPHASE    : integer := 0;
    CLKOS_CPHASE    : integer := 0;
    CLKOS_ENABLE    : string  := "DISABLED";
    FEEDBK_PATH     : string  := "CLKOP";
    INT_LOCK_STICKY : string  := "ENABLED";
    PLLRST_ENA      : string  := "DISABLED"
  );
  port (
    clki         : in    std_ulogic;
    clkfb        : in    std_ulogic;
    phasesel1    : in    std_ulogic;
    phasesel0    : in    std_ulogic;
    phasedir     : in    std_ulogic;
    phasestep    : in    std_ulogic;
    phaseloadreg : in    std_ulogic;
    stdby        : in    std_ulogic;
    pllwakesync  : in    std_ulogic;
    rst          : in    std_ulogic;
    enclkop      : in    std_ulogic;
    enclkos      : in    std_ulogic;
    enclkos2     : in    std_ulogic;
    enclkos3     : in    std_ulogic;
    clkop        : out   std_ulogic;
    clkos        : out   std_ulogic;
    clkos2       : out   std_ulogic;
    clkos3       : out   std_ulogic;
    lock         : out   std_ulogic;
    intlock      : out   std_ulogic;
    refclk       : out   std_ulogic;
    clkintfb     : out   std_ulogic
  );
end entity ehxplll;

architecture behaviour of ehxplll is

  constant LOCK_CYCLES : natural  := 32;
  constant VCO_SLOWEST : time     := 2500 ps;
  constant VCO_FASTEST : time     := 1250 ps;
  constant VCO_CYCLES  : positive := CLKFB_DIV * CLKOP_DIV;

  signal lock_now : std_ulogic := '0';
  -- The second output: free-running, with half of its period; or in step with the input.
  signal now_free : time       := 0 fs;
  signal free     : std_ulogic := '0';
  signal aligned  : std_ulogic := '0';

begin

  assert feedbk_path = "CLKOP" and clki_div = 1 and clkop_cphase = clkop_div - 1 and
         (clkos_cphase = clkos_div - 1 or clkos_enable = "DISABLED")
    report "EHXPLLL: the model knows feedback of CLKOP, CLKI_DIV = 1, phases of 0, only"
    severity failure;

  clkos2   <= '0';
  clkos3   <= '0';
  intlock  <= lock_now;
  refclk   <= clki;
  clkintfb <= '0';
  lock     <= lock_now;
  clkos    <= aligned when VCO_CYCLES mod CLKOS_DIV = 0 else
              free;

  multiply : process is

    variable period : time;
    variable last   : time;
    variable cycles : natural;
    variable begun  : time;

    -- Makes the edges of one output for one input cycle.

    procedure run (
      signal clock   : out std_ulogic;
      constant ratio : positive;
      constant cycle : time
    ) is
    begin

      -- Scheduled from each input edge, so that the outputs stay in step with the input and end with it.
      for i in 0 to 2 * ratio - 1 loop

        if i mod 2 = 0 then
          clock <= transport '1' after cycle * i / (2 * ratio);
        else
          clock <= transport '0' after cycle * i / (2 * ratio);
        end if;

      end loop;

    end procedure run;

  begin

    lock_now <= '0';
    clkop    <= '0';
    aligned  <= '0';
    now_free <= 0 fs;

    if rst = '1' then
      wait until rst = '0';
    end if;

    begun := now;

    wait until rising_edge(clki) or rst = '1';
    last   := now;
    cycles := 0;

    while rst /= '1' loop

      -- A missing cycle is one that is twice too long; before the first cycle a microsecond.
      if cycles = 0 then
        wait until rising_edge(clki) or rst = '1' for 1 us;
      else
        wait until rising_edge(clki) or rst = '1' for 2 * period;
      end if;

      exit when rst = '1' or not rising_edge(clki);

      if cycles > 0 and (now - last > period + period / 8 or now - last < period - period / 8) then
        -- The input has another frequency.
        exit;
      end if;

      period := now - last;
      last   := now;

      -- Out of the oscillator's range no edges go out, and LOCK never rises.
      if period / VCO_CYCLES > VCO_SLOWEST or period / VCO_CYCLES < VCO_FASTEST then
        cycles := 1;
      elsif cycles < LOCK_CYCLES then
        cycles := cycles + 1;
      elsif PLLRST_ENA = "DISABLED" or now - begun >= slow_lock * 1 us then
        lock_now <= '1';
      end if;

      -- Two equal periods are needed to know the length of the next one.
      if cycles > 2 then
        run(clkop, CLKFB_DIV, period);
        if VCO_CYCLES mod CLKOS_DIV = 0 then
          run(aligned, VCO_CYCLES / CLKOS_DIV, period);
        else
          now_free <= period * CLKOS_DIV / (2 * VCO_CYCLES);
        end if;
      end if;

    end loop;

  end process multiply;

  oscillate : process is
  begin

    if now_free = 0 fs then
      wait until now_free /= 0 fs;
    end if;

    wait for now_free;
    free <= not free;

    -- The output stops with its input, as far as a simulation can tell, so that it does not keep a simulation alive.
    if clki'last_event > 1 us then
      wait until clki'event;
    end if;

  end process oscillate;

end architecture behaviour;
