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
-- k + offset + g - 1: by the time a group begins its sum is complete. The age of a pixel is counted in steps from
-- its own. All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;

package moving_sum_pkg is

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
  ) return natural;

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

  -- Lines of a phase that the column memory keeps; even if pixels leave, for two banks. any_rows: frames of any
  -- number of lines follow each other, once in `reach` lines at most; else those of a multiple of M.
  function ring_lines (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    any_rows         : boolean;
    phase            : natural
  ) return natural;

  -- Lines of all phases before a phase that a bank keeps (phase = M: of all).
  function bank_lines (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    any_rows         : boolean;
    phase            : natural
  ) return natural;

  -- Words of a table by phase: a power of two, as of all tables here, so that an index needs no arithmetic.
  function phase_words (
    micro_image_size : positive
  ) return positive;

  -- Words of a table by slice and phase. A table must not end in 32 bits of zeros: GHDL 2.0 synthesises one whose
  -- size is a multiple of them as if all of it were zero. So words without a meaning are not zero.
  function table_words (
    micro_image_size : positive;
    shifts           : string
  ) return positive;

  -- Row of a table by slice and phase.
  function table_row (
    micro_image_size : positive;
    shifts           : string;
    slice            : unsigned;
    phase            : natural
  ) return natural;

  -- Lines from the beginning of a frame to that of the next one at the earliest, of all passes.
  function least_frame (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    order            : natural;
    any_rows         : boolean
  ) return positive;

  -- Clocks from a token at a moving sum stage's input to its output; depth: 1 for rows, the longest line for columns.
  function sum_stage_latency (
    stored : boolean;
    depth  : positive
  ) return positive;

  -- Clocks from a token at the moving sum array's input to its output.
  function sum_array_latency (
    stored      : boolean;
    order       : natural;
    max_columns : positive
  ) return positive;

end package moving_sum_pkg;

