-- SPDX-License-Identifier: Apache-2.0
-- Luma of each micro image of a slice, summed over its pixels.
--
-- A register sums the pixels of a line, and a memory the lines. With the last line of a row of micro images the sums go
-- to a memory of their own, where they stay until the next row is complete. With several pixels a clock, some may begin
-- the next micro image: they are summed separately and then continue in the register.
--
-- Latency: lens_sum_latency - 2 clocks from the last pixel of a micro image until its sum can be read; 2 clocks to
-- read.
-- Throughput: one token each clock.
-- Equation: sum = sum of the luma of M x M pixels; the luma of RGB is R + 2 G + B.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.index_pkg.all;
use work.sharpness_pkg.all;

entity lens_sums is
  generic (
    -- Sizes of sharpness_index.
    BUILD : index_build_t;
    -- The slice that is summed.
    SLICE : natural
  );
  port (
    clk : in    std_logic;
    -- A token's place; which of its pixels lie in the next micro image; its slices, 0 behind a line's last pixel.
    place : in    lens_place_t;
    ahead : in    std_logic_vector(BUILD.pixels - 1 downto 0);
    data  : in    std_logic_vector(BUILD.pixels * BUILD.stack_width - 1 downto 0);
    -- Number of the micro image to read, and 2 clocks later its sum.
    read_lens : in    unsigned(bits_for(BUILD.lenses - 1) - 1 downto 0);
    sum       : out   std_logic_vector(BUILD.sum_bits - 1 downto 0)
  );
end entity lens_sums;

architecture rtl of lens_sums is

  constant SUM_BITS     : positive := BUILD.sum_bits;
  constant ADDRESS_BITS : positive := bits_for(BUILD.lenses - 1);
  constant DATA_BITS    : positive := BUILD.pixel_width;
  constant LUMA_BITS    : positive := BUILD.pixel_bits + choose(BUILD.channels = 1, 0, 2);
  -- Width of the luma of a token's pixels.
  constant PART_BITS : positive := LUMA_BITS + bits_for(BUILD.pixels) - 1;

  subtype address_t is unsigned(ADDRESS_BITS - 1 downto 0);

  -- The luma of one pixel of the token, in this slice.
  function luma_of (
    stack  : std_logic_vector;
    number : natural
  ) return unsigned is

    -- A smaller box comes beside the slice that is summed.
    constant LOW : natural := number * BUILD.stack_width + SLICE * BUILD.boxes * DATA_BITS;

    variable pixel : std_logic_vector(DATA_BITS - 1 downto 0);
    variable luma  : unsigned(LUMA_BITS - 1 downto 0);

  -- The position in the stack is constant, so selecting it takes no logic.

  begin

    pixel := stack(LOW + DATA_BITS - 1 downto LOW);
    luma  := resize(unsigned(pixel(BUILD.pixel_bits - 1 downto 0)), LUMA_BITS);

    -- Weights 1, 2, 1 are close to those of the eye, and need no multipliers.
    if BUILD.channels = 3 then
      luma := luma + resize(unsigned(pixel(pixel'high downto pixel'high - BUILD.pixel_bits + 1)), LUMA_BITS) +
              shift_left(
                         resize(unsigned(pixel(2 * BUILD.pixel_bits - 1 downto BUILD.pixel_bits)), LUMA_BITS), 1);
    end if;

    return luma;

  end function luma_of;

  -- The value if the condition is set, else 0.
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

  -- Names of signals end in the number of clocks behind a token. Clock 1: the place, and the luma of the token's own
  -- micro image and of the next one.
  signal place_1 : lens_place_t;
  signal this_1  : unsigned(PART_BITS - 1 downto 0) := (others => '0');
  signal next_1  : unsigned(PART_BITS - 1 downto 0) := (others => '0');
  signal lens_1  : address_t;
  -- Clock 2: the line's sum so far; the sum with which the next micro image begins (rest); the lines above; tail: a
  -- tail follows.
  signal line_2      : unsigned(SUM_BITS - 1 downto 0) := (others => '0');
  signal rest_2      : unsigned(SUM_BITS - 1 downto 0) := (others => '0');
  signal above_2     : std_logic_vector(SUM_BITS - 1 downto 0);
  signal lens_2      : address_t                       := (others => '0');
  signal ends_2      : std_logic                       := '0';
  signal tail_2      : std_logic                       := '0';
  signal row_first_2 : std_logic                       := '0';
  signal row_last_2  : std_logic                       := '0';
  -- Clock 3: the sum with the lines above, at the micro image's last pixel of the line.
  signal sum_3      : std_logic_vector(SUM_BITS - 1 downto 0) := (others => '0');
  signal lens_3     : address_t                               := (others => '0');
  signal ends_3     : std_logic                               := '0';
  signal row_last_3 : std_logic                               := '0';
  signal final_3    : std_logic;

