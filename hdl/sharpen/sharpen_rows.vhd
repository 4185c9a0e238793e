-- SPDX-License-Identifier: Apache-2.0
-- The taps of sharpening along rows: each value with the values M pixels to its left and right, rounded to a sum
-- again.
--
-- Tokens may have several pixels of a line. The neighbours of pixel i of a token are pixels (i + M) and (i - M)
-- modulo PIXELS_PER_CLOCK of other tokens, always the same number of tokens later and earlier.
--
-- Latency: divide_up(M, PIXELS_PER_CLOCK) tokens and SHARPEN_ROWS_LATENCY clocks. Throughput: one token each clock.
-- Equation: sum(k) = three_taps of value(k), value(k - M), value(k + M), divided by 4**s, limited to 0 .. SUM_MAX.

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
    -- Sizes and weights of the sharpener.
    BUILD : sharpen_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token, with the fields of its line; and which pixels a line's last token has.
    token    : in    token_t;
    line_end : in    std_logic_vector(BUILD.pixels - 1 downto 0);
    -- Whether the token's slice is sharpened.
    sharpened : in    std_logic;
    -- The values of a token, channel 0 of pixel 0 in the low bits.
    values : in    std_logic_vector(BUILD.pixels * BUILD.channels * BUILD.tapped_bits - 1 downto 0);
    -- The token behind the taps.
    out_token : out   token_t;
    -- Its sums; 0 behind a line's last pixel.
    out_sums : out   std_logic_vector(BUILD.pixels * BUILD.channels * bits_for(BUILD.sum_max) - 1 downto 0)
  );
end entity sharpen_rows;

architecture rtl of sharpen_rows is

  constant M          : positive := BUILD.micro_image_size;
  constant PIXELS     : positive := BUILD.pixels;
  constant SUM_BITS   : positive := bits_for(BUILD.sum_max);
  constant PIXEL_BITS : positive := BUILD.channels * BUILD.tapped_bits;
  constant SLICE_BITS : positive := bits_for(BUILD.slices - 1);
  constant SCALE_BITS : positive := scale_exponent(BUILD.weights);
  constant TAP_BITS   : positive := BUILD.tapped_bits + SCALE_BITS + 1;
  -- Integer bits of the result.
  constant WHOLE_BITS : positive := BUILD.tapped_bits + 1 - SCALE_BITS;

  -- Tokens that the middle pixel waits for its right neighbour.
  constant DELAY : positive := divide_up(M, PIXELS);

  -- Length of a token's delay: DELAY tokens up to the middle pixel, then clocks.
  constant LAST : positive := DELAY + SHARPEN_ROWS_LATENCY;

  type lanes_t is array (1 to LAST) of std_logic_vector(PIXELS - 1 downto 0);

  -- Clocks from a token to the sums behind the taps.
  constant TAPS_DONE : positive := 1 + TAPS_LATENCY;

  -- Tokens of the line before this one, counted up to DELAY: the middle pixel has no left neighbour until then.
  signal tokens_before : natural range 0 to DELAY := 0;
  signal tokens_now    : natural range 0 to DELAY;
  -- lanes_now: which pixels the token has. full_now, nearly_now: DELAY, or one fewer, tokens of its line come
  -- before it.
  signal lanes_now  : std_logic_vector(PIXELS - 1 downto 0);
  signal full_now   : std_logic;
  signal nearly_now : std_logic;
  -- The token's fields: whether it is sharpened, which pixels it has, whether DELAY tokens (full) or one fewer
  -- (nearly) of its line come before it.
  signal token_at     : tokens_t(1 to LAST)                         := (others => NO_TOKEN);
  signal sharpened_at : std_logic_vector(1 to LAST)                 := (others => '0');
  signal lanes_at     : lanes_t                                     := (others => (others => '0'));
  signal full_at      : std_logic_vector(1 to LAST)                 := (others => '0');
  signal nearly_at    : std_logic_vector(1 to LAST)                 := (others => '0');
  signal strobe_at    : std_logic_vector(0 to SHARPEN_ROWS_LATENCY) := (others => '0');
  signal slice_tap    : unsigned(SLICE_BITS - 1 downto 0);
  -- The middle pixels. Delays up to the middle count tokens, so that idle clocks do not move it; delays behind it
  -- count clocks.
  signal middle : std_logic_vector(PIXELS * PIXEL_BITS - 1 downto 0);

