-- SPDX-License-Identifier: Apache-2.0
-- Brings one word each clock into another clock of the same frequency and any phase.
--
-- A small memory with two clocks, written and read each clock and kept half full. If a disturbed clock lets it run
-- empty or full, reading starts again at half full.
--
-- Use it for a stream that never pauses, such as video. crossing_fifo takes clocks of any frequency and words that
-- wait.
--
-- Latency: 2**(ADDRESS_BITS - 1) clocks, and 2 to 3 clocks of read_clk. Throughput: one word each clock.
-- Equation: read_word(t) = write_word(t - latency) while flowing.
-- Cost: a memory, WIDTH flip-flops and 5 for each bit of ADDRESS_BITS.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity elastic_buffer is
  generic (
    -- Bits of a word.
    WIDTH : positive;
    -- The buffer holds 2**ADDRESS_BITS words.
    ADDRESS_BITS : positive range 3 to 6 := 4
  );
  port (
    -- The words and their clock.
    write_clk   : in    std_logic;
    write_reset : in    std_logic;
    write_word  : in    std_logic_vector(WIDTH - 1 downto 0);
    -- The words in the other clock.
    read_clk   : in    std_logic;
    read_reset : in    std_logic;
    read_word  : out   std_logic_vector(WIDTH - 1 downto 0);
    -- '0' from the moment that the clocks slip until reading starts again.
    flowing : out   std_logic
  );
end entity elastic_buffer;

architecture rtl of elastic_buffer is

  type memory_t is array (natural range 0 to 2 ** ADDRESS_BITS - 1) of std_logic_vector(WIDTH - 1 downto 0);

  subtype pointer_t is unsigned(ADDRESS_BITS - 1 downto 0);

  constant HALF : pointer_t := to_unsigned(2 ** (ADDRESS_BITS - 1), ADDRESS_BITS);

  -- Two clocks of one frequency move both pointers at the same rate, so their distance only drifts if a clock is
  -- disturbed.
  signal write_pointer : pointer_t := (others => '0');
  signal arrived       : pointer_t;
  signal read_pointer  : pointer_t := (others => '0');
  signal reading       : std_logic := '0';
  -- The words on their way, and the register that reads them; the timing constraints match these names.
  signal crossing_memory : memory_t                             := (others => (others => '0'));
  signal crossing_word   : std_logic_vector(WIDTH - 1 downto 0) := (others => '0');

begin

  flowing   <= reading;
  read_word <= crossing_word;

  write : process (write_clk) is
  begin

    if rising_edge(write_clk) then
      -- The other clock reads a word half the depth later, when the word is long stable.
      crossing_memory(to_integer(write_pointer)) <= write_word;

      -- The pointer moves by one or not at all, even in a reset, because its Gray code must not jump.
      if write_reset = '0' then
        write_pointer <= write_pointer + 1;
      end if;
    end if;

  end process write;

  crossing : entity work.gray_crossing
    generic map (
      WIDTH => ADDRESS_BITS
    )
    port map (
      clk_in    => write_clk,
      count_in  => write_pointer,
      clk_out   => read_clk,
      count_out => arrived
    );

  read : process (read_clk) is

    variable level : pointer_t;

  begin

    if rising_edge(read_clk) then
      -- The other side's pointer arrives late, so this level is a little below the real one. Half the depth
      -- leaves room for that on either side.
      level         := arrived - read_pointer;
      crossing_word <= crossing_memory(to_integer(read_pointer));
      if reading = '1' then
        read_pointer <= read_pointer + 1;
        -- A level near 0 or near the depth means that the clocks have slipped: the next word could be one
        -- that is just being written.
        if level < 2 or level > 2 ** ADDRESS_BITS - 3 then
          reading <= '0';
        end if;
      else
        -- Wait half the depth behind the word that is being written.
        read_pointer <= arrived - HALF;
        if level = HALF or level = HALF + 1 then
          reading      <= '1';
          read_pointer <= read_pointer + 1;
        end if;
      end if;
      if read_reset = '1' then
        reading <= '0';
      end if;
    end if;

  end process read;

end architecture rtl;
