-- SPDX-License-Identifier: Apache-2.0
-- Tables of corrections: for each lens its move from the even grid and its gain; for each pixel of a micro image a gain
-- (the profile).
--
-- A word of the lens table has, from its low bits on, the gain (GAIN_BITS + 4 bits) if there are gains, and the moves
-- along x and y (WEIGHT_BITS + 2 bits each, signed) if there are moves. A word of the profile is a gain.
--
-- Latency: 2 clocks to the moves, 4 to the gain. Throughput: one pixel each clock.
-- Equation: gain = smaller(floor(lens gain * profile / 2**GAIN_BITS + 1/2), LARGEST_GAIN 2**GAIN_BITS).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.resample_pkg.all;

entity lens_tables is
  generic (
    -- Sizes of the resampler.
    BUILD : resample_build_t
  );
  port (
    clk : in    std_logic;
    -- The load port; only words of the lens table and of the profile are used here.
    load : in    load_t;
    -- Addresses of the lens and of its pixel.
    lens    : in    lens_t;
    profile : in    profile_t;
    -- Moves along y and x.
    move_y : out   signed(BUILD.weight_bits + 1 downto 0);
    move_x : out   signed(BUILD.weight_bits + 1 downto 0);
    -- The product of both gains, limited.
    gain : out   unsigned(BUILD.gain_bits + GAIN_INTEGER_BITS - 1 downto 0)
  );
end entity lens_tables;

architecture rtl of lens_tables is

  constant WORD_BITS    : positive := BUILD.gain_bits + GAIN_INTEGER_BITS;
  constant MOVE_BITS    : positive := BUILD.weight_bits + 2;
  constant GAIN_WIDTH   : natural  := choose(BUILD.gains, WORD_BITS, 0);
  constant TABLE_BITS   : positive := larger(GAIN_WIDTH + choose(BUILD.moves, 2 * MOVE_BITS, 0), 1);
  constant ADDRESS_BITS : positive := bits_for(BUILD.lenses - 1);

begin

  -- An even grid needs no table; synthesis removes the addition of moves.
  no_moves : if not BUILD.moves generate
    move_y <= (others => '0');
    move_x <= (others => '0');
  end generate no_moves;

  -- The gain is one, so synthesis turns the multiplier behind it into a wire.
  no_gains : if not BUILD.gains generate
    gain <= to_unsigned(2 ** BUILD.gain_bits, WORD_BITS);
  end generate no_gains;

  tables : if BUILD.moves or BUILD.gains generate

    signal write_lens : std_logic;
    signal word       : std_logic_vector(TABLE_BITS - 1 downto 0);

  begin

    write_lens <= writes(load, LOAD_KIND_LENS);

    lens_table : entity work.ram_simple_dual_port
      generic map (
        WIDTH => TABLE_BITS,
        WORDS => BUILD.lenses
      )
      port map (
        clk           => clk,
        write_enable  => write_lens,
        write_address => unsigned(load.address(ADDRESS_BITS - 1 downto 0)),
        write_data    => load.data(TABLE_BITS - 1 downto 0),
        read_address  => lens(ADDRESS_BITS - 1 downto 0),
        read_data     => word
      );

    moved : if BUILD.moves generate
      move_x <= signed(word(GAIN_WIDTH + MOVE_BITS - 1 downto GAIN_WIDTH));
      move_y <= signed(word(GAIN_WIDTH + 2 * MOVE_BITS - 1 downto GAIN_WIDTH + MOVE_BITS));
    end generate moved;

    gained : if BUILD.gains generate

      constant PROFILE_BITS : positive := bits_for(larger(BUILD.micro_image_size * BUILD.micro_image_size - 1, 1));
      constant PRODUCT_BITS : positive := 2 * WORD_BITS;
      constant MOST         : unsigned := to_unsigned(LARGEST_GAIN * 2 ** BUILD.gain_bits, PRODUCT_BITS);

      signal write_profile : std_logic;
      signal share         : std_logic_vector(WORD_BITS - 1 downto 0);
      signal product       : unsigned(PRODUCT_BITS - 1 downto 0) := (others => '0');

    begin

      write_profile <= writes(load, LOAD_KIND_PROFILE);

      profile_table : entity work.ram_simple_dual_port
        generic map (
          WIDTH => WORD_BITS,
          WORDS => 2 ** PROFILE_BITS
        )
        port map (
          clk           => clk,
          write_enable  => write_profile,
          write_address => unsigned(load.address(PROFILE_BITS - 1 downto 0)),
          write_data    => load.data(WORD_BITS - 1 downto 0),
          read_address  => profile(PROFILE_BITS - 1 downto 0),
          read_data     => share
        );

      multiply : process (clk) is

        variable rounded : unsigned(PRODUCT_BITS - 1 downto 0);

      begin

        if rising_edge(clk) then
          -- Multiplying the lens's gain by the pixel's gain takes two small tables instead of one for each pixel of the
          -- sensor.
          product <= unsigned(word(WORD_BITS - 1 downto 0)) * unsigned(share);

          rounded := shift_right(product + 2 ** (BUILD.gain_bits - 1), BUILD.gain_bits);
          -- Both gains may be at their largest; the limit keeps the product in the bits of a gain.
          if rounded > MOST then
            rounded := MOST;
          end if;
          gain <= rounded(WORD_BITS - 1 downto 0);
        end if;

      end process multiply;

    end generate gained;

  end generate tables;

end architecture rtl;
