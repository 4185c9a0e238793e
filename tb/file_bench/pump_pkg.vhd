-- What the file pumps share: files of words and counts, stalls at pseudo-random clocks.

library ieee;
use ieee.std_logic_1164.all;

library std;
use std.textio.all;

package pump_pkg is

  constant CLOCK_PERIOD : time := 10 ns;
  -- Clocks after the last pixel in which no other may come.
  constant SILENCE : positive := 64;

  type words_t is file of integer;

  subtype random_t is natural range 0 to 65535;

  -- Whether a clock stalls: a linear congruential generator, high bits.

  procedure draw (
    variable random : inout random_t;
    percent         : in natural;
    variable stall  : out boolean
  );

  -- A line "name value".

  procedure write_count (
    file counts : text;
    name        : in string;
    value       : in natural
  );

end package pump_pkg;

package body pump_pkg is

  procedure draw (
    variable random : inout random_t;
    percent         : in natural;
    variable stall  : out boolean
  ) is

    variable drawn : random_t;

  begin

    drawn  := (random * 25173 + 13849) mod 65536;
    stall  := (drawn / 64) * 100 < percent * 1024;
    random := drawn;

  end procedure draw;

  procedure write_count (
    file counts : text;
    name        : in string;
    value       : in natural
  ) is

    variable text_line : line;

  begin

    write(text_line, name & " ");
    write(text_line, value);
    writeline(counts, text_line);

  end procedure write_count;

end package body pump_pkg;
