-- SPDX-License-Identifier: Apache-2.0
-- Weights, word sizes and clock counts of sharpening.
--
-- SHARPENING is a text like SHIFTS: the weight b of each slice in 64ths, with blanks in between, such as "4 0 4". The
-- taps are (-side, 2**s + 2 * side, -side) / 2**s with the least s that makes all sides whole numbers.
--
-- All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;

package sharpen_pkg is

  -- What a sharpener is built for besides its weights, and what follows from them.
  type sharpen_build_t is record
    -- M.
    micro_image_size : positive;
    -- Pixels of a token, tokens of the longest line, sums of a pixel.
    pixels   : positive;
    tokens   : positive;
    channels : positive;
    -- Largest sum; width of a value between both passes, a signed number.
    sum_max     : positive;
    tapped_bits : positive;
    -- What the taps of columns add, for the rounding behind those of rows.
    rounding : natural;
  end record sharpen_build_t;

  -- Stops elaboration, by a message that begins with a name, if SHARPENING cannot be built for these slices; else true.
  function takes_sharpening (
    name          : string;
    sharpening    : string;
    slices        : positive;
    exact         : boolean;
    parallel_rows : positive
  ) return boolean;

  -- Bits of the lines of sums that all lanes keep.
  function sharpen_line_bits (
    sharpening       : string;
    micro_image_size : positive;
    words            : positive;
    sum_bits         : positive
  ) return natural;

  -- Whether a slice has a weight above 0.
  function sharpens (
    sharpening : string
  ) return boolean;

  -- Lines and pixels that sharpening is behind.
  function sharpen_delay (
    sharpening       : string;
    micro_image_size : positive
  ) return natural;

  -- The s of the taps.
  function scale_exponent (
    sharpening : string
  ) return positive;

  -- The side weight of a slice.
  function side_weight (
    sharpening : string;
    slice      : natural
  ) return natural;

  -- The largest side weight.
  function largest_side (
    sharpening : string
  ) return positive;

  -- Whether all slices that are sharpened at all have the same weight.
  function one_weight (
    sharpening : string
  ) return boolean;

  -- Width of a sum of 0 to sum_max behind the taps of columns: signed, with the fraction bits of the scale.
  function tapped_bits (
    sum_max    : positive;
    sharpening : string
  ) return positive;

  -- Clocks of three_taps.
  constant TAPS_LATENCY : positive := 4;

  -- Clocks of sharpen_columns: address, memory 3, taps.
  constant SHARPEN_COLUMNS_LATENCY : positive := 4 + TAPS_LATENCY;

  -- Clocks of sharpen_rows: registers behind the delays, taps, limits 2.
  constant SHARPEN_ROWS_LATENCY : positive := 1 + TAPS_LATENCY + 2;

  -- Clocks of both; 0 without sharpening.
  function sharpen_latency (
    sharpening : string
  ) return natural;

end package sharpen_pkg;

