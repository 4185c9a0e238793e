-- SPDX-License-Identifier: Apache-2.0
-- The outputs of picture_core and their delays. All functions are evaluated at elaboration only.
--
-- The possible outputs are a text with a letter for each: r the refocused slice, a the picture all in focus, d depth in
-- false colours, m the micro images as they go into the core.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.hex_pkg.all;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.core_pkg.all;
use work.index_pkg.all;
use work.sharpness_pkg.all;
use work.refocuser_pkg.all;
use work.screen_pkg.all;
use work.sensor_pkg.all;
use work.video_pkg.all;

package picture_pkg is

  -- What to show from the next frame on.
  type picture_choice_t is record
    -- true: the input passes unchanged.
    pass_through : std_logic;
    -- The slice; or with sweep all slices in turn, each for sweep_frames frames.
    slice        : std_logic_vector(7 downto 0);
    sweep        : std_logic;
    sweep_frames : std_logic_vector(7 downto 0);
    -- Place in OUTPUTS of what is shown; numbers beyond its end mean the first output.
    shown : std_logic_vector(1 downto 0);
  end record picture_choice_t;

  -- What an outgoing frame shows: a slice, and its place in OUTPUTS; raw: the input unchanged.
  type on_show_t is record
    slice : std_logic_vector(7 downto 0);
    place : std_logic_vector(1 downto 0);
    raw   : std_logic;
  end record on_show_t;

  -- How the raster that goes into a core is shown; from sensor_front.
  type front_t is record
    -- Size of the raster; constant while frames are followed.
    columns : std_logic_vector(15 downto 0);
    rows    : std_logic_vector(15 downto 0);
    -- direct: the raster itself is shown; place: the place in OUTPUTS of what is shown.
    direct : std_logic;
    place  : std_logic_vector(1 downto 0);
    -- Lines by which the output lags.
    lag : count_t;
    -- The core, and what follows it, must restart.
    restart : std_logic;
  end record front_t;

  -- Kind of each output by its place: 0 refocused, 1 all in focus, 2 depth, 3 micro images.

  type kinds_t is array (natural range 0 to 3) of natural range 0 to 3;

  function output_kinds (
    outputs : string
  ) return kinds_t;

  -- The core of a picture: a stack if an output needs all slices, else a raster_refocuser. With a sensor the raster's
  -- longest line replaces max_columns. Where no parameters say otherwise, the picture is that of screen_pkg and
  -- sensor_pkg. Stops elaboration if core or picture cannot be built; the message begins with the name.
  function picture_core_of (
    name                : string;
    micro_image_size    : positive;
    shifts              : string;
    interpolation_order : natural  := 0;
    hold                : boolean  := false;
    max_columns         : positive;
    channels            : positive := PIXEL_CHANNELS;
    exact               : boolean  := true;
    fraction_bits       : natural  := 0;
    guard_bits          : natural  := 0;
    broadcast_taps      : natural  := 0;
    engine              : string   := "fir";
    box                 : string   := "";
    outputs             : string   := work.screen_pkg.OUTPUTS;
    radius              : natural  := SHARPNESS_RADIUS;
    vote_radius         : natural  := work.screen_pkg.VOTE_RADIUS;
    colours             : string   := work.screen_pkg.COLOURS;
    sharp_too           : boolean  := work.screen_pkg.SHARP_TOO
  ) return core_t;

  -- Whether a letter is among the outputs.
  function has_output (
    outputs : string;
    letter  : character
  ) return boolean;

  -- Whether the outputs need a focal stack and its depth index: the outputs a and d do.
  function needs_stack (
    outputs : string
  ) return boolean;

  -- The depth index of a stack, as a picture has it.
  function picture_index (
    name        : string;
    core        : core_t;
    between     : boolean;
    radius      : natural;
    confidence  : natural;
    vote_radius : natural
  ) return index_build_t;

  -- Delay of the picture in lines.
  function picture_delay_lines (
    core        : core_t;
    radius      : natural;
    vote_radius : natural
  ) return natural;

  -- The largest lag of the picture in lines behind a sensor's raw frame: half of the lines that the raster has fewer is
  -- at most half of the frame. Without a sensor picture_delay_lines.
  function picture_lag_lines (
    core        : core_t;
    radius      : natural;
    vote_radius : natural
  ) return natural;

  -- Delay of the picture in pixels, besides the lines.
  function picture_delay_pixels (
    core        : core_t;
    radius      : natural;
    vote_radius : natural;
    between     : boolean
  ) return natural;

  -- Lines from a sensor's first raw line to the first line of its raster, besides the lines that the raster has fewer:
  -- the last lines of the raster need raw lines up to half a micro image below them.
  function sensor_delay_lines (
    micro_image_size : positive;
    mosaic           : boolean
  ) return positive;

  -- Colours for each slice in a text of colours: 1, or MOST_SHADES from the middle of the interval before to the middle
  -- of the interval behind, which need the depth between slices.
  constant MOST_SHADES : positive := 8;

  function shades (
    slices  : positive;
    colours : string
  ) return positive;

  -- Colour number index in a text of colours (six hexadecimal digits each): red in the low bits.
  function colour_at (
    colours : string;
    index   : natural
  ) return std_logic_vector;

