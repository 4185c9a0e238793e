-- SPDX-License-Identifier: Apache-2.0
-- Word sizes of an engine, pass by pass.
--
-- A pass is a filter over rows or over columns: `passes` of one dimension, then as many of the other. Exact sums
-- grow by a factor of B, the box, in each pass and are divided once at the end. Stored products are rounded after each
-- pass: between the passes to pixel_bits + guard_bits, after the last pass to pixels.
--
-- All functions except rounded are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

package arithmetic_pkg is

  -- The choices that word sizes follow from: the kind of arithmetic, the largest box, width of a pixel, fraction
  -- bits of stored products, guard bits of the image between the passes, passes in one dimension.
  type arithmetic_t is record
    exact         : boolean;
    box           : positive;
    pixel_bits    : positive;
    fraction_bits : natural;
    guard_bits    : natural;
    passes        : positive range 1 to 4;
  end record arithmetic_t;

  -- Whether the exact sums of all passes, and the terms that round them, fit integers of 31 bits.
  function sums_fit (
    arithmetic : arithmetic_t
  ) return boolean;

  -- Width of a value in front of a pass. Passes count from 0; number 2 * passes is behind the last one.
  function value_bits (
    arithmetic : arithmetic_t;
    pass       : natural
  ) return positive;

  -- Width of the widest sum.
  function widest_bits (
    arithmetic : arithmetic_t
  ) return positive;

  -- Fraction bits that the stored products of a pass have beyond those of its values.
  function scale_bits (
    arithmetic : arithmetic_t;
    pass       : natural
  ) return natural;

  -- Largest value that the filters of a pass sum.
  function product_max (
    arithmetic : arithmetic_t;
    pass       : natural
  ) return positive;

  -- Fraction bits that the sums of a pass are rounded by.
  function drop_bits (
    arithmetic : arithmetic_t;
    pass       : natural
  ) return natural;

  -- The divisor of exact sums behind the last pass.
  function final_divisor (
    arithmetic : arithmetic_t
  ) return positive;

  -- An unsigned number without its lowest bits, rounded to the nearest, halves up, and limited to what the width of the
  -- result holds.
  function rounded (
    value       : std_logic_vector;
    drop_bits   : natural;
    result_bits : positive
  ) return std_logic_vector;

  -- The sizes of a pass, for its stage.
  type pass_t is record
    -- Width of the input, and of the output.
    data_bits   : positive;
    result_bits : positive;
    -- Inputs that a sum adds; stored products are divided by as many.
    box : positive;
    -- stored: whether the input is multiplied by stored products; scale_bits: fraction bits that these have
    -- beyond those of the input.
    stored     : boolean;
    scale_bits : natural;
    -- product_max: the largest value that is summed; sum_max: the largest sum.
    product_max : positive;
    sum_max     : positive;
    -- Fraction bits that sums are rounded by.
    drop_bits : natural;
  end record pass_t;

  function pass_of (
    arithmetic : arithmetic_t;
    pass       : natural
  ) return pass_t;

  -- A pass of exact sums of as many values as the box has samples, each an integer up to the largest.
  function exact_pass (
    largest : positive;
    box     : positive
  ) return pass_t;

end package arithmetic_pkg;

