-- SPDX-License-Identifier: Apache-2.0
-- An engine of direct sums, added by the recipe of CONTRIBUTING.md: each output adds its M pixels anew.
--
-- Output o is S(o + offset). Of each phase p one pixel reaches the output: the largest k <= u with k mod M = p, where
-- u = o + offset - p * (s - 1).

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.core_pkg.all;

package direct_pkg is

  -- Latency of direct_pass in clocks.
  constant DIRECT_LATENCY : positive := 3;

  -- Age of the pixel of a phase that an output adds, in steps.
  function direct_age (
    geometry     : geometry_t;
    slice        : natural;
    phase        : natural;
    output_phase : natural
  ) return natural;

  -- Steps that a pass remembers.
  function direct_steps (
    geometry : geometry_t
  ) return positive;

  -- The plan of direct_array.
  function plan_of (
    core : core_t
  ) return plan_t;

end package direct_pkg;

package body direct_pkg is

  function direct_age (
    geometry     : geometry_t;
    slice        : natural;
    phase        : natural;
    output_phase : natural
  ) return natural is

    constant M    : positive := geometry.micro_image_size;
    constant AWAY : integer  := phase * (geometry.shifts(slice) - 1) - centre_offset(geometry, slice);

  begin

    return geometry.output_delay + AWAY + (output_phase - AWAY - phase) mod M;

  end function direct_age;

  function direct_steps (
    geometry : geometry_t
  ) return positive is

    variable oldest : natural;

  begin

    oldest := geometry.output_delay;

    for s in 0 to geometry.slices - 1 loop

      for p in 0 to geometry.micro_image_size - 1 loop

        for q in 0 to geometry.micro_image_size - 1 loop

          oldest := larger(oldest, direct_age(geometry, s, p, q));

        end loop;

      end loop;

    end loop;

    return oldest + 1;

  end function direct_steps;

  function plan_of (
    core : core_t
  ) return plan_t is

    variable plan : plan_t;

  begin

    plan              := NO_PLAN;
    plan.row_tokens   := core.geometry.output_delay;
    plan.column_lines := core.geometry.output_delay;
    plan.sum_clocks   := 2 * DIRECT_LATENCY;
    plan.min_steps    := 1;
    plan.min_bands    := 1;
    plan.modulus      := 1;
    plan.memory_words := core.channels * core.columns;
    plan.memory_bits  := direct_steps(core.geometry) * value_bits(core.arithmetic, 1);

    return plan;

  end function plan_of;

end package body direct_pkg;
