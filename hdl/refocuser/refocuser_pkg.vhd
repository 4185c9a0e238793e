-- SPDX-License-Identifier: Apache-2.0
-- Latencies and limits of the engines, for the top levels. All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
use work.sharpen_pkg.all;
use work.fir_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_lanes_pkg.all;

package refocuser_pkg is

  -- How a raster_refocuser on a board computes: the core's generics of these names. SHIFTS and ENGINE are generics
  -- beside this record, because VHDL-93 has no fields of unconstrained length.
  type core_t is record
    micro_image_size    : positive range 1 to 128;
    interpolation_order : natural range 0 to 3;
    hold                : boolean;
    max_columns         : positive range 1 to 8192;
    exact               : boolean;
    fraction_bits       : natural range 0 to 12;
    guard_bits          : natural range 0 to 12;
    broadcast_taps      : natural;
  end record core_t;

  -- Returns true, or stops elaboration if a raster_refocuser cannot be built; the message begins with the name.
  function takes_refocuser (
    name          : string;
    arithmetic    : arithmetic_t;
    geometry      : geometry_t;
    hold          : boolean;
    parallel_rows : positive;
    pixels        : positive;
    max_columns   : positive;
    channels      : positive;
    engine        : string;
    any_rows      : boolean;
    sharpening    : string;
    normalised    : boolean
  ) return boolean;

  -- Latency of an engine ("fir", "moving_sum") in clocks.
  function engine_latency (
    engine         : string;
    stored         : boolean;
    order          : natural;
    broadcast_taps : natural
  ) return positive;

  -- The shortest line in tokens that an engine ("fir", "moving_sum", "stack") takes without a pause. With a normalised
  -- border the weights' moving sums set it for every engine.
  function engine_line_steps (
    engine        : string;
    delay         : natural;
    parallel_rows : positive;
    max_columns   : positive;
    normalised    : boolean
  ) return positive;

  -- The shortest frame in bands that an engine takes without a pause.
  function engine_frame_bands (
    engine     : string;
    geometry   : geometry_t;
    order      : natural;
    any_rows   : boolean;
    normalised : boolean
  ) return positive;

end package refocuser_pkg;

package body refocuser_pkg is

  function takes_refocuser (
    name          : string;
    arithmetic    : arithmetic_t;
    geometry      : geometry_t;
    hold          : boolean;
    parallel_rows : positive;
    pixels        : positive;
    max_columns   : positive;
    channels      : positive;
    engine        : string;
    any_rows      : boolean;
    sharpening    : string;
    normalised    : boolean
  ) return boolean is

    variable fits : boolean;

  begin

    -- Checks come in this order: what the engine cannot do at all, sizes, the content of its memories. Each message
    -- names what to change.
    assert same_text(engine, "fir") or same_text(engine, "moving_sum")
      report name & ": unknown ENGINE " & engine & ", expected fir or moving_sum"
      severity failure;

    assert same_text(engine, "moving_sum") or not any_rows
      report name & ": ANY_ROWS needs the ENGINE moving_sum"
      severity failure;

    assert same_text(engine, "moving_sum") or pixels = 1
      report name & ": PIXELS_PER_CLOCK above 1 needs the ENGINE moving_sum"
      severity failure;

    -- Moving sums gain nothing by parallel rows: several pixels of a line share adders instead.
    assert same_text(engine, "fir") or parallel_rows = 1
      report name & ": PARALLEL_ROWS above 1 needs the ENGINE fir"
      severity failure;

    -- Conditions that both engines share.
    fits := takes_columns(name, max_columns) and takes_arithmetic(name, arithmetic) and
            takes_sharpening(name, sharpening, geometry.slices, arithmetic.exact, parallel_rows) and
            takes_border(name, normalised, arithmetic.exact, parallel_rows, sharpens(sharpening));

    -- Limits of the engine's own schedule and memories.
    if same_text(engine, "moving_sum") then
      return fits and takes_sums(name, arithmetic, geometry, any_rows, pixels, max_columns, channels, sharpening);
    end if;

    return fits and takes_filters(name, arithmetic, geometry, hold, parallel_rows, max_columns, channels, sharpening);

  end function takes_refocuser;

  function engine_latency (
    engine         : string;
    stored         : boolean;
    order          : natural;
    broadcast_taps : natural
  ) return positive is
  begin

    -- Each engine's package has its latency, beside the entities that the latency consists of.
    if same_text(engine, "moving_sum") then
      return sum_array_latency(stored, order);
    end if;

    return array_latency(stored, broadcast_taps, order);

  end function engine_latency;

  function engine_line_steps (
    engine        : string;
    delay         : natural;
    parallel_rows : positive;
    max_columns   : positive;
    normalised    : boolean
  ) return positive is
  begin

    -- Moving sums, and the weights of a normalised border, work on one line at a time: the next line begins when the
    -- last output of the line before has left.
    return larger(min_line_steps(parallel_rows, max_columns),
                  choose(normalised or not same_text(engine, "fir"), delay + 1, 1));

  end function engine_line_steps;

  function engine_frame_bands (
    engine     : string;
    geometry   : geometry_t;
    order      : natural;
    any_rows   : boolean;
    normalised : boolean
  ) return positive is
  begin

    -- As in engine_line_steps, with frames and lines in place of lines and pixels.
    if normalised or not same_text(engine, "fir") then
      return least_frame(geometry, order, any_rows);
    end if;

    -- Filters keep no state between frames, because the partial sums of the frame before are dropped: any number of
    -- bands will do.
    return 1;

  end function engine_frame_bands;

end package body refocuser_pkg;
