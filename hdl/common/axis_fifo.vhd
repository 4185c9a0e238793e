-- SPDX-License-Identifier: Apache-2.0
-- First-in first-out buffer for an AXI4-Stream, first word falls through.
--
-- Words leave through the RAM's own register and an output register, which keeps the RAM's delay and the logic behind
-- the buffer in separate clocks.
--
-- Latency: a word written into an empty buffer is offered 3 clocks later.
-- Throughput: one word in and one word out each clock.
-- Equation: the n-th word out is the n-th word in.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity axis_fifo is
  generic (
    -- Bits of a word.
    WIDTH : positive;
    -- The RAM holds 2**ADDRESS_BITS words.
    ADDRESS_BITS : positive;
    -- true for users that ignore tready because their credits leave a place for each word: in simulation a word
    -- without a place is then a failure.
    MUST_FIT : boolean := false
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Words in. tdata holds whatever the user packs into it, side bands included.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(WIDTH - 1 downto 0);
    -- Words out.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(WIDTH - 1 downto 0);
    -- Words in the RAM, without those in the two registers behind it.
    level : out   unsigned(ADDRESS_BITS downto 0)
  );
end entity axis_fifo;

architecture rtl of axis_fifo is

  -- Pointers have one bit more than an address: equal pointers mean empty, pointers that
  -- differ by 2**ADDRESS_BITS mean full.
  subtype pointer_t is unsigned(ADDRESS_BITS downto 0);

  -- write_pointer, read_pointer: the RAM's next word to write and to read; stored: the number of words in between.
  signal write_pointer : pointer_t := (others => '0');
  signal read_pointer  : pointer_t := (others => '0');
  signal stored        : pointer_t;
  signal write_enable  : std_logic;
  signal can_write     : std_logic;
  signal read_enable   : std_logic;
  signal has_words     : std_logic;
  -- word: the RAM's own register. The output register behind it drives the port.
  signal word       : std_logic_vector(WIDTH - 1 downto 0);
  signal word_valid : std_logic := '0';
  signal word_moves : std_logic;
  signal word_free  : std_logic;
  signal on_offer   : std_logic := '0';

begin

  stored        <= write_pointer - read_pointer;
  can_write     <= '0' when write_pointer(ADDRESS_BITS) /= read_pointer(ADDRESS_BITS) and
                            write_pointer(ADDRESS_BITS - 1 downto 0) = read_pointer(ADDRESS_BITS - 1 downto 0) else
                   '1';
  has_words     <= '1' when read_pointer /= write_pointer else
                   '0';
  write_enable  <= s_axis_tvalid and can_write;
  s_axis_tready <= can_write;
  m_axis_tvalid <= on_offer;
  level         <= stored;

  -- A word moves from the RAM to its own register (word) and from there to the output register as soon as each is free.
  word_moves  <= m_axis_tready or not on_offer;
  word_free   <= word_moves or not word_valid;
  read_enable <= has_words and word_free;

  move_words : process (clk) is
  begin

    -- synthesis translate_off
    assert not (rising_edge(clk) and MUST_FIT and reset = '0' and s_axis_tvalid = '1' and can_write = '0')
      report axis_fifo'path_name & " a word came while the FIFO was full, and is lost"
      severity failure;
    -- synthesis translate_on

    if rising_edge(clk) then
      if write_enable = '1' then
        write_pointer <= write_pointer + 1;
      end if;
      if read_enable = '1' then
        read_pointer <= read_pointer + 1;
        word_valid   <= '1';
      elsif word_moves = '1' then
        word_valid <= '0';
      end if;
      if word_moves = '1' then
        on_offer     <= word_valid;
        m_axis_tdata <= word;
      end if;
      if reset = '1' then
        write_pointer <= (others => '0');
        read_pointer  <= (others => '0');
        word_valid    <= '0';
        on_offer      <= '0';
      end if;
    end if;

  end process move_words;

  words : entity work.ram_simple_dual_port
    generic map (
      WIDTH        => WIDTH,
      WORDS        => 2 ** ADDRESS_BITS,
      READ_LATENCY => 1
    )
    port map (
      clk           => clk,
      write_enable  => write_enable,
      write_address => write_pointer(ADDRESS_BITS - 1 downto 0),
      write_data    => s_axis_tdata,
      read_enable   => word_free,
      read_address  => read_pointer(ADDRESS_BITS - 1 downto 0),
      read_data     => word
    );

end architecture rtl;
