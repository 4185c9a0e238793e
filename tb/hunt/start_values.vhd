-- SPDX-License-Identifier: Apache-2.0
-- Drawn values for registers and memories to start with, see start_values.py.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package start_values is

  function bits (
    seed,
    length : natural
  ) return std_logic_vector;

  function bits (
    seed,
    length : natural
  ) return unsigned;

  function bits (
    seed,
    length : natural
  ) return signed;

  function number (
    seed : natural;
    low,
    high : integer
  ) return integer;

end package start_values;

package body start_values is

  function bits (
    seed,
    length : natural
  ) return std_logic_vector is

    variable state : natural := seed mod 65536;
    variable found : std_logic_vector(length - 1 downto 0);

  begin

    -- The high bit of the generator, as the low ones repeat soon.
    for i in found'range loop

      state := (state * 25173 + 13849) mod 65536;

      if state >= 32768 then
        found(i) := '1';
      else
        found(i) := '0';
      end if;

    end loop;

    return found;

  end function bits;

  -- The same for each type that a register may have.
  function bits (
    seed,
    length : natural
  ) return unsigned is

    constant FOUND : std_logic_vector(length - 1 downto 0) := bits(seed, length);

  begin

    return unsigned(FOUND);

  end function bits;

  function bits (
    seed,
    length : natural
  ) return signed is

    constant FOUND : std_logic_vector(length - 1 downto 0) := bits(seed, length);

  begin

    return signed(FOUND);

  end function bits;

  function number (
    seed : natural;
    low,
    high : integer
  ) return integer is
  begin

    -- Not the highest one: a clock before the reset may count on, which only simulation minds.
    if high > low then
      return low + seed mod (high - low);
    end if;

    return low;

  end function number;

end package body start_values;
