-- SPDX-License-Identifier: Apache-2.0
-- The taps of sharpening along rows: each value with those M pixels to its left and right. The result is a sum again.
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
use work.delay_pkg.all;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.token_pkg.all;
use work.sharpen_pkg.all;

entity sharpen_rows is
  generic (
    -- What the sharpener is built for, and the weight of each slice in 64ths, with blanks in between.
    BUILD      : sharpen_build_t;
    SHARPENING : string
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token, which says of its line what holds for it, and the pixels that a line's last token has.
    token    : in    token_t;
    line_end : in    std_logic_vector(BUILD.pixels - 1 downto 0);
    -- Whether the slice is sharpened.
    sharpened : in    std_logic;
    -- The values of a token, channel 0 of pixel 0 in the low bits.
    values : in    std_logic_vector(BUILD.pixels * BUILD.channels * BUILD.tapped_bits - 1 downto 0);
    -- The same behind the taps.
    out_token : out   token_t;
    -- Sums; 0 behind a line's last pixel.
    out_sums : out   std_logic_vector(BUILD.pixels * BUILD.channels * bits_for(BUILD.sum_max) - 1 downto 0)
  );
end entity sharpen_rows;

architecture rtl of sharpen_rows is

  constant M          : positive := BUILD.micro_image_size;
  constant PIXELS     : positive := BUILD.pixels;
  constant SUM_BITS   : positive := bits_for(BUILD.sum_max);
  constant PIXEL_BITS : positive := BUILD.channels * BUILD.tapped_bits;
  constant SLICE_BITS : positive := bits_for(slice_count(SHARPENING) - 1);
  constant SCALE_BITS : positive := scale_exponent(SHARPENING);
  constant TAP_BITS   : positive := BUILD.tapped_bits + SCALE_BITS + 1;
  -- Of them in front of the point.
  constant WHOLE_BITS : positive := BUILD.tapped_bits + 1 - SCALE_BITS;

  -- Tokens that the pixel in the middle waits.
  constant DELAY : positive := divide_up(M, PIXELS);

  -- Of a token, until it comes out: tokens up to the one whose pixels are in the middle, clocks behind it.
  constant LAST : positive := DELAY + SHARPEN_ROWS_LATENCY;

  type lanes_t is array (1 to LAST) of std_logic_vector(PIXELS - 1 downto 0);

  -- Clocks from a token to the sums behind the taps.
  constant TAPS_DONE : positive := 1 + TAPS_LATENCY;

  -- Tokens of the line before this one, up to DELAY: until then the pixel in the middle has no left neighbour.
  signal tokens_before : natural range 0 to DELAY := 0;
  signal tokens_now    : natural range 0 to DELAY;
  -- The pixels that the token has, and whether so many tokens of its line come before it.
  signal lanes_now  : std_logic_vector(PIXELS - 1 downto 0);
  signal full_now   : std_logic;
  signal nearly_now : std_logic;
  -- The fields of a token, whether it is sharpened, which pixels it has, and whether DELAY tokens of its line come
  -- before it, or one fewer.
  signal token_at     : tokens_t(1 to LAST)                         := (others => NO_TOKEN);
  signal sharpened_at : std_logic_vector(1 to LAST)                 := (others => '0');
  signal lanes_at     : lanes_t                                     := (others => (others => '0'));
  signal full_at      : std_logic_vector(1 to LAST)                 := (others => '0');
  signal nearly_at    : std_logic_vector(1 to LAST)                 := (others => '0');
  signal strobe_at    : std_logic_vector(0 to SHARPEN_ROWS_LATENCY) := (others => '0');
  signal slice_tap    : unsigned(SLICE_BITS - 1 downto 0);
  -- Idle clocks must not move the middle: delays up to the middle count tokens, behind it clocks.
  signal middle : std_logic_vector(PIXELS * PIXEL_BITS - 1 downto 0);

