-- SPDX-License-Identifier: Apache-2.0
-- The picture made of the sharpest slices: pixels wait until the index of their micro image is known.
--
-- The pixels wait in a ring of lines until the index of their row of micro images has been written, which then selects
-- the slice. The output also has the depth between slices, and the pixel of a slice that was chosen for the frame.
-- Without the picture only the places of the pixels wait.
--
-- With two boxes each slice waits twice, and has its smaller box in the micro images with texture that are sharpest in
-- it: index and texture together are the number of a picture.
--
-- The pixels of a token lie in one micro image, or in two of which the first is that of the token before. The word read
-- for the token before is kept, so one read for each token is enough.
--
-- Latency: RING_LINES lines and INDEX_LATENCY + 3 clocks. Throughput: one token of all slices each clock.
-- Equation: for each pixel RING_LINES lines before: index of its micro image, data(index), data(slice); with two boxes
-- data(2 index + texture), data(2 slice + (texture and index = slice)).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.delay_pkg.all;
use work.math_pkg.all;
use work.token_pkg.all;
use work.index_pkg.all;
use work.sharpness_pkg.all;

entity sharpest_pixels is
  generic (
    -- Sizes of sharpness_index.
    BUILD : index_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token; its place; which of its pixels lie in the next micro image; its slices: those of the first pixel in the
    -- low bits, the first slice lowest; and which pixels a line's last token has.
    token    : in    token_t;
    place    : in    lens_place_t;
    ahead    : in    std_logic_vector(BUILD.pixels - 1 downto 0);
    data     : in    std_logic_vector(BUILD.pixels * BUILD.stack_width - 1 downto 0);
    line_end : in    std_logic_vector(BUILD.pixels - 1 downto 0);
    -- index_write: the index of a micro image comes; the micro image's number, its index, whether it has texture (used
    -- with two boxes only), its depth.
    index_write    : in    std_logic;
    index_lens     : in    unsigned(bits_for(BUILD.lenses - 1) - 1 downto 0);
    index          : in    unsigned(bits_for(BUILD.slices - 1) - 1 downto 0);
    index_textured : in    std_logic;
    index_depth    : in    depth_t;
    -- Pixels of the picture, and the slice that was chosen for their frame.
    result : out   result_t;
    -- For each pixel, from the low bits: the pixel of its sharpest slice, the index, the depth, the pixel of the chosen
    -- slice. Zeros behind a line's last pixel.
    out_data : out   std_logic_vector(out_bits(BUILD) - 1 downto 0)
  );
end entity sharpest_pixels;

