-- SPDX-License-Identifier: Apache-2.0
-- The taps of sharpening along rows: each value with those M pixels to its left and to its right, and back to sums.
--
-- Tokens may have several pixels of a line. The neighbours of lane i are in the lanes (i + M) and (i - M) modulo
-- PIXELS_PER_CLOCK, always as many tokens later and earlier.
--
-- Latency: divide_up(M, PIXELS_PER_CLOCK) tokens and SHARPEN_ROWS_LATENCY clocks. Throughput: one token each clock.
-- Equation: sum(k) = three_taps of value(k), value(k - M), value(k + M), over 4**s, limited to 0 .. SUM_MAX.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.sharpen_pkg.all;

entity sharpen_rows is
  generic (
    -- M.
    MICRO_IMAGE_SIZE : positive;
    -- The weight of each slice's sharpening in 64ths, with blanks in between; without one there is no sharpener.
    SHARPENING : string;
    -- Neighbouring pixels of a line that a token has.
    PIXELS_PER_CLOCK : positive := 1;
    -- Values of a pixel.
    CHANNELS : positive;
    -- Width of a value, a signed number.
    VALUE_BITS : positive;
    -- Largest sum.
    SUM_MAX : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token; whether it has pixels, and the ends of its line.
    strobe     : in    std_logic;
    pixel      : in    std_logic;
    line_first : in    std_logic;
    line_last  : in    std_logic;
    -- The pixels that a line's last token has.
    line_end : in    std_logic_vector(PIXELS_PER_CLOCK - 1 downto 0);
    -- Of the line, with each of its tokens: it belongs to an image, it is a frame's first one, its slice, and
    -- whether that is sharpened.
    image       : in    std_logic;
    frame_first : in    std_logic;
    slice       : in    unsigned(bits_for(slice_count(SHARPENING) - 1) - 1 downto 0);
    sharpened   : in    std_logic;
    -- The values of a token, channel 0 of pixel 0 in the low bits.
    values : in    std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * VALUE_BITS - 1 downto 0);
    -- The same behind the taps.
    out_strobe      : out   std_logic;
    out_pixel       : out   std_logic;
    out_line_first  : out   std_logic;
    out_line_last   : out   std_logic;
    out_image       : out   std_logic;
    out_frame_first : out   std_logic;
    out_slice       : out   unsigned(bits_for(slice_count(SHARPENING) - 1) - 1 downto 0);
    -- Sums; 0 behind a line's last pixel.
    out_sums : out   std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * bits_for(SUM_MAX) - 1 downto 0)
  );
end entity sharpen_rows;

architecture rtl of sharpen_rows is

  constant M          : positive := MICRO_IMAGE_SIZE;
  constant PIXELS     : positive := PIXELS_PER_CLOCK;
  constant SUM_BITS   : positive := bits_for(SUM_MAX);
  constant PIXEL_BITS : positive := CHANNELS * VALUE_BITS;
  constant SLICE_BITS : positive := slice'length;
  constant SCALE_BITS : positive := scale_exponent(SHARPENING);
  constant TAP_BITS   : positive := VALUE_BITS + SCALE_BITS + 1;
  -- Of them in front of the point.
  constant WHOLE_BITS : positive := VALUE_BITS + 1 - SCALE_BITS;

  -- Tokens that the pixel in the middle waits.
  constant DELAY : positive := divide_up(M, PIXELS);

  -- Side information of a token; bit 0 is the one that reset clears.
  constant PIXEL_BIT     : natural := 0;
  constant FIRST_BIT     : natural := 1;
  constant LAST_BIT      : natural := 2;
  constant IMAGE_BIT     : natural := 3;
  constant FRAME_BIT     : natural := 4;
  constant SHARPENED_BIT : natural := 5;
  -- DELAY tokens of its line, or one fewer, come before it.
  constant FULL_BIT   : natural := 6;
  constant NEARLY_BIT : natural := 7;
  constant SLICE_LOW  : natural := 8;
  -- The pixels that it has.
  constant LANES_LOW : natural := SLICE_LOW + SLICE_BITS;

  subtype tag_t is std_logic_vector(LANES_LOW + PIXELS - 1 downto 0);

  type tags_t is array (1 to SHARPEN_ROWS_LATENCY) of tag_t;

  -- Clocks from a token to the sums behind the taps.
  constant TAPS_DONE : positive := 1 + TAPS_LATENCY;

  -- Tokens of the line before this one, up to DELAY: until then the pixel in the middle has no left neighbour.
  signal tokens_before : natural range 0 to DELAY := 0;
  signal tokens_now    : natural range 0 to DELAY;
  -- Of the token that comes, of the one before it, of the one whose pixels are in the middle.
  signal tag        : tag_t;
  signal tag_before : tag_t;
  signal tag_due    : tag_t;
  signal tag_at     : tags_t := (others => (others => '0'));
  signal strobe_in  : std_logic_vector(0 downto 0);
  signal strobe_due : std_logic_vector(0 downto 0);
  signal slice_tap  : unsigned(SLICE_BITS - 1 downto 0);
  -- Idle clocks must not move the middle on: up to it all is kept in tokens, behind it in clocks.
  signal middle : std_logic_vector(PIXELS * PIXEL_BITS - 1 downto 0);

