-- SPDX-License-Identifier: Apache-2.0
-- Correctly rounded division of sums by a weight that may change at each clock: each pipeline stage computes one bit
-- of the quotient.
--
-- The quotient is floor(n / weight) with n = value + floor(weight / 2). The bits of n above its lowest QUOTIENT_BITS
-- are less than the weight; they are the first remainder. Each stage doubles the remainder, appends the next bit of n
-- and subtracts the weight, or adds it if the remainder is negative. The remainder stays within -weight and weight - 1,
-- and a bit of the quotient is 1 where it is not negative. This is exact for any weight, without a table, a
-- multiplication or a correction.
--
-- A weight of 0 means that no view reaches the pixel: value and quotient are then 0.
--
-- Latency: QUOTIENT_BITS + 1 clocks. Throughput: LANES values each clock.
-- Equation: quotient = floor(value / weight + 1/2) for 0 <= value <= weight * (2**QUOTIENT_BITS - 1).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity divide_weighted is
  generic (
    -- Values that share a weight.
    LANES : positive;
    -- Width of a value.
    VALUE_BITS : positive;
    -- Largest weight.
    WEIGHT_MAX : positive;
    -- Width of a quotient.
    QUOTIENT_BITS : positive
  );
  port (
    clk : in    std_logic;
    -- All words are unsigned, lane 0 in the low bits.
    values    : in    std_logic_vector(LANES * VALUE_BITS - 1 downto 0);
    weight    : in    std_logic_vector(bits_for(WEIGHT_MAX) - 1 downto 0);
    quotients : out   std_logic_vector(LANES * QUOTIENT_BITS - 1 downto 0)
  );
end entity divide_weighted;

architecture rtl of divide_weighted is

  constant WEIGHT_BITS : positive := bits_for(WEIGHT_MAX);
  -- A value plus half its weight is less than the weight times 2**QUOTIENT_BITS.
  constant NUMERATOR_BITS : positive := WEIGHT_BITS + QUOTIENT_BITS;

  subtype weight_t is unsigned(WEIGHT_BITS - 1 downto 0);

  subtype remainder_t is signed(WEIGHT_BITS downto 0);

  -- A word holds the numerator's bits that are still to come, then the quotient's bits so far.
  subtype word_t is unsigned(QUOTIENT_BITS - 1 downto 0);

  type weights_t is array (0 to QUOTIENT_BITS) of weight_t;

  type remainders_t is array (0 to QUOTIENT_BITS) of remainder_t;

  type words_t is array (0 to QUOTIENT_BITS) of word_t;

  -- Twice the remainder plus a bit of the numerator; minus the weight, or plus the weight if the remainder is negative.
  function next_remainder (
    remainder : remainder_t;
    next_bit  : std_logic;
    divisor   : weight_t
  ) return remainder_t is

    variable taken : std_logic;
    variable term  : remainder_t;
    variable sum   : signed(WEIGHT_BITS + 1 downto 0);

  begin

    taken := not remainder(WEIGHT_BITS);
    term  := signed('0' & divisor);

    -- Subtraction adds the complement with a carry into the lowest bit.
    if taken = '1' then
      term := not term;
    end if;

    sum := (remainder(WEIGHT_BITS - 1 downto 0) & next_bit & '1') + (term & taken);

    return sum(WEIGHT_BITS + 1 downto 1);

  end function next_remainder;

  -- The index counts clocks from the numerator.
  signal weight_at : weights_t := (others => (others => '0'));

begin

  delay_weight : process (clk) is
  begin

    if rising_edge(clk) then
      weight_at(0) <= unsigned(weight);
      -- A pixel without views is 0 / 1 = 0.
      if unsigned(weight) = 0 then
        weight_at(0)(0) <= '1';
      end if;
      -- Each stage passes the weight on.
      weight_at(1 to QUOTIENT_BITS) <= weight_at(0 to QUOTIENT_BITS - 1);
    end if;

  end process delay_weight;

  lane : for i in 0 to LANES - 1 generate

    signal remainder_at : remainders_t := (others => (others => '0'));
    signal word_at      : words_t      := (others => (others => '0'));

  begin

    divide : process (clk) is

      variable numerator : unsigned(NUMERATOR_BITS - 1 downto 0);
      variable remainder : remainder_t;

    begin

      if rising_edge(clk) then
        -- Adding half of the weight rounds halves up.
        numerator := resize(unsigned(values((i + 1) * VALUE_BITS - 1 downto i * VALUE_BITS)), NUMERATOR_BITS) +
                     shift_right(unsigned(weight), 1);

        -- A value is below its weight times 2**QUOTIENT_BITS, so its high bits are the first remainder.
        remainder_at(0) <= signed('0' & numerator(NUMERATOR_BITS - 1 downto QUOTIENT_BITS));
        word_at(0)      <= numerator(QUOTIENT_BITS - 1 downto 0);

        for k in 1 to QUOTIENT_BITS loop

          remainder       := next_remainder(remainder_at(k - 1), word_at(k - 1)(QUOTIENT_BITS - 1), weight_at(k - 1));
          remainder_at(k) <= remainder;
          word_at(k)      <= shift_left(word_at(k - 1), 1);
          -- The quotient's bit is the remainder's sign, inverted. A negative remainder is kept: the next
          -- stage adds the weight instead.
          word_at(k)(0) <= not remainder(WEIGHT_BITS);

        end loop;

      end if;

    end process divide;

    quotients((i + 1) * QUOTIENT_BITS - 1 downto i * QUOTIENT_BITS) <= std_logic_vector(word_at(QUOTIENT_BITS));

  end generate lane;

end architecture rtl;