architecture rtl of sharpest_pixels is

  constant P          : positive := BUILD.pixels;
  constant WIDTH      : positive := BUILD.pixel_width;
  constant LENS_BITS  : positive := bits_for(BUILD.lenses - 1);
  constant INDEX_BITS : positive := bits_for(BUILD.slices - 1);
  constant STACK_BITS : positive := P * BUILD.stack_width;
  -- A word of the index memory: the number of a picture, which is the index and below it, with two boxes, the texture;
  -- above it the depth.
  constant BOX_BITS    : natural  := BUILD.boxes - 1;
  constant NUMBER_BITS : positive := INDEX_BITS + BOX_BITS;
  constant FOUND_BITS  : positive := NUMBER_BITS + choose(BUILD.between, 2 * FRACTION_BITS, 0);
  constant WORD_BITS   : positive := pixel_word_bits(WIDTH, BUILD.between, BUILD.chosen_too, BUILD.picture);
  -- Width of the pixel of the sharpest slice.
  constant PICTURE_BITS : natural  := choose(BUILD.picture, WIDTH, 0);
  constant RING_WORDS   : positive := BUILD.ring_lines * BUILD.tokens;
  constant RING_BITS    : positive := bits_for(RING_WORDS - 1);

  -- Clocks that a pixel waits in front of the ring.
  constant IN_FRONT : positive := BUILD.index_latency - 2;
  -- Clocks behind the ring: its address, its word, the selection.
  constant BEHIND : positive := 3;

  type lenses_t is array (natural range <>) of unsigned(LENS_BITS - 1 downto 0);

  type parts_t is array (natural range <>) of std_logic_vector(P - 1 downto 0);

  -- Pixels wait twice: a few clocks until the scan that their row begins is ahead of them, then whole lines in the ring
  -- until the index is known. The last of a token's micro images is looked up; first_at marks the pixels that lie in
  -- the one before.
  signal token_at : tokens_t(1 to IN_FRONT + 1) := (others => NO_TOKEN);
  signal lens_at  : lenses_t(1 to IN_FRONT + 2) := (others => (others => '0'));
  signal first_at : parts_t(1 to IN_FRONT + 3)  := (others => (others => '0'));
  signal new_line : std_logic;
  -- ring_line: first word of the line that is written and read; ring_word: the token's word. Each word is read just
  -- before it is overwritten, so the ring is a delay of RING_LINES lines of any length.
  signal ring_line : unsigned(RING_BITS - 1 downto 0) := (others => '0');
  signal ring_word : unsigned(RING_BITS - 1 downto 0) := (others => '0');
  -- Pixels of all slices that leave the ring; index and depth of their micro image as written, as read, and as kept.
  signal from_ring  : std_logic_vector(STACK_BITS - 1 downto 0);
  signal index_word : std_logic_vector(FOUND_BITS - 1 downto 0);
  signal index_read : std_logic_vector(FOUND_BITS - 1 downto 0);
  signal index_kept : std_logic_vector(FOUND_BITS - 1 downto 0) := (others => '0');

  -- The fields of a line are delayed by lines like its pixels. A pixel that leaves has the fields of its line, and the
  -- place fields of the pixel that enters at its column.
  signal line_at   : tokens_t(1 to BUILD.ring_lines + 1) := (others => NO_TOKEN);
  signal result_at : tokens_t(1 to BEHIND)               := (others => NO_TOKEN);

