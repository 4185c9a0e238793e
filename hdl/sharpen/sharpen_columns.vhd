-- SPDX-License-Identifier: Apache-2.0
-- The taps of sharpening along columns: each sum with those of the lines M above and M below.
--
-- The memory holds for each column, and each line number modulo M, the sums of the last two lines: a word that is read
-- goes back moved on by one. So the last 2 M lines are kept, and both taps come with one word.
--
-- Lines may follow each other without a gap, and frames too: each line remembers whether the one M above it is in its
-- frame.
--
-- Latency: M lines and SHARPEN_COLUMNS_LATENCY clocks. Throughput: one token each clock; the same column comes again
--   PARTIAL_SUM_LOOP clocks later at the earliest.
-- Equation: out(k) = three_taps of sum(k), sum(k - M), sum(k + M), k counting lines.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.sharpen_pkg.all;

entity sharpen_columns is
  generic (
    -- M.
    MICRO_IMAGE_SIZE : positive;
    -- The weight of each slice's sharpening in 64ths, with blanks in between; without one there is no sharpener.
    SHARPENING : string;
    -- Tokens of the longest line.
    TOKENS : positive;
    -- Sums of a token.
    LANES : positive;
    -- Width of a sum.
    SUM_BITS : positive;
    -- What three_taps adds, for the rounding behind the taps of rows.
    OFFSET : natural;
    -- Width of a result.
    RESULT_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token; whether it has pixels, and the ends of its line.
    strobe     : in    std_logic;
    pixel      : in    std_logic;
    line_first : in    std_logic;
    line_last  : in    std_logic;
    -- With a line's first token: it belongs to an image, it is a frame's first one, and its slice.
    image       : in    std_logic;
    frame_first : in    std_logic;
    slice       : in    unsigned(bits_for(slice_count(SHARPENING) - 1) - 1 downto 0);
    -- The sums of a token.
    sums : in    std_logic_vector(LANES * SUM_BITS - 1 downto 0);
    -- The same behind the taps; those of a line hold until the next one.
    out_strobe      : out   std_logic;
    out_pixel       : out   std_logic;
    out_line_first  : out   std_logic;
    out_line_last   : out   std_logic;
    out_image       : out   std_logic;
    out_frame_first : out   std_logic;
    out_slice       : out   unsigned(bits_for(slice_count(SHARPENING) - 1) - 1 downto 0);
    -- Whether the slice is sharpened at all.
    out_sharpened : out   std_logic;
    out_values    : out   std_logic_vector(LANES * RESULT_BITS - 1 downto 0)
  );
end entity sharpen_columns;

architecture rtl of sharpen_columns is

  constant M          : positive := MICRO_IMAGE_SIZE;
  constant WORDS      : positive := M * TOKENS;
  constant LINE_BITS  : positive := LANES * SUM_BITS;
  constant SLICE_BITS : positive := slice'length;

  -- Clocks from a token to the words of its address.
  constant READ : positive := SHARPEN_COLUMNS_LATENCY - TAPS_LATENCY;

  subtype address_t is unsigned(bits_for(WORDS - 1) - 1 downto 0);

  subtype line_t is std_logic_vector(LINE_BITS - 1 downto 0);

  type addresses_t is array (1 to READ) of address_t;

  type lines_t is array (1 to READ) of line_t;

  -- Side information of a line; bit 0 is the one that reset clears.
  constant IMAGE_BIT     : natural := 0;
  constant FRAME_BIT     : natural := 1;
  constant ABOVE_BIT     : natural := 2;
  constant SHARPENED_BIT : natural := 3;
  constant SLICE_LOW     : natural := 4;

  subtype line_tag_t is std_logic_vector(SLICE_LOW + SLICE_BITS - 1 downto 0);

  type line_tags_t is array (1 to SHARPEN_COLUMNS_LATENCY) of line_tag_t;

  type sharpened_t is array (natural range 0 to 2 ** SLICE_BITS - 1) of std_logic;

  function sharpened_table return sharpened_t is

    variable table : sharpened_t;

  begin

    table := (others => '1');

    for i in 0 to slice_count(SHARPENING) - 1 loop

      if slice_shift(SHARPENING, i) = 0 then
        table(i) := '0';
      end if;

    end loop;

    return table;

  end function sharpened_table;

  constant SHARPENED : sharpened_t := sharpened_table;

  -- A pixel, and the first of its line.
  signal active : std_logic;
  signal step   : std_logic;
  -- Each line number modulo M has TOKENS words in the memory; this is the first one of the next line.
  signal next_line  : address_t                   := (others => '0');
  signal address_at : addresses_t                 := (others => (others => '0'));
  signal active_at  : std_logic_vector(1 to READ) := (others => '0');
  signal sums_at    : lines_t                     := (others => (others => '0'));

  -- Lines of the frame before the current one, up to M - 1.
  signal lines_before : natural range 0 to larger(M - 1, 1) := 0;
  signal line_tag     : line_tag_t;
  signal line_due     : line_tag_t;
  signal line_tag_at  : line_tags_t                         := (others => (others => '0'));
  -- The line is M below one of its own frame.
  signal below       : std_logic;
  signal below_at    : std_logic_vector(1 to READ) := (others => '0');
  signal above_there : std_logic;
  signal below_there : std_logic;

  -- What was read: the sums of M lines above in the low bits, of 2 M lines above in the high ones. What goes back has
  -- this line's in the low bits.
  signal word      : std_logic_vector(2 * LINE_BITS - 1 downto 0);
  signal word_back : std_logic_vector(2 * LINE_BITS - 1 downto 0);
  signal slice_tap : unsigned(SLICE_BITS - 1 downto 0);
  signal token_tag : std_logic_vector(3 downto 0);
  signal token_due : std_logic_vector(3 downto 0);

