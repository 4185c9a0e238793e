-- SPDX-License-Identifier: Apache-2.0
-- Interpolates the colours of a filter mosaic (Bayer) in a window of 3 x 3 pixels, on the tokens of a stream shell.
--
-- A memory holds the pixels of the last two lines for each column. A token of a line gives the window of the line
-- before, so a frame's last line comes out with the first line of the next frame or with a flush line, and a line's
-- last pixel comes out with the next token. Pixels are mirrored at the borders; a single line or column stands in for
-- its neighbours.
--
-- Latency: a line, a token and 5 clocks. Throughput: one pixel each clock.
-- Equation: plenofir.camera.resampling.interpolate_mosaic.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.token_pkg.all;

entity mosaic_engine is
  generic (
    -- Longest line in pixels.
    MAX_COLUMNS : positive;
    -- Width of a pixel.
    PIXEL_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Line and column, 0 or 1, of the red pixel in the first 2 x 2 pixels.
    red_line   : in    std_logic;
    red_column : in    std_logic;
    -- Tokens and their pixels.
    token      : in    token_t;
    token_data : in    std_logic_vector(PIXEL_BITS - 1 downto 0);
    -- Results: red in the low bits, then green, blue.
    result      : out   result_t;
    result_data : out   std_logic_vector(3 * PIXEL_BITS - 1 downto 0)
  );
end entity mosaic_engine;

architecture rtl of mosaic_engine is

  constant COLUMN_BITS : positive := bits_for(MAX_COLUMNS - 1);

  subtype pixel_t is unsigned(PIXEL_BITS - 1 downto 0);

  subtype sum_t is unsigned(PIXEL_BITS + 1 downto 0);

  subtype column_t is unsigned(COLUMN_BITS - 1 downto 0);

  -- Three pixels of a column; used: there is a pixel; first: the first of its line; start: in the first line of its
  -- frame.
  type pixels_t is record
    above  : pixel_t;
    middle : pixel_t;
    below  : pixel_t;
    used   : std_logic;
    first  : std_logic;
    start  : std_logic;
    -- Whether the line, and the column, have even numbers.
    even_line   : std_logic;
    even_column : std_logic;
  end record pixels_t;

  -- Means of two and of four values from their sums, rounded.
  function half (
    sum : sum_t
  ) return std_logic_vector is
  begin

    return std_logic_vector(resize(shift_right(sum + 1, 1), PIXEL_BITS));

  end function half;

  function quarter (
    sum : sum_t
  ) return std_logic_vector is

    variable rounded : unsigned(PIXEL_BITS + 2 downto 0);

  begin

    -- One bit more than the sum of four, because adding the half may overflow.
    rounded := resize(sum, PIXEL_BITS + 3) + 2;

    return std_logic_vector(resize(shift_right(rounded, 2), PIXEL_BITS));

  end function quarter;

  function two (
    a : pixel_t;
    b : pixel_t
  ) return sum_t is
  begin

    return resize(a, PIXEL_BITS + 2) + b;

  end function two;

  -- Column of the next pixel, of this one, and of the pixels one and two clocks back.
  signal column     : column_t                                  := (others => '0');
  signal column_now : column_t;
  signal column_1   : column_t                                  := (others => '0');
  signal column_2   : column_t                                  := (others => '0');
  signal token_1    : token_t;
  signal token_2    : token_t;
  signal data_1     : std_logic_vector(PIXEL_BITS - 1 downto 0) := (others => '0');
  signal data_2     : std_logic_vector(PIXEL_BITS - 1 downto 0) := (others => '0');
  -- The two lines above the column, from the memory, and the word to write back.
  signal above        : std_logic_vector(2 * PIXEL_BITS - 1 downto 0);
  signal above_new    : std_logic_vector(2 * PIXEL_BITS - 1 downto 0);
  signal read_enable  : std_logic;
  signal write_enable : std_logic;

  -- About lines: image_line: the tokens' line is an image line; before_: the same about the line before, and whether
  -- that is a frame's first or has an even number.
  signal image_line   : std_logic := '0';
  signal before_image : std_logic;
  signal before_first : std_logic;
  signal first_line   : std_logic;
  signal before_even  : std_logic;
  signal line_even    : std_logic;

  -- The last two columns.
  signal centre : pixels_t;
  signal left   : pixels_t;

  -- Clock 3: the window of a pixel.
  signal valid_3    : std_logic := '0';
  signal start_3    : std_logic := '0';
  signal last_3     : std_logic := '0';
  signal red_line_3 : std_logic := '0';
  signal green_3    : std_logic := '0';
  signal middle_3   : pixel_t   := (others => '0');
  signal left_3     : pixels_t;
  signal right_3    : pixels_t;
  signal centre_3   : pixels_t;
  -- Clock 4: sums.
  signal valid_4    : std_logic := '0';
  signal start_4    : std_logic := '0';
  signal last_4     : std_logic := '0';
  signal red_line_4 : std_logic := '0';
  signal green_4    : std_logic := '0';
  signal middle_4   : pixel_t   := (others => '0');
  signal across_4   : sum_t     := (others => '0');
  signal along_4    : sum_t     := (others => '0');
  signal cross_4    : sum_t     := (others => '0');
  signal corners_4  : sum_t     := (others => '0');

