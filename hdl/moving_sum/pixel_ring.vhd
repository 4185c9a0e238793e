-- SPDX-License-Identifier: Apache-2.0
-- The last pixels of a line. Gives the pixel that enters the moving sum of a row, and the one that leaves it.
--
-- A ring of words, read twice: every token is a step, so that ages count back from the place that is written.
--
-- Latency: 4 clocks from an age to its pixels. Throughput: one token each clock.
-- Equation: entering = the token `age` before the newest, leaving = the token `age` + M before.

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
    -- M, the slices, and what follows from them.
    GEOMETRY : geometry_t;
    -- Bits of a token.
    WIDTH : positive
  );
  port (
    clk : in    std_logic;
    -- Age of the pixel that enters, 2 clocks ahead of the token.
    age : in    natural range 0 to reach(GEOMETRY);
    -- Marks a token, and its pixels.
    active : in    std_logic;
    pixel  : in    std_logic_vector(WIDTH - 1 downto 0);
    -- 2 clocks behind the token: the pixels of that age, and those of M tokens before.
    entering : out   std_logic_vector(WIDTH - 1 downto 0);
    leaving  : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity pixel_ring;

architecture rtl of pixel_ring is

  -- The ring has a power of two of words, so its addresses wrap round by themselves.
  constant M            : positive := GEOMETRY.micro_image_size;
  constant REACHED      : positive := reach(GEOMETRY);
  constant ADDRESS_BITS : positive := bits_for(REACHED);

  subtype address_t is unsigned(ADDRESS_BITS - 1 downto 0);

  -- The pixel that enters, and the one that leaves.
  constant ENTER : natural := 0;
  constant LEAVE : natural := 1;

  type addresses_t is array (ENTER to LEAVE) of address_t;

  type words_t is array (ENTER to LEAVE) of std_logic_vector(WIDTH - 1 downto 0);

  signal write_address : address_t   := (others => '0');
  signal read_address  : addresses_t := (others => (others => '0'));
  signal words         : words_t;
  signal age_at        : natural range 0 to REACHED;

begin

  find_addresses : process (clk) is
  begin

    if rising_edge(clk) then
      -- The age comes a clock before it is used, as it stands behind a comparison.
      age_at <= age;
      if active = '1' then
        write_address       <= write_address + 1;
        read_address(ENTER) <= write_address + 1 - to_unsigned(age_at, ADDRESS_BITS);
        read_address(LEAVE) <= write_address + 1 - to_unsigned((age_at + M) mod 2 ** ADDRESS_BITS, ADDRESS_BITS);
      else
        -- Without a token the newest place stays, and so do the pixels that are looked at.
        read_address(ENTER) <= write_address - to_unsigned(age_at, ADDRESS_BITS);
        read_address(LEAVE) <= write_address - to_unsigned((age_at + M) mod 2 ** ADDRESS_BITS, ADDRESS_BITS);
      end if;
    end if;

  end process find_addresses;

  entering <= words(ENTER);
  leaving  <= words(LEAVE);

  -- A copy of the pixels for each of both, as a memory has one address to read. Where no pixel leaves, one does.
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
