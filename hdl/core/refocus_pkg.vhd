-- Geometry of the switched FIR filters and small arithmetic helpers.
--
-- The refocusing operator of one dimension (M pixels a micro image, integer shift s):
--
--   S(k') = sum over input pixels k and n = 0 .. M-1 with k' = k + n + (k mod M) * (s - 1)
--
-- As a transposed FIR filter with TAPS taps the pixel is broadcast to all taps and tap w
-- delays it by TAPS-1-w steps. A pixel of phase p = k mod M is added by the M neighbouring
-- taps whose delay lies in p*(s-1) + origin .. p*(s-1) + origin + M-1.
--
-- A filter serves a set of shifts, written as text with blanks in between ("-3 0 3"), from
-- which a slice is chosen while it runs. All slices have the same output delay, that of the
-- slice which needs most: so the place of a tap tells the output that its partial sum belongs
-- to, whatever the slice, and slices may change from line to line without a gap.
--
-- With hold (all shifts multiples of M) the M outputs of a micro image are equal. The filter
-- computes the first and holds it; a phase then closes one switch instead of M.
--
-- All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;

package refocus_pkg is

  -- Number of shifts in a set.
  function slice_count (
    shifts : string
  ) return natural;

  -- Shift number index (from 0) of a set.
  function slice_shift (
    shifts : string;
    index  : natural
  ) return integer;

  -- Shifts of a pass: interpolation of order n appends n passes with the shift 1, a moving sum each.
  function pass_shifts (
    shifts : string;
    pass   : natural
  ) return string;

  -- Steps between a pixel and the output of the same index: S(k + floor((M-1)*shift/2)) is
  -- the output at index k when centred, S(k) otherwise. No tap has a negative delay.
  function output_delay (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean
  ) return natural;

  -- output_delay summed over all passes of a dimension.
  function total_delay (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    order            : natural
  ) return natural;

  -- Number of taps that the slice with the most needs.
  function tap_count (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    hold             : boolean
  ) return positive;

  -- Whether the switch of a tap is closed for pixels of a phase (row p, column w of the slice's switch matrix).
  function is_closed (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    hold             : boolean;
    slice            : natural;
    phase            : natural;
    tap              : natural
  ) return boolean;

  -- Whether any slice ever closes the switch of a tap; a tap that none closes has neither switch nor adder.
  function is_switched (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    hold             : boolean;
    tap              : natural
  ) return boolean;

  -- Whether the M outputs of every micro image are equal in all slices.
  function can_hold (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean
  ) return boolean;

  -- Clocks from reading a stream's partial sums to the next possible read: block RAM 2, add 1, write 1.
  constant PARTIAL_SUM_LOOP : positive := 4;

  -- The shortest band in tokens: a multiple of the rows taken at once, and not before the line
  -- buffers are ready again (one column for each module needs none). The sequencer appends empty
  -- steps to shorter bands.
  function min_line_steps (
    parallel_rows : positive;
    max_columns   : positive
  ) return positive;

  -- Clocks from a token at a filter stage's input to its output.
  function stage_latency (
    stored          : boolean;
    broadcast_taps  : natural
  ) return positive;

  -- Clocks from a token at the filter array's input to its output.
  function array_latency (
    stored         : boolean;
    broadcast_taps : natural;
    order          : natural
  ) return positive;

  -- Clocks of the raster core's streams, besides the array: input FIFO 3, sequencer 1, output FIFO 3.
  constant STREAM_LATENCY : positive := 7;

  -- Clocks of divide_round.
  constant DIVIDE_LATENCY : positive := 3;

end package refocus_pkg;

package body refocus_pkg is

  function slice_count (
    shifts : string
  ) return natural is

    variable count  : natural;
    variable inside : boolean;

  begin

    count  := 0;
    inside := false;

    for i in shifts'range loop

      if shifts(i) = ' ' then
        inside := false;
      elsif not inside then
        inside := true;
        count  := count + 1;
      end if;

    end loop;

    return count;

  end function slice_count;

  function slice_shift (
    shifts : string;
    index  : natural
  ) return integer is

    variable count     : natural;
    variable inside    : boolean;
    variable negative  : boolean;
    variable magnitude : natural;

  begin

    count     := 0;
    inside    := false;
    negative  := false;
    magnitude := 0;

    for i in shifts'range loop

      if shifts(i) = ' ' then
        inside := false;
      else
        if not inside then
          inside := true;
          count  := count + 1;
        end if;
        if count = index + 1 then
          if shifts(i) = '-' then
            negative := true;
          else
            magnitude := 10 * magnitude + character'pos(shifts(i)) - character'pos('0');
          end if;
        end if;
      end if;

    end loop;

    if negative then
      return -magnitude;
    end if;

    return magnitude;

  end function slice_shift;

  function pass_shifts (
    shifts : string;
    pass   : natural
  ) return string is
  begin

    if pass = 0 then
      return shifts;
    end if;

    return "1";

  end function pass_shifts;

  -- floor((M-1) * shift / 2).
  function centre_offset (
    micro_image_size : positive;
    shift            : integer
  ) return integer is

    variable span : integer;

  begin

    span := (micro_image_size - 1) * shift;

    return (span - (span mod 2)) / 2;

  end function centre_offset;

  -- Delay of the tap that produces S(k) at step k in a filter for one shift alone.
  function tap_origin (
    micro_image_size : positive;
    shift            : integer
  ) return natural is
  begin

    if shift >= 1 then
      return 0;
    end if;

    return (micro_image_size - 1) * (1 - shift);

  end function tap_origin;

  -- output_delay of a filter for one shift alone.
  function own_delay (
    micro_image_size : positive;
    shift            : integer;
    centred          : boolean
  ) return natural is
  begin

    if not centred then
      return tap_origin(micro_image_size, shift);
    end if;

    return tap_origin(micro_image_size, shift) + centre_offset(micro_image_size, shift);

  end function own_delay;

  function output_delay (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean
  ) return natural is

    variable largest : natural;

  begin

    largest := 0;

    for i in 0 to slice_count(shifts) - 1 loop

      largest := larger(largest, own_delay(micro_image_size, slice_shift(shifts, i), centred));

    end loop;

    return largest;

  end function output_delay;

  function total_delay (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    order            : natural
  ) return natural is
  begin

    return output_delay(micro_image_size, shifts, centred) + order * own_delay(micro_image_size, 1, centred);

  end function total_delay;

  -- Switches that a phase closes.
  function closed_width (
    micro_image_size : positive;
    hold             : boolean
  ) return positive is
  begin

    return choose(hold, 1, micro_image_size);

  end function closed_width;

  function tap_count (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    hold             : boolean
  ) return positive is

    variable largest : natural;
    variable shift   : integer;

  begin

    largest := 0;

    for i in 0 to slice_count(shifts) - 1 loop

      shift   := slice_shift(shifts, i);
      largest := larger(largest, closed_width(micro_image_size, hold) + (micro_image_size - 1) * abs (shift - 1) -
                        own_delay(micro_image_size, shift, centred));

    end loop;

    return largest + output_delay(micro_image_size, shifts, centred);

  end function tap_count;

  function is_closed (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    hold             : boolean;
    slice            : natural;
    phase            : natural;
    tap              : natural
  ) return boolean is

    variable shift       : integer;
    variable first_delay : integer;
    variable delay       : integer;

  begin

    shift       := slice_shift(shifts, slice);
    first_delay := phase * (shift - 1) + tap_origin(micro_image_size, shift) +
                   output_delay(micro_image_size, shifts, centred) - own_delay(micro_image_size, shift, centred);
    delay       := tap_count(micro_image_size, shifts, centred, hold) - 1 - tap;

    return delay >= first_delay and delay < first_delay + closed_width(micro_image_size, hold);

  end function is_closed;

  function is_switched (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    hold             : boolean;
    tap              : natural
  ) return boolean is

    variable found : boolean;

  begin

    found := false;

    for s in 0 to slice_count(shifts) - 1 loop

      for p in 0 to micro_image_size - 1 loop

        if is_closed(micro_image_size, shifts, centred, hold, s, p, tap) then
          found := true;
        end if;

      end loop;

    end loop;

    return found;

  end function is_switched;

  function can_hold (
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean
  ) return boolean is

    variable shift : integer;
    variable equal : boolean;

  begin

    equal := true;

    for i in 0 to slice_count(shifts) - 1 loop

      shift := slice_shift(shifts, i);

      if shift mod micro_image_size /= 0 then
        equal := false;
      end if;

      if centred and centre_offset(micro_image_size, shift) mod micro_image_size /= 0 then
        equal := false;
      end if;

    end loop;

    return equal;

  end function can_hold;

  function min_line_steps (
    parallel_rows : positive;
    max_columns   : positive
  ) return positive is
  begin

    if max_columns <= parallel_rows then
      return parallel_rows;
    end if;

    return divide_up(parallel_rows - 1 + PARTIAL_SUM_LOOP, parallel_rows) * parallel_rows;

  end function min_line_steps;

  function stage_latency (
    stored         : boolean;
    broadcast_taps : natural
  ) return positive is
  begin

    return 3 + choose(stored, 1, 0) + choose(broadcast_taps > 0, 1, 0);

  end function stage_latency;

  function array_latency (
    stored         : boolean;
    broadcast_taps : natural;
    order          : natural
  ) return positive is
  begin

    return 2 * (order + 1) * stage_latency(stored, broadcast_taps) + choose(stored, 0, DIVIDE_LATENCY);

  end function array_latency;

end package body refocus_pkg;
