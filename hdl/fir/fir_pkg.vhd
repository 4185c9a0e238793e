-- SPDX-License-Identifier: Apache-2.0
-- The switched FIR filters: their taps, switches and clock counts.
--
-- In a transposed FIR filter with TAPS taps a pixel is broadcast to all taps, and tap w delays it by TAPS-1-w steps.
-- A pixel of phase p = k mod M is added by M neighbouring taps: those with delays p*(s-1) + origin .. p*(s-1) +
-- origin + M-1. The origin of a slice is the delay that brings S(k) to its place in the output; no tap has a
-- negative delay.
--
-- All slices of a set have the same output delay (refocus_pkg), so the number of a tap tells which output its
-- partial sum belongs to, in every slice.
--
-- With hold (all shifts multiples of M) the M outputs of a micro image are equal. The filter computes the first
-- and holds it; a phase then closes one switch instead of M.
--
-- All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.sharpen_pkg.all;

package fir_pkg is

  -- Limits: taps of all filters in a dimension, and rows at once.
  constant MOST_TAPS          : positive := 512;
  constant MOST_PARALLEL_ROWS : positive := 64;

  -- Returns true, or stops elaboration if the filters cannot be built; the message begins with the name.
  function takes_filters (
    name          : string;
    arithmetic    : arithmetic_t;
    geometry      : geometry_t;
    hold          : boolean;
    parallel_rows : positive;
    max_columns   : positive;
    channels      : positive;
    sharpening    : string
  ) return boolean;

  -- Number of taps of the slice that needs most.
  function tap_count (
    geometry : geometry_t;
    hold     : boolean
  ) return positive;

  -- Neighbouring switches that a phase closes.
  function closed_width (
    micro_image_size : positive;
    hold             : boolean
  ) return positive;

  -- The shortest delay of the taps whose switches are closed for pixels of a phase.
  function first_delay (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural
  ) return natural;

  -- Whether the M outputs of every micro image are equal in all slices.
  function can_hold (
    geometry : geometry_t
  ) return boolean;

  -- The shortest band in tokens: a multiple of the parallel rows, and long enough for the line buffers (a single
  -- column in each module needs none). The sequencer appends empty tokens to shorter bands.
  function min_line_steps (
    parallel_rows : positive;
    max_columns   : positive
  ) return positive;

  -- Latency of a filter stage in clocks.
  function stage_latency (
    stored         : boolean;
    broadcast_taps : natural
  ) return positive;

  -- Latency of the filter array in clocks.
  function array_latency (
    stored         : boolean;
    broadcast_taps : natural;
    order          : natural
  ) return positive;

end package fir_pkg;

