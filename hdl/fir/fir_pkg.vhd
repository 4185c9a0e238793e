-- SPDX-License-Identifier: Apache-2.0
-- The switched FIR filters: their taps, switches and clock counts.
--
-- In a transposed FIR filter with TAPS taps a pixel is broadcast to all taps, and tap w delays it by TAPS-1-w steps.
-- A pixel of phase p = k mod M is added by B neighbouring taps, B the box: those with delays p*(s-1) + origin ..
-- p*(s-1) + origin + B-1. The origin of a slice is the delay that brings S(k) to its place in the output; no tap has a
-- negative delay.
--
-- All slices of a set have the same output delay (refocus_pkg), so the number of a tap tells which output its
-- partial sum belongs to, in every slice.
--
-- With hold (all shifts multiples of M) the M outputs of a micro image are equal. The filter computes the first
-- and holds it; a phase then closes one switch instead of B, which is M then.
--
-- All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.core_pkg.all;

package fir_pkg is

  -- Limits: taps of all filters in a dimension, and rows at once.
  constant MOST_TAPS          : positive := 512;
  constant MOST_PARALLEL_ROWS : positive := 64;

  -- The plan of fir_array.
  function plan_of (
    core : core_t
  ) return plan_t;

  -- Taps of all filters in a dimension.
  function taps_of (
    core : core_t
  ) return positive;

  -- Number of taps of the slice that needs most.
  function tap_count (
    geometry : geometry_t;
    hold     : boolean
  ) return positive;

  -- Neighbouring switches that a phase closes in a slice.
  function closed_width (
    geometry : geometry_t;
    slice    : natural;
    hold     : boolean
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

  -- Latency of a filter stage in clocks.
  function stage_latency (
    stored         : boolean;
    broadcast_taps : natural
  ) return positive;

end package fir_pkg;

package body fir_pkg is

  function closed_width (
    geometry : geometry_t;
    slice    : natural;
    hold     : boolean
  ) return positive is
  begin

    -- A pixel adds to B neighbouring outputs; if these are equal, only to the one that is held.
    return choose(hold, 1, geometry.boxes(slice));

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

      largest := larger(largest, closed_width(geometry, i, hold) + (M - 1) * abs (geometry.shifts(i) - 1) -
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
  begin

    -- The last tap's sum leaves at once and is not stored.
    return (tap_count(geometry, hold) - choose(hold, 0, 1)) *
           bits_for(arithmetic.box * product_max(arithmetic, arithmetic.passes + stage));

  end function kept_bits;

  function taps_of (
    core : core_t
  ) return positive is
  begin

    return tap_count(core.geometry, core.hold) +
           (core.arithmetic.passes - 1) * tap_count(pass_geometry(core.geometry, 1), false);

  end function taps_of;

  function memory_words (
    core : core_t
  ) return natural is

    constant DEPTH : positive := divide_up(core.columns, core.rows);

  begin

    -- A module of a single column keeps its sums in registers.
    if DEPTH = 1 then
      return 0;
    end if;

    -- Line buffers have a power of two of words: their address is a counter that wraps round.
    return core.channels * core.rows * 2 ** bits_for(DEPTH - 1);

  end function memory_words;

  function memory_bits (
    core : core_t
  ) return natural is

    constant ORDER : natural range 0 to 3 := core.arithmetic.passes - 1;

    variable bits : natural;

  begin

    bits := kept_bits(core.arithmetic, core.geometry, core.hold, 0);

    for i in 1 to ORDER loop

      bits := bits + kept_bits(core.arithmetic, pass_geometry(core.geometry, i), false, i);

    end loop;

    return bits;

  end function memory_bits;

  function stage_latency (
    stored         : boolean;
    broadcast_taps : natural
  ) return positive is
  begin

    -- Filter stage 3; the table of products and the latches of the input take one clock each.
    return 3 + choose(stored, 1, 0) + choose(broadcast_taps > 0, 1, 0);

  end function stage_latency;

  function plan_of (
    core : core_t
  ) return plan_t is

    constant PASSES : positive := core.arithmetic.passes;
    constant DELAY  : natural  := total_delay(core.geometry, PASSES - 1);

    variable plan : plan_t;

  begin

    plan              := NO_PLAN;
    plan.row_tokens   := DELAY;
    plan.column_lines := DELAY;
    -- Each pass has a stage for rows and one for columns.
    plan.sum_clocks := 2 * PASSES * stage_latency(not core.arithmetic.exact, core.taps);
    plan.min_steps  := core.rows;

    -- A column comes again in the next band; its partial sums must be back in memory by then. Modules of a single
    -- column keep the sums in registers.
    if core.columns > core.rows then
      plan.min_steps := divide_up(core.rows - 1 + PARTIAL_SUM_LOOP, core.rows) * core.rows;
    end if;

    -- Filters keep no state between frames, because the partial sums of the frame before are dropped: any number of
    -- bands will do.
    plan.min_bands := 1;
    plan.modulus   := 1;

    plan.memory_words := memory_words(core);
    plan.memory_bits  := memory_bits(core);

    return plan;

  end function plan_of;

end package body fir_pkg;