package body moving_sum_pkg is

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

  -- floor((M-1) * shift / 2), or 0.
  function offset (
    micro_image_size : positive;
    shift            : integer;
    centred          : boolean
  ) return integer is

    variable span : integer;

  begin

    if not centred then
      return 0;
    end if;

    span := (micro_image_size - 1) * shift;

    return (span - span mod 2) / 2;

  end function offset;

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
    place := output_phase + offset(micro_image_size, shift, centred) + group_size(micro_image_size, shift) - 1;
    found := 0;

    for v in 0 to micro_image_size - 1 loop

      if (v * shift + place_in_group(micro_image_size, shift, v) - place) mod micro_image_size = 0 then
        found := v;
      end if;

    end loop;

    return found;

  end function entering_phase;

  function entering_age (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    slice            : natural;
    phase            : natural
  ) return natural is

    variable shift : integer;

  begin

    shift := slice_shift(shifts, slice);

    return output_delay(micro_image_size, shifts, centred) - offset(micro_image_size, shift, centred) -
           group_size(micro_image_size, shift) + 1 + phase * (shift - 1) +
           place_in_group(micro_image_size, shift, phase);

  end function entering_age;

  function oldest_entering (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    phase            : natural
  ) return natural is

    variable largest : natural;
    variable age     : natural;

  begin

    largest := 0;

    for i in 0 to slice_count(shifts) - 1 loop

      age := entering_age(micro_image_size, shifts, centred, i, phase);

      if age > largest then
        largest := age;
      end if;

    end loop;

    return largest;

  end function oldest_entering;

  function reach (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean
  ) return natural is

    variable largest : natural;
    variable age     : natural;

  begin

    largest := 0;

    for v in 0 to micro_image_size - 1 loop

      age := oldest_entering(micro_image_size, shifts, centred, v);

      if age > largest then
        largest := age;
      end if;

    end loop;

    return largest + micro_image_size;

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
    first := offset(micro_image_size, shift, centred);

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
    last  := offset(micro_image_size, shift, centred) + equal - 1;

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

    return (output_phase + offset(micro_image_size, shift, centred)) mod group_size(micro_image_size, shift) = 0;

  end function begins_group;

  function holds_outputs (
    micro_image_size : positive;
    shifts           : string
  ) return boolean is

    variable found : boolean;

  begin

    found := false;

    for i in 0 to slice_count(shifts) - 1 loop

      if group_size(micro_image_size, slice_shift(shifts, i)) > 1 then
        found := true;
      end if;

    end loop;

    return found;

  end function holds_outputs;

  function pixels_leave (
    micro_image_size : positive;
    shifts           : string
  ) return boolean is

    variable found : boolean;

  begin

    found := false;

    for i in 0 to slice_count(shifts) - 1 loop

      if group_size(micro_image_size, slice_shift(shifts, i)) /= micro_image_size then
        found := true;
      end if;

    end loop;

    return found;

  end function pixels_leave;

  function begins_within_group (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean
  ) return boolean is

    variable found : boolean;

  begin

    found := false;

    for i in 0 to slice_count(shifts) - 1 loop

      if not begins_group(micro_image_size, shifts, centred, i, 0) then
        found := true;
      end if;

    end loop;

    return found;

  end function begins_within_group;

  function ring_lines (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    any_rows         : boolean;
    phase            : natural
  ) return natural is

    variable oldest : natural;
    variable lines  : natural;

  begin

    oldest := oldest_entering(micro_image_size, shifts, centred, phase);

    -- The first line of a frame may come early, that of phase v by M-1-v lines at most.
    if any_rows and (oldest > 0 or pixels_leave(micro_image_size, shifts)) then
      oldest := oldest + micro_image_size - 1 - phase;
    end if;

    -- One line of the phase comes every M lines; the one that comes may take the place of the one that goes.
    lines := (oldest + micro_image_size - 1) / micro_image_size;

    if pixels_leave(micro_image_size, shifts) then
      lines := lines + 1;
      lines := lines + lines mod 2;
    end if;

    return lines;

  end function ring_lines;

  function bank_lines (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    any_rows         : boolean;
    phase            : natural
  ) return natural is

    variable lines : natural;

  begin

    lines := 0;

    for v in 0 to phase - 1 loop

      lines := lines + ring_lines(micro_image_size, shifts, centred, any_rows, v);

    end loop;

    if pixels_leave(micro_image_size, shifts) then
      lines := lines / 2;
    end if;

    return lines;

  end function bank_lines;

  function phase_words (
    micro_image_size : positive
  ) return positive is
  begin

    return 2 ** bits_for(micro_image_size - 1);

  end function phase_words;

  function table_words (
    micro_image_size : positive;
    shifts           : string
  ) return positive is
  begin

    if slice_count(shifts) = 1 then
      return phase_words(micro_image_size);
    end if;

    return phase_words(micro_image_size) * 2 ** bits_for(slice_count(shifts) - 1);

  end function table_words;

  function table_row (
    micro_image_size : positive;
    shifts           : string;
    slice            : unsigned;
    phase            : natural
  ) return natural is

    variable row : unsigned(slice'length + bits_for(micro_image_size - 1) - 1 downto 0);

  begin

    if slice_count(shifts) = 1 then
      return phase;
    end if;

    row := slice & to_unsigned(phase, bits_for(micro_image_size - 1));

    return to_integer(row);

  end function table_row;

  function least_frame (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    order            : natural;
    any_rows         : boolean
  ) return positive is

    variable lines : positive;

  begin

    lines := total_delay(micro_image_size, shifts, centred, order) + 1;

    -- No pass reaches further than the first.
    if any_rows and reach(micro_image_size, shifts, centred) > lines then
      lines := reach(micro_image_size, shifts, centred);
    end if;

    return lines;

  end function least_frame;

  function sum_stage_latency (
    stored : boolean;
    depth  : positive
  ) return positive is
  begin

    -- The memory of lines (ram_blocks) takes a clock more than that of a line's last pixels.
    return 10 + choose(stored, 1, 0) + choose(depth > 1, 1, 0);

  end function sum_stage_latency;

  function sum_array_latency (
    stored      : boolean;
    order       : natural;
    max_columns : positive
  ) return positive is
  begin

    return (order + 1) * (sum_stage_latency(stored, 1) + sum_stage_latency(stored, max_columns)) +
           choose(stored, 0, DIVIDE_LATENCY);

  end function sum_array_latency;

end package body moving_sum_pkg;
