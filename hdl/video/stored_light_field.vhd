-- SPDX-License-Identifier: Apache-2.0
-- The light field of stored_pkg as video, to show refocusing without a source.
--
-- The light field is in the middle of the frame, aligned to the frame's micro images, with black around it. If it is
-- larger than the frame it is cut off at the right and at the bottom. A memory holds a word for each micro image: two
-- colours, and for each pixel a bit that selects one of them.
--
-- Latency: 4 clocks. Throughput: one pixel each clock.
-- Equation: pixel(x, y) = colour b of micro image (i, j), b its bit M v + u, x = left + M j + u, y = top + M i + v.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.stored_pkg.all;
use work.video_pkg.all;

entity stored_light_field is
  generic (
    -- M of the refocuser; the light field must have the same.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- Size of the frame in whose middle the light field stands.
    FRAME_COLUMNS : positive range 1 to 4095;
    FRAME_ROWS    : positive range 1 to 4095
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Video timing to draw; its frames have the size above.
    timing : in    timing_t;
    -- The light field.
    video : out   video_t
  );
end entity stored_light_field;

architecture rtl of stored_light_field is

  -- The light field is not scaled, so its micro images must have the refocuser's size.
  constant M       : positive := STORED_SIZE;
  constant REFUSED : boolean  := not takes(MICRO_IMAGE_SIZE = M or not WITH_STORED,
                                           "stored_light_field: MICRO_IMAGE_SIZE must be M of the light field");

  constant LENSES  : positive := STORED_LENSES * STORED_LENS_ROWS;
  constant COLUMNS : positive := M * STORED_LENSES;
  constant ROWS    : positive := M * STORED_LENS_ROWS;

  -- First column or row of the picture in a frame.
  function first_place (
    frame   : positive;
    picture : positive
  ) return natural is
  begin

    -- Rounded down to whole micro images, so that the grid of the frame is that of the light field.
    return (larger(frame, picture) - picture) / 2 / M * M;

  end function first_place;

  constant LEFT : natural := first_place(FRAME_COLUMNS, COLUMNS);
  constant TOP  : natural := first_place(FRAME_ROWS, ROWS);

  -- Clocks from a place of the raster to its pixel: memory 2, selection 1; the output register is not counted.
  constant STEPS : positive := 3;

  -- Fields that go with a pixel: its syncs, whether it lies in the light field, and its bit in the word.

  type way_t is record
    active  : std_logic;
    h_sync  : std_logic;
    v_sync  : std_logic;
    in_area : std_logic;
    index   : natural range 0 to larger(M * M - 1, 1);
  end record way_t;

  type ways_t is array (1 to STEPS) of way_t;

  -- The first clock after a reset, which starts the raster.
  signal fresh : std_logic := '1';
  signal place : raster_t;
  -- The place is between two frames: inside the pulse of vertical sync.
  signal between : std_logic;
  -- in_area: the place is in the light field; in_rows: in its rows.
  signal in_area : std_logic;
  signal in_rows : std_logic;
  -- Column u of the pixel in its micro image; above: M v, the pixels of the micro image in the rows above; lens: the
  -- micro image; first_lens: the first micro image of its row.
  signal u          : natural range 0 to larger(M - 1, 1)      := 0;
  signal above      : natural range 0 to larger(M * M - M, 1)  := 0;
  signal lens       : natural range 0 to larger(LENSES - 1, 1) := 0;
  signal first_lens : natural range 0 to larger(LENSES - 1, 1) := 0;

  signal way   : ways_t;
  signal read  : stored_word_t;
  signal word  : stored_word_t;
  signal which : std_logic;
  signal first : std_logic_vector(27 downto 0);

  -- 5 bits red, 5 bits green, 4 bits blue as 8 bits each.
  function to_pixel (
    colour : std_logic_vector(13 downto 0)
  ) return pixel_t is
  begin

    -- The low bits repeat the high bits, so that the brightest colour is 255.
    return colour(13 downto 10) & colour(13 downto 10) & colour(9 downto 5) & colour(9 downto 7) &
           colour(4 downto 0) & colour(4 downto 2);

  end function to_pixel;

begin

  raster : entity work.raster_generator
    port map (
      clk    => clk,
      reset  => reset,
      timing => timing,
      start  => fresh,
      raster => place
    );

  between <= to_logic(place.v_sync = timing.v_sync_level);
  in_rows <= to_logic(place.row >= TOP and place.row < TOP + ROWS);
  in_area <= place.active and in_rows and to_logic(place.column >= LEFT and place.column < LEFT + COLUMNS);

  follow : process (clk) is
  begin

    if rising_edge(clk) then
      fresh <= reset;

      -- Place in the line.
      u    <= 0;
      lens <= first_lens;
      if in_area = '1' then
        -- Within the light field the number stays, and counts on between micro images; elsewhere it is that of the
        -- row's first micro image.
        lens <= lens;
        if u < M - 1 then
          u <= u + 1;
        elsif lens < LENSES - 1 then
          -- Behind the last micro image nothing is shown, so the number may stay.
          lens <= lens + 1;
        end if;
      end if;

      -- Place in the frame. It is reset in the pulse of vertical sync, so that each frame begins with the first micro
      -- image.
      if between = '1' or reset = '1' then
        above      <= 0;
        first_lens <= 0;
      elsif place.line_last = '1' and in_rows = '1' then
        above <= 0;
        -- The micro images of a row are passed M times, once for each of their lines.
        if above < M * M - M then
          above <= above + M;
        elsif first_lens < LENSES - STORED_LENSES then
          first_lens <= first_lens + STORED_LENSES;
        end if;
      end if;

      way(1)          <=
      (
        active  => place.active,
        h_sync  => place.h_sync,
        v_sync  => place.v_sync,
        in_area => in_area,
        index   => above + u
      );
      way(2 to STEPS) <= way(1 to STEPS - 1);

      if reset = '1' then
        u    <= 0;
        lens <= 0;

        for step in 1 to STEPS loop

          way(step).active <= '0';

        end loop;

      end if;
    end if;

  end process follow;

  -- The memory with a register behind it, which fits block RAM; then the bit of the pixel, then its colour.
  draw : process (clk) is

    variable colour : std_logic_vector(13 downto 0);

  begin

    if rising_edge(clk) then
      read  <= STORED_WORDS(lens);
      word  <= read;
      which <= word(way(2).index);
      first <= word(M * M + 27 downto M * M);

      colour := first(13 downto 0);
      if which = '1' then
        colour := first(27 downto 14);
      end if;

      video.active <= way(STEPS).active and not reset;
      video.h_sync <= way(STEPS).h_sync;
      video.v_sync <= way(STEPS).v_sync;
      video.pixel  <= (others => '0');
      if way(STEPS).in_area = '1' then
        video.pixel <= to_pixel(colour);
      end if;
    end if;

  end process draw;

end architecture rtl;
