-- SPDX-License-Identifier: Apache-2.0
-- A deep memory in blocks, with a register behind each block and the multiplexer behind these registers.
--
-- A tool would put the multiplexer between the block RAMs, whose outputs are late, and the first register. Here the
-- words are divided into blocks that need no multiplexer inside: some of one size, then smaller ones for the rest.
-- The division chosen takes the fewest block RAMs, and among equals the fewest blocks. Blocks always read, and their
-- registers have neither enable nor reset, so that they fit the block RAM's own output registers.
--
-- Latency: READ_LATENCY clocks from address to data. 2: block RAM and its register; 3: also a register behind the
-- multiplexer.
-- Throughput: one read and one write each clock. Reading a word in the clock that writes it returns the old word.
-- Equation: read_data(t + READ_LATENCY) = memory(read_address(t)).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity ram_blocks is
  generic (
    -- Bits of a word.
    WIDTH : positive;
    -- Words of the memory.
    WORDS : positive;
    -- Clocks from address to data.
    READ_LATENCY : positive range 2 to 3 := 3
  );
  port (
    clk : in    std_logic;
    -- Writes a word.
    write_enable  : in    std_logic;
    write_address : in    unsigned(bits_for(WORDS - 1) - 1 downto 0);
    write_data    : in    std_logic_vector(WIDTH - 1 downto 0);
    -- Reads a word.
    read_address : in    unsigned(bits_for(WORDS - 1) - 1 downto 0);
    read_data    : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity ram_blocks;

architecture rtl of ram_blocks is

  constant ADDRESS_BITS : positive := bits_for(WORDS - 1);

  -- A block RAM has 2**14 words of one bit to 2**9 words of 36.
  constant MOST_BITS  : positive := 14;
  constant LEAST_BITS : positive := 9;

  -- How to divide: blocks of 2**full words, then a block for each bit that is left down to 2**least words, then
  -- one block for the rest.
  type division_t is record
    full  : natural range LEAST_BITS to MOST_BITS;
    least : natural range LEAST_BITS to MOST_BITS;
  end record division_t;

  -- Words of the next block.
  function block_size (
    left     : natural;
    division : division_t
  ) return natural is

    variable size : natural;

  begin

    -- The largest block that is still full; if none is, all that is left.
    size := left;

    for bits in division.least to division.full loop

      if left >= 2 ** bits then
        size := 2 ** bits;
      end if;

    end loop;

    return size;

  end function block_size;

  -- Block RAMs that a block takes.
  function block_rams (
    size : positive
  ) return positive is

    variable bits : positive;

  begin

    -- The smallest block RAM takes whatever has fewer words.
    bits := bits_for(size - 1);

    if bits < LEAST_BITS then
      bits := LEAST_BITS;
    end if;

    -- Words of eight bits have a parity bit, and wider ones in proportion.
    return (WIDTH - 1) / (2 ** (MOST_BITS - bits) + 2 ** (MOST_BITS - bits) / 8) + 1;

  end function block_rams;

  -- The first word of a block. Blocks of one size are computed at once, because tools limit the length of loops.
  function block_base (
    index    : natural;
    division : division_t
  ) return natural is

    variable alike : natural;
    variable base  : natural;

  begin

    alike := WORDS / 2 ** division.full;

    if index <= alike then
      return index * 2 ** division.full;
    end if;

    base := alike * 2 ** division.full;

    for i in alike + 1 to index loop

      base := base + block_size(WORDS - base, division);

    end loop;

    return base;

  end function block_base;

  -- Number of blocks, or with `rams` the number of block RAMs that they take.
  function total (
    division : division_t;
    rams     : boolean
  ) return natural is

    variable alike : natural;
    variable base  : natural;
    variable sum   : natural;

  begin

    alike := WORDS / 2 ** division.full;
    base  := alike * 2 ** division.full;
    sum   := alike * choose(rams, block_rams(2 ** division.full), 1);

    -- A block for each bit, and one for the rest.
    for i in 0 to MOST_BITS - LEAST_BITS loop

      if base < WORDS then
        sum  := sum + choose(rams, block_rams(block_size(WORDS - base, division)), 1);
        base := base + block_size(WORDS - base, division);
      end if;

    end loop;

    return sum;

  end function total;

  function best_division return division_t is

    variable best : division_t;
    variable now  : division_t;

  begin

    -- All divisions are tried at elaboration: there are 21.
    best := (full => MOST_BITS, least => MOST_BITS);

    for full in LEAST_BITS to MOST_BITS loop

      for least in LEAST_BITS to full loop

        now := (full => full, least => least);

        if total(now, true) < total(best, true) or
           (total(now, true) = total(best, true) and total(now, false) < total(best, false)) then
          best := now;
        end if;

      end loop;

    end loop;

    return best;

  end function best_division;

  constant DIVISION : division_t := best_division;
  constant BLOCKS   : positive   := total(DIVISION, false);

  type words_t is array (natural range 0 to BLOCKS - 1) of std_logic_vector(WIDTH - 1 downto 0);

  signal block_words : words_t;
  -- chosen: the block that each read word belongs to.
  signal chosen : std_logic_vector(0 to BLOCKS - 1);
  signal word   : std_logic_vector(WIDTH - 1 downto 0);

begin

  part : for i in 0 to BLOCKS - 1 generate

    -- Each block begins at a multiple of its size, so the high bits of an address name the block: no subtraction.
    constant BASE : natural  := block_base(i, DIVISION);
    constant SIZE : positive := block_size(WORDS - BASE, DIVISION);
    constant BITS : positive := bits_for(SIZE - 1);

    signal writes : std_logic;
    signal reads  : std_logic;
    signal place  : unsigned(BITS - 1 downto 0);

  begin

    the_only_one : if BLOCKS = 1 generate
      writes    <= write_enable;
      reads     <= '1';
      chosen(i) <= '1';
    end generate the_only_one;

    one_of_several : if BLOCKS > 1 generate

      signal was_read : std_logic := '0';

    begin

      writes <= write_enable when write_address(ADDRESS_BITS - 1 downto BITS) = BASE / 2 ** BITS else
                '0';
      reads  <= '1' when read_address(ADDRESS_BITS - 1 downto BITS) = BASE / 2 ** BITS else
                '0';

      follow : process (clk) is
      begin

        if rising_edge(clk) then
          -- The choice is delayed by two clocks like the words: block RAM and register.
          was_read  <= reads;
          chosen(i) <= was_read;
        end if;

      end process follow;

    end generate one_of_several;

    -- The last block may have fewer than 2**BITS words, so an address of another block must not point beyond them.
    place(BITS - 1) <= read_address(BITS - 1) and reads;

    lower_bits : for b in 0 to BITS - 2 generate
      place(b) <= read_address(b);
    end generate lower_bits;

    words_of_block : entity work.ram_simple_dual_port
      generic map (
        WIDTH => WIDTH,
        WORDS => SIZE
      )
      port map (
        clk           => clk,
        write_enable  => writes,
        write_address => write_address(BITS - 1 downto 0),
        write_data    => write_data,
        read_address  => place,
        read_data     => block_words(i)
      );

  end generate part;

  choose_word : process (block_words, chosen) is

    variable choice : std_logic_vector(WIDTH - 1 downto 0);

  begin

    -- At most one block is chosen, so its word is found by or gates: a tree without priorities.
    choice := (others => '0');

    for i in 0 to BLOCKS - 1 loop

      if chosen(i) = '1' then
        choice := choice or block_words(i);
      end if;

    end loop;

    word <= choice;

  end process choose_word;

  no_register : if READ_LATENCY = 2 generate
    read_data <= word;
  end generate no_register;

  output_register : if READ_LATENCY = 3 generate

    register_word : process (clk) is
    begin

      if rising_edge(clk) then
        read_data <= word;
      end if;

    end process register_word;

  end generate output_register;

end architecture rtl;
