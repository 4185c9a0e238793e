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
    micro_image_size : positive;
    shift            : integer
  ) return positive;

  -- Phase of the pixel that enters with the outputs k, k mod M = output_phase.
  function entering_phase (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    slice            : natural;
    output_phase     : natural
  ) return natural;

  -- Age at which pixels of a phase enter; they leave M steps later.
  function entering_age (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    slice            : natural;
    phase            : natural
  ) return natural;

  -- Largest age of a pixel that enters, of a phase in any slice.
  function oldest_entering (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    phase            : natural
  ) return natural;

  -- The largest age at which a pixel is needed.
  function reach (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean
  ) return positive;

  -- Index in its line of the pixel of a phase that is in the sum with output 0, or -1. With held it is
  -- the sum of output 0 itself, else the sum as it goes on from there (they differ within a group).
  function initial_index (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    slice            : natural;
    phase            : natural;
    held             : boolean
  ) return integer;

  -- Whether the pixel of initial_index is added to the first sum. Where sums begin anew with each
  -- group, the sum that goes on from output 0 holds no pixel of the group before.
  function is_initial (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    slice            : natural;
    phase            : natural;
    held             : boolean
  ) return boolean;

  -- Whether the output of index output_phase (mod M) begins a group.
  function begins_group (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    slice            : natural;
    output_phase     : natural
  ) return boolean;

  -- Whether any slice holds outputs (g > 1).
  function holds_outputs (
    micro_image_size : positive;
    shifts           : string
  ) return boolean;

  -- Whether pixels leave the sum: unless all slices begin a new sum with each group (g = M).
  function pixels_leave (
    micro_image_size : positive;
    shifts           : string
  ) return boolean;

  -- Whether a slice begins a line within a group.
  function begins_within_group (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean
  ) return boolean;

end package sum_schedule_pkg;

package body sum_schedule_pkg is

  function group_size (
    micro_image_size : positive;
    shift            : integer
  ) return positive is

    variable a : natural;
    variable b : natural;
    variable c : natural;

  begin

    a := micro_image_size;
    b := abs (shift) mod micro_image_size;

    while b > 0 loop

      c := a mod b;
      a := b;
      b := c;

    end loop;

    return a;

  end function group_size;

  -- r: place of a phase in its group. The pixel that comes last takes the last place.
  function place_in_group (
    micro_image_size : positive;
    shift            : integer;
    phase            : natural
  ) return natural is

    variable equal : positive;
    variable index : natural;

  begin

    equal := group_size(micro_image_size, shift);
    index := phase / (micro_image_size / equal);

    if shift >= 1 then
      return equal - 1 - index;
    end if;

    return index;

  end function place_in_group;

  function entering_phase (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    slice            : natural;
    output_phase     : natural
  ) return natural is

    variable shift : integer;
    variable place : integer;
    variable found : natural;

  begin

    shift := slice_shift(shifts, slice);
    place := output_phase + centre_offset(micro_image_size, shift, centred) + group_size(micro_image_size, shift) - 1;
    found := 0;

    for v in 0 to micro_image_size - 1 loop

      if (v * shift + place_in_group(micro_image_size, shift, v) - place) mod micro_image_size = 0 then
        found := v;
      end if;

    end loop;

    return found;

  end function entering_phase;

  -- Age at which pixels of a phase enter, without the output delay.
  function own_entering_age (
    micro_image_size : positive;
    shift            : integer;
    centred          : boolean;
    phase            : natural
  ) return integer is
  begin

    return phase * (shift - 1) + place_in_group(micro_image_size, shift, phase) + 1 -
           centre_offset(micro_image_size, shift, centred) - group_size(micro_image_size, shift);

  end function own_entering_age;

  function entering_age (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    slice            : natural;
    phase            : natural
  ) return natural is
  begin

    return output_delay(micro_image_size, shifts, centred) +
           own_entering_age(micro_image_size, slice_shift(shifts, slice), centred, phase);

  end function entering_age;

  function oldest_entering (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    phase            : natural
  ) return natural is

    variable delay  : natural;
    variable oldest : natural;

  begin

    delay  := output_delay(micro_image_size, shifts, centred);
    oldest := 0;

    for i in 0 to slice_count(shifts) - 1 loop

      oldest := larger(oldest, delay + own_entering_age(micro_image_size, slice_shift(shifts, i), centred, phase));

    end loop;

    return oldest;

  end function oldest_entering;

  function reach (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean
  ) return positive is

    variable oldest : natural;

  begin

    oldest := 0;

    for v in 0 to micro_image_size - 1 loop

      oldest := larger(oldest, oldest_entering(micro_image_size, shifts, centred, v));

    end loop;

    return oldest + micro_image_size;

  end function reach;

  function initial_index (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    slice            : natural;
    phase            : natural;
    held             : boolean
  ) return integer is

    variable shift : integer;
    variable equal : positive;
    variable first : integer;
    variable last  : integer;
    variable index : integer;

  begin

    shift := slice_shift(shifts, slice);
    equal := group_size(micro_image_size, shift);
    first := centre_offset(micro_image_size, shift, centred);

    if held then
      first := first - first mod equal;
    end if;

    last := first + equal - 1;
    -- The only pixel of the phase whose place is one of the M up to `last`.
    index := last - phase * (shift - 1) - place_in_group(micro_image_size, shift, phase);
    index := index - (index - phase) mod micro_image_size;

    if index < 0 then
      return -1;
    end if;

    return index;

  end function initial_index;

  function is_initial (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    slice            : natural;
    phase            : natural;
    held             : boolean
  ) return boolean is

    variable shift : integer;
    variable index : integer;
    variable place : integer;
    variable equal : positive;
    variable last  : integer;

  begin

    index := initial_index(micro_image_size, shifts, centred, slice, phase, held);

    if index < 0 or held or pixels_leave(micro_image_size, shifts) then
      return index >= 0;
    end if;

    shift := slice_shift(shifts, slice);
    equal := group_size(micro_image_size, shift);
    place := index + phase * (shift - 1) + place_in_group(micro_image_size, shift, phase);
    last  := centre_offset(micro_image_size, shift, centred) + equal - 1;

    return place >= last - last mod equal;

  end function is_initial;

  function begins_group (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    slice            : natural;
    output_phase     : natural
  ) return boolean is

    variable shift : integer;

  begin

    shift := slice_shift(shifts, slice);

    return (output_phase + centre_offset(micro_image_size, shift, centred)) mod group_size(micro_image_size, shift) = 0;

  end function begins_group;

  function holds_outputs (
    micro_image_size : positive;
    shifts           : string
  ) return boolean is
  begin

    for i in 0 to slice_count(shifts) - 1 loop

      if group_size(micro_image_size, slice_shift(shifts, i)) > 1 then
        return true;
      end if;

    end loop;

    return false;

  end function holds_outputs;

  function pixels_leave (
    micro_image_size : positive;
    shifts           : string
  ) return boolean is
  begin

    for i in 0 to slice_count(shifts) - 1 loop

      if group_size(micro_image_size, slice_shift(shifts, i)) /= micro_image_size then
        return true;
      end if;

    end loop;

    return false;

  end function pixels_leave;

  function begins_within_group (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean
  ) return boolean is
  begin

    for i in 0 to slice_count(shifts) - 1 loop

      if not begins_group(micro_image_size, shifts, centred, i, 0) then
        return true;
      end if;

    end loop;

    return false;

  end function begins_within_group;

end package body sum_schedule_pkg;