begin

  --------------------------------------------------------------------------------------------------
  -- The fields of tokens.

  -- Counted up to DELAY only: more tokens before a pixel change nothing.
  tokens_now <= 0 when begins_line(token) = '1' else
                tokens_before when tokens_before = DELAY else
                tokens_before + 1;

  full_now     <= '1' when tokens_now = DELAY else
                  '0';
  nearly_now   <= '1' when tokens_now >= DELAY - 1 else
                  '0';
  strobe_at(0) <= token.strobe;

  -- A pixel that the token does not have is no neighbour.
  every_lane : for i in 0 to PIXELS - 1 generate
    lanes_now(i) <= token.pixel and (line_end(i) or not token.line_last);
  end generate every_lane;

  follow : process (clk) is
  begin

    if rising_edge(clk) then
      if token.strobe = '1' then
        tokens_before   <= tokens_now;
        token_at(1)     <= token;
        sharpened_at(1) <= sharpened;
        lanes_at(1)     <= lanes_now;
        full_at(1)      <= full_now;
        nearly_at(1)    <= nearly_now;
      end if;

      for i in 2 to LAST loop

        -- Up to the middle with tokens, as its pixels; from there on with clocks, as the taps.
        if token.strobe = '1' or i > DELAY then
          token_at(i)     <= token_at(i - 1);
          sharpened_at(i) <= sharpened_at(i - 1);
          lanes_at(i)     <= lanes_at(i - 1);
          full_at(i)      <= full_at(i - 1);
          nearly_at(i)    <= nearly_at(i - 1);
        end if;

      end loop;

      strobe_at(1 to SHARPEN_ROWS_LATENCY) <= strobe_at(0 to SHARPEN_ROWS_LATENCY - 1);
      if reset = '1' then
        -- Fields without strobe do not count; the pixel mark is looked at from the neighbours'
        -- side.
        strobe_at(1 to SHARPEN_ROWS_LATENCY) <= (others => '0');

        for i in 1 to DELAY loop

          token_at(i).pixel <= '0';

        end loop;

      end if;
    end if;

  end process follow;

  slice_tap <= token_at(DELAY + 3).slice(SLICE_BITS - 1 downto 0);

  --------------------------------------------------------------------------------------------------
  -- Pixels and their neighbours.

  lane : for i in 0 to PIXELS - 1 generate

    -- Tokens from the pixel in the middle to its neighbours, and their lanes.
    -- Whole tokens to the right, the rest is another lane; to the left the same, counted from DELAY
    -- tokens earlier, so that nothing is negative.
    constant RIGHT_TOKENS : natural := (i + M) / PIXELS;
    constant RIGHT_LANE   : natural := (i + M) mod PIXELS;
    constant LEFT_TOKENS  : natural := (DELAY * PIXELS + PIXELS - 1 + M - i) / PIXELS - DELAY;
    constant LEFT_LANE    : natural := (DELAY * PIXELS + i - M) mod PIXELS;

    subtype pixel_t is std_logic_vector(PIXEL_BITS - 1 downto 0);

    -- The pixel and its neighbours as they come, and those under way until the last of them is there.
    signal own         : pixel_t;
    signal right       : pixel_t;
    signal left        : pixel_t;
    signal owns        : std_logic_vector(delay_bits(PIXEL_BITS, DELAY) - 1 downto 0)                := (others => '0');
    signal rights      : std_logic_vector(delay_bits(PIXEL_BITS, DELAY - RIGHT_TOKENS) - 1 downto 0) := (others => '0');
    signal lefts       : std_logic_vector(delay_bits(PIXEL_BITS, LEFT_TOKENS) - 1 downto 0)          := (others => '0');
    signal own_1       : pixel_t := (others => '0');
    signal right_1     : pixel_t := (others => '0');
    signal left_1      : pixel_t := (others => '0');
    signal right_there : std_logic;
    signal left_there  : std_logic;
    signal right_on    : std_logic                                 := '0';
    signal left_on     : std_logic                                 := '0';

  begin

    own   <= values((i + 1) * PIXEL_BITS - 1 downto i * PIXEL_BITS);
    right <= values((RIGHT_LANE + 1) * PIXEL_BITS - 1 downto RIGHT_LANE * PIXEL_BITS);
    left  <= middle((LEFT_LANE + 1) * PIXEL_BITS - 1 downto LEFT_LANE * PIXEL_BITS);

    middle((i + 1) * PIXEL_BITS - 1 downto i * PIXEL_BITS) <= delayed(owns, own, DELAY);

    -- A neighbour is there if its token belongs to the line, and has this pixel.
    right_now : if RIGHT_TOKENS = DELAY generate
      right_there <= full_now and lanes_now(RIGHT_LANE);
    end generate right_now;

    right_before : if RIGHT_TOKENS < DELAY generate
      right_there <= nearly_at(1) and lanes_at(1)(RIGHT_LANE);
    end generate right_before;

    left_far : if LEFT_TOKENS = DELAY generate
      left_there <= full_at(DELAY);
    end generate left_far;

    left_near : if LEFT_TOKENS < DELAY generate
      left_there <= nearly_at(DELAY);
    end generate left_near;

    hold : process (clk) is
    begin

      if rising_edge(clk) then
        owns     <= moved_on(owns, own, token.strobe);
        rights   <= moved_on(rights, right, token.strobe);
        lefts    <= moved_on(lefts, left, token.strobe);
        own_1    <= middle((i + 1) * PIXEL_BITS - 1 downto i * PIXEL_BITS);
        right_1  <= delayed(rights, right, DELAY - RIGHT_TOKENS);
        left_1   <= delayed(lefts, left, LEFT_TOKENS);
        right_on <= right_there and sharpened_at(DELAY);
        left_on  <= left_there and sharpened_at(DELAY);
      end if;

    end process hold;

    channel : for c in 0 to BUILD.channels - 1 generate

      constant LOW : natural := (i * BUILD.channels + c) * SUM_BITS;

      signal tapped    : signed(TAP_BITS - 1 downto 0);
      signal whole     : signed(WHOLE_BITS - 1 downto 0);
      signal none      : std_logic                       := '0';
      signal above_all : std_logic                       := '0';
      signal low_bits  : unsigned(SUM_BITS - 1 downto 0) := (others => '0');
      signal sum       : unsigned(SUM_BITS - 1 downto 0) := (others => '0');

    begin

      taps : entity work.three_taps
        generic map (
          VALUE_BITS  => BUILD.tapped_bits,
          SHARPENING  => SHARPENING,
          RESULT_BITS => TAP_BITS
        )
        port map (
          clk           => clk,
          value         => signed(own_1((c + 1) * BUILD.tapped_bits - 1 downto c * BUILD.tapped_bits)),
          earlier       => signed(left_1((c + 1) * BUILD.tapped_bits - 1 downto c * BUILD.tapped_bits)),
          later         => signed(right_1((c + 1) * BUILD.tapped_bits - 1 downto c * BUILD.tapped_bits)),
          earlier_there => left_on,
          later_there   => right_on,
          slice_2       => slice_tap,
          result        => tapped
        );

      -- OFFSET has rounded already, so the fraction bits are cut.
      whole <= tapped(TAP_BITS - 1 downto 2 * SCALE_BITS);

      limit : process (clk) is
      begin

        if rising_edge(clk) then
          -- A negative sum and a pixel behind the line end alike: as zero.
          none <= whole(whole'high) or not lanes_at(DELAY + TAPS_DONE)(i);
          -- Compared a clock before the choice, as the sum has many bits.
          above_all <= '0';

          if whole > BUILD.sum_max then
            above_all <= '1';
          end if;

          low_bits <= unsigned(whole(SUM_BITS - 1 downto 0));

          if none = '1' then
            sum <= (others => '0');
          elsif above_all = '1' then
            sum <= to_unsigned(BUILD.sum_max, SUM_BITS);
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

  give : process (token_at, strobe_at) is
  begin

    out_token        <= token_at(LAST);
    out_token.strobe <= strobe_at(SHARPEN_ROWS_LATENCY);

  end process give;

end architecture rtl;
