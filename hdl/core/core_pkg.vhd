-- SPDX-License-Identifier: Apache-2.0
-- What a core is built for, and how its stream shell works with the engine.
--
-- What users instantiate makes one constant of type core_t from its generics (refocuser_pkg). All entities inside take
-- this constant whole, so that texts are parsed, limits checked and clocks counted once.
--
-- All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;

package core_pkg is

  -- The engines: switched filters, moving sums, and moving sums of all slices at once.
  type engine_t is (fir, moving_sum, stack);

  -- The largest weight of sharpening is a quarter: the taps of a dimension then double a sum at most.
  constant MOST_WEIGHT : positive := 16;

  -- The weight of sharpening in 64ths by slice, 0 behind the last one.
  type weights_t is array (natural range 0 to MOST_SLICES - 1) of natural range 0 to MOST_WEIGHT;

  constant NO_WEIGHTS : weights_t := (others => 0);

  -- The numbers by which a stream shell works with an engine. An engine's package counts them for the engine alone;
  -- refocuser_pkg adds what the sharpener, the weights and the division need.
  type plan_t is record
    -- Delay of rows in tokens, and of columns in lines.
    row_tokens   : natural;
    column_lines : natural;
    -- Clocks from a token to its sums in the engine, and to its result.
    sum_clocks : natural;
    clocks     : natural;
    -- The shortest band in tokens, a multiple of the parallel rows; the shortest frame in bands.
    min_steps : natural;
    min_bands : natural;
    -- The number of bands of each frame is filled up to a multiple of modulus. keeps_modulus: flush lines that are not
    -- needed for the multiple count as well.
    modulus       : natural;
    keeps_modulus : boolean;
    -- Column memories: words of all channels, and bits of a word.
    memory_words : natural;
    memory_bits  : natural;
  end record plan_t;

  -- A plan without numbers, which takes_plan refuses.
  constant NO_PLAN : plan_t :=
  (
    row_tokens    => 0,
    column_lines  => 0,
    sum_clocks    => 0,
    clocks        => 0,
    min_steps     => 0,
    min_bands     => 0,
    modulus       => 0,
    keeps_modulus => false,
    memory_words  => 0,
    memory_bits   => 0
  );

  type core_t is record
    engine     : engine_t;
    geometry   : geometry_t;
    arithmetic : arithmetic_t;
    -- Stack: how often each slice comes, one behind the other; 2 with a smaller box behind that of M samples.
    boxes_each : positive range 1 to 2;
    -- Rows filtered at once; neighbouring pixels of a token; longest line in pixels; channels of a pixel.
    rows     : positive;
    pixels   : positive;
    columns  : positive;
    channels : positive;
    -- Filters: whether outputs are held; taps that each latch of the broadcast net drives, 0 without latches.
    hold : boolean;
    taps : natural;
    -- Moving sums: frames of any number of rows follow each other without a pause.
    any_rows : boolean;
    -- sharpens: a slice has a weight above 0; weights: the weight of each slice.
    sharpens : boolean;
    weights  : weights_t;
    -- Sums are divided by the number of views that reach an output.
    normalised : boolean;
    plan       : plan_t;
  end record core_t;

  -- Tokens of the longest line.
  function tokens_of (
    core : core_t
  ) return positive;

  -- Slices to choose from, each once, and their shifts.
  function slices_of (
    core : core_t
  ) return positive;

  function shifts_of (
    core : core_t
  ) return shifts_t;

  -- Slices that come out side by side.
  function slices_at_once (
    core : core_t
  ) return positive;

  -- Pixels of a row in a token, in bits.
  function row_bits (
    core : core_t
  ) return positive;

  -- Pixels of a row in a result, in bits: those of all slices that come out at once.
  function result_bits (
    core : core_t
  ) return positive;

  -- Width of a sum behind the last pass, and of the sums of a row's result.
  function final_sum_bits (
    core : core_t
  ) return positive;

  function row_sums_bits (
    core : core_t
  ) return positive;

  -- Whether sums are divided by weights that come with them: those of a normalised border, or those of the slices where
  -- these have boxes that differ.
  function weighted (
    core : core_t
  ) return boolean;

  -- Width of a weight; 0 without weights.
  function weight_bits (
    core : core_t
  ) return natural;

  -- Width of all weights of a token; 1 bit for each without weights, because ports need at least one.
  function weights_bits (
    core : core_t
  ) return positive;

  -- Returns true, or stops elaboration if the plan that an engine's package made is wrong; the message begins with the
  -- name.
  function takes_plan (
    name : string;
    core : core_t;
    plan : plan_t
  ) return boolean;

