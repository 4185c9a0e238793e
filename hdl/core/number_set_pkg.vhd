-- SPDX-License-Identifier: Apache-2.0
-- Sets of whole numbers, written as text with blanks in between: the shifts of an engine ("-3 0 3"), and the boxes and
-- weights of its slices. A set keeps its order, so the index of a number is the slice that it belongs to.
--
-- All functions are evaluated at elaboration only.

package number_set_pkg is

  -- Whether a text is a set of decimal integers from least to most, with blanks in between. The set may be empty.
  function is_set (
    text  : string;
    least : integer;
    most  : integer
  ) return boolean;

  -- How many numbers a set has.
  function slice_count (
    text : string
  ) return natural;

  -- The number at an index of the set, from 0.
  function slice_shift (
    text  : string;
    index : natural
  ) return integer;

end package number_set_pkg;

package body number_set_pkg is

  function is_set (
    text  : string;
    least : integer;
    most  : integer
  ) return boolean is

    variable inside    : boolean;
    variable digits    : boolean;
    variable negative  : boolean;
    variable digit     : integer;
    variable magnitude : natural;

  begin

    inside    := false;
    digits    := true;
    negative  := false;
    magnitude := 0;

    for i in text'range loop

      digit := character'pos(text(i)) - character'pos('0');

      if text(i) = ' ' then
        -- A sign without digits is no number.
        if not digits then
          return false;
        end if;
        inside := false;
      elsif text(i) = '-' then
        if inside then
          return false;
        end if;
        inside    := true;
        digits    := false;
        negative  := true;
        magnitude := 0;
      elsif digit >= 0 and digit <= 9 then
        if not inside then
          inside    := true;
          negative  := false;
          magnitude := 0;
        end if;
        digits    := true;
        magnitude := 10 * magnitude + digit;
        -- The range is checked at each digit, so that no number exceeds an integer.
        if (negative and -magnitude < least) or (not negative and magnitude > most) then
          return false;
        end if;
      else
        return false;
      end if;

    end loop;

    return digits;

  end function is_set;

  function slice_count (
    text : string
  ) return natural is

    variable count  : natural;
    variable inside : boolean;

  begin

    count  := 0;
    inside := false;

    for i in text'range loop

      if text(i) = ' ' then
        inside := false;
      elsif not inside then
        inside := true;
        count  := count + 1;
      end if;

    end loop;

    return count;

  end function slice_count;

  function slice_shift (
    text  : string;
    index : natural
  ) return integer is

    variable count     : natural;
    variable inside    : boolean;
    variable negative  : boolean;
    variable magnitude : natural;

  begin

    count     := 0;
    inside    := false;
    negative  := false;
    magnitude := 0;

    for i in text'range loop

      if text(i) = ' ' then
        inside := false;
      else
        if not inside then
          inside := true;
          count  := count + 1;
        end if;
        if count = index + 1 then
          if text(i) = '-' then
            negative := true;
          else
            magnitude := 10 * magnitude + character'pos(text(i)) - character'pos('0');
          end if;
        end if;
      end if;

    end loop;

    assert index < count
      report "a number that the set does not have"
      severity failure;

    if negative then
      return -magnitude;
    end if;

    return magnitude;

  end function slice_shift;

end package body number_set_pkg;
