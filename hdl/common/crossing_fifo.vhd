-- SPDX-License-Identifier: Apache-2.0
-- First-in first-out buffer from one clock into another, first word falls through.
--
-- Each side sees the other side's pointer late, so it takes the buffer for fuller or emptier than it is, which is
-- safe. There is no reset: the reading side can drop the content, even while either clock stands still.
--
-- Use it between any two clocks for a stream that may lose no word. elastic_buffer is smaller and has no handshake,
-- but needs clocks of one frequency. bus_crossing is for values of which only the latest counts.
--
-- Latency: a word is offered 4 to 5 clocks of read_clk after it was written. Throughput: one word each clock.
-- Equation: the n-th word out is the n-th word in. Cost: a memory, WIDTH flip-flops and 12 for each bit of a pointer.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity crossing_fifo is
  generic (
    -- Bits of a word.
    WIDTH : positive;
    -- The buffer holds 2**ADDRESS_BITS words.
    ADDRESS_BITS : positive range 2 to 12
  );
  port (
    -- Words in. A word that comes while the buffer is full is lost. full: no free place; nearly_full: at most
    -- one free place.
    write_clk    : in    std_logic;
    write_enable : in    std_logic;
    write_word   : in    std_logic_vector(WIDTH - 1 downto 0);
    full         : out   std_logic;
    nearly_full  : out   std_logic;
    -- Words out. read_drop drops all words in the buffer, one each clock.
    read_clk   : in    std_logic;
    read_drop  : in    std_logic;
    read_valid : out   std_logic;
    read_ready : in    std_logic;
    read_word  : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity crossing_fifo;

architecture rtl of crossing_fifo is

  constant WORDS : positive := 2 ** ADDRESS_BITS;

  type memory_t is array (natural range 0 to WORDS - 1) of std_logic_vector(WIDTH - 1 downto 0);

  -- Pointers have one bit more than an address, so equal pointers mean an empty buffer.
  subtype pointer_t is unsigned(ADDRESS_BITS downto 0);

  -- The words on their way, and the register that reads them; the timing constraints match these names. Memory and
  -- register may become a block RAM.
  signal crossing_memory : memory_t                             := (others => (others => '0'));
  signal crossing_word   : std_logic_vector(WIDTH - 1 downto 0) := (others => '0');
  -- Each side has its own pointer, and the other side's pointer as it last arrived.
  signal write_pointer : pointer_t := (others => '0');
  signal write_arrived : pointer_t;
  signal written       : pointer_t := (others => '0');
  signal read_pointer  : pointer_t := (others => '0');
  signal read_arrived  : pointer_t;
  signal taken         : pointer_t := (others => '0');
  signal used          : pointer_t;
  -- no_place: the buffer is full; one_place: at most one place is free.
  signal no_place  : std_logic := '0';
  signal one_place : std_logic := '0';
  signal on_offer  : std_logic := '0';
  signal free      : std_logic;
  -- Dropping passes over the words in front of drop_to.
  signal drop_to   : pointer_t := (others => '0');
  signal dropping  : std_logic := '0';
  signal drop_ends : std_logic;

begin

  --------------------------------------------------------------------------------------------------
  -- Writing side.

  used        <= write_pointer - taken;
  full        <= no_place;
  nearly_full <= one_place;

  write : process (write_clk) is
  begin

    -- synthesis translate_off
    assert not (rising_edge(write_clk) and write_enable = '1' and no_place = '1')
      report "crossing_fifo: a word came while the FIFO was full, and is lost"
      severity failure;
    -- synthesis translate_on

    if rising_edge(write_clk) then
      if write_enable = '1' and no_place = '0' then
        crossing_memory(to_integer(write_pointer(ADDRESS_BITS - 1 downto 0))) <= write_word;

        write_pointer <= write_pointer + 1;
      end if;
      taken <= read_arrived;

      -- The flags after this clock count the word that is written now.
      no_place  <= to_logic(used >= WORDS) or (write_enable and to_logic(used >= WORDS - 1));
      one_place <= to_logic(used >= WORDS - 1) or (write_enable and to_logic(used >= WORDS - 2));
    end if;

  end process write;

  -- The word is written a clock before the pointer that announces it leaves, so the word is stable when the other
  -- side reads it.
  forward : entity work.gray_crossing
    generic map (
      WIDTH => ADDRESS_BITS + 1
    )
    port map (
      clk_in    => write_clk,
      count_in  => write_pointer,
      clk_out   => read_clk,
      count_out => write_arrived
    );

  --------------------------------------------------------------------------------------------------
  -- Reading side.

  read_valid <= on_offer;
  read_word  <= crossing_word;
  free       <= read_ready or not on_offer;
  -- Dropping passes over one word each clock, because the read pointer crosses as a Gray code and may only move by
  -- single steps.
  drop_ends <= to_logic(read_pointer = drop_to) or not dropping;

  read : process (read_clk) is
  begin

    if rising_edge(read_clk) then
      written <= write_arrived;
      if free = '1' then
        -- Read ahead: the register takes the next word as soon as it is free.
        crossing_word <= crossing_memory(to_integer(read_pointer(ADDRESS_BITS - 1 downto 0)));
        on_offer      <= to_logic(written /= read_pointer) and drop_ends;
        if written /= read_pointer then
          read_pointer <= read_pointer + 1;
        end if;
      end if;
      if drop_ends = '1' then
        dropping <= '0';
      end if;
      if read_drop = '1' then
        -- Drop up to the last word that is known to be written.
        drop_to  <= written;
        dropping <= '1';
        on_offer <= '0';
      end if;
    end if;

  end process read;

  backward : entity work.gray_crossing
    generic map (
      WIDTH => ADDRESS_BITS + 1
    )
    port map (
      clk_in    => read_clk,
      count_in  => read_pointer,
      clk_out   => write_clk,
      count_out => read_arrived
    );

end architecture rtl;
