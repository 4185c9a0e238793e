-- SPDX-License-Identifier: Apache-2.0
-- The plan and the memories of moving_sum_array.
--
-- All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.core_pkg.all;
use work.sum_schedule_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_lanes_pkg.all;

package sum_plan_pkg is

  -- The plan of moving_sum_array.
  function plan_of (
    core : core_t
  ) return plan_t;

  -- Delay of the row stages in tokens.
  function rows_delay (
    core : core_t
  ) return natural;

  -- Latency of the row stage of a pass in clocks.
  function rows_latency (
    core : core_t;
    pass : natural
  ) return positive;

end package sum_plan_pkg;

package body sum_plan_pkg is

  -- Bits that a column stage keeps for one channel of a column: pixels, running sums, first sums, held results.
  function kept_bits (
    arithmetic : arithmetic_t;
    geometry   : geometry_t;
    any_rows   : boolean;
    stage      : natural
  ) return natural is

    variable lines : natural;
    variable sums  : positive;

  begin

    -- Running and first sums are always kept; results too if outputs are held, and held first sums if a line begins
    -- within a group.
    lines := kept_lines(geometry, any_rows);
    sums  := 2 + choose(holds_outputs(geometry), 1, 0) + choose(begins_within_group(geometry), 1, 0);

    return lines * bits_for(product_max(arithmetic, stage)) +
           sums * bits_for(arithmetic.box * product_max(arithmetic, stage));

  end function kept_bits;

  function memory_bits (
    core : core_t
  ) return natural is

    constant ORDER : natural range 0 to 3 := core.arithmetic.passes - 1;

    variable first : natural;
    variable bits  : natural;

  begin

    -- Exact sums filter columns first.
    first := choose(core.arithmetic.exact, 0, core.arithmetic.passes);
    bits  := kept_bits(core.arithmetic, core.geometry, core.any_rows, first);

    for i in 1 to ORDER loop

      bits := bits + kept_bits(core.arithmetic, pass_geometry(core.geometry, i), core.any_rows, first + i);

    end loop;

    return bits;

  end function memory_bits;

  function rows_delay (
    core : core_t
  ) return natural is

    constant ORDER : natural range 0 to 3 := core.arithmetic.passes - 1;

    variable tokens : natural;

  begin

    tokens := 0;

    for i in 0 to ORDER loop

      tokens := tokens + lane_delay(pass_geometry(core.geometry, i), core.pixels);

    end loop;

    return tokens;

  end function rows_delay;

  function rows_latency (
    core : core_t;
    pass : natural
  ) return positive is
  begin

    if core.pixels = 1 then
      return sum_stage_latency(not core.arithmetic.exact, 1);
    end if;

    return lane_stage_latency(pass_geometry(core.geometry, pass), core.pixels);

  end function rows_latency;

  function plan_of (
    core : core_t
  ) return plan_t is

    constant ORDER : natural range 0 to 3 := core.arithmetic.passes - 1;

    variable plan : plan_t;

  begin

    plan              := NO_PLAN;
    plan.row_tokens   := rows_delay(core);
    plan.column_lines := total_delay(core.geometry, ORDER);

    for i in 0 to ORDER loop

      -- Columns have at least two tokens.
      plan.sum_clocks := plan.sum_clocks + sum_stage_latency(not core.arithmetic.exact, 2) + rows_latency(core, i);

    end loop;

    -- Moving sums work on one line at a time: the next line begins when the last output of the line before has left.
    -- So do frames and lines in place of lines and pixels. A column's sums must be back in memory by the next line.
    plan.min_steps := larger(PARTIAL_SUM_LOOP, plan.row_tokens + 1);
    plan.min_bands := least_frame(core.geometry, ORDER, core.any_rows);
    plan.modulus   := choose(core.any_rows, 1, core.geometry.micro_image_size);

    plan.memory_words := core.channels * core.pixels * tokens_of(core);
    plan.memory_bits  := memory_bits(core);

    return plan;

  end function plan_of;

end package body sum_plan_pkg;
