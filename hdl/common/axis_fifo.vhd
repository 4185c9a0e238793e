-- First-in first-out buffer for an AXI4-Stream, first word falls through.
--
-- Latency: a word written into an empty buffer is offered 2 clocks later.
-- Throughput: one word in and one word out each clock.
-- Ports: s_axis_* in, m_axis_* out (tdata carries whatever the user packs into it, side bands
--   included); level counts the stored words, the one on offer included.
-- Equation: the n-th word out is the n-th word in.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity axis_fifo is
  generic (
    -- Bits of a word.
    WIDTH : positive;
    -- The buffer holds 2**ADDRESS_BITS words.
    ADDRESS_BITS : positive
  );
  port (
    clk           : in    std_logic;
    reset         : in    std_logic;
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(WIDTH - 1 downto 0);
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(WIDTH - 1 downto 0);
    level         : out   unsigned(ADDRESS_BITS downto 0)
  );
end entity axis_fifo;

architecture rtl of axis_fifo is

  -- Pointers have one bit more than an address: equal pointers mean empty, pointers that
  -- differ by 2**ADDRESS_BITS mean full.
  subtype pointer_t is unsigned(ADDRESS_BITS downto 0);

  constant CAPACITY : pointer_t := to_unsigned(2 ** ADDRESS_BITS, ADDRESS_BITS + 1);

  signal write_pointer : pointer_t := (others => '0');
  signal read_pointer  : pointer_t := (others => '0');
  signal read_next     : pointer_t;
  signal stored        : pointer_t;
  signal write_enable  : std_logic;
  signal can_write     : std_logic;
  signal on_offer      : std_logic := '0';

begin

  stored        <= write_pointer - read_pointer;
  can_write     <= '1' when stored /= CAPACITY else
                   '0';
  write_enable  <= s_axis_tvalid and can_write;
  s_axis_tready <= can_write;
  m_axis_tvalid <= on_offer;
  level         <= stored;
  read_next     <= read_pointer + 1 when on_offer = '1' and m_axis_tready = '1' else
                   read_pointer;

  move_pointers : process (clk) is
  begin

    if rising_edge(clk) then
      if write_enable = '1' then
        write_pointer <= write_pointer + 1;
      end if;
      read_pointer <= read_next;
      -- The RAM is read at read_next in this very clock, so only words written earlier count.
      if read_next /= write_pointer then
        on_offer <= '1';
      else
        on_offer <= '0';
      end if;
      if reset = '1' then
        write_pointer <= (others => '0');
        read_pointer  <= (others => '0');
        on_offer      <= '0';
      end if;
    end if;

  end process move_pointers;

  words : entity work.ram_simple_dual_port
    generic map (
      WIDTH        => WIDTH,
      ADDRESS_BITS => ADDRESS_BITS,
      READ_LATENCY => 1
    )
    port map (
      clk           => clk,
      write_enable  => write_enable,
      write_address => write_pointer(ADDRESS_BITS - 1 downto 0),
      write_data    => s_axis_tdata,
      read_address  => read_next(ADDRESS_BITS - 1 downto 0),
      read_data     => m_axis_tdata
    );

end architecture rtl;
