-- SPDX-License-Identifier: Apache-2.0
-- Counts, which are registers of the caller: of events, for people who read them, and of tokens in turn.
--
-- Latency: none. Throughput: one event or token each clock.
-- Equation: count = min(events since the last clearing, the largest number of its width);
--   place = (tokens since the one with restart) mod modulus.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package count_pkg is

  -- What a count is after a clock with or without an event. It stays at the largest one: a count that wrapped around
  -- would look like few events. An event in the clock of the clearing is not counted.
  function counted (
    count  : std_logic_vector;
    happen : std_logic;
    clear  : std_logic
  ) return std_logic_vector;

  -- The same of several counts of one width, side by side, and the event of each.
  function each_counted (
    counts : std_logic_vector;
    happen : std_logic_vector;
    clear  : std_logic
  ) return std_logic_vector;

  -- Number of a token modulo a constant, counted from the last one with restart, by the number of the token before. It
  -- is 0 with the restart itself, without a clock of delay.
  function place_in_turn (
    before  : natural;
    restart : std_logic;
    modulus : positive
  ) return natural;

end package count_pkg;

package body count_pkg is

  function counted (
    count  : std_logic_vector;
    happen : std_logic;
    clear  : std_logic
  ) return std_logic_vector is

    constant LARGEST : unsigned(count'length - 1 downto 0) := (others => '1');

    variable events : unsigned(count'length - 1 downto 0);

  begin

    events := unsigned(count);

    if happen = '1' and events /= LARGEST then
      events := events + 1;
    end if;

    if clear = '1' then
      events := (others => '0');
    end if;

    return std_logic_vector(events);

  end function counted;

  function place_in_turn (
    before  : natural;
    restart : std_logic;
    modulus : positive
  ) return natural is
  begin

    -- With a modulus of 1 nothing is left to count, and all that depends on it falls away.
    if modulus = 1 or restart = '1' or before = modulus - 1 then
      return 0;
    end if;

    return before + 1;

  end function place_in_turn;

  function each_counted (
    counts : std_logic_vector;
    happen : std_logic_vector;
    clear  : std_logic
  ) return std_logic_vector is

    constant WIDTH : positive := counts'length / happen'length;

    variable now    : std_logic_vector(counts'length - 1 downto 0);
    variable events : std_logic_vector(happen'length - 1 downto 0);

  begin

    now    := counts;
    events := happen;

    for i in events'range loop

      now((i + 1) * WIDTH - 1 downto i * WIDTH) := counted(now((i + 1) * WIDTH - 1 downto i * WIDTH), events(i), clear);

    end loop;

    return now;

  end function each_counted;

end package body count_pkg;