begin

  -- The first pixel of a line always has column 0, wherever the line before has ended.
  column_now <= (others => '0') when token.line_first = '1' else
                column;
  -- Only pixels move the memory on; empty tokens leave it unchanged.
  read_enable  <= token.strobe and token.pixel;
  write_enable <= token_2.strobe and token_2.pixel;
  above_new    <= above(PIXEL_BITS - 1 downto 0) & data_2;

  -- A word has two lines: the pixel's own and the one above it. The line that comes in is the one below.
  lines_above : entity work.ram_simple_dual_port
    generic map (
      WIDTH => 2 * PIXEL_BITS,
      WORDS => MAX_COLUMNS
    )
    port map (
      clk           => clk,
      write_enable  => write_enable,
      write_address => column_2,
      write_data    => above_new,
      read_enable   => read_enable,
      read_address  => column_now,
      read_data     => above
    );

  delay_tokens : process (clk) is
  begin

    if rising_edge(clk) then
      if token.strobe = '1' and token.pixel = '1' then
        column <= column_now + 1;
      end if;
      -- As late as the memory's word.
      column_1 <= column_now;
      column_2 <= column_1;
      token_1  <= token;
      token_2  <= token_1;
      data_1   <= token_data;
      data_2   <= data_1;
      if reset = '1' then
        token_1.strobe <= '0';
        token_2.strobe <= '0';
      end if;
    end if;

  end process delay_tokens;

  -- The new column of three pixels, whose middle lies in the line before, and the window that the column completes.
  gather : process (clk) is

    variable right     : pixels_t;
    variable now       : pixels_t;
    variable is_image  : std_logic;
    variable was_image : std_logic;
    variable was_first : std_logic;
    variable was_even  : std_logic;
    variable ends_line : std_logic;

  begin

    if rising_edge(clk) then
      valid_3 <= '0';
      if token_2.strobe = '1' then
        -- The fields of this line, and those of the line before.
        was_image := before_image;
        was_first := before_first;
        was_even  := before_even;
        if token_2.pixel = '1' and token_2.line_first = '1' then
          was_image    := image_line;
          was_first    := first_line;
          was_even     := line_even;
          before_image <= image_line;
          before_first <= first_line;
          before_even  <= line_even;
          image_line   <= token_2.image;
          first_line   <= token_2.frame_first;
          line_even    <= token_2.frame_first or not line_even;
        end if;

        now.used   := token_2.pixel and was_image;
        now.first  := token_2.line_first;
        now.start  := was_first;
        now.middle := unsigned(above(PIXEL_BITS - 1 downto 0));
        now.above  := unsigned(above(2 * PIXEL_BITS - 1 downto PIXEL_BITS));
        now.below  := unsigned(data_2);
        -- Behind a frame's last line comes the next frame or a flush line, which is no neighbour: the line above stands
        -- in for the one below.
        if token_2.frame_first = '1' or token_2.image = '0' then
          if was_first = '1' then
            -- A frame that was cut to a single line.
            now.above := now.middle;
          end if;
          now.below := now.above;
        elsif was_first = '1' then
          -- The first line has none above: the line below stands in for it.
          now.above := now.below;
        end if;
        -- The window's middle is a line back, and so are its fields.
        now.even_line   := was_even;
        now.even_column := token_2.line_first or not centre.even_column;

        -- The window of the column before. ends_line: its middle was the last column of its line.
        ends_line := not token_2.pixel or token_2.line_first;
        right     := now;
        if ends_line = '1' then
          -- The last column has none to its right: the column to its left stands in for it.
          right := left;
          if centre.first = '1' then
            -- A line of a single column.
            right := centre;
          end if;
        end if;
        left_3 <= left;
        -- The first column has none to its left: the column to its right stands in for it.
        if centre.first = '1' then
          left_3 <= right;
        end if;
        right_3  <= right;
        centre_3 <= centre;
        middle_3 <= centre.middle;
        valid_3  <= centre.used;
        start_3  <= centre.start and centre.first;
        last_3   <= ends_line;
        -- The kind of the pixel: a line with red filters, and a green filter in it.
        red_line_3 <= centre.even_line xor red_line;
        green_3    <= (centre.even_line xor red_line) xor (centre.even_column xor red_column);

        left   <= centre;
        centre <= now;
        -- Behind the last line no pixel of it remains.
        if token_2.pixel = '0' then
          centre.used <= '0';
        end if;
      end if;

      if reset = '1' then
        image_line  <= '0';
        centre.used <= '0';
        valid_3     <= '0';
      end if;
    end if;

  end process gather;

  -- Sums of the neighbours; each kind of filter needs two of them.
  add_up : process (clk) is
  begin

    if rising_edge(clk) then
      valid_4    <= valid_3;
      start_4    <= start_3;
      last_4     <= last_3;
      red_line_4 <= red_line_3;
      green_4    <= green_3;
      middle_4   <= middle_3;
      -- All sums are computed: each pixel needs two of them, and which is known only with the pixel.
      across_4  <= two(left_3.middle, right_3.middle);
      along_4   <= two(centre_3.above, centre_3.below);
      cross_4   <= two(left_3.middle, right_3.middle) + two(centre_3.above, centre_3.below);
      corners_4 <= two(left_3.above, left_3.below) + two(right_3.above, right_3.below);
      if reset = '1' then
        valid_4 <= '0';
      end if;
    end if;

  end process add_up;

  -- The colour of the pixel's own filter is taken as it came in, the others are means.
  mix : process (clk) is
  begin

    if rising_edge(clk) then
      result.valid <= valid_4;
      result.start <= start_4;
      result.last  <= last_4;
      -- A green pixel: red and blue lie along the line or across it, two of each.
      if green_4 = '1' then
        result_data(2 * PIXEL_BITS - 1 downto PIXEL_BITS) <= std_logic_vector(middle_4);
        if red_line_4 = '1' then
          result_data(PIXEL_BITS - 1 downto 0)                  <= half(across_4);
          result_data(3 * PIXEL_BITS - 1 downto 2 * PIXEL_BITS) <= half(along_4);
        else
          result_data(PIXEL_BITS - 1 downto 0)                  <= half(along_4);
          result_data(3 * PIXEL_BITS - 1 downto 2 * PIXEL_BITS) <= half(across_4);
        end if;
      else
        -- A red or blue pixel: green lies on four sides, the other colour at the four corners.
        result_data(2 * PIXEL_BITS - 1 downto PIXEL_BITS) <= quarter(cross_4);
        if red_line_4 = '1' then
          result_data(PIXEL_BITS - 1 downto 0)                  <= std_logic_vector(middle_4);
          result_data(3 * PIXEL_BITS - 1 downto 2 * PIXEL_BITS) <= quarter(corners_4);
        else
          result_data(PIXEL_BITS - 1 downto 0)                  <= quarter(corners_4);
          result_data(3 * PIXEL_BITS - 1 downto 2 * PIXEL_BITS) <= std_logic_vector(middle_4);
        end if;
      end if;

      if reset = '1' then
        result.valid <= '0';
      end if;
    end if;

  end process mix;

  result.skip  <= '0';
  result.slice <= (others => '0');

end architecture rtl;
