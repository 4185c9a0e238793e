-- SPDX-License-Identifier: Apache-2.0
-- Bytes from texts of hexadecimal digits, evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

package hex_pkg is

  -- Whether a text has no other characters than 0 to 9 and a to f.
  function is_hex (
    text : string
  ) return boolean;

  -- The byte at a place of a text, counted in digits from 0; digits above 9 in lower case.
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

      if code < character'pos('0') or code > character'pos('f') or
         (code > character'pos('9') and code < character'pos('a')) then
        return false;
      end if;

    end loop;

    return true;

  end function is_hex;

  function nibble (
    digit : character
  ) return std_logic_vector is
  begin

    case digit is

      when '0' =>

        return "0000";

      when '1' =>

        return "0001";

      when '2' =>

        return "0010";

      when '3' =>

        return "0011";

      when '4' =>

        return "0100";

      when '5' =>

        return "0101";

      when '6' =>

        return "0110";

      when '7' =>

        return "0111";

      when '8' =>

        return "1000";

      when '9' =>

        return "1001";

      when 'a' =>

        return "1010";

      when 'b' =>

        return "1011";

      when 'c' =>

        return "1100";

      when 'd' =>

        return "1101";

      when 'e' =>

        return "1110";

      when others =>

        return "1111";

    end case;

  end function nibble;

  function hex_byte (
    text  : string;
    place : natural
  ) return std_logic_vector is
  begin

    return nibble(text(text'left + place)) & nibble(text(text'left + place + 1));

  end function hex_byte;

end package body hex_pkg;
