-- SPDX-License-Identifier: Apache-2.0
-- The refocusing operator of one dimension as a re-ordering and a moving sum.
--
-- Pixel i = M j + v (phase v) contributes to the M outputs from J = i + v (s-1) on, J a multiple of
-- g = gcd(s, M). The g pixels with the same J get places of their own, p = J + r with r = 0..g-1 by
-- phase; that makes i -> p a re-ordering, with no place left out or taken twice. Then
--
--   S(J + r) = sum of the pixels at the M places up to J + g - 1,
--
-- so S changes only at multiples of g, and from one such place to the next g pixels enter the sum and
-- g leave it: one enters and one leaves at each step, each at an age that depends on its phase alone.
--
-- At step t the output is k = t - output_delay (refocus_pkg), and the newest place in the sum is
-- k + centre_offset + g - 1: by the time a group begins its sum is complete. The age of a pixel is counted in
-- steps from its own. All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;

package sum_schedule_pkg is

  -- g, the number of neighbouring outputs that are equal.
  function group_size (
    geometry : geometry_t;
    slice    : natural
  ) return positive;

  -- Phase of the pixel that enters with the outputs k, k mod M = output_phase.
  function entering_phase (
    geometry     : geometry_t;
    slice        : natural;
    output_phase : natural
  ) return natural;

  -- Age at which pixels of a phase enter; they leave M steps later.
  function entering_age (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural
  ) return natural;

  -- Largest age of a pixel that enters, of a phase in any slice.
  function oldest_entering (
    geometry : geometry_t;
    phase    : natural
  ) return natural;

  -- The largest age at which a pixel is needed.
  function reach (
    geometry : geometry_t
  ) return positive;

  -- Index in its line of the pixel of a phase that is in the sum with output 0, or -1. With held it is
  -- the sum of output 0 itself, else the sum as it goes on from there (they differ within a group).
  function initial_index (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural;
    held     : boolean
  ) return integer;

  -- Whether the pixel of initial_index is added to the first sum. Where sums begin anew with each
  -- group, the sum that goes on from output 0 holds no pixel of the group before.
  function is_initial (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural;
    held     : boolean
  ) return boolean;

  -- Whether the output of index output_phase (mod M) begins a group.
  function begins_group (
    geometry     : geometry_t;
    slice        : natural;
    output_phase : natural
  ) return boolean;

  -- Whether any slice holds outputs (g > 1).
  function holds_outputs (
    geometry : geometry_t
  ) return boolean;

  -- Whether pixels leave the sum: unless all slices begin a new sum with each group (g = M).
  function pixels_leave (
    geometry : geometry_t
  ) return boolean;

  -- Whether a slice begins a line within a group.
  function begins_within_group (
    geometry : geometry_t
  ) return boolean;

end package sum_schedule_pkg;

