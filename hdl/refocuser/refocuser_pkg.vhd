-- SPDX-License-Identifier: Apache-2.0
-- From the generics of a core to its record: parsing, refusals, the plan.
--
-- What users instantiate calls core_of or stack_of once, in front of all that it computes from its generics. Another
-- engine has a line in each `case`.
--
-- All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.number_set_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.core_pkg.all;
use work.sharpen_pkg.all;
use work.fir_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_lanes_pkg.all;
use work.border_pkg.all;

package refocuser_pkg is

  -- The core that the generics of raster_refocuser describe. Stops elaboration if the core cannot be built; the message
  -- begins with the name.
  function core_of (
    name                : string;
    micro_image_size    : positive;
    shifts              : string;
    centred             : boolean  := true;
    interpolation_order : natural  := 0;
    hold                : boolean  := false;
    parallel_rows       : positive := 1;
    pixels_per_clock    : positive := 1;
    max_columns         : positive := 2048;
    channels            : positive := 1;
    pixel_bits          : positive := 8;
    exact               : boolean  := true;
    fraction_bits       : natural  := 0;
    guard_bits          : natural  := 0;
    engine              : string   := "fir";
    any_rows            : boolean  := false;
    sharpening          : string   := "";
    border_normalised   : boolean  := false;
    broadcast_taps      : natural  := 0;
    box                 : string   := ""
  ) return core_t;

  -- The core that the generics of focal_stack describe; refused like core_of.
  function stack_of (
    name              : string;
    micro_image_size  : positive;
    shifts            : string;
    centred           : boolean  := true;
    max_columns       : positive := 2048;
    pixels_per_clock  : positive := 1;
    channels          : positive := 1;
    pixel_bits        : positive := 8;
    border_normalised : boolean  := false;
    box               : string   := "";
    boxes_each        : positive := 1
  ) return core_t;

end package refocuser_pkg;

