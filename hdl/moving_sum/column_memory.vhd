-- SPDX-License-Identifier: Apache-2.0
-- The last word of each column: a memory, or with one column the register that its words come from.
--
-- Latency: 2 clocks from a column to its word. Throughput: one word read and one written each clock.
-- Equation: old_word(t + 2) = the last word that was written for read_column(t).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity column_memory is
  generic (
    -- Columns; 1: a wire.
    COLUMNS : positive;
    -- Bits of a word.
    WIDTH : positive
  );
  port (
    clk : in    std_logic;
    -- Marks a word to keep, and its column.
    write_enable : in    std_logic;
    write_column : in    unsigned(bits_for(COLUMNS - 1) - 1 downto 0);
    -- With one column it must stay until the next write.
    word : in    std_logic_vector(WIDTH - 1 downto 0);
    -- Column of old_word, 2 clocks ahead.
    read_column : in    unsigned(bits_for(COLUMNS - 1) - 1 downto 0);
    old_word    : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity column_memory;

architecture rtl of column_memory is

begin

  -- The word is the register behind the adder, which holds until the next token: a loop of one
  -- clock.
  one_column : if COLUMNS = 1 generate
    old_word <= word;
  end generate one_column;

  several_columns : if COLUMNS > 1 generate

    words : entity work.ram_blocks
      generic map (
        WIDTH        => WIDTH,
        WORDS        => COLUMNS,
        READ_LATENCY => 2
      )
      port map (
        clk           => clk,
        write_enable  => write_enable,
        write_address => write_column,
        write_data    => word,
        read_address  => read_column,
        read_data     => old_word
      );

  end generate several_columns;

end architecture rtl;
