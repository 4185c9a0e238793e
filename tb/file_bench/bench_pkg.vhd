-- SPDX-License-Identifier: Apache-2.0
-- What the benches that move pixels between files and streams share.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library std;
use std.textio.all;

package bench_pkg is

  -- Words of 32 bits, little-endian.
  type words_t is file of integer;

  subtype random_t is natural range 0 to 65535;

  -- A word of the load port of a resampler.
  type bench_load_t is record
    write   : std_logic;
    kind    : std_logic_vector(1 downto 0);
    address : std_logic_vector(19 downto 0);
    data    : std_logic_vector(39 downto 0);
  end record bench_load_t;

  constant NO_BENCH_LOAD : bench_load_t := ('0', "00", (others => '0'), (others => '0'));

  -- Whether a clock stalls, of so many in a hundred: a linear congruential generator, high bits.

  procedure draw (
    variable random : inout random_t;
    variable stall  : out boolean;
    stall_percent   : in natural
  );

  -- The share of a side in a clock: for 256 clocks the sink stalls in so many of a hundred clocks and the source in a
  -- third of them, then the other way round, so that FIFOs run full and empty in turn.
  function stall_share (
    stall_percent : natural;
    clock         : natural;
    of_sink       : boolean
  ) return natural;

  -- A line "name value".

  procedure write_count (
    file counts : text;
    name        : in string;
    value       : in natural
  );

  -- Values of some bits each, the first from the low bits.

  procedure read_values (
    file words  : words_t;
    bits        : in positive;
    signal data : out std_logic_vector
  );

  procedure write_values (
    file words : words_t;
    bits       : in positive;
    data       : in std_logic_vector
  );

  -- Four words of a file: kind, address, low 20 bits, high 20 bits.

  procedure read_load (
    file words  : words_t;
    signal load : out bench_load_t
  );

  -- Marks of the number-th token of frames of so many in lines of so many.
  function starts_frame (
    number       : natural;
    frame_tokens : positive
  ) return std_logic_vector;

  function ends_line (
    number      : natural;
    line_tokens : positive
  ) return std_logic;

end package bench_pkg;

package body bench_pkg is

  procedure draw (
    variable random : inout random_t;
    variable stall  : out boolean;
    stall_percent   : in natural
  ) is

    variable drawn : random_t;

  begin

    -- Two numbers of 16 bits make no product beyond an integer. The high bits are drawn, as the low
    -- ones of such a generator repeat soon.
    drawn  := (random * 25173 + 13849) mod 65536;
    stall  := (drawn / 64) * 100 < stall_percent * 1024;
    random := drawn;

  end procedure draw;

  function stall_share (
    stall_percent : natural;
    clock         : natural;
    of_sink       : boolean
  ) return natural is
  begin

    if ((clock / 256) mod 2 = 0) = of_sink then
      return stall_percent;
    end if;

    return stall_percent / 3;

  end function stall_share;

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

  procedure read_values (
    file words  : words_t;
    bits        : in positive;
    signal data : out std_logic_vector
  ) is

    variable word       : integer;
    variable all_values : std_logic_vector(data'length - 1 downto 0);

  begin

    for i in 0 to data'length / bits - 1 loop

      -- The file has a word for each value, whatever its width, so that Python reads and writes it
      -- without packing.
      read(words, word);
      all_values((i + 1) * bits - 1 downto i * bits) := std_logic_vector(to_unsigned(word, bits));

    end loop;

    data <= all_values;

  end procedure read_values;

  procedure write_values (
    file words : words_t;
    bits       : in positive;
    data       : in std_logic_vector
  ) is
  begin

    for i in 0 to data'length / bits - 1 loop

      write(words, to_integer(unsigned(data((i + 1) * bits - 1 downto i * bits))));

    end loop;

  end procedure write_values;

  procedure read_load (
    file words  : words_t;
    signal load : out bench_load_t
  ) is

    variable kind    : integer;
    variable address : integer;
    variable low     : integer;
    variable high    : integer;

  begin

    read(words, kind);
    read(words, address);
    read(words, low);
    read(words, high);
    -- A word of 40 bits does not fit an integer, so it comes in two halves.
    load <=
    (
      '1',
      std_logic_vector(to_unsigned(kind,
                                    2)),
      std_logic_vector(to_unsigned(address,
                                    20)),
      std_logic_vector(to_unsigned(high,
                                    20)) & std_logic_vector(to_unsigned(low,
                                                                         20))
    );

  end procedure read_load;

  function starts_frame (
    number       : natural;
    frame_tokens : positive
  ) return std_logic_vector is
  begin

    if number mod frame_tokens = 0 then
      return "1";
    end if;

    return "0";

  end function starts_frame;

  function ends_line (
    number      : natural;
    line_tokens : positive
  ) return std_logic is
  begin

    if number mod line_tokens = line_tokens - 1 then
      return '1';
    end if;

    return '0';

  end function ends_line;

end package body bench_pkg;
