-- SPDX-License-Identifier: Apache-2.0
-- The switched FIR filters: their taps, switches and clock counts.
--
-- As a transposed FIR filter with TAPS taps a pixel is broadcast to all taps, and tap w delays it by TAPS-1-w
-- steps. A pixel of phase p = k mod M is added by M neighbouring taps: those whose delay lies in
-- p*(s-1) + origin .. p*(s-1) + origin + M-1. The origin of a slice is the delay that brings S(k) to its place
-- in the output; no tap has a negative delay.
--
-- All slices of a set have the same output delay (refocus_pkg). So the place of a tap tells the output that its
-- partial sum belongs to, whatever the slice.
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

  -- The most taps of all filters of a dimension, and the most rows at once.
  constant MOST_TAPS          : positive := 512;
  constant MOST_PARALLEL_ROWS : positive := 64;

  -- Stops elaboration, by a message that begins with a name, if the filters cannot be built; else true.
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

  -- Number of taps that the slice with the most needs.
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

  -- The shortest band in tokens: a multiple of the rows taken at once, and not before the line
  -- buffers are ready again (one column for each module needs none). The sequencer appends empty
  -- steps to shorter bands.
  function min_line_steps (
    parallel_rows : positive;
    max_columns   : positive
  ) return positive;

  -- Clocks from a token at a filter stage's input to its output.
  function stage_latency (
    stored         : boolean;
    broadcast_taps : natural
  ) return positive;

  -- Clocks from a token at the filter array's input to its output.
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

    -- A pixel adds to M neighbouring outputs; where these are equal, to the one that is held.
    return choose(hold, 1, micro_image_size);

  end function closed_width;

  function tap_count (
    geometry : geometry_t;
    hold     : boolean
  ) return positive is

    constant M : positive := geometry.micro_image_size;

    variable largest : natural;

  begin

    -- All slices end at the same tap, so that they have the same delay; the one that reaches furthest back decides.
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

    -- A slice with less delay than the set's begins that much later, so that all end together.
    return phase * (geometry.shifts(slice) - 1) + geometry.output_delay - centre_offset(geometry, slice);

  end function first_delay;

  function can_hold (
    geometry : geometry_t
  ) return boolean is

    constant M : positive := geometry.micro_image_size;

  begin

    for i in 0 to geometry.slices - 1 loop

      -- The outputs of a micro image are equal only if a' is a multiple of M, and it begins where they do only if the
      -- offset is.
      if geometry.shifts(i) mod M /= 0 or centre_offset(geometry, i) mod M /= 0 then
        return false;
      end if;

    end loop;

    return true;

  end function can_hold;

  -- Bits that a column stage stores for a column of a channel: partial sums. The last tap of a filter without hold
  -- needs none.
  function kept_bits (
    arithmetic : arithmetic_t;
    geometry   : geometry_t;
    hold       : boolean;
    stage      : natural
  ) return natural is

    constant M : positive := arithmetic.micro_image_size;

  begin

    -- The last tap's sum goes out at once and is not kept.
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
      -- Line buffers of a power of two: their address is a counter that wraps around.
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

    -- A module has a single column then, whose sums stay in its registers.
    if max_columns <= parallel_rows then
      return parallel_rows;
    end if;

    -- A column comes again in the next band: its partial sums must be back in memory before they are read.
    return divide_up(parallel_rows - 1 + PARTIAL_SUM_LOOP, parallel_rows) * parallel_rows;

  end function min_line_steps;

  function stage_latency (
    stored         : boolean;
    broadcast_taps : natural
  ) return positive is
  begin

    -- Three clocks of fir_stage; a table of products and latches of the input take one each.
    return 3 + choose(stored, 1, 0) + choose(broadcast_taps > 0, 1, 0);

  end function stage_latency;

  function array_latency (
    stored         : boolean;
    broadcast_taps : natural;
    order          : natural
  ) return positive is
  begin

    -- A stage for rows and one for columns in each pass.
    return 2 * (order + 1) * stage_latency(stored, broadcast_taps) + choose(stored, 0, DIVIDE_LATENCY);

  end function array_latency;

end package body fir_pkg;