end package picture_pkg;

package body picture_pkg is

  function output_kinds (
    outputs : string
  ) return kinds_t is

    variable made : kinds_t;

  begin

    -- Two bits choose an output, so the table has four entries; places beyond the text are never chosen.
    made := (others => 0);

    for i in 0 to 3 loop

      if i < outputs'length then

        case outputs(outputs'left + i) is

          when 'a' =>

            made(i) := 1;

          when 'd' =>

            made(i) := 2;

          when 'm' =>

            made(i) := 3;

          -- r; other letters have been refused by then.
          when others =>

            made(i) := 0;

        end case;

      end if;

    end loop;

    return made;

  end function output_kinds;

  function has_output (
    outputs : string;
    letter  : character
  ) return boolean is
  begin

    -- All loops over OUTPUTS have a constant length; the condition leaves out places beyond the text.
    for i in 0 to 3 loop

      if i < outputs'length then
        if outputs(outputs'left + i) = letter then
          return true;
        end if;
      end if;

    end loop;

    return false;

  end function has_output;

  -- Whether the text has one to four letters, all of them valid.
  function are_outputs (
    outputs : string
  ) return boolean is
  begin

    for i in 0 to 3 loop

      if i < outputs'length then
        if not has_output("radm", outputs(outputs'left + i)) then
          return false;
        end if;
      end if;

    end loop;

    return outputs'length >= 1 and outputs'length <= 4;

  end function are_outputs;

  -- Stops elaboration if the picture cannot be made; the message begins with the name.
  function takes_picture (
    name        : string;
    core        : core_t;
    shifts      : string;
    channels    : positive;
    outputs     : string;
    radius      : natural;
    vote_radius : natural;
    colours     : string
  ) return boolean is

    constant M       : positive := core.geometry.micro_image_size;
    constant SLICES  : positive := slices_of(core);
    constant BETWEEN : boolean  := shades(SLICES, colours) > 1;

    variable index   : index_build_t;
    variable ordered : shifts_t;

  begin

    assert are_outputs(outputs)
      report name & ": OUTPUTS """ & outputs & """ must be 1 to 4 of the letters r, a, d, m"
      severity failure;

    assert WITH_SENSOR or not has_output(outputs, 'm')
      report name & ": OUTPUTS of the letter m need a sensor"
      severity failure;

    assert not WITH_SENSOR or core.engine /= stack
      report name & ": a sensor needs OUTPUTS of the letters r and m"
      severity failure;

    assert channels /= 2
      report name & ": CHANNELS must be 1 or 3"
      severity failure;

    if core.engine = stack then
      assert M >= 2
        report name & ": OUTPUTS a and d need a MICRO_IMAGE_SIZE above 1"
        severity failure;

      index := picture_index(name, core, BETWEEN, radius, 0, vote_radius);

      assert is_hex(colours) and
             (colours'length = 6 * shades(SLICES, colours) * SLICES or
              (colours'length = 0 and not has_output(outputs, 'd')))
        report name & ": COLOURS """ & colours & """ must be six digits, 0 to 9 and a to f, for each slice of " &
               "SHIFTS, or eight times as many"
        severity failure;

      if BETWEEN then
        ordered := ordered_shifts(name, shifts, SLICES, core.boxes_each);
      end if;
    end if;

    -- The counters of the delay have COUNT_BITS bits.
    assert picture_delay_lines(core, radius, vote_radius) < 2 ** COUNT_BITS and
           picture_delay_pixels(core, radius, vote_radius, BETWEEN) < 2 ** COUNT_BITS
      report name & ": SHIFTS """ & shifts & """ delay the picture by more than a frame's 4095 lines and pixels"
      severity failure;

    assert picture_lag_lines(core, radius, vote_radius) < 2 ** COUNT_BITS
      report name & ": SHIFTS """ & shifts & """ and the sensor need a lag of more than 4095 lines"
      severity failure;

    return true;

  end function takes_picture;

  function picture_core_of (
    name                : string;
    micro_image_size    : positive;
    shifts              : string;
    interpolation_order : natural  := 0;
    hold                : boolean  := false;
    max_columns         : positive;
    channels            : positive := PIXEL_CHANNELS;
    exact               : boolean  := true;
    fraction_bits       : natural  := 0;
    guard_bits          : natural  := 0;
    broadcast_taps      : natural  := 0;
    engine              : string   := "fir";
    box                 : string   := "";
    outputs             : string   := work.screen_pkg.OUTPUTS;
    radius              : natural  := SHARPNESS_RADIUS;
    vote_radius         : natural  := work.screen_pkg.VOTE_RADIUS;
    colours             : string   := work.screen_pkg.COLOURS;
    sharp_too           : boolean  := work.screen_pkg.SHARP_TOO
  ) return core_t is

    constant LONGEST  : positive := choose(WITH_SENSOR, RASTER_COLUMNS, max_columns);
    constant JUDGED   : positive := judged_slices(name, shifts, choose(sharp_too, 2, 1));
    constant NO_INDEX : boolean  := not takes(needs_stack(outputs) or not sharp_too,
                                              name & ": SHARP_TOO needs OUTPUTS of the letter a or d");

    function chosen_core return core_t is
    begin

      if needs_stack(outputs) then
        -- A stack has three channels of 8 bits, whatever the video, because the picture of depth is in colour.
        return stack_of(name, micro_image_size, shifts, max_columns => LONGEST, channels => 3, box => box,
                        boxes_each => choose(sharp_too, 2, 1));
      end if;

      return core_of
      (
        name                => name,
        micro_image_size    => micro_image_size,
        shifts              => shifts,
        interpolation_order => interpolation_order,
        hold                => hold,
        max_columns         => LONGEST,
        channels            => channels,
        exact               => exact,
        fraction_bits       => fraction_bits,
        guard_bits          => guard_bits,
        engine              => engine,
        broadcast_taps      => broadcast_taps,
        box                 => box
      );

    end function chosen_core;

    constant CORE    : core_t  := chosen_core;
    constant REFUSED : boolean := not takes_picture(name, CORE, shifts, channels, outputs, radius, vote_radius,
                                                    colours);

  begin

    return CORE;

  end function picture_core_of;

  function needs_stack (
    outputs : string
  ) return boolean is
  begin

    -- Both outputs compare slices, so all slices are needed in the same clock.
    return has_output(outputs, 'a') or has_output(outputs, 'd');

  end function needs_stack;

  function picture_index (
    name        : string;
    core        : core_t;
    between     : boolean;
    radius      : natural;
    confidence  : natural;
    vote_radius : natural
  ) return index_build_t is
  begin

    return index_of
    (
      name             => name,
      micro_image_size => core.geometry.micro_image_size,
      slices           => slices_of(core),
      shifts           => shifts_of(core),
      between          => between,
      radius           => radius,
      confidence       => confidence,
      vote_radius      => vote_radius,
      max_columns      => core.columns,
      cropped          => true,
      chosen_too       => true,
      boxes            => core.boxes_each
    );

  end function picture_index;

  function picture_delay_lines (
    core        : core_t;
    radius      : natural;
    vote_radius : natural
  ) return natural is
  begin

    if core.engine = stack then
      -- A stack takes a multiple of M lines; lines that a frame with its blanking has beyond that wait for the next
      -- frame.
      return core.plan.column_lines + sharpness_delay(core.geometry.micro_image_size, radius, vote_radius) +
             core.geometry.micro_image_size - 1;
    end if;

    return core.plan.column_lines;

  end function picture_delay_lines;

  function picture_lag_lines (
    core        : core_t;
    radius      : natural;
    vote_radius : natural
  ) return natural is
  begin

    return picture_delay_lines(core, radius, vote_radius) +
           choose(WITH_SENSOR, sensor_delay_lines(core.geometry.micro_image_size, MOSAIC) + (SENSOR_ROWS + 1) / 2, 0);

  end function picture_lag_lines;

  function picture_delay_pixels (
    core        : core_t;
    radius      : natural;
    vote_radius : natural;
    between     : boolean
  ) return natural is
  begin

    if core.engine = stack then
      -- Two stream shells (of the stack and of the index) and the latency of both engines.
      return core.plan.row_tokens + 2 * STREAM_LATENCY + core.plan.clocks +
             index_latency(slices_of(core), radius, vote_radius, between, 1, core.boxes_each);
    end if;

    -- One stream shell and its engine.
    return core.plan.row_tokens + STREAM_LATENCY + core.plan.clocks;

  end function picture_delay_pixels;

  function sensor_delay_lines (
    micro_image_size : positive;
    mosaic           : boolean
  ) return positive is
  begin

    -- Half a micro image below a raster line, and the lines that mosaic and raw_window hold back.
    return micro_image_size / 2 + choose(mosaic, 6, 5);

  end function sensor_delay_lines;

  function shades (
    slices  : positive;
    colours : string
  ) return positive is
  begin

    -- A text with more than one colour for each slice has MOST_SHADES for each.
    return choose(colours'length > 6 * slices, MOST_SHADES, 1);

  end function shades;

  function colour_at (
    colours : string;
    index   : natural
  ) return std_logic_vector is
  begin

    -- The text has red, green, blue.
    return hex_byte(colours, 6 * index + 4) & hex_byte(colours, 6 * index + 2) & hex_byte(colours, 6 * index);

  end function colour_at;

end package body picture_pkg;