package body sum_schedule_pkg is

  function group_size (
    geometry : geometry_t;
    slice    : natural
  ) return positive is
  begin

    -- M itself for s = 0: all pixels of a micro image add to the same outputs.
    return common_divisor(geometry.micro_image_size, abs (geometry.shifts(slice)));

  end function group_size;

  -- r: place of a phase in its group. The pixel that comes last takes the last place.
  function place_in_group (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural
  ) return natural is

    variable equal : positive;
    variable index : natural;

  begin

    equal := group_size(geometry, slice);
    -- Phases of a group are M / g apart.
    index := phase / (geometry.micro_image_size / equal);

    -- With a' >= 1 pixels of later phases add further on, so of those of one output the first phase comes last.
    if geometry.shifts(slice) >= 1 then
      return equal - 1 - index;
    end if;

    return index;

  end function place_in_group;

  function entering_phase (
    geometry     : geometry_t;
    slice        : natural;
    output_phase : natural
  ) return natural is

    constant M : positive := geometry.micro_image_size;

    variable place : integer;
    variable found : natural;

  begin

    -- The newest place in the sum with this output.
    place := output_phase + centre_offset(geometry, slice) + group_size(geometry, slice) - 1;
    found := 0;

    -- A search, as it is run at elaboration alone: the re-ordering has an inverse, but no simple
    -- one.
    for v in 0 to M - 1 loop

      if (v * geometry.shifts(slice) + place_in_group(geometry, slice, v) - place) mod M = 0 then
        found := v;
      end if;

    end loop;

    return found;

  end function entering_phase;

  -- Age at which pixels of a phase enter, without the output delay.
  function own_entering_age (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural
  ) return integer is
  begin

    -- Where the pixel's place is, less the last place that the sum of its own index takes in.
    return phase * (geometry.shifts(slice) - 1) + place_in_group(geometry, slice, phase) + 1 -
           centre_offset(geometry, slice) - group_size(geometry, slice);

  end function own_entering_age;

  function entering_age (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural
  ) return natural is
  begin

    -- The delay is what the earliest pixel needs to have come: with it no age is negative.
    return geometry.output_delay + own_entering_age(geometry, slice, phase);

  end function entering_age;

  function oldest_entering (
    geometry : geometry_t;
    phase    : natural
  ) return natural is

    variable oldest : natural;

  begin

    oldest := 0;

    for i in 0 to geometry.slices - 1 loop

      -- One memory serves all slices, so it keeps a pixel as long as the slice that needs it longest.
      oldest := larger(oldest, entering_age(geometry, i, phase));

    end loop;

    return oldest;

  end function oldest_entering;

  function reach (
    geometry : geometry_t
  ) return positive is

    variable oldest : natural;

  begin

    -- A pixel is in the sum for M steps from the age at which it enters, so that of the last phase to enter and M
    -- more is the oldest that is read.
    oldest := 0;

    for v in 0 to geometry.micro_image_size - 1 loop

      oldest := larger(oldest, oldest_entering(geometry, v));

    end loop;

    return oldest + geometry.micro_image_size;

  end function reach;

  function initial_index (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural;
    held     : boolean
  ) return integer is

    variable equal : positive;
    variable first : integer;
    variable last  : integer;
    variable index : integer;

  begin

    equal := group_size(geometry, slice);
    first := centre_offset(geometry, slice);

    if held then
      -- The group of output 0 may begin before the line; what it shows is the sum of that first place.
      first := first - first mod equal;
    end if;

    last := first + equal - 1;
    -- The only pixel of the phase whose place is one of the M up to `last`.
    index := last - phase * (geometry.shifts(slice) - 1) - place_in_group(geometry, slice, phase);
    index := index - (index - phase) mod geometry.micro_image_size;

    -- It would lie before the line begins, where everything counts as zero.
    if index < 0 then
      return -1;
    end if;

    return index;

  end function initial_index;

  function is_initial (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural;
    held     : boolean
  ) return boolean is

    variable index : integer;
    variable place : integer;
    variable equal : positive;
    variable last  : integer;

  begin

    index := initial_index(geometry, slice, phase, held);

    if index < 0 or held or pixels_leave(geometry) then
      return index >= 0;
    end if;

    equal := group_size(geometry, slice);
    -- Its place, and the first place of the group of output 0: without pixels that leave, a sum holds those of its
    -- own group alone.
    place := index + phase * (geometry.shifts(slice) - 1) + place_in_group(geometry, slice, phase);
    last  := centre_offset(geometry, slice) + equal - 1;

    return place >= last - last mod equal;

  end function is_initial;

  function begins_group (
    geometry     : geometry_t;
    slice        : natural;
    output_phase : natural
  ) return boolean is
  begin

    return (output_phase + centre_offset(geometry, slice)) mod group_size(geometry, slice) = 0;

  end function begins_group;

  function holds_outputs (
    geometry : geometry_t
  ) return boolean is
  begin

    for i in 0 to geometry.slices - 1 loop

      -- One slice of the set is enough: the register is there for all, and the others update it every step.
      if group_size(geometry, i) > 1 then
        return true;
      end if;

    end loop;

    return false;

  end function holds_outputs;

  function pixels_leave (
    geometry : geometry_t
  ) return boolean is
  begin

    for i in 0 to geometry.slices - 1 loop

      -- With g = M each group is a micro image by itself: its sum begins at 0 and nothing has to leave.
      if group_size(geometry, i) /= geometry.micro_image_size then
        return true;
      end if;

    end loop;

    return false;

  end function pixels_leave;

  function begins_within_group (
    geometry : geometry_t
  ) return boolean is
  begin

    for i in 0 to geometry.slices - 1 loop

      -- One slice of the set is enough: the sum of the first place is kept for all.
      if not begins_group(geometry, i, 0) then
        return true;
      end if;

    end loop;

    return false;

  end function begins_within_group;

end package body sum_schedule_pkg;
