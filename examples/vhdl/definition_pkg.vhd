-- SPDX-License-Identifier: Apache-2.0
-- The definition of refocusing, for the test benches: summed up pixel by pixel, as slow as it is plain.
--
-- In one dimension (S of rows, then of columns; x = 0 outside the frame; M pixels a micro image, a' the shift):
--   S(k) = sum over u = 0..M-1 of x(M * floor((k - u * a') / M) + u),  out(k) = S(k + floor((M - 1) * a' / 2)) / M
-- and one division by M * M at the end, halves up.

library ieee;
use ieee.std_logic_1164.all;

package definition_pkg is

  type pixels_t is array (natural range <>) of natural;

  -- A pixel of the refocused frame; the frame line by line.
  function refocused (
    frame   : pixels_t;
    columns : positive;
    m       : positive;
    shift   : integer;
    row     : natural;
    column  : natural
  ) return natural;

  -- '1' where a condition holds.
  function bit_of (
    condition : boolean
  ) return std_logic;

end package definition_pkg;

package body definition_pkg is

  -- Division that rounds down, also below zero.

  function floor_divide (
    a : integer;
    b : positive
  ) return integer is
  begin

    return (a - a mod b) / b;

  end function floor_divide;

  function refocused (
    frame   : pixels_t;
    columns : positive;
    m       : positive;
    shift   : integer;
    row     : natural;
    column  : natural
  ) return natural is

    constant OFFSET : integer := floor_divide((m - 1) * shift, 2);

    variable sum : natural := 0;
    variable y   : integer;
    variable x   : integer;

  begin

    for v in 0 to m - 1 loop

      for u in 0 to m - 1 loop

        y := m * floor_divide(row + OFFSET - v * shift, m) + v;
        x := m * floor_divide(column + OFFSET - u * shift, m) + u;

        if y >= 0 and y < frame'length / columns and x >= 0 and x < columns then
          sum := sum + frame(frame'low + y * columns + x);
        end if;

      end loop;

    end loop;

    return (2 * sum + m * m) / (2 * m * m);

  end function refocused;

  function bit_of (
    condition : boolean
  ) return std_logic is
  begin

    if condition then
      return '1';
    end if;

    return '0';

  end function bit_of;

end package body definition_pkg;