begin

  -- Luma comes first, so that one sum serves three channels.
  one_pixel : if BUILD.pixels = 1 generate

    find_luma : process (clk) is
    begin

      if rising_edge(clk) then
        place_1 <= place;
        this_1  <= luma_of(data, 0);
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

      variable this_lens : unsigned(PART_BITS - 1 downto 0);
      variable behind    : unsigned(PART_BITS - 1 downto 0);

    begin

      if rising_edge(clk) then
        place_0   <= place;
        ahead_0   <= ahead;
        place_1   <= place_0;
        this_lens := (others => '0');
        behind    := (others => '0');

        -- Lumas take one clock and their sums another: P of both would be too long for one.
        for j in 0 to BUILD.pixels - 1 loop

          lumas_0(j) <= luma_of(data, j);
          this_lens  := this_lens + where_set(not ahead_0(j), lumas_0(j));
          behind     := behind + where_set(ahead_0(j), lumas_0(j));

        end loop;

        this_1 <= this_lens;
        next_1 <= behind;
      end if;

    end process add_pixels;

  end generate several_pixels;

  -- Behind a line's last token a tail follows as if it belonged to the next micro image.
  lens_1 <= lens_2 + 1 when tail_2 = '1' else
            place_1.lens(ADDRESS_BITS - 1 downto 0);

  add : process (clk) is

    variable so_far : unsigned(SUM_BITS - 1 downto 0);

  begin

    if rising_edge(clk) then
      so_far := resize(this_1, SUM_BITS);
      -- A micro image continues with the sum of the tokens before.
      if place_1.lens_first = '0' then
        so_far := rest_2 + this_1;
      end if;

      -- The line's sum changes only with pixels.
      if place_1.active = '1' then
        line_2 <= so_far;
        rest_2 <= so_far;
        -- Pixels that lie ahead are the beginning of the next micro image.
        if BUILD.pixels > 1 and place_1.lens_last = '1' then
          rest_2 <= resize(next_1, SUM_BITS);
        end if;
      end if;
      lens_2      <= lens_1;
      ends_2      <= place_1.active and place_1.lens_last;
      tail_2      <= place_1.active and place_1.tail;
      row_first_2 <= place_1.row_first;
      row_last_2  <= place_1.row_last;
      -- A micro image that a line's last token both begins and ends comes a clock behind the one that this token ends.
      -- The next token begins a line and ends no micro image.
      if tail_2 = '1' then
        line_2      <= rest_2;
        ends_2      <= '1';
        row_first_2 <= row_first_2;
        row_last_2  <= row_last_2;
      end if;

      lens_3     <= lens_2;
      ends_3     <= ends_2;
      row_last_3 <= row_last_2;
      -- The first line of a micro image starts its sum, so the memory need not be cleared.
      if row_first_2 = '1' then
        sum_3 <= std_logic_vector(line_2);
      else
        sum_3 <= std_logic_vector(line_2 + unsigned(above_2));
      end if;
    end if;

  end process add;

  -- A word for each micro image of a row holds the lines so far. It is written with a micro image's last pixel of a
  -- line and read a line later, so no word is read in the clock that writes it.
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

  -- The last line of a row completes the sums. They are kept in a second memory, because the next row overwrites the
  -- first one while the scan still reads.
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
