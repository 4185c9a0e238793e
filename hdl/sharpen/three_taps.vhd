-- SPDX-License-Identifier: Apache-2.0
-- Three taps: a value, and its neighbours on both sides where they exist.
--
-- The taps work on differences to the neighbours; a missing neighbour counts as the value itself. Each clock has at
-- most one addition.
--
-- Latency: TAPS_LATENCY clocks. Throughput: one value each clock.
-- Equation: result = 2**SCALE_BITS * value + side * sum over existing neighbours (value - neighbour) + OFFSET.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.sharpen_pkg.all;

entity three_taps is
  generic (
    -- Width of a value, a signed number.
    VALUE_BITS : positive;
    -- Width of the difference of two values: a bit more than a value, or as wide as values that are never negative.
    DIFFERENCE_BITS : positive;
    -- Sizes and weights of the sharpener.
    BUILD : sharpen_build_t;
    -- Number added to the result, 0 to 2**SCALE_BITS - 1.
    OFFSET : natural := 0;
    -- Width of the result.
    RESULT_BITS : positive
  );
  port (
    clk : in    std_logic;
    -- A value and its neighbours, and which neighbours exist.
    value         : in    signed(VALUE_BITS - 1 downto 0);
    earlier       : in    signed(VALUE_BITS - 1 downto 0);
    later         : in    signed(VALUE_BITS - 1 downto 0);
    earlier_there : in    std_logic;
    later_there   : in    std_logic;
    -- The slice, 2 clocks behind the value; only read if slices have several weights above 0.
    slice_2 : in    unsigned(bits_for(BUILD.slices - 1) - 1 downto 0);
    result  : out   signed(RESULT_BITS - 1 downto 0)
  );
end entity three_taps;

architecture rtl of three_taps is

  constant SCALE_BITS   : positive := scale_exponent(BUILD.weights);
  constant SIDE         : positive := largest_side(BUILD.weights);
  constant SIDE_BITS    : positive := bits_for(SIDE) + 1;
  constant PRODUCT_BITS : positive := DIFFERENCE_BITS + 1 + SIDE_BITS;

  -- Trailing zeros of a number below 32.
  function lowest_bit (
    number : positive
  ) return natural is

    variable place : natural;

  begin

    place := 0;

    for i in 1 to 4 loop

      if number mod 2 ** i = 0 then
        place := i;
      end if;

    end loop;

    return place;

  end function lowest_bit;

  -- Names of signals end in the number of clocks behind the value.
  signal value_1   : signed(VALUE_BITS - 1 downto 0)      := (others => '0');
  signal value_2   : signed(VALUE_BITS - 1 downto 0)      := (others => '0');
  signal value_3   : signed(VALUE_BITS - 1 downto 0)      := (others => '0');
  signal earlier_1 : signed(DIFFERENCE_BITS - 1 downto 0) := (others => '0');
  signal later_1   : signed(DIFFERENCE_BITS - 1 downto 0) := (others => '0');
  signal change_2  : signed(DIFFERENCE_BITS downto 0)     := (others => '0');
  signal change_3  : signed(PRODUCT_BITS - 1 downto 0)    := (others => '0');
  signal scaled_3  : signed(RESULT_BITS - 1 downto 0);

begin

  -- The value times 2**SCALE_BITS has OFFSET in its fraction bits: this takes no adder.
  scaled_3 <= resize(value_3 & signed(to_unsigned(OFFSET, SCALE_BITS)), RESULT_BITS);

  add : process (clk) is
  begin

    if rising_edge(clk) then
      -- Clock 1: differences to existing neighbours. 2: their sum. 3 (below): times the side weight. 4: the result.
      value_1   <= value;
      earlier_1 <= (others => '0');
      later_1   <= (others => '0');

      if earlier_there = '1' then
        earlier_1 <= resize(value, DIFFERENCE_BITS) - resize(earlier, DIFFERENCE_BITS);
      end if;

      if later_there = '1' then
        later_1 <= resize(value, DIFFERENCE_BITS) - resize(later, DIFFERENCE_BITS);
      end if;

      value_2  <= value_1;
      change_2 <= resize(earlier_1, DIFFERENCE_BITS + 1) + resize(later_1, DIFFERENCE_BITS + 1);

      value_3 <= value_2;
      if one_weight(BUILD.weights) then
        result <= scaled_3 + resize(change_3, RESULT_BITS);
      else
        result <= scaled_3 - resize(change_3, RESULT_BITS);
      end if;
    end if;

  end process add;

  -- A single side weight is a sum or a difference of two powers of two (all but 11 and 13): one adder.
  one_side : if one_weight(BUILD.weights) generate

    constant LOW_BIT : natural := lowest_bit(SIDE);
    -- The side weight without its trailing zeros.
    constant ODD : positive := SIDE / 2 ** LOW_BIT;
    -- The power of two that is nearest to ODD.
    constant HIGH_BIT : natural := bits_for((4 * ODD - 1) / 3) - 1;

    signal scaled : signed(PRODUCT_BITS - 1 downto 0);
    signal high   : signed(PRODUCT_BITS - 1 downto 0);

  begin

    scaled <= shift_left(resize(change_2, PRODUCT_BITS), LOW_BIT);
    high   <= shift_left(resize(change_2, PRODUCT_BITS), LOW_BIT + HIGH_BIT);

    multiply : process (clk) is
    begin

      if rising_edge(clk) then
        if ODD = 1 then
          change_3 <= scaled;
        elsif ODD = 2 ** HIGH_BIT + 1 then
          change_3 <= high + scaled;
        elsif ODD = 2 ** HIGH_BIT - 1 then
          change_3 <= high - scaled;
        else
          change_3 <= change_2 * to_signed(SIDE, SIDE_BITS);
        end if;
      end if;

    end process multiply;

  end generate one_side;

  -- Weights are multiplied as negative numbers, because Yosys takes a product with a factor that is never negative for
  -- one of numbers without a sign, which needs a second multiplier for the copies of the other factor's sign.
  many_sides : if not one_weight(BUILD.weights) generate

    type sides_t is array (natural range 0 to 2 ** slice_2'length - 1) of signed(SIDE_BITS - 1 downto 0);

    -- The weight of each slice, negative. Numbers beyond the set do not occur; they have the largest weight.
    function side_table return sides_t is

      variable table : sides_t;

    begin

      table := (others => to_signed(-SIDE, SIDE_BITS));

      for i in 0 to BUILD.slices - 1 loop

        table(i) := to_signed(-side_weight(BUILD.weights, i), SIDE_BITS);

      end loop;

      return table;

    end function side_table;

    constant SIDE_OF : sides_t := side_table;

  begin

    multiply : process (clk) is
    begin

      if rising_edge(clk) then
        change_3 <= change_2 * SIDE_OF(to_integer(slice_2));
      end if;

    end process multiply;

  end generate many_sides;

end architecture rtl;