end package core_pkg;

package body core_pkg is

  function tokens_of (
    core : core_t
  ) return positive is
  begin

    return line_tokens(core.columns, core.pixels);

  end function tokens_of;

  function slices_of (
    core : core_t
  ) return positive is
  begin

    return core.geometry.slices / core.boxes_each;

  end function slices_of;

  function shifts_of (
    core : core_t
  ) return shifts_t is

    variable shifts : shifts_t;

  begin

    shifts := (others => 0);

    for i in 0 to core.geometry.slices - 1 loop

      shifts(i / core.boxes_each) := core.geometry.shifts(i);

    end loop;

    return shifts;

  end function shifts_of;

  function slices_at_once (
    core : core_t
  ) return positive is
  begin

    return choose(core.engine = stack, core.geometry.slices, 1);

  end function slices_at_once;

  function row_bits (
    core : core_t
  ) return positive is
  begin

    return core.pixels * core.channels * core.arithmetic.pixel_bits;

  end function row_bits;

  function result_bits (
    core : core_t
  ) return positive is
  begin

    return slices_at_once(core) * row_bits(core);

  end function result_bits;

  function final_sum_bits (
    core : core_t
  ) return positive is
  begin

    return value_bits(core.arithmetic, 2 * core.arithmetic.passes);

  end function final_sum_bits;

  function row_sums_bits (
    core : core_t
  ) return positive is
  begin

    return slices_at_once(core) * core.pixels * core.channels * final_sum_bits(core);

  end function row_sums_bits;

  function weighted (
    core : core_t
  ) return boolean is
  begin

    return core.normalised or boxes_differ(core.geometry);

  end function weighted;

  function weight_bits (
    core : core_t
  ) return natural is
  begin

    -- A weight is at most the sum of a frame of ones.
    return choose(weighted(core), bits_for(final_divisor(core.arithmetic)), 0);

  end function weight_bits;

  function weights_bits (
    core : core_t
  ) return positive is
  begin

    return slices_at_once(core) * core.pixels * larger(weight_bits(core), 1);

  end function weights_bits;

  function takes_plan (
    name : string;
    core : core_t;
    plan : plan_t
  ) return boolean is

    constant DELAY : natural := total_delay(core.geometry, core.arithmetic.passes - 1);

  begin

    -- A shorter delay would leave a line's last pixels, or a frame's last lines, in the engine.
    assert plan.row_tokens * core.pixels >= DELAY
      report name & ": the engine's plan has row_tokens that are shorter than the delay of the rows"
      severity failure;

    assert plan.column_lines >= DELAY
      report name & ": the engine's plan has column_lines that are shorter than the delay of the columns"
      severity failure;

    assert plan.sum_clocks > 0
      report name & ": the engine's plan has no sum_clocks"
      severity failure;

    assert plan.min_steps > 0 and plan.min_steps mod core.rows = 0
      report name & ": the engine's plan has min_steps that are no multiple of PARALLEL_ROWS"
      severity failure;

    assert plan.min_bands > 0
      report name & ": the engine's plan has no min_bands"
      severity failure;

    assert plan.modulus > 0
      report name & ": the engine's plan has no modulus"
      severity failure;

    return true;

  end function takes_plan;

end package body core_pkg;