begin

  -- A line of the ring begins with its first pixel, wherever the line before has ended.
  new_line <= token_at(IN_FRONT).strobe and token_at(IN_FRONT).line_first;

  wait_for_scan : process (clk) is

    variable any : std_logic;

  begin

    if rising_edge(clk) then
      -- strobe means from here on that there is a pixel: empty tokens have no word in the ring.
      token_at(1)        <= token;
      token_at(1).strobe <= place.active;
      lens_at(1)         <= place.last_lens(LENS_BITS - 1 downto 0);
      any                := '0';

      -- Whether the token reaches into a further micro image; only then its first pixels belong to the one before.
      for j in 1 to P - 1 loop

        any := any or ahead(j);

      end loop;

      -- Otherwise all pixels belong to the micro image that is looked up.
      for j in 0 to P - 1 loop

        first_at(1)(j) <= any and not ahead(j);

      end loop;

      token_at(2 to IN_FRONT + 1) <= token_at(1 to IN_FRONT);
      lens_at(2 to IN_FRONT + 2)  <= lens_at(1 to IN_FRONT + 1);
      first_at(2 to IN_FRONT + 3) <= first_at(1 to IN_FRONT + 2);

      if reset = '1' then

        for i in 1 to IN_FRONT loop

          token_at(i).strobe <= '0';

        end loop;

      end if;
    end if;

  end process wait_for_scan;

  wait_in_lines : process (clk) is
  begin

    if rising_edge(clk) then
      if new_line = '1' then
        -- The fields of a line are stored once a line and read RING_LINES lines later.
        line_at(1)                         <= token_at(IN_FRONT);
        line_at(2 to BUILD.ring_lines + 1) <= line_at(1 to BUILD.ring_lines);
      end if;

      -- The pixel that leaves and the pixel that enters have the same word in their lines, hence the same column: the
      -- place fields are taken from the one that enters.
      result_at(1)            <= line_at(BUILD.ring_lines + 1);
      result_at(1).strobe     <= token_at(IN_FRONT + 1).strobe;
      result_at(1).line_first <= token_at(IN_FRONT + 1).line_first;
      result_at(1).line_last  <= token_at(IN_FRONT + 1).line_last;
      result_at(2 to BEHIND)  <= result_at(1 to BEHIND - 1);

      if reset = '1' then
        -- After a reset no stored line is an image line, so the ring's old content does not come out.
        for i in 1 to BUILD.ring_lines + 1 loop

          line_at(i).image <= '0';

        end loop;

        for i in 1 to BEHIND loop

          result_at(i).strobe <= '0';

        end loop;

      end if;
    end if;

  end process wait_in_lines;

  find_word : process (clk) is
  begin

    if rising_edge(clk) then
      if new_line = '1' then
        -- The last line of the ring is followed by the first; its length need not be a power of two.
        if ring_line = (BUILD.ring_lines - 1) * BUILD.tokens then
          ring_line <= (others => '0');
          ring_word <= (others => '0');
        else
          ring_line <= ring_line + BUILD.tokens;
          ring_word <= ring_line + BUILD.tokens;
        end if;
      -- No line is longer than MAX_TOKENS, so a line never runs into the next line's words.
      elsif token_at(IN_FRONT).strobe = '1' then
        ring_word <= ring_word + 1;
      end if;
      if reset = '1' then
        ring_line <= (others => '0');
      end if;
    end if;

  end process find_word;

  pixels_wait : if BUILD.picture generate

    signal waiting  : std_logic_vector(delay_bits(STACK_BITS, IN_FRONT + 1) - 1 downto 0) := (others => '0');
    signal entering : std_logic_vector(STACK_BITS - 1 downto 0);

  begin

    entering <= delayed(waiting, data, IN_FRONT + 1);

    wait_in_front : process (clk) is
    begin

      if rising_edge(clk) then
        waiting <= moved_on(waiting, data);
      end if;

    end process wait_in_front;

    -- Read and write have one address: the memory gives the old word in the clock that overwrites it.
    ring : entity work.ram_simple_dual_port
      generic map (
        WIDTH => STACK_BITS,
        WORDS => RING_WORDS
      )
      port map (
        clk           => clk,
        write_enable  => token_at(IN_FRONT + 1).strobe,
        write_address => ring_word,
        write_data    => entering,
        read_address  => ring_word,
        read_data     => from_ring
      );

  end generate pixels_wait;

  no_picture : if not BUILD.picture generate
    from_ring <= (others => '0');
  end generate no_picture;

  index_word(NUMBER_BITS - 1 downto BOX_BITS) <= std_logic_vector(index);

  texture_below : if BOX_BITS > 0 generate
    index_word(0) <= index_textured;
  end generate texture_below;

  -- The index memory gets its address a clock after the ring and is read in one clock instead of two, so both words
  -- come together.
  indices : entity work.ram_simple_dual_port
    generic map (
      WIDTH        => FOUND_BITS,
      WORDS        => BUILD.lenses,
      READ_LATENCY => 1
    )
    port map (
      clk           => clk,
      write_enable  => index_write,
      write_address => index_lens,
      write_data    => index_word,
      read_address  => lens_at(IN_FRONT + 2),
      read_data     => index_read
    );

  depth_beside : if BUILD.between generate
    index_word(FOUND_BITS - 1 downto NUMBER_BITS) <= index_depth.confidence & index_depth.fraction;
  end generate depth_beside;

  keep : process (clk) is
  begin

    if rising_edge(clk) then
      -- The word read for a token's last micro image is kept for the next token, whose first pixels may belong to it.
      if result_at(BEHIND - 1).strobe = '1' then
        index_kept <= index_read;
      end if;
    end if;

  end process keep;

  pixel : for j in 0 to P - 1 generate

    constant LOW : natural := j * WORD_BITS;

    -- Index and depth of the pixel's micro image; the pixel's slices; whether the pixel lies beyond the line's end.
    signal found  : std_logic_vector(FOUND_BITS - 1 downto 0);
    signal stack  : std_logic_vector(BUILD.stack_width - 1 downto 0);
    signal beyond : std_logic;
    -- Selected from the slices: the sharpest, the chosen; and index and depth that go out.
    signal picked : std_logic_vector(WIDTH - 1 downto 0);
    signal chosen : std_logic_vector(WIDTH - 1 downto 0);
    signal told   : std_logic_vector(FOUND_BITS - 1 downto 0);
    -- The index as a byte.
    signal index_byte : std_logic_vector(7 downto 0);

  begin

    found  <= index_kept when first_at(IN_FRONT + 3)(j) = '1' else
              index_read;
    stack  <= from_ring((j + 1) * BUILD.stack_width - 1 downto j * BUILD.stack_width);
    beyond <= result_at(BEHIND - 1).line_last and not line_end(j);

    -- Comparing with each slice makes a multiplexer that accepts any index.
    pick : process (clk) is

      variable sharpest : natural range 0 to 2 ** NUMBER_BITS - 1;
      variable wanted   : natural range 0 to 2 ** NUMBER_BITS - 1;

    begin

      if rising_edge(clk) then
        sharpest := to_integer(unsigned(found(NUMBER_BITS - 1 downto 0)));
        wanted   := to_integer(shift_left(resize(result_at(BEHIND - 1).slice, NUMBER_BITS), BOX_BITS));
        -- The chosen slice has its smaller box where that is the picture's, too.
        if BOX_BITS > 0 and sharpest = wanted + 1 then
          wanted := sharpest;
        end if;
        told <= found;
        -- Beyond the line's end the pixels are 0 already.
        if beyond = '1' then
          told <= (others => '0');
        end if;
        -- Numbers beyond the set select the first slice.
        picked <= stack(WIDTH - 1 downto 0);
        chosen <= stack(WIDTH - 1 downto 0);

        for s in 1 to BUILD.slices * BUILD.boxes - 1 loop

          if sharpest = s then
            picked <= stack((s + 1) * WIDTH - 1 downto s * WIDTH);
          end if;
          if wanted = s then
            chosen <= stack((s + 1) * WIDTH - 1 downto s * WIDTH);
          end if;

        end loop;

      end if;

    end process pick;

    index_byte <= std_logic_vector(resize(unsigned(told(NUMBER_BITS - 1 downto BOX_BITS)), 8));

    with_pixel : if BUILD.picture generate
      out_data(LOW + WIDTH - 1 downto LOW) <= picked;
    end generate with_pixel;

    out_data(LOW + PICTURE_BITS + 7 downto LOW + PICTURE_BITS) <= index_byte;

    with_depth : if BUILD.between generate
      out_data(LOW + PICTURE_BITS + 7 + 2 * FRACTION_BITS downto LOW + PICTURE_BITS + 8) <= told(FOUND_BITS - 1 downto
                                                                                                 NUMBER_BITS);
    end generate with_depth;

    -- The chosen slice goes along, so that a screen can switch between the two pictures without another pass.
    with_chosen : if BUILD.chosen_too generate
      out_data(LOW + WORD_BITS - 1 downto LOW + WORD_BITS - WIDTH) <= chosen;
    end generate with_chosen;

  end generate pixel;

  -- Only pixels that were image when they came in leave.
  result.valid <= result_at(BEHIND).strobe and result_at(BEHIND).image;
  result.skip  <= '0';
  result.last  <= result_at(BEHIND).line_last;
  result.start <= result_at(BEHIND).line_first and result_at(BEHIND).frame_first;
  result.slice <= result_at(BEHIND).slice;

end architecture rtl;
