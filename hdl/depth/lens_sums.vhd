-- SPDX-License-Identifier: Apache-2.0
-- Luma of each micro image of a slice, summed over its pixels.
--
-- A register sums the pixels of a line, a memory the lines; with the last line of a row of micro images the sums go to
-- a memory of their own, where they stay until the next row is complete. Of several pixels a clock some may begin the
-- next micro image: they are summed apart, and go on in the register.
--
-- Latency: lens_sum_latency - 2 clocks from the last pixel of a micro image until its sum can be read; reading takes 2.
-- Throughput: one token each clock.
-- Equation: sum = sum of the luma of M x M pixels; of RGB R + 2 G + B.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.sharpness_pkg.all;

entity lens_sums is
  generic (
    -- What sharpness_index is built for.
    BUILD : index_build_t;
    -- The slice that is summed.
    SLICE : natural
  );
  port (
    clk : in    std_logic;
    -- A token's place, those of its pixels that lie in the next micro image, its slices, 0 behind a line's last pixel.
    place : in    lens_place_t;
    ahead : in    std_logic_vector(BUILD.pixels - 1 downto 0);
    data  : in    std_logic_vector(BUILD.pixels * BUILD.slices * BUILD.pixel_width - 1 downto 0);
    -- Address of the sum, and 2 clocks later the sum.
    read_lens : in    unsigned(bits_for(BUILD.lenses - 1) - 1 downto 0);
    sum       : out   std_logic_vector(BUILD.sum_bits - 1 downto 0)
  );
end entity lens_sums;