begin

  active <= strobe and pixel;
  step   <= active and line_first;

  --------------------------------------------------------------------------------------------------
  -- Lines.

  below <= image and not frame_first when lines_before = M - 1 else
           '0';

  line_tag(IMAGE_BIT)     <= image;
  line_tag(FRAME_BIT)     <= frame_first;
  line_tag(ABOVE_BIT)     <= below;
  line_tag(SHARPENED_BIT) <= SHARPENED(to_integer(slice));

  line_tag(line_tag_t'high downto SLICE_LOW) <= std_logic_vector(slice);

  delay_lines : entity work.tag_delay
    generic map (
      WIDTH  => line_tag_t'length,
      LENGTH => M
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => step,
      tag     => line_tag,
      delayed => line_due
    );

  follow_lines : process (clk) is
  begin

    if rising_edge(clk) then
      if step = '1' then
        if frame_first = '1' then
          lines_before <= 0;
        elsif lines_before < M - 1 then
          lines_before <= lines_before + 1;
        end if;

        line_tag_at(1) <= line_due;
        below_at(1)    <= below;
      end if;

      for i in 2 to SHARPEN_COLUMNS_LATENCY loop

        line_tag_at(i) <= line_tag_at(i - 1);

      end loop;

      for i in 2 to READ loop

        below_at(i) <= below_at(i - 1);

      end loop;

    end if;

  end process follow_lines;

  above_there <= line_tag_at(READ)(ABOVE_BIT) and line_tag_at(READ)(SHARPENED_BIT);
  below_there <= below_at(READ) and line_tag_at(READ)(SHARPENED_BIT);
  slice_tap   <= unsigned(line_tag_at(READ + 2)(line_tag_t'high downto SLICE_LOW));

  --------------------------------------------------------------------------------------------------
  -- The memory.

  find_address : process (clk) is
  begin

    if rising_edge(clk) then
      if step = '1' then
        address_at(1) <= next_line;

        if next_line = (M - 1) * TOKENS then
          next_line <= (others => '0');
        else
          next_line <= next_line + TOKENS;
        end if;
      elsif active = '1' then
        address_at(1) <= address_at(1) + 1;
      end if;

      active_at(1) <= active;
      sums_at(1)   <= sums;

      for i in 2 to READ loop

        address_at(i) <= address_at(i - 1);
        active_at(i)  <= active_at(i - 1);
        sums_at(i)    <= sums_at(i - 1);

      end loop;

      -- A place beyond the memory would never come back into it.
      if reset = '1' then
        next_line <= (others => '0');
      end if;
    end if;

  end process find_address;

  word_back <= word(LINE_BITS - 1 downto 0) & sums_at(READ);

  memory : entity work.ram_blocks
    generic map (
      WIDTH        => 2 * LINE_BITS,
      WORDS        => WORDS,
      READ_LATENCY => 3
    )
    port map (
      clk           => clk,
      write_enable  => active_at(READ),
      write_address => address_at(READ),
      write_data    => word_back,
      read_address  => address_at(1),
      read_data     => word
    );

  --------------------------------------------------------------------------------------------------
  -- The taps.

  lane : for i in 0 to LANES - 1 generate

    signal own        : signed(SUM_BITS downto 0);
    signal line_above : signed(SUM_BITS downto 0);
    signal line_below : signed(SUM_BITS downto 0);
    signal tapped     : signed(RESULT_BITS - 1 downto 0);

  begin

    own        <= signed('0' & word((i + 1) * SUM_BITS - 1 downto i * SUM_BITS));
    line_above <= signed('0' & word(LINE_BITS + (i + 1) * SUM_BITS - 1 downto LINE_BITS + i * SUM_BITS));
    line_below <= signed('0' & sums_at(READ)((i + 1) * SUM_BITS - 1 downto i * SUM_BITS));

    taps : entity work.three_taps
      generic map (
        VALUE_BITS  => SUM_BITS + 1,
        SHARPENING  => SHARPENING,
        OFFSET      => OFFSET,
        RESULT_BITS => RESULT_BITS
      )
      port map (
        clk           => clk,
        value         => own,
        earlier       => line_above,
        later         => line_below,
        earlier_there => above_there,
        later_there   => below_there,
        slice_2       => slice_tap,
        result        => tapped
      );

    out_values((i + 1) * RESULT_BITS - 1 downto i * RESULT_BITS) <= std_logic_vector(tapped);

  end generate lane;

  --------------------------------------------------------------------------------------------------
  -- Side information. Bit 0 is the one that reset clears.

  token_tag <= line_last & line_first & pixel & strobe;

  delay_tokens : entity work.tag_delay
    generic map (
      WIDTH  => token_tag'length,
      LENGTH => SHARPEN_COLUMNS_LATENCY
    )
    port map (
      clk     => clk,
      reset   => reset,
      tag     => token_tag,
      delayed => token_due
    );

  out_strobe     <= token_due(0);
  out_pixel      <= token_due(1);
  out_line_first <= token_due(2);
  out_line_last  <= token_due(3);

  out_image       <= line_tag_at(SHARPEN_COLUMNS_LATENCY)(IMAGE_BIT);
  out_frame_first <= line_tag_at(SHARPEN_COLUMNS_LATENCY)(FRAME_BIT);
  out_sharpened   <= line_tag_at(SHARPEN_COLUMNS_LATENCY)(SHARPENED_BIT);
  out_slice       <= unsigned(line_tag_at(SHARPEN_COLUMNS_LATENCY)(line_tag_t'high downto SLICE_LOW));

end architecture rtl;
