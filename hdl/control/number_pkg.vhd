-- SPDX-License-Identifier: Apache-2.0
-- Numbers of the status line: 16 bits each, in two's complement.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.tmds_pkg.all;

package number_pkg is

  -- An unsigned number, extended.
  function number (
    value : std_logic_vector
  ) return std_logic_vector;

  -- A flag as 0 or 1.
  function flag (
    value : std_logic
  ) return std_logic_vector;

  -- A number for each channel, of equal widths; negative: the numbers have a sign.
  function numbers (
    values   : std_logic_vector;
    negative : boolean := false
  ) return std_logic_vector;

end package number_pkg;

package body number_pkg is

  function number (
    value : std_logic_vector
  ) return std_logic_vector is
  begin

    return std_logic_vector(resize(unsigned(value), 16));

  end function number;

  function flag (
    value : std_logic
  ) return std_logic_vector is
  begin

    return "000000000000000" & value;

  end function flag;

  function numbers (
    values   : std_logic_vector;
    negative : boolean := false
  ) return std_logic_vector is

    -- The bounds below are computed from c, so the argument must end at bit 0; callers pass whole vectors.
    constant WIDTH  : positive := values'length / CHANNELS;
    variable value  : std_logic_vector(WIDTH - 1 downto 0);
    variable result : std_logic_vector(16 * CHANNELS - 1 downto 0);

  begin

    -- Channel 0 is in the low bits, as everywhere on the link.
    for c in 0 to CHANNELS - 1 loop

      value := values(WIDTH * c + WIDTH - 1 downto WIDTH * c);

      -- Extended with zeros, or with the sign if there is one. A function returns one type, so both are vectors.
      result(16 * c + 15 downto 16 * c) := number(value);

      if negative then
        result(16 * c + 15 downto 16 * c) := std_logic_vector(resize(signed(value), 16));
      end if;

    end loop;

    return result;

  end function numbers;

end package body number_pkg;
