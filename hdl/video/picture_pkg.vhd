-- SPDX-License-Identifier: Apache-2.0
-- What picture_core can show, and how far it is behind. All functions but to_colour are evaluated at elaboration only.
--
-- The outputs that can be chosen are a text with a letter for each: r the refocused slice, a the picture in focus
-- everywhere, d the depth in false colours.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.focal_stack_pkg.all;
use work.sharpness_pkg.all;
use work.refocuser_pkg.all;

package picture_pkg is

  -- Whether these outputs need a focal stack and its depth index: all but the refocused slice alone.
  function needs_stack (
    outputs : string
  ) return boolean;

  -- Lines that a picture is behind its input.
  function picture_delay_lines (
    outputs          : string;
    micro_image_size : positive;
    shifts           : string;
    order            : natural;
    radius           : natural;
    vote_radius      : natural
  ) return natural;

  -- Pixels that it is behind, besides the lines.
  function picture_delay_pixels (
    outputs          : string;
    micro_image_size : positive;
    shifts           : string;
    order            : natural;
    radius           : natural;
    vote_radius      : natural;
    engine           : string;
    stored           : boolean;
    broadcast_taps   : natural;
    max_columns      : positive
  ) return natural;

  -- Colour number index of a text of colours, six hexadecimal digits each: red in the low bits.
  function colour_at (
    colours : string;
    index   : natural
  ) return std_logic_vector;

end package picture_pkg;

package body picture_pkg is

  function needs_stack (
    outputs : string
  ) return boolean is
  begin

    return not same_text(outputs, "r");

  end function needs_stack;

  function picture_delay_lines (
    outputs          : string;
    micro_image_size : positive;
    shifts           : string;
    order            : natural;
    radius           : natural;
    vote_radius      : natural
  ) return natural is
  begin

    if needs_stack(outputs) then
      -- Lines of a frame with its blanking that are no multiple of M wait for the next one.
      return output_delay(micro_image_size, shifts, true) + sharpness_delay(micro_image_size, radius, vote_radius) +
             micro_image_size - 1;
    end if;

    return total_delay(micro_image_size, shifts, true, order);

  end function picture_delay_lines;

  function picture_delay_pixels (
    outputs          : string;
    micro_image_size : positive;
    shifts           : string;
    order            : natural;
    radius           : natural;
    vote_radius      : natural;
    engine           : string;
    stored           : boolean;
    broadcast_taps   : natural;
    max_columns      : positive
  ) return natural is
  begin

    if needs_stack(outputs) then
      return output_delay(micro_image_size, shifts, true) + 2 * STREAM_LATENCY + stack_array_latency +
             index_latency(slice_count(shifts), radius, vote_radius);
    end if;

    return total_delay(micro_image_size, shifts, true, order) + STREAM_LATENCY +
           engine_latency(engine, stored, order, broadcast_taps, max_columns);

  end function picture_delay_pixels;

  -- Value of a hexadecimal digit.

  function nibble (
    digit : character
  ) return std_logic_vector is
  begin

    case digit is

      when '0' =>

        return "0000";

      when '1' =>

        return "0001";

      when '2' =>

        return "0010";

      when '3' =>

        return "0011";

      when '4' =>

        return "0100";

      when '5' =>

        return "0101";

      when '6' =>

        return "0110";

      when '7' =>

        return "0111";

      when '8' =>

        return "1000";

      when '9' =>

        return "1001";

      when 'a' =>

        return "1010";

      when 'b' =>

        return "1011";

      when 'c' =>

        return "1100";

      when 'd' =>

        return "1101";

      when 'e' =>

        return "1110";

      when others =>

        return "1111";

    end case;

  end function nibble;

  function colour_at (
    colours : string;
    index   : natural
  ) return std_logic_vector is

    constant FIRST : natural := colours'left + 6 * index;

  begin

    -- Red, green, blue in the text.
    return nibble(colours(FIRST + 4)) & nibble(colours(FIRST + 5)) & nibble(colours(FIRST + 2)) &
           nibble(colours(FIRST + 3)) & nibble(colours(FIRST)) & nibble(colours(FIRST + 1));

  end function colour_at;

end package body picture_pkg;
