-- SPDX-License-Identifier: Apache-2.0
-- The moving sums of the outputs of a token: prefix sums of their differences, on top of the last sum of the token
-- before (the carry).
--
-- Level l of the network adds, to each place whose bit l - 1 is set, the last sum of the neighbouring block of 2 **
-- (l - 1) places below it. Only the carry forms a loop, with one addition.
--
-- Latency: bits_for(PIXELS_PER_CLOCK - 1) + 1 clocks, and 1 more with HOLDING. Throughput: one token each clock.
-- Equation: sum j = carry + difference 0 + .. + difference j. The carry is the last sum of the token before; with
-- take it is the sum ahead of the line. With HOLDING, result j is the sum of the last place up to j that begins a
-- group.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity prefix_sums is
  generic (
    -- P, pixels of a token.
    PIXELS_PER_CLOCK : positive;
    -- Channels of a pixel.
    CHANNELS : positive;
    -- Width of a difference.
    DIFFERENCE_BITS : positive;
    -- Width of a sum.
    SUM_BITS : positive;
    -- true: a group of several outputs shows one held result.
    HOLDING : boolean
  );
  port (
    clk : in    std_logic;
    -- The differences of a token, signed; difference 0 in the low bits.
    differences : in    std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * DIFFERENCE_BITS - 1 downto 0);
    -- bits_for(PIXELS_PER_CLOCK - 1) clocks later: active: there is a token; take: a line begins with it;
    -- begins: the places that begin groups; ahead: the sum ahead of the line; held: the sum that a group shows
    -- which began before the line.
    active : in    std_logic;
    take   : in    std_logic;
    begins : in    std_logic_vector(PIXELS_PER_CLOCK - 1 downto 0);
    ahead  : in    std_logic_vector(CHANNELS * SUM_BITS - 1 downto 0);
    held   : in    std_logic_vector(CHANNELS * SUM_BITS - 1 downto 0);
    -- Results of all outputs of the token.
    sums : out   std_logic_vector(PIXELS_PER_CLOCK * CHANNELS * SUM_BITS - 1 downto 0)
  );
end entity prefix_sums;

architecture rtl of prefix_sums is

  constant UNEVEN : boolean := not takes(PIXELS_PER_CLOCK = 2 ** bits_for(PIXELS_PER_CLOCK - 1),
                                         "prefix_sums: PIXELS_PER_CLOCK must be a power of two");

  constant P      : positive := PIXELS_PER_CLOCK;
  constant LEVELS : positive := bits_for(P - 1);

  subtype sum_t is unsigned(SUM_BITS - 1 downto 0);

  type sums_t is array (natural range 0 to P * CHANNELS - 1) of sum_t;

  type partial_t is array (natural range 0 to LEVELS) of sums_t;

  -- A difference in the width of a sum, modulo 2 ** SUM_BITS: with M = 1 a sum is narrower than a difference.
  function widened (
    difference : std_logic_vector
  ) return sum_t is

    variable bits : signed(difference'length downto 0);

  begin

    -- One bit more keeps the sign when the number is cut afterwards.
    bits := resize(signed(difference), difference'length + 1);

    if SUM_BITS <= difference'length then
      return unsigned(bits(SUM_BITS - 1 downto 0));
    end if;

    return unsigned(resize(bits, SUM_BITS));

  end function widened;

  -- Sums of growing blocks, level after level. The last level adds the carry.
  signal partial : partial_t := (others => (others => (others => '0')));
  signal running : sums_t    := (others => (others => '0'));

begin

  place : for i in 0 to P * CHANNELS - 1 generate
    partial(0)(i) <= widened(differences((i + 1) * DIFFERENCE_BITS - 1 downto i * DIFFERENCE_BITS));
  end generate place;

  every_level : for l in 1 to LEVELS generate

    add : process (clk) is
    begin

      if rising_edge(clk) then
        -- The last place of a block holds the block's sum, so each place of the next block needs one addition.
        for j in 0 to P - 1 loop

          for c in 0 to CHANNELS - 1 loop

            if j / 2 ** (l - 1) mod 2 = 1 then
              partial(l)(j * CHANNELS + c) <= partial(l - 1)(j * CHANNELS + c) +
                                              partial(l - 1)((j / 2 ** (l - 1) * 2 ** (l - 1) - 1) * CHANNELS + c);
            else
              partial(l)(j * CHANNELS + c) <= partial(l - 1)(j * CHANNELS + c);
            end if;

          end loop;

        end loop;

      end if;

    end process add;

  end generate every_level;

  -- The next token needs only the last sum, so the loop has one adder whatever P is.
  carry : process (clk) is

    variable before : sum_t;

  begin

    if rising_edge(clk) then
      if active = '1' then

        for c in 0 to CHANNELS - 1 loop

          before := running((P - 1) * CHANNELS + c);
          -- A line begins: the sum ahead replaces the old line's sum.
          if take = '1' then
            before := unsigned(ahead((c + 1) * SUM_BITS - 1 downto c * SUM_BITS));
          end if;

          for j in 0 to P - 1 loop

            running(j * CHANNELS + c) <= before + partial(LEVELS)(j * CHANNELS + c);

          end loop;

        end loop;

      end if;
    end if;

  end process carry;

  every_sum : if not HOLDING generate

    result : for i in 0 to P * CHANNELS - 1 generate
      sums((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(running(i));
    end generate result;

  end generate every_sum;

  groups : if HOLDING generate

    signal active_late : std_logic                        := '0';
    signal take_late   : std_logic                        := '0';
    signal begins_late : std_logic_vector(P - 1 downto 0) := (others => '0');
    signal held_late   : std_logic_vector(CHANNELS * SUM_BITS - 1 downto 0);
    signal results     : sums_t                           := (others => (others => '0'));

  begin

    hold : process (clk) is

      variable found  : std_logic_vector(P - 1 downto 0);
      variable values : sums_t;

    begin

      if rising_edge(clk) then
        active_late <= active;
        take_late   <= take;
        begins_late <= begins;
        held_late   <= held;

        -- For each place, the sum of the last place up to it that begins a group: a binary search in log2 P steps.
        found  := begins_late;
        values := running;

        for l in 0 to LEVELS - 1 loop

          -- The loop goes down from the top, so that places below still hold the level before.
          for j in P - 1 downto 2 ** l loop

            -- A place without a begin takes the value of the place 2 ** l below, which already covers
            -- the 2 ** l places below it.
            if found(j) = '0' then

              for c in 0 to CHANNELS - 1 loop

                values(j * CHANNELS + c) := values((j - 2 ** l) * CHANNELS + c);

              end loop;

            end if;
            found(j) := found(j) or found(j - 2 ** l);

          end loop;

        end loop;

        -- Places in front of the token's first group continue a group that began in an earlier token, or
        -- before the line.
        if active_late = '1' then

          for j in 0 to P - 1 loop

            for c in 0 to CHANNELS - 1 loop

              if found(j) = '1' then
                results(j * CHANNELS + c) <= values(j * CHANNELS + c);
              elsif take_late = '1' then
                results(j * CHANNELS + c) <= unsigned(held_late((c + 1) * SUM_BITS - 1 downto c * SUM_BITS));
              else
                results(j * CHANNELS + c) <= results((P - 1) * CHANNELS + c);
              end if;

            end loop;

          end loop;

        end if;
      end if;

    end process hold;

    result : for i in 0 to P * CHANNELS - 1 generate
      sums((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(results(i));
    end generate result;

  end generate groups;

end architecture rtl;
