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

  -- Sizes of a sharpener, besides its weights.
  type sharpen_build_t is record
    -- Micro image size M.
    micro_image_size : positive;
    -- pixels of a token; tokens of the longest line; channels, sums of a pixel.
    pixels   : positive;
    tokens   : positive;
    channels : positive;
    -- Largest sum; width of a value between the two passes, a signed number.
    sum_max     : positive;
    tapped_bits : positive;
    -- Number that the taps of columns add, for the rounding behind the taps of rows.
    rounding : natural;
  end record sharpen_build_t;

  -- Returns true, or stops elaboration if SHARPENING cannot be built for these slices; the message begins with the
  -- name.
  function takes_sharpening (
    name          : string;
    sharpening    : string;
    slices        : positive;
    exact         : boolean;
    parallel_rows : positive
  ) return boolean;

  -- Bits of the lines of sums that the sharpener keeps, for all channels.
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

  -- Delay of the sharpener, in lines and in pixels.
  function sharpen_delay (
    sharpening       : string;
    micro_image_size : positive
  ) return natural;

  -- The scale exponent s of the taps.
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

  -- Whether all slices with a weight above 0 have the same weight.
  function one_weight (
    sharpening : string
  ) return boolean;

  -- Width of a sum of 0 to sum_max behind the taps of columns: signed, with the fraction bits of the scale.
  function tapped_bits (
    sum_max    : positive;
    sharpening : string
  ) return positive;

  -- Latency of three_taps in clocks.
  constant TAPS_LATENCY : positive := 4;

  -- Latency of sharpen_columns in clocks: address 1, memory 3, taps.
  constant SHARPEN_COLUMNS_LATENCY : positive := 4 + TAPS_LATENCY;

  -- Latency of sharpen_rows in clocks: registers behind the delays 1, taps, limits 2.
  constant SHARPEN_ROWS_LATENCY : positive := 1 + TAPS_LATENCY + 2;

  -- Latency of both in clocks; 0 without sharpening.
  function sharpen_latency (
    sharpening : string
  ) return natural;

end package sharpen_pkg;

package body sharpen_pkg is

  -- Weights are integers in units of 1 / 2**UNIT_BITS.
  constant UNIT_BITS : positive := 6;

  -- The largest weight is a quarter: the taps of a dimension then double a sum at most.
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

    -- The sharpener works on unrounded sums in raster order.
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

    -- A word of the memory has two lines.
    return micro_image_size * words * 2 * sum_bits;

  end function sharpen_line_bits;

  function sharpens (
    sharpening : string
  ) return boolean is

    variable found : boolean;

  begin

    -- One weight above 0 is enough: slices with weight 0 then pass the sharpener unchanged.
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

      -- A weight that is no integer in units of 2**-candidate needs a bit more; candidates are tried in
      -- ascending order.
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

    -- Units of 1 / 2**scale_exponent are the coarsest in which all weights are integers, so products are as
    -- narrow as possible.
    return slice_shift(sharpening, slice) / 2 ** (UNIT_BITS - scale_exponent(sharpening));

  end function side_weight;

  function largest_side (
    sharpening : string
  ) return positive is

    variable largest : natural;

  begin

    largest := 1;

    -- At least 1, because widths must be positive.
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

      -- The first weight above 0; all others must equal it or be 0.
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

    -- The taps make a sum at most 1 + 4 b times as large, which is at most 2.
    growth := 1;

    -- The comparison is in 256ths, so that no product exceeds an integer.
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

    -- Columns come first, then rows.
    return choose(sharpens(sharpening), SHARPEN_COLUMNS_LATENCY + SHARPEN_ROWS_LATENCY, 0);

  end function sharpen_latency;

end package body sharpen_pkg;
