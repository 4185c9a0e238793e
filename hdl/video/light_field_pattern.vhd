-- SPDX-License-Identifier: Apache-2.0
-- A small synthetic light field as video, to show refocusing without a source.
--
-- Three upright bands, each a chequered plane at a depth of its own. The refocuser shows a band sharp at the band's
-- shift a' and blurs the others. Pixel u of micro image j sees the plane at M * j + u * a', in both dimensions.
--
-- Latency: 2 clocks. Throughput: one pixel each clock.
-- Equation: pixel(x, y) is light where bit CELL of (M j + u a') and of (M i + v a') differ, x = M j + u, y = M i + v,
-- with the band's a'.

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
    -- The shift a' of each band.
    LEFT_SHIFT   : integer range -4096 to 4096;
    MIDDLE_SHIFT : integer range -4096 to 4096;
    RIGHT_SHIFT  : integer range -4096 to 4096;
    -- Columns where the second and the third band begin.
    MIDDLE_BEGIN : positive;
    RIGHT_BEGIN  : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Video timing to draw; must be constant.
    timing : in    timing_t;
    -- The pattern.
    video : out   video_t
  );
end entity light_field_pattern;

architecture rtl of light_field_pattern is

  -- A cell of the chequers has 2**CELL pixels.
  constant CELL : natural range 0 to 11 := 3;

  constant BANDS : positive := 3;

  type shifts_t is array (0 to BANDS - 1) of integer;

  type colours_t is array (0 to BANDS - 1) of pixel_t;

  type places_t is array (0 to BANDS - 1) of signed(COUNT_BITS downto 0);

  constant SHIFTS : shifts_t := (LEFT_SHIFT, MIDDLE_SHIFT, RIGHT_SHIFT);
  -- Colours of the bands; a word has blue, green, red from the left.
  constant LIGHT : colours_t := (x"40C0FF", x"60FF60", x"FFA060");
  constant DARK  : colours_t := (x"200840", x"084008", x"401008");

  subtype phase_t is natural range 0 to larger(MICRO_IMAGE_SIZE - 1, 1);

  -- The first clock after a reset, which starts the raster.
  signal fresh : std_logic := '1';
  signal place : raster_t;
  -- The place is between two frames: inside the pulse of vertical sync.
  signal between : std_logic;
  -- Pixel (v, u) of its micro image, and the places on the three planes that it sees.
  signal u        : phase_t  := 0;
  signal v        : phase_t  := 0;
  signal places_x : places_t := (others => (others => '0'));
  signal places_y : places_t := (others => (others => '0'));

  -- The place on a plane that the next pixel sees.
  function next_place (
    from  : signed(COUNT_BITS downto 0);
    phase : natural;
    shift : integer
  ) return signed is
  begin

    -- From a micro image's last pixel to the next one's first: back by the steps of its pixels, and on by a micro
    -- image.
    if phase = MICRO_IMAGE_SIZE - 1 then
      return from + (MICRO_IMAGE_SIZE - (MICRO_IMAGE_SIZE - 1) * shift);
    end if;

    return from + shift;

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

  raster : entity work.raster_generator
    port map (
      clk    => clk,
      reset  => reset,
      timing => timing,
      start  => fresh,
      raster => place
    );

  -- The counters of a frame are reset while vertical sync is active, in whichever lines that is.
  between <= to_logic(place.v_sync = timing.v_sync_level);

  draw : process (clk) is

    variable band : natural range 0 to BANDS - 1;

  begin

    if rising_edge(clk) then
      -- The raster begins a clock behind the reset; the places are cleared by then.
      fresh <= reset;

      -- Places in the line and in the frame.
      if place.active = '1' then
        u <= next_phase(u);
      else
        u <= 0;
      end if;
      if between = '1' then
        v <= 0;
      elsif place.line_last = '1' then
        v <= next_phase(v);
      end if;

      for b in 0 to BANDS - 1 loop

        if place.active = '1' then
          -- Each band lies at a depth of its own: its place moves by another step from pixel to pixel.
          places_x(b) <= next_place(places_x(b), u, SHIFTS(b));
        else
          places_x(b) <= (others => '0');
        end if;
        if between = '1' then
          places_y(b) <= (others => '0');
        elsif place.line_last = '1' then
          places_y(b) <= next_place(places_y(b), v, SHIFTS(b));
        end if;

      end loop;

      -- The column selects the band, so bands are upright strips and all three are in one picture.
      band := 0;
      if place.column >= RIGHT_BEGIN then
        band := 2;
      elsif place.column >= MIDDLE_BEGIN then
        band := 1;
      end if;

      video.active <= place.active;
      video.h_sync <= place.h_sync;
      video.v_sync <= place.v_sync;
      video.pixel  <= (others => '0');
      if place.active = '1' then
        -- A chessboard has edges in both directions, which shows wrong focus at once.
        if places_x(band)(CELL) /= places_y(band)(CELL) then
          video.pixel <= LIGHT(band);
        else
          video.pixel <= DARK(band);
        end if;
      end if;

      if reset = '1' then
        u        <= 0;
        v        <= 0;
        places_x <= (others => (others => '0'));
        places_y <= (others => (others => '0'));

        video.active <= '0';
      end if;
    end if;

  end process draw;

end architecture rtl;
