-- SPDX-License-Identifier: Apache-2.0
-- Model of IDELAYE2 (UG471) of IDELAY_TYPE VARIABLE: a delay of 0 to 31 taps of 1 / (64 REFCLK_FREQUENCY).
--
-- LD sets the delay to IDELAY_VALUE, CE moves it by one tap up (INC) or down with each clock of C; behind either end
-- it begins at the other. With faults (model_faults) it loses its setting, as delay lines were seen to do on boards.
--
-- Left out: the constant part of the delay, the spread between taps and between delay lines, jitter, DATAIN, the other
-- types, REGRST, CINVCTRL, dependence on IDELAYCTRL.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.model_faults.all;

entity idelaye2 is
  generic (
    CINVCTRL_SEL          : string  := "FALSE";
    DELAY_SRC             : string  := "IDATAIN";
    HIGH_PERFORMANCE_MODE : string  := "FALSE";
    IDELAY_TYPE           : string  := "FIXED";
    IDELAY_VALUE          : integer := 0;
    PIPE_SEL              : string  := "FALSE";
    REFCLK_FREQUENCY      : real    := 200.0;
    SIGNAL_PATTERN        : string  := "DATA"
  );
  port (
    cntvalueout : out   std_logic_vector(4 downto 0);
    dataout     : out   std_ulogic;
    c           : in    std_ulogic;
    ce          : in    std_ulogic;
    cinvctrl    : in    std_ulogic;
    cntvaluein  : in    std_logic_vector(4 downto 0);
    datain      : in    std_ulogic;
    idatain     : in    std_ulogic;
    inc         : in    std_ulogic;
    ld          : in    std_ulogic;
    ldpipeen    : in    std_ulogic;
    regrst      : in    std_ulogic
  );
end entity idelaye2;

architecture behaviour of idelaye2 is

  constant TAP     : time     := integer(15625000.0 / REFCLK_FREQUENCY) * 1 fs;
  constant HIGHEST : positive := 31;
  -- Time between two faults; clocks of LD that a search does not reach (it takes 17), a restart of C does.
  constant GOOD        : time    := 20 us;
  constant LONG_ENOUGH : natural := 32;

  -- Another number for each delay line of a design.

  function hash (
    name : string
  ) return natural is

    variable value : natural := 1;

  begin

    for i in name'range loop

      value := (value * 31 + character'pos(name(i))) mod 65536;

    end loop;

    return value;

  end function hash;

  signal taps    : natural range 0 to HIGHEST := IDELAY_VALUE;
  signal blocked : boolean                    := false;

begin

  assert IDELAY_TYPE = "VARIABLE" and DELAY_SRC = "IDATAIN" and PIPE_SEL = "FALSE" and CINVCTRL_SEL = "FALSE"
    report "IDELAYE2: the model knows VARIABLE, IDATAIN only"
    severity failure;

  -- transport, because a delay line passes every edge, however short the pulse.
  dataout     <= transport '0' when blocked else
                 idatain after taps * TAP;
  cntvalueout <= std_logic_vector(to_unsigned(taps, 5));

  control : process is

    variable random   : natural := hash(idelaye2'path_name);
    variable loads    : natural := 0;
    variable faulty   : time    := 0 fs;
    variable stubborn : boolean := false;

  begin

    wait on c, delay_faults;

    -- Each fault comes with a clock.
    if delay_faults = 0 then
      faulty := now;
    elsif now - faulty >= GOOD then
      faulty   := now;
      stubborn := delay_faults mod 2 = 1;
      random   := (random * 25173 + 13849 + delay_faults mod 65536) mod 65536;
      taps     <= (random / 16) mod (HIGHEST + 1);
      blocked  <= blocked or (random / 2048) mod 2 = 0;
    end if;

    -- A short LD frees a line that is not stubborn, a long one every line.
    if rising_edge(c) then
      if ld = '1' then
        taps  <= IDELAY_VALUE;
        loads := loads + 1;
        if loads = LONG_ENOUGH or not stubborn then
          blocked <= false;
        end if;
      elsif ce = '1' and inc = '1' then
        taps <= (taps + 1) mod (HIGHEST + 1);
      elsif ce = '1' then
        taps <= (taps + HIGHEST) mod (HIGHEST + 1);
      end if;
      if ld = '0' then
        loads := 0;
      end if;
    end if;

  end process control;

end architecture behaviour;
