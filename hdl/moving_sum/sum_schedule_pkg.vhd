-- SPDX-License-Identifier: Apache-2.0
-- The refocusing operator of one dimension as a re-ordering and a moving sum.
--
-- Pixel i = M j + v (phase v) contributes to the B outputs from J = i + v (s-1) on, J a multiple of
-- g = gcd(s, M). The g pixels with the same J get places of their own, p = J + r with r = 0..g-1 by
-- phase; that makes i -> p a re-ordering, with no place left out or taken twice. Then
--
--   S(J + r) = sum of the pixels at the B places up to J + g - 1, B the box, a multiple of g,
--
-- so S changes only at multiples of g, and from one such place to the next g pixels enter the sum and
-- g leave it: one enters and one leaves at each step, each at an age that depends on its phase alone.
-- The pixel that leaves is the one that entered B steps before.
--
-- At step t the output is k = t - output_delay (refocus_pkg), and the newest place in the sum is k + centre_offset +
-- g - 1, so a group's sum is complete when the group begins. The age of a pixel counts steps since it came. All
-- functions are evaluated at elaboration only.

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

  -- Phase of the pixel that enters with outputs k for which k mod M = output_phase.
  function entering_phase (
    geometry     : geometry_t;
    slice        : natural;
    output_phase : natural
  ) return natural;

  -- Age at which pixels of a phase enter the sum.
  function entering_age (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural
  ) return natural;

  -- Phase of the pixel that leaves, as entering_phase; and the age at which pixels of a phase leave, B steps after they
  -- entered.
  function leaving_phase (
    geometry     : geometry_t;
    slice        : natural;
    output_phase : natural
  ) return natural;

  function leaving_age (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural
  ) return natural;

  -- Largest age at which a pixel of this phase enters or leaves in any slice.
  function oldest (
    geometry : geometry_t;
    phase    : natural
  ) return natural;

  -- The largest age of a pixel in a sum.
  function reach (
    geometry : geometry_t
  ) return positive;

  -- Index in its line of the phase's pixel that entered last with output 0, or -1 for none. With held output 0 counts
  -- as the first of its group. The two differ if the line begins within a group.
  function initial_index (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural;
    held     : boolean
  ) return integer;

  -- Whether the pixel of initial_index is added to the first sum: with held to the one that output 0 shows, else to the
  -- one that goes on from there. Where each group begins a new sum, the latter has no pixels of the group before.
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

  -- Whether pixels leave sums. No pixel does if each group of all slices begins a new sum (g = B).
  function pixels_leave (
    geometry : geometry_t
  ) return boolean;

  -- Whether pixels enter and leave that are of the same phase, M steps apart: those of a box of M.
  function alternates (
    geometry : geometry_t
  ) return boolean;

  -- Whether any slice begins a line within a group.
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

    -- For s = 0 this is M: all pixels of a micro image add to the same outputs.
    return common_divisor(geometry.micro_image_size, abs (geometry.shifts(slice)));

  end function group_size;

  -- r, the place of a phase within its group. The pixel that comes last takes the last place.
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

    -- With a shift of 1 or more, later phases add further on, so among the pixels of an output the first phase
    -- comes last.
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

    -- The re-ordering has no simple inverse, so this searches; it runs at elaboration only.
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

    -- The pixel's place, less the newest place in the sum at the pixel's own index.
    return phase * (geometry.shifts(slice) - 1) + place_in_group(geometry, slice, phase) + 1 -
           centre_offset(geometry, slice) - group_size(geometry, slice);

  end function own_entering_age;

  function entering_age (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural
  ) return natural is
  begin

    -- output_delay is large enough that no age is negative.
    return geometry.output_delay + own_entering_age(geometry, slice, phase);

  end function entering_age;

  function leaving_phase (
    geometry     : geometry_t;
    slice        : natural;
    output_phase : natural
  ) return natural is
  begin

    return entering_phase(geometry, slice, (output_phase - geometry.boxes(slice)) mod geometry.micro_image_size);

  end function leaving_phase;

  function leaving_age (
    geometry : geometry_t;
    slice    : natural;
    phase    : natural
  ) return natural is
  begin

    return entering_age(geometry, slice, phase) + geometry.boxes(slice);

  end function leaving_age;

  function oldest (
    geometry : geometry_t;
    phase    : natural
  ) return natural is

    variable age : natural;

  begin

    age := 0;

    for i in 0 to geometry.slices - 1 loop

      -- One memory serves all slices, so it keeps a pixel for the slice that needs it longest.
      age := larger(age, choose(pixels_leave(geometry), leaving_age(geometry, i, phase),
                                entering_age(geometry, i, phase)));

    end loop;

    return age;

  end function oldest;

  function reach (
    geometry : geometry_t
  ) return positive is

    variable age : positive;

  begin

    age := 1;

    for i in 0 to geometry.slices - 1 loop

      for v in 0 to geometry.micro_image_size - 1 loop

        age := larger(age, leaving_age(geometry, i, v));

      end loop;

    end loop;

    return age;

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
      -- Output 0 may lie within its group; the sum that it shows is that of the group's first place.
      first := first - first mod equal;
    end if;

    last := first + equal - 1;
    -- The phase's only pixel whose place is one of the M up to `last`.
    index := last - phase * (geometry.shifts(slice) - 1) - place_in_group(geometry, slice, phase);
    index := index - (index - phase) mod geometry.micro_image_size;

    -- The pixel would lie before the line's begin, where everything counts as zero.
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

    if index < 0 then
      return false;
    end if;

    equal := group_size(geometry, slice);
    -- The pixel's place, and the newest place in the sum.
    place := index + phase * (geometry.shifts(slice) - 1) + place_in_group(geometry, slice, phase);
    last  := centre_offset(geometry, slice) + equal - 1;

    if held then
      last := last - centre_offset(geometry, slice) mod equal;
    end if;

    if held or pixels_leave(geometry) then
      return place > last - geometry.boxes(slice);
    end if;

    -- If no pixel leaves, a sum holds the pixels of its own group only.
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

      -- One slice of the set is enough: the register is there for all, and the others update it at every step.
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

      -- With g = B each group is one box: its sum begins at 0, and no pixel has to leave.
      if group_size(geometry, i) /= geometry.boxes(i) then
        return true;
      end if;

    end loop;

    return false;

  end function pixels_leave;

  function alternates (
    geometry : geometry_t
  ) return boolean is
  begin

    return pixels_leave(geometry) and largest_box(geometry) = geometry.micro_image_size;

  end function alternates;

  function begins_within_group (
    geometry : geometry_t
  ) return boolean is
  begin

    for i in 0 to geometry.slices - 1 loop

      -- One slice of the set is enough: the sum of the first place is then kept for all slices.
      if not begins_group(geometry, i, 0) then
        return true;
      end if;

    end loop;

    return false;

  end function begins_within_group;

end package body sum_schedule_pkg;
