-- SPDX-License-Identifier: Apache-2.0
-- Weights, word sizes and clock counts of sharpening.
--
-- Each slice has a weight b in 64ths. The taps are (-side, 2**s + 2 * side, -side) / 2**s with the least s that makes
-- all sides whole numbers.
--
-- All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.core_pkg.all;

package sharpen_pkg is

  -- Sizes and weights of a sharpener.
  type sharpen_build_t is record
    -- Weight of each slice in 64ths; number of slices.
    weights : weights_t;
    slices  : positive;
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

  -- The sharpener of a core.
  function sharpener_of (
    core : core_t
  ) return sharpen_build_t;

  -- Bits of the lines of sums that the sharpener keeps, for all channels; 0 without a sharpener.
  function sharpen_line_bits (
    core : core_t
  ) return natural;

  -- The scale exponent s of the taps.
  function scale_exponent (
    weights : weights_t
  ) return positive;

  -- The side weight of a slice.
  function side_weight (
    weights : weights_t;
    slice   : natural
  ) return natural;

  -- The largest side weight.
  function largest_side (
    weights : weights_t
  ) return positive;

  -- Whether all slices with a weight above 0 have the same weight.
  function one_weight (
    weights : weights_t
  ) return boolean;

  -- Width of a sum of 0 to sum_max behind the taps of columns: signed, with the fraction bits of the scale.
  function tapped_bits (
    sum_max : positive;
    weights : weights_t
  ) return positive;

  -- Latency of three_taps in clocks.
  constant TAPS_LATENCY : positive := 4;

  -- Latency of sharpen_columns in clocks: address 1, memory 3, taps.
  constant SHARPEN_COLUMNS_LATENCY : positive := 4 + TAPS_LATENCY;

  -- Latency of sharpen_rows in clocks: registers behind the delays 1, taps, limits 2.
  constant SHARPEN_ROWS_LATENCY : positive := 1 + TAPS_LATENCY + 2;

  -- Latency of both in clocks.
  constant SHARPEN_LATENCY : positive := SHARPEN_COLUMNS_LATENCY + SHARPEN_ROWS_LATENCY;

end package sharpen_pkg;

package body sharpen_pkg is

  -- Weights are integers in units of 1 / 2**UNIT_BITS.
  constant UNIT_BITS : positive := 6;

  function sharpener_of (
    core : core_t
  ) return sharpen_build_t is

    constant LARGEST : positive := product_max(core.arithmetic, 2 * core.arithmetic.passes);

  begin

    return
    (
      weights          => core.weights,
      slices           => core.geometry.slices,
      micro_image_size => core.geometry.micro_image_size,
      pixels           => core.pixels,
      tokens           => tokens_of(core),
      channels         => core.channels,
      sum_max          => LARGEST,
      tapped_bits      => tapped_bits(LARGEST, core.weights),
      -- h, before the taps of rows multiply it by 2**s.
      rounding => choose(final_divisor(core.arithmetic) mod 2 = 1, 2 ** (scale_exponent(core.weights) - 1), 0)
    );

  end function sharpener_of;

  function sharpen_line_bits (
    core : core_t
  ) return natural is
  begin

    if not core.sharpens then
      return 0;
    end if;

    -- A word of the memory has two lines.
    return core.geometry.micro_image_size * core.channels * core.pixels * tokens_of(core) * 2 * final_sum_bits(core);

  end function sharpen_line_bits;

  function scale_exponent (
    weights : weights_t
  ) return positive is

    variable exponent : positive;
    variable weight   : natural;

  begin

    -- 2 suffices for b = 1/4.
    exponent := 2;

    for i in weights'range loop

      weight := weights(i);

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
    weights : weights_t;
    slice   : natural
  ) return natural is
  begin

    -- Units of 1 / 2**scale_exponent are the coarsest in which all weights are integers, so products are as
    -- narrow as possible.
    return weights(slice) / 2 ** (UNIT_BITS - scale_exponent(weights));

  end function side_weight;

  function largest_side (
    weights : weights_t
  ) return positive is

    variable largest : natural;

  begin

    largest := 1;

    -- At least 1, because widths must be positive.
    for i in weights'range loop

      largest := larger(largest, weights(i));

    end loop;

    return larger(largest / 2 ** (UNIT_BITS - scale_exponent(weights)), 1);

  end function largest_side;

  function one_weight (
    weights : weights_t
  ) return boolean is

    variable same   : boolean;
    variable weight : natural;
    variable first  : natural;

  begin

    same  := true;
    first := 0;

    for i in weights'range loop

      weight := weights(i);

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
    sum_max : positive;
    weights : weights_t
  ) return positive is

    constant EXPONENT : positive := scale_exponent(weights);

    variable growth : natural;

  begin

    -- The taps make a sum at most 1 + 4 b times as large, which is at most 2.
    growth := 1;

    -- The comparison is in 256ths, so that no product exceeds an integer.
    if (sum_max / 256 + 1) * (2 ** EXPONENT + 4 * largest_side(weights)) <
       2 ** (larger(bits_for(sum_max) + EXPONENT, 8) - 8) then
      growth := 0;
    end if;

    return bits_for(sum_max) + growth + EXPONENT + 1;

  end function tapped_bits;

end package body sharpen_pkg;