package body refocuser_pkg is

  -- The engine of this name.
  function engine_of (
    name   : string;
    engine : string
  ) return engine_t is
  begin

    if same_text(engine, "moving_sum") then
      return moving_sum;
    end if;

    assert same_text(engine, "fir")
      report name & ": unknown ENGINE " & engine & ", expected fir or moving_sum"
      severity failure;

    return fir;

  end function engine_of;

  -- The weights that SHARPENING names, for so many slices.
  function weights_of (
    name       : string;
    sharpening : string;
    slices     : positive
  ) return weights_t is

    variable weights : weights_t;

  begin

    assert is_set(sharpening, 0, MOST_WEIGHT)
      report name & ": SHARPENING """ & sharpening & """ must be whole numbers from 0 to 16 with blanks in between"
      severity failure;

    assert slice_count(sharpening) = 0 or slice_count(sharpening) = slices
      report name & ": SHARPENING """ & sharpening & """ must have a weight for each slice of SHIFTS, or none"
      severity failure;

    weights := (others => 0);

    for i in 0 to slice_count(sharpening) - 1 loop

      weights(i) := slice_shift(sharpening, i);

    end loop;

    return weights;

  end function weights_of;

  -- The plan of the engine alone.
  function engine_plan (
    core : core_t
  ) return plan_t is
  begin

    case core.engine is

      when fir =>

        return work.fir_pkg.plan_of(core);

      when moving_sum =>

        return work.sum_plan_pkg.plan_of(core);

      when stack =>

        return work.focal_stack_pkg.plan_of(core);

    end case;

  end function engine_plan;

  -- Stops elaboration if the core cannot be built: what the engine cannot do at all, sizes, the content of its
  -- memories, in this order. Each message names what to change.
  function takes_core (
    name : string;
    core : core_t
  ) return boolean is

    constant SIZES : arithmetic_t := core.arithmetic;

    variable plan : plan_t;

  begin

    assert core.engine = moving_sum or not core.any_rows
      report name & ": ANY_ROWS needs the ENGINE moving_sum"
      severity failure;

    assert core.engine = moving_sum or core.engine = stack or core.pixels = 1
      report name & ": PIXELS_PER_CLOCK above 1 needs the ENGINE moving_sum"
      severity failure;

    -- Moving sums gain nothing by parallel rows: several pixels of a line share adders instead.
    assert core.engine = fir or core.rows = 1
      report name & ": PARALLEL_ROWS above 1 needs the ENGINE fir"
      severity failure;

    assert core.rows <= MOST_PARALLEL_ROWS
      report name & ": PARALLEL_ROWS must be at most 64"
      severity failure;

    assert core.pixels <= 32 and 2 ** bits_for(larger(core.pixels - 1, 1)) = larger(core.pixels, 2)
      report name & ": PIXELS_PER_CLOCK must be 1, 2, 4, 8, 16 or 32"
      severity failure;

    -- Stored products are rounded between rows and columns, so they filter rows first; several pixels a token need
    -- columns first.
    assert core.pixels = 1 or SIZES.exact
      report name & ": PIXELS_PER_CLOCK above 1 needs EXACT"
      severity failure;

    assert core.columns <= MOST_COLUMNS
      report name & ": MAX_COLUMNS must be at most 8192"
      severity failure;

    -- A column's sums come back from memory, for which a line of one pixel leaves no clock.
    assert core.engine /= moving_sum or core.columns > 1
      report name & ": MAX_COLUMNS must be at least 2 with the ENGINE moving_sum"
      severity failure;

    -- Constants of an exact core are VHDL integers, which have 31 bits.
    assert not SIZES.exact or sums_fit(SIZES)
      report name & ": exact sums of MICRO_IMAGE_SIZE, PIXEL_BITS and INTERPOLATION_ORDER take more than 31 bits: " &
             "take smaller ones, or EXACT => false"
      severity failure;

    -- Stored products are divided by the box before they are summed.
    assert SIZES.exact or not boxes_differ(core.geometry)
      report name & ": BOX must be the same for all slices without EXACT"
      severity failure;

    -- The sharpener limits and rounds sums for one divisor.
    assert not core.sharpens or not boxes_differ(core.geometry)
      report name & ": BOX must be the same for all slices with SHARPENING"
      severity failure;

    -- Guard bits are the highest of the fraction bits, so there cannot be more of them.
    assert SIZES.exact or SIZES.guard_bits <= SIZES.fraction_bits
      report name & ": GUARD_BITS exceeds FRACTION_BITS"
      severity failure;

    -- The table has a word for each value; beyond 2**16 words it would take too much block RAM.
    assert SIZES.exact or SIZES.pixel_bits + SIZES.guard_bits <= 16
      report name & ": PIXEL_BITS + GUARD_BITS exceeds the 16 address bits of a stored product"
      severity failure;

    -- A table of zeros would make every picture black without raising a fault.
    assert SIZES.exact or
           scaled_quotient(2 ** SIZES.pixel_bits - 1, SIZES.fraction_bits, SIZES.box) > 0
      report name & ": all stored products are 0: take more FRACTION_BITS, or a smaller MICRO_IMAGE_SIZE or BOX"
      severity failure;

    -- The sharpener works on unrounded sums in raster order.
    assert not core.sharpens or (SIZES.exact and core.rows = 1)
      report name & ": SHARPENING needs EXACT and PARALLEL_ROWS = 1"
      severity failure;

    assert not core.normalised or SIZES.exact
      report name & ": BORDER_NORMALISED needs EXACT: stored products are divided by M before they are summed"
      severity failure;

    -- Weights come in raster order, one token after the other, so there cannot be parallel rows.
    assert not core.normalised or core.rows = 1
      report name & ": BORDER_NORMALISED needs PARALLEL_ROWS = 1"
      severity failure;

    -- The sharpener subtracts neighbours one lens away; near a border their sums would have other weights.
    assert not core.normalised or not core.sharpens
      report name & ": BORDER_NORMALISED cannot be combined with SHARPENING"
      severity failure;

    -- Weights of a stack come for all slices of one pixel.
    assert not core.normalised or core.engine /= stack or core.pixels = 1
      report name & ": BORDER_NORMALISED needs a PIXELS_PER_CLOCK of 1"
      severity failure;

    assert not core.hold or core.engine /= fir or can_hold(core.geometry)
      report name & ": HOLD needs outputs that are equal throughout a micro image: SHIFTS that are multiples of " &
             "MICRO_IMAGE_SIZE, even ones if that is even"
      severity failure;

    if core.engine = fir then
      assert taps_of(core) <= MOST_TAPS
        report name & ": MICRO_IMAGE_SIZE and SHIFTS need more than 512 taps"
        severity failure;
    end if;

    assert core.pixels = 1 or lane_delay(core.geometry, core.pixels) <= MOST_LANE_DELAY
      report name & ": SHIFTS delay rows by more than 4096 tokens of PIXELS_PER_CLOCK pixels"
      severity failure;

    -- Only now do all numbers of a plan fit integers.
    plan := engine_plan(core);

    assert line_bits_fit(plan.memory_words, plan.memory_bits, sharpen_line_bits(core))
      report name & ": SHIFTS, MICRO_IMAGE_SIZE and MAX_COLUMNS need more than 64 Mbit of column memories: " &
             "take fewer columns, or shifts nearer to 1"
      severity failure;

    return true;

  end function takes_core;

  -- The engine's plan, with what stands behind and beside the engine: sharpener, weights, division.
  function whole_plan (
    name : string;
    core : core_t
  ) return plan_t is

    constant M       : positive := core.geometry.micro_image_size;
    constant ENGINE  : plan_t   := engine_plan(core);
    constant REFUSED : boolean  := not takes_plan(name, core, ENGINE);

    variable counted : core_t;
    variable plan    : plan_t;

  begin

    plan         := ENGINE;
    counted      := core;
    counted.plan := ENGINE;
    plan.clocks  := ENGINE.sum_clocks + choose(core.arithmetic.exact, scaler_latency(weighted(core),
                                                                                     core.arithmetic.pixel_bits), 0);

    if core.sharpens then
      plan.row_tokens   := ENGINE.row_tokens + divide_up(M, core.pixels);
      plan.column_lines := ENGINE.column_lines + M;
      plan.clocks       := plan.clocks + SHARPEN_LATENCY;
      plan.min_steps    := larger(ENGINE.min_steps, PARTIAL_SUM_LOOP);
    end if;

    if core.normalised then
      -- The slower of sums and weights sets the latency. The weights are moving sums, which work on one line and on one
      -- frame at a time.
      plan.clocks    := larger(ENGINE.sum_clocks, border_latency(counted)) +
                        scaler_latency(true, core.arithmetic.pixel_bits);
      plan.min_steps := larger(ENGINE.min_steps, ENGINE.row_tokens + 1);
      plan.min_bands := larger(ENGINE.min_bands, least_frame(core.geometry, core.arithmetic.passes - 1,
                                                             core.any_rows));
    end if;

    return plan;

  end function whole_plan;

  -- A core whose fields are all given but the plan: refused, or with its plan.
  function planned (
    name : string;
    core : core_t
  ) return core_t is

    constant REFUSED : boolean := not takes_core(name, core);

    variable whole : core_t;

  begin

    whole      := core;
    whole.plan := whole_plan(name, core);

    return whole;

  end function planned;

  function core_of (
    name                : string;
    micro_image_size    : positive;
    shifts              : string;
    centred             : boolean  := true;
    interpolation_order : natural  := 0;
    hold                : boolean  := false;
    parallel_rows       : positive := 1;
    pixels_per_clock    : positive := 1;
    max_columns         : positive := 2048;
    channels            : positive := 1;
    pixel_bits          : positive := 8;
    exact               : boolean  := true;
    fraction_bits       : natural  := 0;
    guard_bits          : natural  := 0;
    engine              : string   := "fir";
    any_rows            : boolean  := false;
    sharpening          : string   := "";
    border_normalised   : boolean  := false;
    broadcast_taps      : natural  := 0;
    box                 : string   := ""
  ) return core_t is

    constant PARSED : geometry_t := geometry_of(name, micro_image_size, shifts, centred, box);
    constant SHARP  : weights_t  := weights_of(name, sharpening, PARSED.slices);

  begin

    return planned(name,
      (
        engine     => engine_of(name, engine),
        geometry   => PARSED,
        arithmetic =>
        (
          exact         => exact,
          box           => largest_box(PARSED),
          pixel_bits    => pixel_bits,
          fraction_bits => fraction_bits,
          guard_bits    => guard_bits,
          passes        => interpolation_order + 1
        ),
        boxes_each => 1,
        rows       => parallel_rows,
        pixels     => pixels_per_clock,
        columns    => max_columns,
        channels   => channels,
        hold       => hold,
        taps       => broadcast_taps,
        any_rows   => any_rows,
        sharpens   => SHARP /= NO_WEIGHTS,
        weights    => SHARP,
        normalised => border_normalised,
        plan       => NO_PLAN
      ));

  end function core_of;

  function stack_of (
    name              : string;
    micro_image_size  : positive;
    shifts            : string;
    centred           : boolean  := true;
    max_columns       : positive := 2048;
    pixels_per_clock  : positive := 1;
    channels          : positive := 1;
    pixel_bits        : positive := 8;
    border_normalised : boolean  := false;
    box               : string   := "";
    boxes_each        : positive := 1
  ) return core_t is

    constant PARSED : geometry_t := geometry_of(name, micro_image_size, shifts, centred, box);

  begin

    return planned(name,
      (
        engine     => stack,
        geometry   => PARSED,
        arithmetic =>
        (
          exact         => true,
          box           => largest_box(PARSED),
          pixel_bits    => pixel_bits,
          fraction_bits => 0,
          guard_bits    => 0,
          passes        => 1
        ),
        boxes_each => boxes_each,
        rows       => 1,
        pixels     => pixels_per_clock,
        columns    => max_columns,
        channels   => channels,
        hold       => false,
        taps       => 0,
        any_rows   => false,
        sharpens   => false,
        weights    => NO_WEIGHTS,
        normalised => border_normalised,
        plan       => NO_PLAN
      ));

  end function stack_of;

end package body refocuser_pkg;
