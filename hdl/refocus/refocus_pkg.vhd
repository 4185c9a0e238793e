-- Geometry of the switched FIR filter and small arithmetic helpers.
--
-- The refocusing operator of one dimension (M pixels a micro image, integer shift s):
--
--   S(k') = sum over input pixels k and n = 0 .. M-1 with k' = k + n + (k mod M) * (s - 1)
--
-- As a transposed FIR filter with TAPS taps the pixel is broadcast to all taps and tap w
-- delays it by TAPS-1-w steps. A pixel of phase p = k mod M is added by the M neighbouring
-- taps whose delay lies in p*(s-1) + origin .. p*(s-1) + origin + M-1.
--
-- All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

package refocus_pkg is

  -- Bits of an unsigned number that holds 0 to max_value.
  function bits_for (
    max_value : natural
  ) return positive;

  -- Number of taps of the filter: M + (M-1) * |shift - 1|.
  function tap_count (
    micro_image_size : positive;
    shift            : integer
  ) return positive;

  -- Delay of the tap that produces S(k) at step k, so that no tap needs a negative delay.
  function tap_origin (
    micro_image_size : positive;
    shift            : integer
  ) return natural;

  -- Steps between a pixel and the output of the same index: S(k + floor((M-1)*shift/2)) is
  -- the output at index k when centred, S(k) otherwise.
  function output_delay (
    micro_image_size : positive;
    shift            : integer;
    centred          : boolean
  ) return natural;

  -- Whether the switch of a tap is closed for pixels of a phase (row p, column w of the switch matrix).
  function is_closed (
    micro_image_size : positive;
    shift            : integer;
    phase            : natural;
    tap              : natural
  ) return boolean;

  -- value * 2**scale_bits / divisor, rounded to the nearest integer, halves up.
  function scaled_quotient (
    value      : natural;
    scale_bits : natural;
    divisor    : positive
  ) return natural;

  -- The shortest line that the column filter's read-modify-write loop takes, in pixels;
  -- the sequencer appends empty steps to shorter lines.
  constant MIN_LINE_STEPS : positive := 4;

  -- Clocks from a token at a filter stage's input to its output.
  constant STAGE_LATENCY : positive := 3;

end package refocus_pkg;

package body refocus_pkg is

  function bits_for (
    max_value : natural
  ) return positive is

    variable remaining : natural;
    variable bits      : natural;

  begin

    remaining := max_value;
    bits      := 0;

    while remaining > 0 loop

      remaining := remaining / 2;
      bits      := bits + 1;

    end loop;

    if bits = 0 then
      bits := 1;
    end if;

    return bits;

  end function bits_for;

  function tap_count (
    micro_image_size : positive;
    shift            : integer
  ) return positive is
  begin

    return micro_image_size + (micro_image_size - 1) * abs (shift - 1);

  end function tap_count;

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

  function output_delay (
    micro_image_size : positive;
    shift            : integer;
    centred          : boolean
  ) return natural is

    variable span : integer;

  begin

    if not centred then
      return tap_origin(micro_image_size, shift);
    end if;

    span := (micro_image_size - 1) * shift;

    -- (span - (span mod 2)) / 2 is floor(span / 2) for negative spans too.
    return tap_origin(micro_image_size, shift) + (span - (span mod 2)) / 2;

  end function output_delay;

  function is_closed (
    micro_image_size : positive;
    shift            : integer;
    phase            : natural;
    tap              : natural
  ) return boolean is

    variable first_delay : integer;
    variable delay       : integer;

  begin

    first_delay := phase * (shift - 1) + tap_origin(micro_image_size, shift);
    delay       := tap_count(micro_image_size, shift) - 1 - tap;

    return delay >= first_delay and delay < first_delay + micro_image_size;

  end function is_closed;

  function scaled_quotient (
    value      : natural;
    scale_bits : natural;
    divisor    : positive
  ) return natural is
  begin

    return (2 * value * 2 ** scale_bits + divisor) / (2 * divisor);

  end function scaled_quotient;

end package body refocus_pkg;
