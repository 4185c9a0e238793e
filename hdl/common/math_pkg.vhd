-- SPDX-License-Identifier: Apache-2.0
-- Arithmetic of integers for widths, sizes and tables, and the comparison of names.
-- All functions are evaluated at elaboration only, except to_logic, which is a wire.

library ieee;
use ieee.std_logic_1164.all;

package math_pkg is

  -- Returns true, or stops elaboration with the message if the condition is false. An entity calls it in a
  -- constant in front of all that it computes from its generics.
  function takes (
    condition : boolean;
    message   : string
  ) return boolean;

  -- Bits of an unsigned number that holds 0 to max_value.
  function bits_for (
    max_value : natural
  ) return positive;

  function choose (
    condition : boolean;
    yes       : integer;
    no        : integer
  ) return integer;

  function larger (
    a : integer;
    b : integer
  ) return integer;

  -- '1' for true.
  function to_logic (
    condition : boolean
  ) return std_logic;

  -- value / divisor, rounded up.
  function divide_up (
    value   : natural;
    divisor : positive
  ) return natural;

  -- value / divisor, rounded towards minus infinity.
  function floor_divided (
    value   : integer;
    divisor : positive
  ) return integer;

  -- Greatest common divisor.
  function common_divisor (
    a : positive;
    b : natural
  ) return positive;

  -- Whether two texts, of any length, are the same: synthesis tools differ on "=" of different lengths.
  function same_text (
    a : string;
    b : string
  ) return boolean;

  -- value * 2**scale_bits / divisor, rounded to the nearest integer, halves up.
  function scaled_quotient (
    value      : natural;
    scale_bits : natural;
    divisor    : positive
  ) return natural;

end package math_pkg;

package body math_pkg is

  function takes (
    condition : boolean;
    message   : string
  ) return boolean is
  begin

    -- As an initial value of a constant it is evaluated before anything that depends on it.
    assert condition
      report message
      severity failure;

    return condition;

  end function takes;

  function bits_for (
    max_value : natural
  ) return positive is

    variable remaining : natural;
    variable bits      : positive;

  begin

    -- 0 takes a bit as well, because some tools do not take a vector without elements as a signal.
    remaining := max_value / 2;
    bits      := 1;

    while remaining > 0 loop

      remaining := remaining / 2;
      bits      := bits + 1;

    end loop;

    return bits;

  end function bits_for;

  function choose (
    condition : boolean;
    yes       : integer;
    no        : integer
  ) return integer is
  begin

    if condition then
      return yes;
    end if;

    return no;

  end function choose;

  function larger (
    a : integer;
    b : integer
  ) return integer is
  begin

    return choose(a > b, a, b);

  end function larger;

  function to_logic (
    condition : boolean
  ) return std_logic is
  begin

    if condition then
      return '1';
    end if;

    return '0';

  end function to_logic;

  function divide_up (
    value   : natural;
    divisor : positive
  ) return natural is
  begin

    if value = 0 then
      return 0;
    end if;

    -- (value + divisor - 1) / divisor would round up too, but its sum may exceed an integer.
    return (value - 1) / divisor + 1;

  end function divide_up;

  function floor_divided (
    value   : integer;
    divisor : positive
  ) return integer is
  begin

    -- VHDL's division rounds towards zero, but mod always gives a remainder of 0 or more: the remainder is taken
    -- off first.
    return (value - value mod divisor) / divisor;

  end function floor_divided;

  function common_divisor (
    a : positive;
    b : natural
  ) return positive is

    variable divisor   : positive;
    variable remainder : natural;
    variable next_one  : natural;

  begin

    -- Euclid: the last remainder that is not 0 divides both.
    divisor   := a;
    remainder := b mod a;

    while remainder > 0 loop

      next_one  := divisor mod remainder;
      divisor   := remainder;
      remainder := next_one;

    end loop;

    return divisor;

  end function common_divisor;

  function same_text (
    a : string;
    b : string
  ) return boolean is

    variable same : boolean;

  begin

    -- Texts of generics may begin at any index, so both are walked through from their left ends.
    same := a'length = b'length;

    for i in natural range 0 to a'length - 1 loop

      if same then
        same := a(a'left + i) = b(b'left + i);
      end if;

    end loop;

    return same;

  end function same_text;

  function scaled_quotient (
    value      : natural;
    scale_bits : natural;
    divisor    : positive
  ) return natural is
  begin

    -- Numerator and denominator are doubled, so that half a divisor is a whole number for odd divisors too:
    -- halves round up.
    return (2 * value * 2 ** scale_bits + divisor) / (2 * divisor);

  end function scaled_quotient;

end package body math_pkg;