package body sharpen_pkg is

  -- Weights are whole numbers of 1 / 2**UNIT_BITS.
  constant UNIT_BITS : positive := 6;

  -- A quarter, with which the taps of a dimension double a sum at most.
  constant LARGEST_WEIGHT : positive := 16;

  function takes_sharpening (
    name          : string;
    sharpening    : string;
    slices        : positive;
    exact         : boolean;
    parallel_rows : positive
  ) return boolean is
  begin

    assert is_set(sharpening, 0, LARGEST_WEIGHT)
      report name & ": SHARPENING """ & sharpening & """ must be whole numbers from 0 to 16 with blanks in between"
      severity failure;

    assert slice_count(sharpening) = 0 or slice_count(sharpening) = slices
      report name & ": SHARPENING """ & sharpening & """ must have a weight for each slice of SHIFTS, or none"
      severity failure;

    -- It works on sums that are not rounded yet, in raster order.
    assert not sharpens(sharpening) or (exact and parallel_rows = 1)
      report name & ": SHARPENING needs EXACT and PARALLEL_ROWS = 1"
      severity failure;

    return true;

  end function takes_sharpening;

  function sharpen_line_bits (
    sharpening       : string;
    micro_image_size : positive;
    words            : positive;
    sum_bits         : positive
  ) return natural is
  begin

    if not sharpens(sharpening) then
      return 0;
    end if;

    -- A word has two lines.
    return micro_image_size * words * 2 * sum_bits;

  end function sharpen_line_bits;

  function sharpens (
    sharpening : string
  ) return boolean is

    variable found : boolean;

  begin

    -- One weight above 0 is enough: slices with weight 0 then go through the sharpener unchanged.
    found := false;

    for i in 0 to slice_count(sharpening) - 1 loop

      found := found or slice_shift(sharpening, i) > 0;

    end loop;

    return found;

  end function sharpens;

  function sharpen_delay (
    sharpening       : string;
    micro_image_size : positive
  ) return natural is
  begin

    return choose(sharpens(sharpening), micro_image_size, 0);

  end function sharpen_delay;

  function scale_exponent (
    sharpening : string
  ) return positive is

    variable exponent : positive;
    variable weight   : natural;

  begin

    -- 2 suffices for b = 1/4.
    exponent := 2;

    for i in 0 to slice_count(sharpening) - 1 loop

      weight := slice_shift(sharpening, i);

      -- A weight that 2**candidate does not make whole needs a bit more; each candidate is tried in
      -- its turn.
      for candidate in 2 to UNIT_BITS - 1 loop

        if exponent = candidate and weight mod 2 ** (UNIT_BITS - candidate) /= 0 then
          exponent := candidate + 1;
        end if;

      end loop;

    end loop;

    return exponent;

  end function scale_exponent;

  function side_weight (
    sharpening : string;
    slice      : natural
  ) return natural is
  begin

    -- In units of 1 / 2 ** scale_exponent, the coarsest in which all weights are whole: products are no wider than
    -- they must be.
    return slice_shift(sharpening, slice) / 2 ** (UNIT_BITS - scale_exponent(sharpening));

  end function side_weight;

  function largest_side (
    sharpening : string
  ) return positive is

    variable largest : natural;

  begin

    largest := 1;

    -- At least 1, so that widths are positive.
    for i in 0 to slice_count(sharpening) - 1 loop

      largest := larger(largest, slice_shift(sharpening, i));

    end loop;

    return larger(largest / 2 ** (UNIT_BITS - scale_exponent(sharpening)), 1);

  end function largest_side;

  function one_weight (
    sharpening : string
  ) return boolean is

    variable same   : boolean;
    variable weight : natural;
    variable first  : natural;

  begin

    same  := true;
    first := 0;

    for i in 0 to slice_count(sharpening) - 1 loop

      weight := slice_shift(sharpening, i);

      -- The first weight above 0; the others must be the same, or 0.
      if first = 0 then
        first := weight;
      elsif weight /= 0 and weight /= first then
        same := false;
      end if;

    end loop;

    return same;

  end function one_weight;

  function tapped_bits (
    sum_max    : positive;
    sharpening : string
  ) return positive is

    constant EXPONENT : positive := scale_exponent(sharpening);

    variable growth : natural;

  begin

    -- Behind the taps a sum is 1 + 4 b times as large at most, which is no more than 2.
    growth := 1;

    -- Compared in 256ths, so that no product exceeds an integer.
    if (sum_max / 256 + 1) * (2 ** EXPONENT + 4 * largest_side(sharpening)) <
       2 ** (larger(bits_for(sum_max) + EXPONENT, 8) - 8) then
      growth := 0;
    end if;

    return bits_for(sum_max) + growth + EXPONENT + 1;

  end function tapped_bits;

  function sharpen_latency (
    sharpening : string
  ) return natural is
  begin

    -- Columns, then rows.
    return choose(sharpens(sharpening), SHARPEN_COLUMNS_LATENCY + SHARPEN_ROWS_LATENCY, 0);

  end function sharpen_latency;

end package body sharpen_pkg;
