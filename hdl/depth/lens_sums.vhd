-- SPDX-License-Identifier: Apache-2.0
-- Luma of each micro image of a slice, summed over its pixels.
--
-- A register sums the pixels of a line, a memory the lines; with the last line of a row of micro images the sums go to
-- a memory of their own, where they stay until the next row is complete.
--
-- Latency: 4 clocks from the last pixel of a micro image until its sum can be read; reading takes 2.
-- Throughput: one pixel each clock.
-- Equation: sum = sum of the luma of M x M pixels; of RGB R + 2 G + B.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.sharpness_pkg.all;

entity lens_sums is
  generic (
    -- M.
    MICRO_IMAGE_SIZE : positive;
    -- Micro images of the longest line.
    LENSES : positive;
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3;
    -- Width of a channel.
    PIXEL_BITS : positive
  );
  port (
    clk : in    std_logic;
    -- A pixel, and its place.
    place : in    lens_place_t;
    data  : in    std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
    -- Address of the sum, and 2 clocks later the sum.
    read_lens : in    unsigned(bits_for(LENSES - 1) - 1 downto 0);
    sum       : out   std_logic_vector(lens_bits(MICRO_IMAGE_SIZE, CHANNELS, PIXEL_BITS) - 1 downto 0)
  );
end entity lens_sums;

architecture rtl of lens_sums is

  constant SUM_BITS     : positive := lens_bits(MICRO_IMAGE_SIZE, CHANNELS, PIXEL_BITS);
  constant ADDRESS_BITS : positive := bits_for(LENSES - 1);
  constant LUMA_BITS    : positive := PIXEL_BITS + choose(CHANNELS = 1, 0, 2);

  subtype address_t is unsigned(ADDRESS_BITS - 1 downto 0);

  function luma_of (
    pixel : std_logic_vector
  ) return unsigned is

    variable luma : unsigned(LUMA_BITS - 1 downto 0);

  begin

    luma := resize(unsigned(pixel(PIXEL_BITS - 1 downto 0)), LUMA_BITS);

    if CHANNELS = 3 then
      luma := luma + shift_left(resize(unsigned(pixel(2 * PIXEL_BITS - 1 downto PIXEL_BITS)), LUMA_BITS), 1) +
              resize(unsigned(pixel(pixel'high downto pixel'high - PIXEL_BITS + 1)), LUMA_BITS);
    end if;

    return luma;

  end function luma_of;

  -- Clocks behind a pixel are part of the names. 1: its brightness; 2: the line of the micro image so far; 3: with
  -- the lines above, at the last pixel of the line.
  signal luma_1      : unsigned(LUMA_BITS - 1 downto 0)        := (others => '0');
  signal active_1    : std_logic                               := '0';
  signal first_1     : std_logic                               := '0';
  signal ends_1      : std_logic                               := '0';
  signal ends_2      : std_logic                               := '0';
  signal ends_3      : std_logic                               := '0';
  signal final_3     : std_logic;
  signal row_first_1 : std_logic                               := '0';
  signal row_first_2 : std_logic                               := '0';
  signal row_last_1  : std_logic                               := '0';
  signal row_last_2  : std_logic                               := '0';
  signal row_last_3  : std_logic                               := '0';
  signal lens_1      : address_t                               := (others => '0');
  signal lens_2      : address_t                               := (others => '0');
  signal lens_3      : address_t                               := (others => '0');
  signal line_2      : unsigned(SUM_BITS - 1 downto 0)         := (others => '0');
  signal above_2     : std_logic_vector(SUM_BITS - 1 downto 0);
  signal sum_3       : std_logic_vector(SUM_BITS - 1 downto 0) := (others => '0');

begin

  add : process (clk) is
  begin

    if rising_edge(clk) then
      -- Brightness first, so that one sum serves three channels.
      luma_1      <= luma_of(data);
      active_1    <= place.active;
      first_1     <= place.lens_first;
      ends_1      <= place.active and place.lens_last;
      ends_2      <= ends_1;
      ends_3      <= ends_2;
      row_first_1 <= place.row_first;
      row_first_2 <= row_first_1;
      row_last_1  <= place.row_last;
      row_last_2  <= row_last_1;
      row_last_3  <= row_last_2;
      lens_1      <= place.lens(ADDRESS_BITS - 1 downto 0);
      lens_2      <= lens_1;
      lens_3      <= lens_2;

      -- Only pixels count; between two of them the sum of the line stands still.
      if active_1 = '1' then
        if first_1 = '1' then
          line_2 <= resize(luma_1, SUM_BITS);
        else
          line_2 <= line_2 + luma_1;
        end if;
      end if;

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
      ADDRESS_BITS => ADDRESS_BITS,
      WORDS        => LENSES,
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
      WIDTH        => SUM_BITS,
      ADDRESS_BITS => ADDRESS_BITS,
      WORDS        => LENSES
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
