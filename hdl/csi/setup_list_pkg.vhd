-- SPDX-License-Identifier: Apache-2.0
-- The list of registers that sensor_setup writes: turns its text into entries of one width, when the design is built.
--
-- Equation: entry n holds the digits of the n-th text between blanks, the address in front.

library ieee;
use ieee.std_logic_1164.all;
use work.hex_pkg.all;
use work.math_pkg.all;

package setup_list_pkg is

  -- Bits of an entry, from the top: a pause follows; the value has 16 bits; address; value, one of 8 bits in the upper
  -- bits.
  constant ENTRY_BITS   : positive := 34;
  constant BEFORE_PAUSE : positive := 33;
  constant WIDE         : positive := 32;

  subtype entry_t is std_logic_vector(ENTRY_BITS - 1 downto 0);

  type entries_t is array (natural range <>) of entry_t;

  -- Number of texts between blanks.
  function entry_count (
    text : string
  ) return positive;

  -- Whether each text between blanks has the digits of a register.
  function is_list (
    text : string
  ) return boolean;

  -- Whether an entry is a pause: the address FFFF with 8 bits.
  function is_pause (
    value : entry_t
  ) return std_logic;

  -- The entries of a list of `count` texts.
  function entries_of (
    text  : string;
    count : positive
  ) return entries_t;

end package setup_list_pkg;

package body setup_list_pkg is

  -- Characters of the longest list.
  constant LONGEST : positive := 4095 * 9;

  function entry_count (
    text : string
  ) return positive is

    variable count : positive;

  begin

    count := 1;

    for i in text'range loop

      if text(i) = ' ' then
        count := count + 1;
      end if;

    end loop;

    return count;

  end function entry_count;

  function is_list (
    text : string
  ) return boolean is

    variable digits : natural;

  begin

    digits := 0;

    for i in text'range loop

      if text(i) /= ' ' then
        digits := digits + 1;
        if not is_hex(text(i to i)) then
          return false;
        end if;
      elsif digits /= 6 and digits /= 8 then
        return false;
      else
        digits := 0;
      end if;

    end loop;

    return digits = 6 or digits = 8;

  end function is_list;

  function is_pause (
    value : entry_t
  ) return std_logic is
  begin

    return to_logic(value(31 downto 16) = x"FFFF") and not value(WIDE);

  end function is_pause;

  function entries_of (
    text  : string;
    count : positive
  ) return entries_t is

    variable entries : entries_t(0 to count - 1);
    variable number  : natural range 0 to 4095;
    variable digits  : natural range 0 to 8;
    variable symbol  : character;

  begin

    entries := (others => (others => '0'));
    number  := 0;
    digits  := 0;

    -- The digits of a register fill the entry from the left; a value of 8 bits leaves the last two zero.
    for i in 0 to LONGEST - 1 loop

      if i < text'length then
        symbol := text(text'left + i);

        if symbol = ' ' then
          number := number + 1;
          digits := 0;
        elsif digits < 8 then
          entries(number)(31 - 4 * digits downto 28 - 4 * digits) := hex_digit(symbol);

          if digits = 7 then
            entries(number)(WIDE) := '1';
          end if;
          digits := digits + 1;
        end if;
      end if;

    end loop;

    for i in 1 to 4095 loop

      if i < count then
        entries(i - 1)(BEFORE_PAUSE) := is_pause(entries(i));
      end if;

    end loop;

    return entries;

  end function entries_of;

end package body setup_list_pkg;