package body arithmetic_pkg is

  function sums_fit (
    arithmetic : arithmetic_t
  ) return boolean is

    variable room : natural;

  begin

    -- 2**pixel_bits * B**(2 * passes) < 2**31 is tested by divisions, so that no number exceeds an integer.
    room := integer'high / 2 ** arithmetic.pixel_bits;

    for i in 1 to 2 * arithmetic.passes loop

      room := room / arithmetic.box;

    end loop;

    return room > 0;

  end function sums_fit;

  function value_bits (
    arithmetic : arithmetic_t;
    pass       : natural
  ) return positive is
  begin

    -- Exact sums grow with each pass, and so does the width of each pass's input.
    if arithmetic.exact then
      return bits_for(product_max(arithmetic, pass));
    -- Only the intermediate image has guard bits; the pixels at both ends have none.
    elsif pass = 0 or pass = 2 * arithmetic.passes then
      return arithmetic.pixel_bits;
    end if;

    return arithmetic.pixel_bits + arithmetic.guard_bits;

  end function value_bits;

  function widest_bits (
    arithmetic : arithmetic_t
  ) return positive is
  begin

    if arithmetic.exact then
      -- The last sums are the widest, because nothing is divided in between.
      return value_bits(arithmetic, 2 * arithmetic.passes);
    end if;

    return arithmetic.pixel_bits + arithmetic.guard_bits;

  end function widest_bits;

  function scale_bits (
    arithmetic : arithmetic_t;
    pass       : natural
  ) return natural is
  begin

    if arithmetic.exact then
      return 0;
    elsif pass = 0 then
      return arithmetic.fraction_bits;
    end if;

    -- The input has the guard bits of the pass before, so the products add the other fraction bits only.
    return arithmetic.fraction_bits - arithmetic.guard_bits;

  end function scale_bits;

  function product_max (
    arithmetic : arithmetic_t;
    pass       : natural
  ) return positive is
  begin

    if arithmetic.exact then
      -- A white image: each pass adds B equal values.
      return (2 ** arithmetic.pixel_bits - 1) * arithmetic.box ** pass;
    end if;

    -- The largest word of the table, rounded like all its words.
    return scaled_quotient(2 ** value_bits(arithmetic, pass) - 1, scale_bits(arithmetic, pass),
                           arithmetic.box);

  end function product_max;

  function drop_bits (
    arithmetic : arithmetic_t;
    pass       : natural
  ) return natural is
  begin

    -- Pixels have no fraction bits, so the last pass drops all of them; between the passes the guard bits stay.
    if pass = 2 * arithmetic.passes - 1 then
      return choose(arithmetic.exact, 0, arithmetic.fraction_bits);
    end if;

    return choose(arithmetic.exact, 0, arithmetic.fraction_bits - arithmetic.guard_bits);

  end function drop_bits;

  function final_divisor (
    arithmetic : arithmetic_t
  ) return positive is
  begin

    if arithmetic.exact then
      -- Each pass of rows and of columns multiplies by B. One division by the product rounds once.
      return arithmetic.box ** (2 * arithmetic.passes);
    end if;

    -- Stored products are divided by B already.
    return 1;

  end function final_divisor;

  function rounded (
    value       : std_logic_vector;
    drop_bits   : natural;
    result_bits : positive
  ) return std_logic_vector is

    constant LARGEST : unsigned(result_bits - 1 downto 0) := (others => '1');

    -- One bit more than the result, because rounding may carry.
    variable whole : unsigned(value'length downto 0);

  begin

    whole := shift_right(resize(unsigned(value), whole'length) + 2 ** drop_bits / 2, drop_bits);

    if whole > LARGEST then
      return std_logic_vector(LARGEST);
    end if;

    return std_logic_vector(resize(whole, result_bits));

  end function rounded;

  function pass_of (
    arithmetic : arithmetic_t;
    pass       : natural
  ) return pass_t is
  begin

    return
    (
      data_bits   => value_bits(arithmetic, pass),
      result_bits => value_bits(arithmetic, pass + 1),
      box         => arithmetic.box,
      stored      => not arithmetic.exact,
      scale_bits  => scale_bits(arithmetic, pass),
      product_max => product_max(arithmetic, pass),
      sum_max     => arithmetic.box * product_max(arithmetic, pass),
      drop_bits   => drop_bits(arithmetic, pass)
    );

  end function pass_of;

  function exact_pass (
    largest : positive;
    box     : positive
  ) return pass_t is
  begin

    return
    (
      data_bits   => bits_for(largest),
      result_bits => bits_for(box * largest),
      box         => box,
      stored      => false,
      scale_bits  => 0,
      product_max => largest,
      sum_max     => box * largest,
      drop_bits   => 0
    );

  end function exact_pass;

end package body arithmetic_pkg;
