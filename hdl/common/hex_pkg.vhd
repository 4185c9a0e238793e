-- SPDX-License-Identifier: Apache-2.0
-- Bytes from texts of hexadecimal digits, evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package hex_pkg is

  -- Whether a text consists of the characters 0 to 9 and a to f only.
  function is_hex (
    text : string
  ) return boolean;

  -- The value of a digit; letters are lower case.
  function hex_digit (
    digit : character
  ) return std_logic_vector;

  -- The byte at a place of a text, counted in digits from 0; letters are lower case.
  function hex_byte (
    text  : string;
    place : natural
  ) return std_logic_vector;

end package hex_pkg;

package body hex_pkg is

  function is_hex (
    text : string
  ) return boolean is

    variable code : natural;

  begin

    for i in text'range loop

      code := character'pos(text(i));

      -- Two ranges of ASCII with letters and signs between them. Capitals are refused, so that a
      -- text has one form.
      if code < character'pos('0') or code > character'pos('f') or
         (code > character'pos('9') and code < character'pos('a')) then
        return false;
      end if;

    end loop;

    return true;

  end function is_hex;

  function hex_digit (
    digit : character
  ) return std_logic_vector is

    constant CODE : natural := character'pos(digit);

  begin

    -- In ASCII the low four bits of 0 to 9 are the digit's value, and those of a to f count from 1.
    if CODE <= character'pos('9') then
      return std_logic_vector(to_unsigned(CODE mod 16, 4));
    end if;

    return std_logic_vector(to_unsigned((CODE + 9) mod 16, 4));

  end function hex_digit;

  function hex_byte (
    text  : string;
    place : natural
  ) return std_logic_vector is
  begin

    -- The first of the two digits is the high one. Indices of a text may begin anywhere, so places count from
    -- its left end.
    return hex_digit(text(text'left + place)) & hex_digit(text(text'left + place + 1));

  end function hex_byte;

end package body hex_pkg;