begin

  --------------------------------------------------------------------------------------------------
  -- Fields of tokens.

  -- The count stops at DELAY, because more tokens in front change nothing.
  tokens_now <= 0 when begins_line(token) = '1' else
                tokens_before when tokens_before = DELAY else
                tokens_before + 1;

  full_now     <= '1' when tokens_now = DELAY else
                  '0';
  nearly_now   <= '1' when tokens_now >= DELAY - 1 else
                  '0';
  strobe_at(0) <= token.strobe;

  -- A pixel that the token lacks is no neighbour.
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

        -- Up to the middle fields move with tokens like the pixels; behind it they move with clocks like the taps.
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
        -- Only tokens with strobe count; the neighbours look at the pixel mark.
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

    -- Tokens from the middle pixel to its neighbours, and the neighbours' numbers within their tokens. To the right:
    -- whole tokens and the rest. To the left the same, counted from DELAY tokens earlier so that no number is negative.
    constant RIGHT_TOKENS : natural := (i + M) / PIXELS;
    constant RIGHT_LANE   : natural := (i + M) mod PIXELS;
    constant LEFT_TOKENS  : natural := (DELAY * PIXELS + PIXELS - 1 + M - i) / PIXELS - DELAY;
    constant LEFT_LANE    : natural := (DELAY * PIXELS + i - M) mod PIXELS;

    subtype pixel_t is std_logic_vector(PIXEL_BITS - 1 downto 0);

    -- The pixel and its neighbours as they come, and those that wait until the last of the three has come.
    signal centre      : pixel_t;
    signal right       : pixel_t;
    signal left        : pixel_t;
    signal centres     : std_logic_vector(delay_bits(PIXEL_BITS, DELAY) - 1 downto 0)                := (others => '0');
    signal rights      : std_logic_vector(delay_bits(PIXEL_BITS, DELAY - RIGHT_TOKENS) - 1 downto 0) := (others => '0');
    signal lefts       : std_logic_vector(delay_bits(PIXEL_BITS, LEFT_TOKENS) - 1 downto 0)          := (others => '0');
    signal centre_1    : pixel_t := (others => '0');
    signal right_1     : pixel_t := (others => '0');
    signal left_1      : pixel_t := (others => '0');
    signal right_there : std_logic;
    signal left_there  : std_logic;
    signal right_on    : std_logic                                 := '0';
    signal left_on     : std_logic                                 := '0';

  begin

    centre <= values((i + 1) * PIXEL_BITS - 1 downto i * PIXEL_BITS);
    right  <= values((RIGHT_LANE + 1) * PIXEL_BITS - 1 downto RIGHT_LANE * PIXEL_BITS);
    left   <= middle((LEFT_LANE + 1) * PIXEL_BITS - 1 downto LEFT_LANE * PIXEL_BITS);

    middle((i + 1) * PIXEL_BITS - 1 downto i * PIXEL_BITS) <= delayed(centres, centre, DELAY);

    -- A neighbour exists if its token belongs to the line and has that pixel.
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
        centres  <= moved_on(centres, centre, token.strobe);
        rights   <= moved_on(rights, right, token.strobe);
        lefts    <= moved_on(lefts, left, token.strobe);
        centre_1 <= middle((i + 1) * PIXEL_BITS - 1 downto i * PIXEL_BITS);
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
          VALUE_BITS      => BUILD.tapped_bits,
          DIFFERENCE_BITS => BUILD.tapped_bits + 1,
          BUILD           => BUILD,
          RESULT_BITS     => TAP_BITS
        )
        port map (
          clk           => clk,
          value         => signed(centre_1((c + 1) * BUILD.tapped_bits - 1 downto c * BUILD.tapped_bits)),
          earlier       => signed(left_1((c + 1) * BUILD.tapped_bits - 1 downto c * BUILD.tapped_bits)),
          later         => signed(right_1((c + 1) * BUILD.tapped_bits - 1 downto c * BUILD.tapped_bits)),
          earlier_there => left_on,
          later_there   => right_on,
          slice_2       => slice_tap,
          result        => tapped
        );

      -- OFFSET has rounded already, so the fraction bits are cut off.
      whole <= tapped(TAP_BITS - 1 downto 2 * SCALE_BITS);

      limit : process (clk) is
      begin

        if rising_edge(clk) then
          -- A negative sum becomes 0, and so does a pixel behind the line's end.
          none <= whole(whole'high) or not lanes_at(DELAY + TAPS_DONE)(i);
          -- The comparison has a clock of its own, because the sum has many bits.
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
  -- Results.

  give : process (token_at, strobe_at) is
  begin

    out_token        <= token_at(LAST);
    out_token.strobe <= strobe_at(SHARPEN_ROWS_LATENCY);

  end process give;

end architecture rtl;
