-- SPDX-License-Identifier: Apache-2.0
-- The places of a token's pixels in their micro images, and whether these belong to the picture.
--
-- Latency: 1 clock. Throughput: one token each clock.
-- Equation: lens = column / M, ahead = (column / M > lens of the token's first pixel), row_first, row_last = (line mod
--   M = 0, M - 1), column and line counted from the first pixel of a line and of a frame.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.token_pkg.all;
use work.index_pkg.all;
use work.sharpness_pkg.all;

entity lens_place is
  generic (
    -- Sizes of sharpness_index.
    BUILD : index_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Lines of the picture; lines below it do not count. Used with CROPPED only.
    rows : in    std_logic_vector(15 downto 0);
    -- A token and the slices of its pixels; and which pixels a line's last token has.
    token      : in    token_t;
    token_data : in    std_logic_vector(BUILD.pixels * BUILD.stack_width - 1 downto 0);
    line_end   : in    std_logic_vector(BUILD.pixels - 1 downto 0);
    -- The token, with image only inside the picture; its place; its slices, 0 below the picture and behind a line's
    -- end.
    placed : out   token_t;
    place  : out   lens_place_t;
    data   : out   std_logic_vector(BUILD.pixels * BUILD.stack_width - 1 downto 0);
    -- Which pixels of the token lie in the micro image behind that of its first pixel.
    ahead : out   std_logic_vector(BUILD.pixels - 1 downto 0)
  );
end entity lens_place;

architecture rtl of lens_place is

  constant M : positive range 2 to 128 := BUILD.micro_image_size;
  constant P : positive                := BUILD.pixels;

  -- Column and micro image of the token's first pixel.
  signal token_1 : token_t;
  -- Which pixels of the last token with pixels belong to its line. Kept between tokens, so that a micro image's number
  -- never exceeds those of the longest line.
  signal belongs_1    : std_logic_vector(P - 1 downto 0)                  := (others => '0');
  signal column_phase : natural range 0 to M - 1                          := 0;
  signal line_phase   : natural range 0 to M - 1                          := 0;
  signal lens_now     : unsigned(bits_for(BUILD.lenses - 1) - 1 downto 0) := (others => '0');
  signal line_number  : unsigned(15 downto 0)                             := (others => '0');
  signal inside_now   : std_logic                                         := '0';

begin

  count : process (clk) is

    variable next_phase : natural range 0 to M - 1;
    variable next_line  : unsigned(15 downto 0);
    variable in_picture : std_logic;

  begin

    if rising_edge(clk) then
      place.active <= token.strobe and token.pixel;
      token_1      <= token;
      if token.strobe = '1' and token.pixel = '1' then
        in_picture := inside_now;
        if token.line_first = '1' then
          -- Lines are counted here because frames may have lines below the picture (CROPPED), which tokens do not show.
          next_line := line_number + 1;
          if token.frame_first = '1' then
            next_line := (others => '0');
          end if;
          line_number  <= next_line;
          in_picture   := token.image and to_logic(not BUILD.cropped or next_line < unsigned(rows));
          inside_now   <= in_picture;
          column_phase <= 0;
          lens_now     <= (others => '0');
          next_phase   := 0;
          if token.frame_first = '0' and line_phase < M - 1 then
            next_phase := line_phase + 1;
          end if;
          line_phase <= next_phase;
          -- Decided with the first line of a row of micro images and kept for the row: a picture that ends within a row
          -- of micro images ends with that row.
          if next_phase = 0 then
            place.row_live   <= in_picture;
            place.row_starts <= in_picture and token.frame_first;
          end if;
        elsif column_phase >= M - P then
          -- P is at most M, so a token ends at most one micro image.
          column_phase <= column_phase - (M - P);
          lens_now     <= lens_now + 1;
        else
          column_phase <= column_phase + P;
        end if;
        belongs_1 <= (others => '1');
        if token.line_last = '1' then
          belongs_1 <= line_end;
        end if;
        -- Lines below the picture are no image lines from here on.
        token_1.image <= in_picture;
        data          <= in_line(token_data, BUILD.stack_width, token, line_end);
        -- Zeros below the picture, so that it has no sharpness there.
        if BUILD.cropped and in_picture = '0' then
          data <= (others => '0');
        end if;
      end if;
      if reset = '1' then
        place.active <= '0';
      end if;
    end if;

  end process count;

  -- The first pixel's micro image may end within this token.
  place.lens_first <= '1' when column_phase = 0 else
                      '0';
  place.lens_last  <= '1' when column_phase >= M - P or token_1.line_last = '1' else
                      '0';
  place.row_first  <= '1' when line_phase = 0 else
                      '0';
  place.row_last   <= '1' when line_phase = M - 1 else
                      '0';

  placed     <= token_1;
  place.lens <= resize(lens_now, 12);

  find_ahead : process (token_1, belongs_1, column_phase, lens_now) is

    -- A column is ahead if it lies beyond the border of a micro image; beyond the line's end there are none.
    variable is_ahead : std_logic;
    variable any      : std_logic;

  begin

    -- The first pixel lies in its own micro image.
    any      := '0';
    ahead(0) <= '0';

    for j in 1 to P - 1 loop

      is_ahead := to_logic(column_phase >= M - j) and belongs_1(j);
      any      := any or is_ahead;
      ahead(j) <= is_ahead;

    end loop;

    -- A line whose last token reaches into a further micro image has one micro image more than the first pixel's number
    -- says.
    place.tail      <= token_1.line_last and any;
    place.last_lens <= resize(lens_now, 12);

    if any = '1' then
      place.last_lens <= resize(lens_now, 12) + 1;
    end if;

  end process find_ahead;

end architecture rtl;
