-- SPDX-License-Identifier: Apache-2.0
-- Writes a line of text over the picture, and below it a ruler of the slices, each with a label.
--
-- The text is that of the current slice or output, followed by the number of errors if there are any. The ruler has a
-- field for each slice, with the current one in white; while depth is shown, the fields have the colours of the slices
-- and are its legend. Under the overlay the picture is a quarter as bright. The vertical sync marks where a frame
-- begins; place and errors are updated there.
--
-- Latency: OVERLAY_LATENCY clocks, syncs included. Throughput: one pixel each clock.
-- Equation: out = 255 where a glyph or the ruler is white, the ruler's colour in its fields, in / 4 (rounded down)
-- elsewhere in the overlay, in outside.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.hex_pkg.all;
use work.overlay_pkg.all;
use work.video_pkg.all;

entity text_overlay is
  generic (
    -- Number of slices.
    SLICES : positive range 1 to 64;
    -- For each character from the blank to the tilde: 16 lines of 8 pixels in hexadecimal.
    FONT : string;
    -- A text for each slice, for the picture all in focus, for depth, and for the unchanged input, each of TEXT_COLUMNS
    -- characters.
    TEXTS        : string;
    TEXT_COLUMNS : positive range 1 to 64;
    -- A label for each slice, of LABEL_COLUMNS characters.
    LABELS        : string;
    LABEL_COLUMNS : positive range 2 to 16;
    -- Colours of the slices, six hexadecimal digits each (red, green, blue). Of several for a slice the middle one is
    -- used. Empty if depth is never shown.
    COLOURS : string := ""
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- show: the overlay is shown; bottom: at the bottom of the picture.
    show   : in    std_logic;
    bottom : in    std_logic;
    -- Lines of the picture.
    rows : in    std_logic_vector(11 downto 0);
    -- About the coming frame: its slice; kind: 0 the slice is shown, 1 all in focus, 2 depth; raw: it is the unchanged
    -- input.
    slice : in    std_logic_vector(7 downto 0);
    kind  : in    std_logic_vector(1 downto 0);
    raw   : in    std_logic;
    -- Sum of the errors, as in the status line.
    errors : in    std_logic_vector(4 downto 0);
    -- Video in, and video out with the overlay.
    in_video  : in    video_t;
    out_video : out   video_t
  );
end entity text_overlay;

