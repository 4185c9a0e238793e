-- SPDX-License-Identifier: Apache-2.0
-- Functions for counters that are registers of the caller: counters of events for people, and of tokens in turn.
--
-- Throughput: one event or token each clock.
-- Equation: count = min(events since the last clearing, the largest number of its width);
--   place = (tokens since the one with restart) mod modulus.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package count_pkg is

  -- The next value of a counter, with or without an event. The counter stays at its largest value: one that
  -- wrapped around would look like few events. An event in the clock of the clearing is not counted.
  function counted (
    count  : std_logic_vector;
    happen : std_logic;
    clear  : std_logic
  ) return std_logic_vector;

  -- The next values of several counters of one width, side by side, each with its own event.
  function each_counted (
    counts : std_logic_vector;
    happen : std_logic_vector;
    clear  : std_logic
  ) return std_logic_vector;

  -- The next value of a count that is one less than what is left, so that its sign tells whether any is left. A load
  -- sets what is left, a step takes one off.
  function counted_down (
    count : integer;
    load  : boolean;
    left  : natural;
    step  : boolean
  ) return integer;

  -- Number of a token modulo a constant, from the number of the token before. The token with restart has number 0
  -- in the same clock.
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

  function counted_down (
    count : integer;
    load  : boolean;
    left  : natural;
    step  : boolean
  ) return integer is
  begin

    if load then
      return left - 1;
    elsif step and count >= 0 then
      return count - 1;
    end if;

    return count;

  end function counted_down;

  function place_in_turn (
    before  : natural;
    restart : std_logic;
    modulus : positive
  ) return natural is
  begin

    -- With a modulus of 1 there is nothing to count, and synthesis removes all that depends on the count.
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
