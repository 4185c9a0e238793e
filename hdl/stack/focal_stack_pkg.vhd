-- SPDX-License-Identifier: Apache-2.0
-- The places in the shared column memory at which the slices of a focal stack find their pixels.
--
-- The lines of each phase form a shift register: each line that arrives moves those of its phase by one place.
-- Frames are a multiple of M lines apart, so every M-th line is of a phase, and a pixel of a given age is always at
-- the same place. Ages are those of sum_schedule_pkg. All functions are evaluated at elaboration only.

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

package focal_stack_pkg is

  -- The plan of stack_array.
  function plan_of (
    core : core_t
  ) return plan_t;

  -- Place, among the lines of its phase, of a pixel of this age: 0 is the newest in memory, -1 the line that is just
  -- coming in.
  function history_place (
    geometry : geometry_t;
    age      : natural
  ) return integer;

  -- Lines of a phase that are kept for all slices.
  function history_lines (
    geometry : geometry_t;
    phase    : natural
  ) return natural;

  -- Lines of all phases before this one (phase = M: of all phases).
  function history_base (
    geometry : geometry_t;
    phase    : natural
  ) return natural;

  -- Width of a word with the pixels of all phases; one bit more than needed, because ports need at least one bit.
  function history_word_bits (
    geometry   : geometry_t;
    pixel_bits : positive
  ) return positive;

  -- Width of one sum of a slice over columns.
  function column_sum_bits (
    geometry  : geometry_t;
    lane_bits : positive
  ) return positive;

  -- Width of the column sums of all slices, for a whole token.
  function stack_sum_bits (
    geometry  : geometry_t;
    lanes     : positive;
    lane_bits : positive
  ) return positive;

  -- Latency of stack_columns in clocks.
  constant STACK_COLUMN_LATENCY : positive := 7;

  -- Latency of the slowest row stage with several pixels a token; slices take that many clocks or one fewer.
  function stack_lanes_latency (
    geometry : geometry_t;
    pixels   : positive
  ) return positive;

end package focal_stack_pkg;

package body focal_stack_pkg is

  function history_place (
    geometry : geometry_t;
    age      : natural
  ) return integer is
  begin

    -- Lines of a phase are M apart, so one place is M steps of age.
    return divide_up(age, geometry.micro_image_size) - 1;

  end function history_place;

  function history_lines (
    geometry : geometry_t;
    phase    : natural
  ) return natural is
  begin

    -- Lines of a phase are M apart; the one that has just come is not in the memory yet.
    return divide_up(oldest(geometry, phase), geometry.micro_image_size);

  end function history_lines;

  function history_base (
    geometry : geometry_t;
    phase    : natural
  ) return natural is

    variable lines : natural;

  begin

    -- The shift registers of the phases lie side by side in a word.
    lines := 0;

    for v in 0 to phase - 1 loop

      lines := lines + history_lines(geometry, v);

    end loop;

    return lines;

  end function history_base;

  function history_word_bits (
    geometry   : geometry_t;
    pixel_bits : positive
  ) return positive is
  begin

    -- One bit more, always 0: a set that needs no line of any phase would else have an empty word.
    return history_base(geometry, geometry.micro_image_size) * pixel_bits + 1;

  end function history_word_bits;

  function column_sum_bits (
    geometry  : geometry_t;
    lane_bits : positive
  ) return positive is
  begin

    -- The sum of a box of white pixels.
    return bits_for(largest_box(geometry) * (2 ** lane_bits - 1));

  end function column_sum_bits;

  function stack_sum_bits (
    geometry  : geometry_t;
    lanes     : positive;
    lane_bits : positive
  ) return positive is
  begin

    return geometry.slices * lanes * column_sum_bits(geometry, lane_bits);

  end function stack_sum_bits;

  function stack_lanes_latency (
    geometry : geometry_t;
    pixels   : positive
  ) return positive is

    variable most : positive;

  begin

    -- All slices wait for the slowest, so that their pixels leave together.
    most := 1;

    for i in 0 to geometry.slices - 1 loop

      most := larger(most, lane_stage_latency(slice_geometry(geometry, i), pixels));

    end loop;

    return most;

  end function stack_lanes_latency;

  function memory_bits (
    core : core_t
  ) return natural is

    constant M          : positive := core.geometry.micro_image_size;
    constant PIXEL_BITS : positive := core.arithmetic.pixel_bits;

    variable sums : natural;

  begin

    sums := 0;

    -- A line of one token keeps pixels and sums in registers.
    if tokens_of(core) = 1 then
      return 0;
    end if;

    for i in 0 to core.geometry.slices - 1 loop

      -- Running and first sums; results if the slice holds outputs; held first sums if a line begins within a group.
      sums := sums + 2 + choose(group_size(core.geometry, i) > 1, 1, 0) +
              choose(begins_group(core.geometry, i, 0), 0, 1);

    end loop;

    return history_base(core.geometry, M) * PIXEL_BITS + sums * column_sum_bits(core.geometry, PIXEL_BITS);

  end function memory_bits;

  function plan_of (
    core : core_t
  ) return plan_t is

    constant DELAY : natural := core.geometry.output_delay;

    variable plan : plan_t;

  begin

    plan              := NO_PLAN;
    plan.row_tokens   := lane_delay(core.geometry, core.pixels);
    plan.column_lines := DELAY;
    plan.sum_clocks   := STACK_COLUMN_LATENCY + sum_stage_latency(false, 1);

    -- With several pixels a token, lane_stage filters the rows.
    if core.pixels > 1 then
      plan.sum_clocks := STACK_COLUMN_LATENCY + stack_lanes_latency(core.geometry, core.pixels);
    end if;

    -- Rows and columns of moving sums, as in sum_plan_pkg. A line of one token keeps its sums in registers.
    plan.min_steps     := larger(choose(tokens_of(core) > 1, PARTIAL_SUM_LOOP, 1), plan.row_tokens + 1);
    plan.min_bands     := DELAY + 1;
    plan.modulus       := core.geometry.micro_image_size;
    plan.keeps_modulus := true;
    plan.memory_words  := core.channels * core.pixels * tokens_of(core);
    plan.memory_bits   := memory_bits(core);

    return plan;

  end function plan_of;

end package body focal_stack_pkg;