architecture rtl of text_overlay is

  -- Whether all characters of a text are in the font.
  function has_glyphs (
    text : string
  ) return boolean is
  begin

    for i in text'range loop

      if character'pos(text(i)) < FIRST_GLYPH or character'pos(text(i)) >= FIRST_GLYPH + GLYPHS then
        return false;
      end if;

    end loop;

    return true;

  end function has_glyphs;

  constant NO_FONT    : boolean := not takes(FONT'length = 2 * GLYPHS * GLYPH_ROWS and is_hex(FONT),
                                             "text_overlay: FONT must be 95 x 16 lines of two digits, 0 to 9, a to f");
  constant NO_TEXTS   : boolean := not takes(TEXTS'length = (SLICES + 3) * TEXT_COLUMNS and has_glyphs(TEXTS),
                                             "text_overlay: TEXTS must be SLICES + 3 times TEXT_COLUMNS letters");
  constant NO_LABELS  : boolean := not takes(LABELS'length = SLICES * LABEL_COLUMNS and has_glyphs(LABELS),
                                             "text_overlay: LABELS must be SLICES times LABEL_COLUMNS letters");
  constant NO_COLOURS : boolean := not takes(COLOURS'length mod (6 * SLICES) = 0 and is_hex(COLOURS),
                                             "text_overlay: COLOURS must be six digits, 0 to 9, a to f, a slice, or" &
                                             " several colours a slice");

  constant ENTRIES     : positive := SLICES + 3;
  constant COLUMNS     : positive := overlay_columns(SLICES, TEXT_COLUMNS, LABEL_COLUMNS);
  constant COLUMN_BITS : positive := bits_for(COLUMNS);
  constant LABEL_BASE  : positive := ENTRIES * TEXT_COLUMNS;
  constant ERROR_BASE  : positive := LABEL_BASE + SLICES * LABEL_COLUMNS;
  constant CODES       : positive := ERROR_BASE + ERROR_COLUMNS;
  constant CODE_BITS   : positive := bits_for(CODES - 1);
  constant FIELD_BITS  : positive := bits_for(SLICES);

  -- First characters of the texts in the ROM. A table takes the place of a multiplication, because TEXT_COLUMNS need
  -- not be a power of two.
  type bases_t is array (natural range 0 to ENTRIES - 1) of unsigned(CODE_BITS - 1 downto 0);

  type colours_t is array (natural range 0 to SLICES - 1) of std_logic_vector(23 downto 0);

  function make_bases return bases_t is

    variable made : bases_t;

  begin

    for i in 0 to ENTRIES - 1 loop

      made(i) := to_unsigned(i * TEXT_COLUMNS, CODE_BITS);

    end loop;

    return made;

  end function make_bases;

  function make_colours return colours_t is

    constant SHADES : natural := COLOURS'length / (6 * SLICES);
    variable digit  : natural;
    variable made   : colours_t;

  begin

    made := (others => (others => '0'));

    if SHADES > 0 then

      for i in 0 to SLICES - 1 loop

        -- The middle one of several colours stands for a slice.
        digit := 6 * (i * SHADES + SHADES / 2);
        -- The digits are red, green, blue; a pixel has blue at the left.
        made(i) := hex_byte(COLOURS, digit + 4) & hex_byte(COLOURS, digit + 2) & hex_byte(COLOURS, digit);

      end loop;

    end if;

    return made;

  end function make_colours;

  constant BASES : bases_t   := make_bases;
  constant TABLE : colours_t := make_colours;

  -- Vertical sync a clock ago; whether the overlay is shown in this frame; column of the coming pixel, and its line in
  -- the overlay; data enable a clock ago; the frame's number of errors.
  signal v_before : std_logic                    := '0';
  signal shown    : std_logic                    := '0';
  signal column   : unsigned(11 downto 0)        := (others => '0');
  signal over     : unsigned(11 downto 0)        := (others => '0');
  signal was      : std_logic                    := '0';
  signal faults   : std_logic_vector(4 downto 0) := (others => '0');

  -- Clock 1: place in the overlay.
  signal inside_1 : std_logic                            := '0';
  signal ruler_1  : std_logic                            := '0';
  signal labels_1 : std_logic                            := '0';
  signal x_1      : unsigned(2 downto 0)                 := (others => '0');
  signal y_1      : unsigned(3 downto 0)                 := (others => '0');
  signal place_1  : unsigned(COLUMN_BITS - 1 downto 0)   := (others => '0');
  signal field_1  : unsigned(FIELD_BITS - 1 downto 0)    := (others => '0');
  signal within_1 : natural range 0 to LABEL_COLUMNS - 1 := 0;

  -- Clock 2: the character.
  signal inside_2 : std_logic                        := '0';
  signal ruler_2  : std_logic                        := '0';
  signal blank_2  : std_logic                        := '0';
  signal digit_2  : std_logic_vector(1 downto 0)     := "00";
  signal x_2      : unsigned(2 downto 0)             := (others => '0');
  signal y_2      : unsigned(3 downto 0)             := (others => '0');
  signal at_2     : unsigned(CODE_BITS - 1 downto 0) := (others => '0');
  signal field_2  : std_logic_vector(23 downto 0)    := (others => '0');

  -- Clocks 3 and 4: fields wait for the character's line of pixels; clock 5: the pixel.
  signal inside_3 : std_logic                     := '0';
  signal ruler_3  : std_logic                     := '0';
  signal blank_3  : std_logic                     := '0';
  signal x_3      : unsigned(2 downto 0)          := (others => '0');
  signal field_3  : std_logic_vector(23 downto 0) := (others => '0');
  signal inside_4 : std_logic                     := '0';
  signal ruler_4  : std_logic                     := '0';
  signal blank_4  : std_logic                     := '0';
  signal x_4      : unsigned(2 downto 0)          := (others => '0');
  signal line_4   : std_logic_vector(7 downto 0);
  signal field_4  : std_logic_vector(23 downto 0) := (others => '0');

  -- The pixel, by the number of clocks behind the input; a reset clears only its data enable.
  type videos_t is array (natural range 1 to OVERLAY_LATENCY - 1) of video_t;

  signal video_at : videos_t := (others => NO_VIDEO);

