-- SPDX-License-Identifier: Apache-2.0
-- A small synthetic light field as video, to see refocusing without any source.
--
-- Three upright bands, each a chequered plane at a depth of its own: its shift a' is the one at which the
-- refocuser shows it sharp, while it blurs the others. Pixel u of micro image j sees the plane at
-- M * j + u * a', in both dimensions.
--
-- Latency: 2 clocks from the raster. Throughput: one pixel each clock.
-- Equation: pixel(x, y) is light where bit CELL of (M j + u a') and of (M i + v a') differ, x = M j + u,
--   y = M i + v, a' by band.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.video_pkg.all;

entity light_field_pattern is
  generic (
    -- M: pixels a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- a' of the bands.
    LEFT_SHIFT   : integer range -4096 to 4096;
    MIDDLE_SHIFT : integer range -4096 to 4096;
    RIGHT_SHIFT  : integer range -4096 to 4096;
    -- Columns where the second and the third band begin.
    MIDDLE_BEGIN : positive;
    RIGHT_BEGIN  : positive;
    -- A cell of the chequers has 2**CELL pixels.
    CELL : natural range 0 to 11 := 3
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Video timing to draw, see video_pkg.
    timing : in    std_logic_vector(TIMING_BITS - 1 downto 0);
    -- Video: red in the low bits of pixel.
    active : out   std_logic;
    h_sync : out   std_logic;
    v_sync : out   std_logic;
    pixel  : out   std_logic_vector(23 downto 0)
  );
end entity light_field_pattern;

architecture rtl of light_field_pattern is

  constant BANDS : positive := 3;

  type shifts_t is array (0 to BANDS - 1) of integer;

  type colours_t is array (0 to BANDS - 1) of std_logic_vector(23 downto 0);

  type places_t is array (0 to BANDS - 1) of signed(COUNT_BITS downto 0);

  constant SHIFTS : shifts_t := (LEFT_SHIFT, MIDDLE_SHIFT, RIGHT_SHIFT);
  -- Blue, green, red.
  constant LIGHT : colours_t := (x"40C0FF", x"60FF60", x"FFA060");
  constant DARK  : colours_t := (x"200840", x"084008", x"401008");

  subtype phase_t is natural range 0 to larger(MICRO_IMAGE_SIZE - 1, 1);

  signal mode          : timing_t;
  signal fresh         : std_logic := '1';
  signal column        : count_t;
  signal raster_active : std_logic;
  signal raster_last   : std_logic;
  signal raster_h      : std_logic;
  signal raster_v      : std_logic;
  signal u             : phase_t   := 0;
  signal v             : phase_t   := 0;
  signal places_x      : places_t  := (others => (others => '0'));
  signal places_y      : places_t  := (others => (others => '0'));

  -- The place that the next pixel sees.
  function next_place (
    place : signed(COUNT_BITS downto 0);
    phase : natural;
    shift : integer
  ) return signed is
  begin

    if phase = MICRO_IMAGE_SIZE - 1 then
      return place + (MICRO_IMAGE_SIZE - (MICRO_IMAGE_SIZE - 1) * shift);
    end if;

    return place + shift;

  end function next_place;

  function next_phase (
    phase : natural
  ) return natural is
  begin

    if phase = MICRO_IMAGE_SIZE - 1 then
      return 0;
    end if;

    return phase + 1;

  end function next_phase;

begin

  mode <= to_timing(timing);

  raster : entity work.raster_generator
    port map (
      clk         => clk,
      reset       => reset,
      timing      => timing,
      start       => fresh,
      running     => open,
      column      => column,
      row         => open,
      active      => raster_active,
      frame_first => open,
      line_last   => raster_last,
      h_sync      => raster_h,
      v_sync      => raster_v
    );

  draw : process (clk) is

    variable band : natural range 0 to BANDS - 1;

  begin

    if rising_edge(clk) then
      fresh  <= reset;
      active <= raster_active;
      h_sync <= raster_h;
      v_sync <= raster_v;

      -- Places in the line and in the frame.
      if raster_active = '1' then
        u <= next_phase(u);
      else
        u <= 0;
      end if;
      if raster_v = mode.v_sync_level then
        v <= 0;
      elsif raster_last = '1' then
        v <= next_phase(v);
      end if;

      for b in 0 to BANDS - 1 loop

        if raster_active = '1' then
          places_x(b) <= next_place(places_x(b), u, SHIFTS(b));
        else
          places_x(b) <= (others => '0');
        end if;
        if raster_v = mode.v_sync_level then
          places_y(b) <= (others => '0');
        elsif raster_last = '1' then
          places_y(b) <= next_place(places_y(b), v, SHIFTS(b));
        end if;

      end loop;

      band := 0;
      if column >= RIGHT_BEGIN then
        band := 2;
      elsif column >= MIDDLE_BEGIN then
        band := 1;
      end if;
      pixel <= (others => '0');
      if raster_active = '1' then
        if places_x(band)(CELL) /= places_y(band)(CELL) then
          pixel <= LIGHT(band);
        else
          pixel <= DARK(band);
        end if;
      end if;

      if reset = '1' then
        active   <= '0';
        u        <= 0;
        v        <= 0;
        places_x <= (others => (others => '0'));
        places_y <= (others => (others => '0'));
      end if;
    end if;

  end process draw;

end architecture rtl;
