-- SPDX-License-Identifier: Apache-2.0
-- One row of pixels through the row module, for its timing diagrams.
--
-- Reads input.bin in the working directory: one 32-bit little-endian word for each of PIXELS pixels. A
-- pixel goes in with each clock; pixels of value 0, which are no part of the row, push the last sums
-- out. The simulation ends when as many sums as pixels have come out.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.token_pkg.all;

entity module_bench is
  generic (
    MICRO_IMAGE_SIZE : positive := 3;
    SHIFTS           : string   := "1";
    HOLD             : boolean  := false;
    PIXELS           : positive := 1;
    CLOCK_PERIOD_NS  : positive := 60
  );
end entity module_bench;

architecture test of module_bench is

  constant CLOCK_PERIOD : time     := CLOCK_PERIOD_NS * 1 ns;
  constant PIXEL_MAX    : positive := 255;
  constant PIXEL_BITS   : positive := bits_for(PIXEL_MAX);
  -- The text's arithmetic: products are rounded to whole grey levels.
  constant PRODUCT_MAX : positive := scaled_quotient(PIXEL_MAX, 0, MICRO_IMAGE_SIZE);

  type words_t is file of integer;

  signal clk     : std_logic                                 := '0';
  signal reset   : std_logic                                 := '1';
  signal running : boolean                                   := true;
  signal pixel   : std_logic_vector(PIXEL_BITS - 1 downto 0) := (others => '0');
  -- The fields of the token by themselves, as waveforms show no records. Its pixel says whether the step takes a pixel
  -- of the row.
  signal strobe    : std_logic := '0';
  signal first     : std_logic := '0';
  signal is_pixel  : std_logic := '0';
  signal token     : token_t;
  signal out_pixel : std_logic_vector(PIXEL_BITS - 1 downto 0);
  signal out_token : token_t;
  signal valid     : std_logic;

begin

  reset <= '0' after 2 * CLOCK_PERIOD;
  token <= (strobe, is_pixel, first, '0', '0', '0', '0', (others => '0'));
  valid <= out_token.strobe and out_token.pixel;

  stage : entity work.fir_stage
    generic map (
      GEOMETRY       => geometry_of("module_bench", MICRO_IMAGE_SIZE, SHIFTS, false),
      SIZES          =>
      (
        data_bits   => PIXEL_BITS,
        result_bits => PIXEL_BITS,
        box         => MICRO_IMAGE_SIZE,
        stored      => true,
        scale_bits  => 0,
        product_max => PRODUCT_MAX,
        sum_max     => MICRO_IMAGE_SIZE * PRODUCT_MAX,
        drop_bits   => 0
      ),
      HOLD           => HOLD,
      LANES          => 1,
      BROADCAST_TAPS => 0
    )
    port map (
      clk       => clk,
      reset     => reset,
      token     => token,
      data      => pixel,
      out_token => out_token,
      out_data  => out_pixel
    );

  -- No pulse of no width at the end, as stopping a concurrent assignment would leave.
  pixel_clock : process is
  begin

    while running loop

      wait for CLOCK_PERIOD / 2;
      clk <= '1';
      wait for CLOCK_PERIOD / 2;
      clk <= '0';

    end loop;

    wait;

  end process pixel_clock;

  drive : process (clk) is

    file     input_file : words_t open read_mode is "input.bin";
    variable word       : integer;
    variable given      : natural := 0;
    variable received   : natural := 0;

  begin

    if rising_edge(clk) and reset = '0' then
      -- Behind the row zeros push the sums out.
      word     := 0;
      is_pixel <= '0';
      if given < PIXELS then
        read(input_file, word);
        is_pixel <= '1';
      end if;
      pixel  <= std_logic_vector(to_unsigned(word, PIXEL_BITS));
      strobe <= '1';
      first  <= '0';
      if given = 0 then
        first <= '1';
      end if;
      given := given + 1;
      if valid = '1' then
        received := received + 1;
      end if;
      running <= received < PIXELS;
    end if;

  end process drive;

end architecture test;