begin

  --------------------------------------------------------------------------------------------------
  -- Place of the pixel.

  locate : process (clk) is

    variable least : unsigned(11 downto 0);

  begin

    if rising_edge(clk) then
      v_before <= in_video.v_sync;
      was      <= in_video.active;
      -- The column counts the pixels of the line; the blanking resets it.
      if in_video.active = '1' then
        column <= column + 1;
      else
        column <= (others => '0');
      end if;
      -- Lines are counted by their ends, so the overlay needs no raster.
      if was = '1' and in_video.active = '0' then
        over <= over + 1;
      end if;
      -- Either edge of vertical sync: polarity does not matter, and both edges lie between two pictures.
      if in_video.v_sync /= v_before then
        -- The overlay's line counts from the top of the picture, or, for the bottom, from the number of lines.
        least := to_unsigned(MARGIN, 12);
        if bottom = '1' then
          least := unsigned(rows) - (OVERLAY_ROWS + MARGIN);
        end if;
        -- Changes take effect between frames, so that no text is torn.
        shown <= show;
        -- The overlay's first line is line 0. Lines above it wrap round to large numbers and are outside.
        over <= 0 - least;

        faults <= errors;
      end if;
      if reset = '1' then
        shown <= '0';
      end if;
    end if;

  end process locate;

  --------------------------------------------------------------------------------------------------
  -- Clock 1.

  find_place : process (clk) is

    variable x : unsigned(11 downto 0);

  begin

    if rising_edge(clk) then
      -- Left of the margin this wraps round to a number beyond every overlay.
      x        := column - MARGIN;
      inside_1 <= shown and in_video.active and to_logic(over < OVERLAY_ROWS and x < COLUMNS * GLYPH_COLUMNS);
      ruler_1  <= to_logic(over(5 downto 0) >= 2 * GLYPH_ROWS);
      labels_1 <= to_logic(over(5 downto 0) >= GLYPH_ROWS);
      x_1      <= x(2 downto 0);
      y_1      <= over(3 downto 0);
      place_1  <= x(COLUMN_BITS + 2 downto 3);
      -- The field of a pixel is counted, because the width of a label need not be a power of two. The count goes on in
      -- the blanking and is reset here in each line.
      if column = MARGIN then
        field_1  <= (others => '0');
        within_1 <= 0;
      elsif x(2 downto 0) = 0 then
        if within_1 = LABEL_COLUMNS - 1 then
          within_1 <= 0;
          -- Behind the last field the count stays.
          if field_1 /= SLICES then
            field_1 <= field_1 + 1;
          end if;
        else
          within_1 <= within_1 + 1;
        end if;
      end if;
    end if;

  end process find_place;

  --------------------------------------------------------------------------------------------------
  -- Clock 2.

  find_character : process (clk) is

    variable entry  : natural range 0 to ENTRIES - 1;
    variable number : natural range 0 to 255;

  begin

    if rising_edge(clk) then
      -- A number beyond the set has no text; the first text stands in for it.
      number := to_integer(unsigned(slice));
      entry  := 0;
      if raw = '1' then
        entry := SLICES + 2;
      elsif kind = "10" then
        entry := SLICES + 1;
      elsif kind = "01" then
        entry := SLICES;
      elsif number < SLICES then
        entry := number;
      end if;

      inside_2 <= inside_1;
      ruler_2  <= ruler_1;
      x_2      <= x_1;
      y_2      <= y_1;
      blank_2  <= '0';
      digit_2  <= "00";
      -- The ruler lies in the labels' columns but shows no character.
      if labels_1 = '1' then
        at_2    <= to_unsigned(LABEL_BASE, CODE_BITS) + resize(place_1, CODE_BITS);
        blank_2 <= to_logic(place_1 >= SLICES * LABEL_COLUMNS);
      elsif place_1 < TEXT_COLUMNS then
        at_2 <= BASES(entry) + resize(place_1, CODE_BITS);
      else
        -- Behind the text come the errors, whose ROM begins where column TEXT_COLUMNS of the text would be.
        at_2    <= to_unsigned(ERROR_BASE - TEXT_COLUMNS, CODE_BITS) + resize(place_1, CODE_BITS);
        blank_2 <= to_logic(unsigned(faults) = 0) or to_logic(place_1 >= TEXT_COLUMNS + ERROR_COLUMNS);
        digit_2 <= to_logic(place_1 = TEXT_COLUMNS + ERROR_COLUMNS - 2) &
                   to_logic(place_1 = TEXT_COLUMNS + ERROR_COLUMNS - 1);
      end if;

      -- The ruler: grey fields, white for the current slice; for depth the slices' colours; gaps between fields.
      field_2 <= x"404040";
      if raw = '0' then
        if kind = "10" then

          for i in 0 to SLICES - 1 loop

            -- Each field has a colour of its own, so the slice is not compared here.
            if field_1 = i then
              field_2 <= TABLE(i);
            end if;

          end loop;

        elsif kind = "01" or resize(field_1, 8) = unsigned(slice) then
          -- The current slice is white; the picture all in focus is made of all slices.
          field_2 <= x"FFFFFF";
        end if;
      end if;
      -- A field ends with two black columns, and the ruler ends with its last field.
      if field_1 = SLICES or (within_1 = LABEL_COLUMNS - 1 and x_1 >= GLYPH_COLUMNS - 2) then
        field_2 <= x"000000";
      end if;
    end if;

  end process find_character;

  --------------------------------------------------------------------------------------------------
  -- Clocks 3 and 4.

  lines : entity work.glyph_lines
    generic map (
      FONT        => FONT,
      TEXTS       => TEXTS,
      LABELS      => LABELS,
      FIRST_LABEL => LABEL_BASE,
      FIRST_ERROR => ERROR_BASE
    )
    port map (
      clk    => clk,
      errors => faults,
      place  => at_2,
      digit  => digit_2,
      row    => y_2,
      line   => line_4
    );

  -- Fields of the pixel wait for its character, two clocks of glyph_lines.
  follow : process (clk) is
  begin

    if rising_edge(clk) then
      inside_3 <= inside_2;
      ruler_3  <= ruler_2;
      blank_3  <= blank_2;
      x_3      <= x_2;
      field_3  <= field_2;
      inside_4 <= inside_3;
      ruler_4  <= ruler_3;
      blank_4  <= blank_3;
      x_4      <= x_3;
      field_4  <= field_3;
    end if;

  end process follow;

  --------------------------------------------------------------------------------------------------
  -- Clock 5.

  -- The video waits as long as the character and its line of pixels take.
  delay_video : process (clk) is
  begin

    if rising_edge(clk) then
      video_at <= in_video & video_at(1 to OVERLAY_LATENCY - 2);
      if reset = '1' then

        for i in video_at'range loop

          video_at(i).active <= '0';

        end loop;

      end if;
    end if;

  end process delay_video;

  mix : process (clk) is

    variable bits : std_logic_vector(7 downto 0);
    variable last : video_t;

  begin

    if rising_edge(clk) then
      last      := video_at(OVERLAY_LATENCY - 1);
      out_video <= last;
      if inside_4 = '1' then
        -- A shift brings the bit of the pixel's column to the left end.
        bits := std_logic_vector(shift_left(unsigned(line_4), to_integer(x_4)));
        if ruler_4 = '1' then
          out_video.pixel <= field_4;
        elsif blank_4 = '0' and bits(7) = '1' then
          out_video.pixel <= x"FFFFFF";
        else
          -- A quarter of each colour.
          out_video.pixel <= "00" & last.pixel(23 downto 18) & "00" & last.pixel(15 downto 10) &
                             "00" & last.pixel(7 downto 2);
        end if;
      end if;
      if reset = '1' then
        out_video.active <= '0';
      end if;
    end if;

  end process mix;

end architecture rtl;
