-- SPDX-License-Identifier: Apache-2.0
-- Adds up output 0 of the next line while the outputs of the line before still leave.
--
-- Latency: LATENCY clocks, a generic, at least bits_for(PIXELS_PER_CLOCK - 1) + 2. Throughput: one token each clock.
-- Equation: sum = the chosen pixels of all tokens since the one with fresh.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity ahead_sum is
  generic (
    -- P, pixels of a token.
    PIXELS_PER_CLOCK : positive;
    -- Channels of a pixel.
    CHANNELS : positive;
    -- Width of a channel.
    PIXEL_BITS : positive;
    -- Width of a sum.
    SUM_BITS : positive;
    -- Clocks from a token to the sum that holds its pixels.
    LATENCY : positive
  );
  port (
    clk : in    std_logic;
    -- active: there is a token; fresh: it begins a line; its pixels, and which of them count (chosen).
    active : in    std_logic;
    fresh  : in    std_logic;
    chosen : in    std_logic_vector(PIXELS_PER_CLOCK - 1 downto 0);
    pixels : in    std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * PIXEL_BITS - 1 downto 0);
    -- The sums of all channels.
    sum : out   std_logic_vector(CHANNELS * SUM_BITS - 1 downto 0)
  );
end entity ahead_sum;

architecture rtl of ahead_sum is

  constant UNEVEN  : boolean := not takes(PIXELS_PER_CLOCK = 2 ** bits_for(PIXELS_PER_CLOCK - 1),
                                          "ahead_sum: PIXELS_PER_CLOCK must be a power of two");
  constant HURRIED : boolean := not takes(LATENCY > bits_for(PIXELS_PER_CLOCK - 1) + 1,
                                          "ahead_sum: LATENCY must exceed the levels of the adders by 2 at least");

  -- A tree of adders: log2 P levels, each with half of the sums of the one before.
  constant P      : positive := PIXELS_PER_CLOCK;
  constant LEVELS : positive := bits_for(P - 1);

  -- Width of a value of the tree. Level 0 holds the pixels that count, level l the sums of 2**l of them.

  function bits_of (
    level : natural
  ) return positive is
  begin

    -- A level's sums are at most SUM_BITS wide, because the whole sum is.
    if PIXEL_BITS + level > SUM_BITS then
      return SUM_BITS;
    end if;

    return PIXEL_BITS + level;

  end function bits_of;

  type sums_t is array (natural range 0 to P * CHANNELS - 1) of unsigned(SUM_BITS - 1 downto 0);

  type gathered_t is array (natural range <>) of std_logic_vector(CHANNELS * SUM_BITS - 1 downto 0);

  type partial_t is array (natural range 0 to LEVELS) of sums_t;

  signal partial : partial_t := (others => (others => (others => '0')));
  -- Whether there is a token, and whether it begins a line, while its pixels go through the tree.
  signal active_at : std_logic_vector(0 to LEVELS) := (others => '0');
  signal fresh_at  : std_logic_vector(0 to LEVELS) := (others => '0');
  -- The sum so far, delayed from the clock behind the last addition.
  signal gathered_at : gathered_t(LEVELS + 1 to LATENCY) := (others => (others => '0'));

begin

  -- Pixels that do not count are zero from here on, so the adders need no enable.
  pixel : for i in 0 to P * CHANNELS - 1 generate
    partial(0)(i) <= resize(unsigned(pixels((i + 1) * PIXEL_BITS - 1 downto i * PIXEL_BITS)), SUM_BITS)
                     when chosen(i / CHANNELS) = '1' else
                     (others => '0');
  end generate pixel;

  -- A register behind each level: log2 P short additions instead of a chain of P.
  every_level : for l in 1 to LEVELS generate

    add : process (clk) is

      variable narrow : unsigned(bits_of(l) - 1 downto 0);

    begin

      if rising_edge(clk) then

        for i in 0 to P / 2 ** l - 1 loop

          for c in 0 to CHANNELS - 1 loop

            -- Added in the width of the level, because a tool does not see that higher bits stay zero.
            narrow := resize(partial(l - 1)(2 * i * CHANNELS + c), bits_of(l)) +
                      resize(partial(l - 1)((2 * i + 1) * CHANNELS + c), bits_of(l));

            partial(l)(i * CHANNELS + c) <= resize(narrow, SUM_BITS);

          end loop;

        end loop;

      end if;

    end process add;

  end generate every_level;

  active_at(0) <= active;
  fresh_at(0)  <= fresh;

  gather : process (clk) is

    variable before : unsigned(SUM_BITS - 1 downto 0);

  begin

    if rising_edge(clk) then
      active_at(1 to LEVELS) <= active_at(0 to LEVELS - 1);
      fresh_at(1 to LEVELS)  <= fresh_at(0 to LEVELS - 1);

      -- The sum waits here until its line's output 0 comes.
      gathered_at(LEVELS + 2 to LATENCY) <= gathered_at(LEVELS + 1 to LATENCY - 1);

      -- The first token of a line replaces the sum instead of adding to it, so no clock is lost for clearing.
      if active_at(LEVELS) = '1' then

        for c in 0 to CHANNELS - 1 loop

          -- The sum's own register is the first one of the delay, so the loop has one addition.
          before := (others => '0');
          if fresh_at(LEVELS) = '0' then
            before := unsigned(gathered_at(LEVELS + 1)((c + 1) * SUM_BITS - 1 downto c * SUM_BITS));
          end if;

          gathered_at(LEVELS + 1)((c + 1) * SUM_BITS - 1 downto c * SUM_BITS) <= std_logic_vector(before +
                                                                                                  partial(LEVELS)(c));

        end loop;

      end if;
    end if;

  end process gather;

  sum <= gathered_at(LATENCY);

end architecture rtl;