architecture rtl of lens_sums is

  constant SUM_BITS     : positive := BUILD.sum_bits;
  constant ADDRESS_BITS : positive := bits_for(BUILD.lenses - 1);
  constant DATA_BITS    : positive := BUILD.pixel_width;
  constant LUMA_BITS    : positive := BUILD.pixel_bits + choose(BUILD.channels = 1, 0, 2);
  -- Of the pixels of a token.
  constant PART_BITS : positive := LUMA_BITS + bits_for(BUILD.pixels) - 1;

  subtype address_t is unsigned(ADDRESS_BITS - 1 downto 0);

  -- Of a pixel of the token, in the slice.
  function luma_of (
    stack  : std_logic_vector;
    number : natural
  ) return unsigned is

    constant LOW : natural := (number * BUILD.slices + SLICE) * DATA_BITS;

    variable own  : std_logic_vector(DATA_BITS - 1 downto 0);
    variable luma : unsigned(LUMA_BITS - 1 downto 0);

  -- A place in the stack by constants: it costs no logic.

  begin

    own  := stack(LOW + DATA_BITS - 1 downto LOW);
    luma := resize(unsigned(own(BUILD.pixel_bits - 1 downto 0)), LUMA_BITS);

    -- Weights 1, 2, 1: close to those of the eye, and free of multipliers.
    if BUILD.channels = 3 then
      luma := luma + shift_left(resize(unsigned(own(2 * BUILD.pixel_bits - 1 downto BUILD.pixel_bits)), LUMA_BITS), 1) +
              resize(unsigned(own(own'high downto own'high - BUILD.pixel_bits + 1)), LUMA_BITS);
    end if;

    return luma;

  end function luma_of;

  -- The value, or nothing.
  function where_set (
    condition : std_logic;
    value     : unsigned
  ) return unsigned is
  begin

    if condition = '1' then
      return value;
    end if;

    return to_unsigned(0, value'length);

  end function where_set;

  -- Clocks behind a token are part of the names. 1: its place, brightness of its own micro image and of the next one.
  signal place_1 : lens_place_t;
  signal own_1   : unsigned(PART_BITS - 1 downto 0) := (others => '0');
  signal next_1  : unsigned(PART_BITS - 1 downto 0) := (others => '0');
  signal lens_1  : address_t;
  -- 2: the line of the micro image so far, that of the one that goes on, the lines above; a tail is to come.
  signal line_2      : unsigned(SUM_BITS - 1 downto 0) := (others => '0');
  signal rest_2      : unsigned(SUM_BITS - 1 downto 0) := (others => '0');
  signal above_2     : std_logic_vector(SUM_BITS - 1 downto 0);
  signal lens_2      : address_t                       := (others => '0');
  signal ends_2      : std_logic                       := '0';
  signal tail_2      : std_logic                       := '0';
  signal row_first_2 : std_logic                       := '0';
  signal row_last_2  : std_logic                       := '0';
  -- 3: with the lines above, at the last pixel of the line.
  signal sum_3      : std_logic_vector(SUM_BITS - 1 downto 0) := (others => '0');
  signal lens_3     : address_t                               := (others => '0');
  signal ends_3     : std_logic                               := '0';
  signal row_last_3 : std_logic                               := '0';
  signal final_3    : std_logic;

begin

  -- Brightness first, so that one sum serves three channels.
  one_pixel : if BUILD.pixels = 1 generate

    find_luma : process (clk) is
    begin

      if rising_edge(clk) then
        place_1 <= place;
        own_1   <= luma_of(data, 0);
      end if;

    end process find_luma;

  end generate one_pixel;

  several_pixels : if BUILD.pixels > 1 generate

    type lumas_t is array (0 to BUILD.pixels - 1) of unsigned(LUMA_BITS - 1 downto 0);

    signal place_0 : lens_place_t;
    signal ahead_0 : std_logic_vector(BUILD.pixels - 1 downto 0) := (others => '0');
    signal lumas_0 : lumas_t                                         := (others => (others => '0'));

  begin

    add_pixels : process (clk) is

      variable own    : unsigned(PART_BITS - 1 downto 0);
      variable behind : unsigned(PART_BITS - 1 downto 0);

    begin

      if rising_edge(clk) then
        place_0 <= place;
        ahead_0 <= ahead;
        place_1 <= place_0;
        own     := (others => '0');
        behind  := (others => '0');

        -- A clock for the lumas and one for their sums: P of each would be too long for one.
        for j in 0 to BUILD.pixels - 1 loop

          lumas_0(j) <= luma_of(data, j);
          own        := own + where_set(not ahead_0(j), lumas_0(j));
          behind     := behind + where_set(ahead_0(j), lumas_0(j));

        end loop;

        own_1  <= own;
        next_1 <= behind;
      end if;

    end process add_pixels;

  end generate several_pixels;

  -- Behind a line's last token a tail comes as if it were the next micro image's.
  lens_1 <= lens_2 + 1 when tail_2 = '1' else
            place_1.lens(ADDRESS_BITS - 1 downto 0);

  add : process (clk) is

    variable so_far : unsigned(SUM_BITS - 1 downto 0);

  begin

    if rising_edge(clk) then
      so_far := resize(own_1, SUM_BITS);
      -- A micro image goes on with what the tokens before gave it.
      if place_1.lens_first = '0' then
        so_far := rest_2 + own_1;
      end if;

      -- Only pixels count; between two of them the sum of the line stands still.
      if place_1.active = '1' then
        line_2 <= so_far;
        rest_2 <= so_far;
        -- What lies ahead belongs to the next one and is its beginning.
        if BUILD.pixels > 1 and place_1.lens_last = '1' then
          rest_2 <= resize(next_1, SUM_BITS);
        end if;
      end if;
      lens_2      <= lens_1;
      ends_2      <= place_1.active and place_1.lens_last;
      tail_2      <= place_1.active and place_1.tail;
      row_first_2 <= place_1.row_first;
      row_last_2  <= place_1.row_last;
      -- The micro image that a line's last token begins and ends comes a clock behind the one that it ends. The next
      -- token is the first one of a line then, which ends none.
      if tail_2 = '1' then
        line_2      <= rest_2;
        ends_2      <= '1';
        row_first_2 <= row_first_2;
        row_last_2  <= row_last_2;
      end if;

      lens_3     <= lens_2;
      ends_3     <= ends_2;
      row_last_3 <= row_last_2;
      -- The first line of a micro image starts its sum: the memory need not be cleared.
      if row_first_2 = '1' then
        sum_3 <= std_logic_vector(line_2);
      else
        sum_3 <= std_logic_vector(line_2 + unsigned(above_2));
      end if;
    end if;

  end process add;

  -- A word for each micro image of a row: the lines so far. It is written with a micro image's last pixel of a line
  -- and read with it a line later, so nothing is read in the clock that writes it.
  lines_above : entity work.ram_simple_dual_port
    generic map (
      WIDTH        => SUM_BITS,
      WORDS        => BUILD.lenses,
      READ_LATENCY => 1
    )
    port map (
      clk           => clk,
      write_enable  => ends_3,
      write_address => lens_3,
      write_data    => sum_3,
      read_address  => lens_1,
      read_data     => above_2
    );

  -- The last line of a row completes its sums; they are kept apart, as the next row overwrites the others while the
  -- scan still reads these.
  final_3 <= ends_3 and row_last_3;

  complete : entity work.ram_simple_dual_port
    generic map (
      WIDTH => SUM_BITS,
      WORDS => BUILD.lenses
    )
    port map (
      clk           => clk,
      write_enable  => final_3,
      write_address => lens_3,
      write_data    => sum_3,
      read_address  => read_lens,
      read_data     => sum
    );

end architecture rtl;
