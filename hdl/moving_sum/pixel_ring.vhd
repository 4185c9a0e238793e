-- SPDX-License-Identifier: Apache-2.0
-- Keeps the last pixels of a line, and gives the pixel that enters a row's moving sum and the one that leaves it.
--
-- The ring of words is read twice. Every token is a step, so ages count back from the place that is written.
--
-- Latency: 4 clocks from an age to its pixels. Throughput: one token each clock.
-- Equation: entering = the token `age` before the newest, leaving = the token `left_age` before.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.sum_schedule_pkg.all;
use work.moving_sum_pkg.all;

entity pixel_ring is
  generic (
    -- Geometry of the slices.
    GEOMETRY : geometry_t;
    -- Bits of a token.
    WIDTH : positive
  );
  port (
    clk : in    std_logic;
    -- Ages of the pixels that enter and leave, 2 clocks ahead of the token.
    age      : in    natural range 0 to reach(GEOMETRY);
    left_age : in    natural range 0 to reach(GEOMETRY);
    -- active: there is a token; its pixels.
    active : in    std_logic;
    pixel  : in    std_logic_vector(WIDTH - 1 downto 0);
    -- 2 clocks behind the token: the pixels of these ages.
    entering : out   std_logic_vector(WIDTH - 1 downto 0);
    leaving  : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity pixel_ring;

architecture rtl of pixel_ring is

  -- The ring has a power of two of words, so that addresses wrap round.
  constant REACHED      : positive := reach(GEOMETRY);
  constant ADDRESS_BITS : positive := bits_for(REACHED);

  subtype address_t is unsigned(ADDRESS_BITS - 1 downto 0);

  -- Index of the pixel that enters, and of the one that leaves.
  constant ENTER : natural := 0;
  constant LEAVE : natural := 1;

  type addresses_t is array (ENTER to LEAVE) of address_t;

  type words_t is array (ENTER to LEAVE) of std_logic_vector(WIDTH - 1 downto 0);

  signal write_address : address_t   := (others => '0');
  signal read_address  : addresses_t := (others => (others => '0'));
  signal words         : words_t;
  signal age_at        : natural range 0 to REACHED;
  signal left_age_at   : natural range 0 to REACHED;

begin

  find_addresses : process (clk) is
  begin

    if rising_edge(clk) then
      -- The age comes from a comparison, so it is registered before it is used.
      age_at      <= age;
      left_age_at <= left_age;
      if active = '1' then
        write_address       <= write_address + 1;
        read_address(ENTER) <= write_address + 1 - to_unsigned(age_at, ADDRESS_BITS);
        read_address(LEAVE) <= write_address + 1 - to_unsigned(left_age_at, ADDRESS_BITS);
      else
        -- Without a token the newest place and the addresses to read stay.
        read_address(ENTER) <= write_address - to_unsigned(age_at, ADDRESS_BITS);
        read_address(LEAVE) <= write_address - to_unsigned(left_age_at, ADDRESS_BITS);
      end if;
    end if;

  end process find_addresses;

  entering <= words(ENTER);
  leaving  <= words(LEAVE);

  -- Each of the two reads needs a copy of the pixels, because a memory has one address to read. If no pixel
  -- leaves, one copy is enough.
  each_read : for i in ENTER to LEAVE generate

    kept : if i = ENTER or pixels_leave(GEOMETRY) generate

      pixels : entity work.ram_simple_dual_port
        generic map (
          WIDTH => WIDTH,
          WORDS => 2 ** ADDRESS_BITS
        )
        port map (
          clk           => clk,
          write_enable  => active,
          write_address => write_address,
          write_data    => pixel,
          read_address  => read_address(i),
          read_data     => words(i)
        );

    end generate kept;

    nothing : if i = LEAVE and not pixels_leave(GEOMETRY) generate
      words(i) <= (others => '0');
    end generate nothing;

  end generate each_read;

end architecture rtl;
