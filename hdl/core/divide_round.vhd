-- SPDX-License-Identifier: Apache-2.0
-- Correctly rounded division by a constant, as one multiplication by its reciprocal.
--
-- The quotient is floor(n / DIVISOR) with n = value + floor(DIVISOR/2). It equals floor(n * R / 2**T) for all
-- n <= N when R = ceil(2**T / DIVISOR) and (R * DIVISOR - 2**T) * N < 2**T. T is the smallest number for which
-- that holds. A power of two as divisor gives R = 1, and no multiplier remains.
--
-- Latency: 3 clocks (the input, product and output registers of a DSP48A1).
-- Throughput: one value each clock.
-- Equation: quotient = floor(value / DIVISOR + 1/2) for 0 <= value <= VALUE_MAX.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity divide_round is
  generic (
    -- Largest input.
    VALUE_MAX : positive;
    -- Constant to divide by.
    DIVISOR : positive;
    -- Width of the quotient.
    QUOTIENT_BITS : positive
  );
  port (
    clk : in    std_logic;
    -- Both words are unsigned.
    value    : in    std_logic_vector(bits_for(VALUE_MAX) - 1 downto 0);
    quotient : out   std_logic_vector(QUOTIENT_BITS - 1 downto 0)
  );
end entity divide_round;

architecture rtl of divide_round is

  constant NARROW : boolean := not takes(bits_for((VALUE_MAX + DIVISOR / 2) / DIVISOR) <= QUOTIENT_BITS,
                                         "divide_round: QUOTIENT_BITS must hold VALUE_MAX / DIVISOR");

  -- Half of the divisor is added first, which rounds halves up.
  constant HALF           : natural  := DIVISOR / 2;
  constant NUMERATOR_MAX  : positive := VALUE_MAX + HALF;
  constant NUMERATOR_BITS : positive := bits_for(NUMERATOR_MAX);

  -- T = NUMERATOR_BITS + bits_for(DIVISOR) always suffices, because R * DIVISOR - 2**T < DIVISOR.
  constant RECIPROCAL_BITS : positive := NUMERATOR_BITS + bits_for(DIVISOR) + 1;

  -- The excess R * DIVISOR - 2**t = (-2**t) mod DIVISOR, by doubling, so that no number exceeds an integer.
  function excess (
    t : natural
  ) return natural is

    variable power : natural;

  begin

    -- Powers of two modulo the divisor, each from the one before.
    power := 1 mod DIVISOR;

    for i in 1 to t loop

      power := (2 * power) mod DIVISOR;

    end loop;

    return (DIVISOR - power) mod DIVISOR;

  end function excess;

  -- Whether exponent t is exact: excess * NUMERATOR_MAX < 2**t.
  function is_exact (
    t : natural
  ) return boolean is

    variable product : unsigned(RECIPROCAL_BITS + 31 downto 0);

  begin

    -- The product exceeds VHDL's integers, so it is computed as a vector.
    product := resize(to_unsigned(excess(t), 31) * to_unsigned(NUMERATOR_MAX, NUMERATOR_BITS), product'length);

    return shift_right(product, t) = 0;

  end function is_exact;

  function smallest_exponent return natural is

    variable exponent : natural;

  begin

    -- The loop always sets the exponent, because its first one suffices.
    exponent := 0;

    -- The loop goes down from the largest exponent: the last one set is the smallest that suffices.
    for t in natural range RECIPROCAL_BITS - 1 downto 0 loop

      if is_exact(t) then
        exponent := t;
      end if;

    end loop;

    return exponent;

  end function smallest_exponent;

  constant EXPONENT : natural := smallest_exponent;

  -- ceil(2**EXPONENT / DIVISOR) by long division, one bit of the quotient after the other.
  function reciprocal return unsigned is

    variable quotient_so_far : unsigned(RECIPROCAL_BITS - 1 downto 0);
    variable remainder       : natural;

  begin

    quotient_so_far := (others => '0');
    remainder       := 0;

    for bit_index in EXPONENT downto 0 loop

      remainder := 2 * remainder;

      -- 2**EXPONENT is a one with zeros behind it.
      if bit_index = EXPONENT then
        remainder := 1;
      end if;

      quotient_so_far := shift_left(quotient_so_far, 1);

      if remainder >= DIVISOR then
        remainder          := remainder - DIVISOR;
        quotient_so_far(0) := '1';
      end if;

    end loop;

    -- R is rounded up.
    if remainder /= 0 then
      quotient_so_far := quotient_so_far + 1;
    end if;

    return quotient_so_far;

  end function reciprocal;

  -- The width of the reciprocal.
  function width_of (
    number : unsigned
  ) return positive is

    variable width : positive;

  begin

    width := 1;

    for i in natural range 0 to number'length - 1 loop

      if number(i) = '1' then
        width := i + 1;
      end if;

    end loop;

    return width;

  end function width_of;

  constant FACTOR_BITS : positive                           := width_of(reciprocal);
  constant FACTOR      : unsigned(FACTOR_BITS - 1 downto 0) := resize(reciprocal, FACTOR_BITS);

  signal numerator : unsigned(NUMERATOR_BITS - 1 downto 0)               := (others => '0');
  signal product   : unsigned(NUMERATOR_BITS + FACTOR_BITS - 1 downto 0) := (others => '0');

begin

  divide : process (clk) is
  begin

    if rising_edge(clk) then
      -- Three clocks: adding half the divisor, multiplying, shifting.
      numerator <= resize(unsigned(value), NUMERATOR_BITS) + HALF;
      product   <= numerator * FACTOR;
      quotient  <= std_logic_vector(resize(shift_right(product, EXPONENT), QUOTIENT_BITS));
    end if;

  end process divide;

end architecture rtl;
