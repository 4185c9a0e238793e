-- SPDX-License-Identifier: Apache-2.0
-- Model of DELAYF (FPGA-TN-02035) of DEL_MODE USER_DEFINED: a delay of 0 to 127 taps of 25 ps.
--
-- LOADN low sets the delay to DEL_VALUE; a falling edge of MOVE moves it by one tap, up with DIRECTION low, down with
-- DIRECTION high, within its limits, where CFLAG is high. With faults (model_faults) it loses its setting.
--
-- Left out: the constant part of the delay, the spread between taps and between delay lines, glitches when it moves.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.model_faults.all;

entity delayf is
  generic (
    DEL_MODE  : string  := "USER_DEFINED";
    DEL_VALUE : integer := 0
  );
  port (
    a         : in    std_ulogic;
    loadn     : in    std_ulogic;
    move      : in    std_ulogic;
    direction : in    std_ulogic;
    z         : out   std_ulogic;
    cflag     : out   std_ulogic
  );
end entity delayf;

architecture behaviour of delayf is

  constant TAP     : time     := 25 ps;
  constant HIGHEST : positive := 127;
  -- Time between two faults; a LOADN shorter than LONG_ENOUGH belongs to a search, a longer one to a restart.
  constant GOOD        : time := 20 us;
  constant LONG_ENOUGH : time := 1 us;

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

  signal taps    : natural range 0 to HIGHEST := DEL_VALUE;
  signal blocked : boolean                    := false;

begin

  assert del_mode = "USER_DEFINED"
    report "DELAYF: the model knows USER_DEFINED only"
    severity failure;

  -- transport, because a delay line passes every edge, however short the pulse.
  z     <= transport '0' when blocked else
           a after taps * TAP;
  cflag <= '1' when taps = 0 or taps = HIGHEST else
           '0';

  control : process is

    variable random   : natural := hash(delayf'path_name);
    variable since    : time    := 0 fs;
    variable stubborn : boolean := false;

    procedure draw is
    begin

      random := (random * 25173 + 13849 + delay_faults mod 65536) mod 65536;

    end procedure draw;

  begin

    -- Without faults only the ports move the delay, so a simulation can end.
    if delay_faults = 0 then
      wait on loadn, move, delay_faults;
    else
      wait on loadn, move, delay_faults for GOOD;
    end if;

    -- A blocked line stays blocked when there are no more faults.
    if delay_faults /= 0 then
      stubborn := delay_faults mod 2 = 1;
    end if;

    -- A long LOADN frees every blocked line, a short one only a line that is not stubborn.
    if loadn'event and loadn = '0' then
      since := now;
      if not stubborn then
        blocked <= false;
      end if;
    elsif loadn'event and loadn = '1' and now - since >= LONG_ENOUGH then
      blocked <= false;
    end if;

    if loadn = '0' then
      taps <= DEL_VALUE;
    elsif falling_edge(move) then
      if direction = '0' and taps < HIGHEST then
        taps <= taps + 1;
      elsif direction = '1' and taps > 0 then
        taps <= taps - 1;
      end if;
    elsif delay_faults /= 0 and not (loadn'event or move'event or delay_faults'event) then
      draw;
      taps    <= (random / 16) mod (HIGHEST + 1);
      blocked <= blocked or (random / 2048) mod 2 = 0;
    end if;

  end process control;

end architecture behaviour;