begin

  --------------------------------------------------------------------------------------------------
  -- Side information.

  tokens_now <= 0 when (pixel = '1' and line_first = '1') else
                tokens_before when tokens_before = DELAY else
                tokens_before + 1;

  tag(PIXEL_BIT)     <= pixel;
  tag(FIRST_BIT)     <= line_first;
  tag(LAST_BIT)      <= line_last;
  tag(IMAGE_BIT)     <= image;
  tag(FRAME_BIT)     <= frame_first;
  tag(SHARPENED_BIT) <= sharpened;
  tag(FULL_BIT)      <= '1' when tokens_now = DELAY else
                        '0';
  tag(NEARLY_BIT)    <= '1' when tokens_now >= DELAY - 1 else
                        '0';

  tag(LANES_LOW - 1 downto SLICE_LOW) <= std_logic_vector(slice);

  every_lane : for i in 0 to PIXELS - 1 generate
    tag(LANES_LOW + i) <= pixel and (line_end(i) or not line_last);
  end generate every_lane;

  delay_tag_once : entity work.tag_delay
    generic map (
      WIDTH  => tag_t'length,
      LENGTH => 1
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => strobe,
      tag     => tag,
      delayed => tag_before
    );

  delay_tag : entity work.tag_delay
    generic map (
      WIDTH  => tag_t'length,
      LENGTH => DELAY - 1
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => strobe,
      tag     => tag_before,
      delayed => tag_due
    );

  strobe_in(0) <= strobe;

  delay_strobe : entity work.tag_delay
    generic map (
      WIDTH  => 1,
      LENGTH => SHARPEN_ROWS_LATENCY
    )
    port map (
      clk     => clk,
      reset   => reset,
      tag     => strobe_in,
      delayed => strobe_due
    );

  follow : process (clk) is
  begin

    if rising_edge(clk) then
      if strobe = '1' then
        tokens_before <= tokens_now;
      end if;

      tag_at(1) <= tag_due;

      for i in 2 to SHARPEN_ROWS_LATENCY loop

        tag_at(i) <= tag_at(i - 1);

      end loop;

    end if;

  end process follow;

  slice_tap <= unsigned(tag_at(3)(LANES_LOW - 1 downto SLICE_LOW));

  --------------------------------------------------------------------------------------------------
  -- Pixels and their neighbours.

  lane : for i in 0 to PIXELS - 1 generate

    -- Tokens from the pixel in the middle to its neighbours, and their lanes.
    constant RIGHT_TOKENS : natural := (i + M) / PIXELS;
    constant RIGHT_LANE   : natural := (i + M) mod PIXELS;
    constant LEFT_TOKENS  : natural := (DELAY * PIXELS + PIXELS - 1 + M - i) / PIXELS - DELAY;
    constant LEFT_LANE    : natural := (DELAY * PIXELS + i - M) mod PIXELS;

    signal right_pixel : std_logic_vector(PIXEL_BITS - 1 downto 0);
    signal left_pixel  : std_logic_vector(PIXEL_BITS - 1 downto 0);
    signal own_1       : std_logic_vector(PIXEL_BITS - 1 downto 0) := (others => '0');
    signal right_1     : std_logic_vector(PIXEL_BITS - 1 downto 0) := (others => '0');
    signal left_1      : std_logic_vector(PIXEL_BITS - 1 downto 0) := (others => '0');
    signal right_there : std_logic;
    signal left_there  : std_logic;
    signal right_on    : std_logic                                 := '0';
    signal left_on     : std_logic                                 := '0';

  begin

    delay_middle : entity work.tag_delay
      generic map (
        WIDTH  => PIXEL_BITS,
        LENGTH => DELAY
      )
      port map (
        clk     => clk,
        enable  => strobe,
        tag     => values((i + 1) * PIXEL_BITS - 1 downto i * PIXEL_BITS),
        delayed => middle((i + 1) * PIXEL_BITS - 1 downto i * PIXEL_BITS)
      );

    delay_right : entity work.tag_delay
      generic map (
        WIDTH  => PIXEL_BITS,
        LENGTH => DELAY - RIGHT_TOKENS
      )
      port map (
        clk     => clk,
        enable  => strobe,
        tag     => values((RIGHT_LANE + 1) * PIXEL_BITS - 1 downto RIGHT_LANE * PIXEL_BITS),
        delayed => right_pixel
      );

    delay_left : entity work.tag_delay
      generic map (
        WIDTH  => PIXEL_BITS,
        LENGTH => LEFT_TOKENS
      )
      port map (
        clk     => clk,
        enable  => strobe,
        tag     => middle((LEFT_LANE + 1) * PIXEL_BITS - 1 downto LEFT_LANE * PIXEL_BITS),
        delayed => left_pixel
      );

    -- A neighbour is there if its token belongs to the line, and has this pixel.
    right_now : if RIGHT_TOKENS = DELAY generate
      right_there <= tag(FULL_BIT) and tag(LANES_LOW + RIGHT_LANE);
    end generate right_now;

    right_before : if RIGHT_TOKENS < DELAY generate
      right_there <= tag_before(NEARLY_BIT) and tag_before(LANES_LOW + RIGHT_LANE);
    end generate right_before;

    left_far : if LEFT_TOKENS = DELAY generate
      left_there <= tag_due(FULL_BIT);
    end generate left_far;

    left_near : if LEFT_TOKENS < DELAY generate
      left_there <= tag_due(NEARLY_BIT);
    end generate left_near;

    hold : process (clk) is
    begin

      if rising_edge(clk) then
        own_1    <= middle((i + 1) * PIXEL_BITS - 1 downto i * PIXEL_BITS);
        right_1  <= right_pixel;
        left_1   <= left_pixel;
        right_on <= right_there and tag_due(SHARPENED_BIT);
        left_on  <= left_there and tag_due(SHARPENED_BIT);
      end if;

    end process hold;

    channel : for c in 0 to CHANNELS - 1 generate

      constant LOW : natural := (i * CHANNELS + c) * SUM_BITS;

      signal tapped    : signed(TAP_BITS - 1 downto 0);
      signal whole     : signed(WHOLE_BITS - 1 downto 0);
      signal none      : std_logic                       := '0';
      signal above_all : std_logic                       := '0';
      signal low_bits  : unsigned(SUM_BITS - 1 downto 0) := (others => '0');
      signal sum       : unsigned(SUM_BITS - 1 downto 0) := (others => '0');

    begin

      taps : entity work.three_taps
        generic map (
          VALUE_BITS  => VALUE_BITS,
          SHARPENING  => SHARPENING,
          OFFSET      => 0,
          RESULT_BITS => TAP_BITS
        )
        port map (
          clk           => clk,
          value         => signed(own_1((c + 1) * VALUE_BITS - 1 downto c * VALUE_BITS)),
          earlier       => signed(left_1((c + 1) * VALUE_BITS - 1 downto c * VALUE_BITS)),
          later         => signed(right_1((c + 1) * VALUE_BITS - 1 downto c * VALUE_BITS)),
          earlier_there => left_on,
          later_there   => right_on,
          slice_2       => slice_tap,
          result        => tapped
        );

      whole <= tapped(TAP_BITS - 1 downto 2 * SCALE_BITS);

      limit : process (clk) is
      begin

        if rising_edge(clk) then
          none      <= whole(whole'high) or not tag_at(TAPS_DONE)(LANES_LOW + i);
          above_all <= '0';

          if whole > SUM_MAX then
            above_all <= '1';
          end if;

          low_bits <= unsigned(whole(SUM_BITS - 1 downto 0));

          if none = '1' then
            sum <= (others => '0');
          elsif above_all = '1' then
            sum <= to_unsigned(SUM_MAX, SUM_BITS);
          else
            sum <= low_bits;
          end if;
        end if;

      end process limit;

      out_sums(LOW + SUM_BITS - 1 downto LOW) <= std_logic_vector(sum);

    end generate channel;

  end generate lane;

  --------------------------------------------------------------------------------------------------
  -- Out.

  out_strobe      <= strobe_due(0);
  out_pixel       <= tag_at(SHARPEN_ROWS_LATENCY)(PIXEL_BIT);
  out_line_first  <= tag_at(SHARPEN_ROWS_LATENCY)(FIRST_BIT);
  out_line_last   <= tag_at(SHARPEN_ROWS_LATENCY)(LAST_BIT);
  out_image       <= tag_at(SHARPEN_ROWS_LATENCY)(IMAGE_BIT);
  out_frame_first <= tag_at(SHARPEN_ROWS_LATENCY)(FRAME_BIT);
  out_slice       <= unsigned(tag_at(SHARPEN_ROWS_LATENCY)(LANES_LOW - 1 downto SLICE_LOW));

end architecture rtl;