package body fir_pkg is

  function closed_width (
    micro_image_size : positive;
    hold             : boolean
  ) return positive is
  begin

    -- A pixel adds to M neighbouring outputs; if these are equal, only to the one that is held.
    return choose(hold, 1, micro_image_size);

  end function closed_width;

  function tap_count (
    geometry : geometry_t;
    hold     : boolean
  ) return positive is

    constant M : positive := geometry.micro_image_size;

    variable largest : natural;

  begin

    -- All slices end at the same tap, so that they have the same delay. The slice that reaches furthest back
    -- decides.
    largest := 0;

    for i in 0 to geometry.slices - 1 loop

      largest := larger(largest, closed_width(M, hold) + (M - 1) * abs (geometry.shifts(i) - 1) -
                        own_delay(geometry, i));

    end loop;

    return largest + geometry.output_delay;

  end function tap_count;

  function first_delay (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural
  ) return natural is
  begin

    -- A slice with less delay than the set begins later, so that all slices end together.
    return phase * (geometry.shifts(slice) - 1) + geometry.output_delay - centre_offset(geometry, slice);

  end function first_delay;

  function can_hold (
    geometry : geometry_t
  ) return boolean is

    constant M : positive := geometry.micro_image_size;

  begin

    for i in 0 to geometry.slices - 1 loop

      -- The outputs of a micro image are equal only if the shift is a multiple of M, and they begin with a
      -- micro image only if the offset is a multiple of M too.
      if geometry.shifts(i) mod M /= 0 or centre_offset(geometry, i) mod M /= 0 then
        return false;
      end if;

    end loop;

    return true;

  end function can_hold;

  -- Bits that a column stage stores for one channel of a column: its partial sums. The last tap of a filter
  -- without hold stores none.
  function kept_bits (
    arithmetic : arithmetic_t;
    geometry   : geometry_t;
    hold       : boolean;
    stage      : natural
  ) return natural is

    constant M : positive := arithmetic.micro_image_size;

  begin

    -- The last tap's sum leaves at once and is not stored.
    return (tap_count(geometry, hold) - choose(hold, 0, 1)) *
           bits_for(M * product_max(arithmetic, arithmetic.passes + stage));

  end function kept_bits;

  function takes_filters (
    name          : string;
    arithmetic    : arithmetic_t;
    geometry      : geometry_t;
    hold          : boolean;
    parallel_rows : positive;
    max_columns   : positive;
    channels      : positive;
    sharpening    : string
  ) return boolean is

    constant M : positive := arithmetic.micro_image_size;

    variable depth : positive;
    variable words : natural;
    variable bits  : natural;

  begin

    assert parallel_rows <= MOST_PARALLEL_ROWS
      report name & ": PARALLEL_ROWS must be at most 64"
      severity failure;

    assert not hold or can_hold(geometry)
      report name & ": HOLD needs outputs that are equal throughout a micro image: SHIFTS that are multiples of " &
             "MICRO_IMAGE_SIZE, even ones if that is even"
      severity failure;

    assert tap_count(geometry, hold) + (arithmetic.passes - 1) * tap_count(pass_geometry(geometry, 1), false) <=
           MOST_TAPS
      report name & ": MICRO_IMAGE_SIZE and SHIFTS need more than 512 taps"
      severity failure;

    depth := divide_up(max_columns, parallel_rows);
    words := 0;
    bits  := kept_bits(arithmetic, geometry, hold, 0);

    if depth > 1 then
      -- Line buffers have a power of two of words: their address is a counter that wraps round.
      words := channels * parallel_rows * 2 ** bits_for(depth - 1);
    end if;

    for i in 1 to arithmetic.passes - 1 loop

      bits := bits + kept_bits(arithmetic, pass_geometry(geometry, i), false, i);

    end loop;

    return takes_line_bits(name, words, bits,
                           sharpen_line_bits(sharpening, M, channels * max_columns,
                                             bits_for(product_max(arithmetic, 2 * arithmetic.passes))));

  end function takes_filters;

  function min_line_steps (
    parallel_rows : positive;
    max_columns   : positive
  ) return positive is
  begin

    -- Each module then has a single column, whose sums stay in registers.
    if max_columns <= parallel_rows then
      return parallel_rows;
    end if;

    -- A column comes again in the next band; its partial sums must be back in memory by then.
    return divide_up(parallel_rows - 1 + PARTIAL_SUM_LOOP, parallel_rows) * parallel_rows;

  end function min_line_steps;

  function stage_latency (
    stored         : boolean;
    broadcast_taps : natural
  ) return positive is
  begin

    -- Filter stage 3; the table of products and the latches of the input take one clock each.
    return 3 + choose(stored, 1, 0) + choose(broadcast_taps > 0, 1, 0);

  end function stage_latency;

  function array_latency (
    stored         : boolean;
    broadcast_taps : natural;
    order          : natural
  ) return positive is
  begin

    -- Each pass has a stage for rows and one for columns.
    return 2 * (order + 1) * stage_latency(stored, broadcast_taps) + choose(stored, 0, DIVIDE_LATENCY);

  end function array_latency;

end package body fir_pkg;
