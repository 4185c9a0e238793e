-- SPDX-License-Identifier: Apache-2.0
-- Simple dual-port RAM: one write port, one read port, one clock.
--
-- This is the only description of block RAM: synthesis infers RAMB16BWER or RAMB8BWER from it. A deep memory may be
-- divided into blocks, with a register behind each and the multiplexer behind these registers (ram_blocks_pkg).
--
-- Latency: READ_LATENCY clocks from address to data. 1: the RAM's own register; 2: also the output register behind
-- it, which block RAM needs at high clock rates; 3: also a register behind the multiplexer.
-- Throughput: one read and one write each clock. Reading a word in the clock that writes it returns the old word.
-- Equation: read_data(t + READ_LATENCY) = memory(read_address(t)) where read_enable(t).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.ram_blocks_pkg.all;

entity ram_simple_dual_port is
  generic (
    -- Bits of a word.
    WIDTH : positive;
    -- Words of the memory; addresses beyond are not used.
    WORDS : positive;
    -- Clocks from address to data; at least 2 if the memory is divided.
    READ_LATENCY : positive range 1 to 3 := 2;
    -- true: a deep memory is divided into blocks.
    DIVIDED : boolean := false
  );
  port (
    clk : in    std_logic;
    -- Writes a word.
    write_enable  : in    std_logic;
    write_address : in    unsigned(bits_for(WORDS - 1) - 1 downto 0);
    write_data    : in    std_logic_vector(WIDTH - 1 downto 0);
    -- The RAM's own register reads a word.
    read_enable  : in    std_logic := '1';
    read_address : in    unsigned(bits_for(WORDS - 1) - 1 downto 0);
    -- The word read.
    read_data : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity ram_simple_dual_port;

architecture rtl of ram_simple_dual_port is

  constant REFUSED : boolean := not takes(not DIVIDED or READ_LATENCY > 1,
                                          "ram_simple_dual_port: DIVIDED needs a READ_LATENCY of at least 2");

  constant ADDRESS_BITS : positive := bits_for(WORDS - 1);

  -- XST's template for block RAM has a signal (UG687; its other template has a shared variable, which VHDL-2008
  -- forbids). Simulators keep a driver for each bit of a signal, too much for a memory of megabits: simulation
  -- gets a variable.
  function is_simulation return boolean is
  begin

    -- synthesis translate_off
    return true;
    -- synthesis translate_on

    return false;

  end function is_simulation;

  function division return division_t is
  begin

    if DIVIDED then
      return best_division(WORDS, WIDTH);
    end if;

    return UNDIVIDED;

  end function division;

  constant DIVISION_OF : division_t := division;
  constant BLOCKS      : positive   := block_count(WORDS, DIVISION_OF);

  subtype word_t is std_logic_vector(WIDTH - 1 downto 0);

  type words_t is array (natural range 0 to BLOCKS - 1) of word_t;

  -- The word of the block that an address belongs to.
  function chosen_word (
    of_blocks : words_t;
    chosen    : std_logic_vector(0 to BLOCKS - 1)
  ) return word_t is

    variable word : word_t;

  begin

    if BLOCKS = 1 then
      return of_blocks(0);
    end if;

    -- At most one block is chosen, so its word is found by or gates: a tree without priorities.
    word := (others => '0');

    for i in 0 to BLOCKS - 1 loop

      if chosen(i) = '1' then
        word := word or of_blocks(i);
      end if;

    end loop;

    return word;

  end function chosen_word;

  -- block_words: the word read of each block; chosen: the block that the word belongs to.
  signal block_words : words_t;
  signal chosen      : std_logic_vector(0 to BLOCKS - 1);
  signal word        : word_t;

begin

  part : for i in 0 to BLOCKS - 1 generate

    -- Each block begins at a multiple of its size, so the high bits of an address name the block: no subtraction.
    constant BASE : natural  := block_base(i, WORDS, DIVISION_OF);
    constant SIZE : positive := block_size(WORDS - BASE, DIVISION_OF);
    constant BITS : positive := bits_for(SIZE - 1);

    type memory_t is array (natural range 0 to SIZE - 1) of word_t;

    -- The last block may have fewer than 2**BITS words, so an address of another block must not point beyond them.
    function place_of (
      address : unsigned(BITS - 1 downto 0);
      reads   : std_logic
    ) return unsigned is

      variable place : unsigned(BITS - 1 downto 0);

    begin

      place           := address;
      place(BITS - 1) := address(BITS - 1) and reads;

      return place;

    end function place_of;

    signal writes    : std_logic;
    signal reads     : std_logic;
    signal place     : unsigned(BITS - 1 downto 0);
    signal read_word : word_t := (others => '0');

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
          if read_enable = '1' then
            was_read <= reads;
          end if;
          chosen(i) <= was_read;
        end if;

      end process follow;

    end generate one_of_several;

    place <= place_of(read_address(BITS - 1 downto 0), reads);

    synthesised : if not is_simulation generate

      signal memory : memory_t := (others => (others => '0'));

    begin

      access_memory : process (clk) is
      begin

        if rising_edge(clk) then
          if read_enable = '1' then
            read_word <= memory(to_integer(place));
          end if;
          if writes = '1' then
            memory(to_integer(write_address(BITS - 1 downto 0))) <= write_data;
          end if;
        end if;

      end process access_memory;

    end generate synthesised;

    simulated : if is_simulation generate

      access_memory : process (clk) is

        variable memory : memory_t := (others => (others => '0'));

      begin

        if rising_edge(clk) then
          -- Read before write: a variable, too, then gives the old word if both addresses are equal.
          if read_enable = '1' then
            read_word <= memory(to_integer(place));
          end if;
          if writes = '1' then
            memory(to_integer(write_address(BITS - 1 downto 0))) := write_data;
          end if;
        end if;

      end process access_memory;

    end generate simulated;

    no_output_register : if READ_LATENCY = 1 generate
      block_words(i) <= read_word;
    end generate no_output_register;

    -- This register has neither enable nor reset, so that it fits the block RAM's own output register.
    output_register : if READ_LATENCY > 1 generate

      register_block : process (clk) is
      begin

        if rising_edge(clk) then
          block_words(i) <= read_word;
        end if;

      end process register_block;

    end generate output_register;

  end generate part;

  word <= chosen_word(block_words, chosen);

  no_word_register : if READ_LATENCY < 3 generate
    read_data <= word;
  end generate no_word_register;

  word_register : if READ_LATENCY = 3 generate

    register_word : process (clk) is
    begin

      if rising_edge(clk) then
        read_data <= word;
      end if;

    end process register_word;

  end generate word_register;

end architecture rtl;
