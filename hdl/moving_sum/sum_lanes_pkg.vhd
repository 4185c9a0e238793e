-- SPDX-License-Identifier: Apache-2.0
-- The moving sums of P neighbouring outputs of a row at once: which pixels they add and subtract, and in which
-- banks.
--
-- Output o adds pixel e(o) = o + entering_offset(o mod M) and subtracts pixel e(o) - M (sum_schedule_pkg). So the P
-- outputs of a token are the last sum of the token before plus the prefix sums of d(o) = x(e(o)) - x(e(o) - M).
--
-- Pixels are stored in B banks, where B is the smallest multiple of M that is not less than P: pixel i in bank i mod B,
-- row i / B. P neighbouring pixels lie in different banks, and so do the pixels that P neighbouring outputs add,
-- because e(o + M) = e(o) + M. The pixel that output o adds comes from the bank that belongs to o mod B (its place).
--
-- All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.sum_schedule_pkg.all;
use work.moving_sum_pkg.all;

package sum_lanes_pkg is

  -- The most tokens of several pixels by which a row stage delays.
  constant MOST_LANE_DELAY : positive := 4096;

  -- Delay of a row stage: tokens from pixels to the outputs of the same index.
  function lane_delay (
    geometry : geometry_t;
    pixels   : positive
  ) return natural;

  -- B, the number of banks.
  function bank_count (
    micro_image_size : positive;
    pixels           : positive
  ) return positive;

  -- Tokens begin at banks that are multiples of bank_step; bank_places is the number of such banks.
  function bank_step (
    micro_image_size : positive;
    pixels           : positive
  ) return positive;

  function token_places (
    micro_image_size : positive;
    pixels           : positive
  ) return positive;

  -- Offset from an output o to the pixel that enters with it, by o mod M.
  function entering_offset (
    geometry     : geometry_t;
    slice        : natural;
    output_phase : natural
  ) return integer;

  -- For outputs of a place: bank of the pixel that enters, and its row counted from the output's own.
  function entering_bank (
    geometry : geometry_t;
    pixels   : positive;
    slice    : natural;
    place    : natural
  ) return natural;

  function entering_row (
    geometry : geometry_t;
    pixels   : positive;
    slice    : natural;
    place    : natural
  ) return integer;

  -- The pixel that leaves with the outputs of a place: its bank, and its row counted from the row of the pixel that
  -- enters.
  type left_t is record
    bank : natural;
    rows : integer;
  end record left_t;

  function left_pixel (
    geometry : geometry_t;
    pixels   : positive;
    slice    : natural;
    place    : natural
  ) return left_t;

  -- The least and the largest row among all slices.
  function row_range (
    geometry : geometry_t;
    pixels   : positive
  ) return row_range_t;

  -- Whether a pixel is in the sum ahead of output 0. With held: whether it is in the sum that output 0 shows,
  -- which differs if output 0's group began before the line.
  function is_ahead (
    geometry : geometry_t;
    slice    : natural;
    index    : natural;
    held     : boolean
  ) return boolean;

  -- Rows of a bank, a power of two: from the newest pixel back to the oldest that leaves, and the rows that are
  -- not full at a line's end.
  function bank_rows (
    geometry : geometry_t;
    pixels   : positive
  ) return positive;

  -- The sizes of a row stage with several pixels a token.
  function to_lanes (
    geometry   : geometry_t;
    pixels     : positive;
    channels   : positive;
    pixel_bits : positive
  ) return lanes_build_t;

  -- Latency of lane_stage in clocks.
  function lane_stage_latency (
    geometry : geometry_t;
    pixels   : positive
  ) return positive;

end package sum_lanes_pkg;

package body sum_lanes_pkg is

  function lane_delay (
    geometry : geometry_t;
    pixels   : positive
  ) return natural is
  begin

    -- The delay is a whole number of tokens; reading later rows compensates for the excess.
    return divide_up(geometry.output_delay, pixels);

  end function lane_delay;

  function bank_count (
    micro_image_size : positive;
    pixels           : positive
  ) return positive is
  begin

    -- The least multiple of M that is at least P: the bank of a pixel then determines its phase, and the pixels
    -- of a token lie in different banks.
    return divide_up(pixels, micro_image_size) * micro_image_size;

  end function bank_count;

  function bank_step (
    micro_image_size : positive;
    pixels           : positive
  ) return positive is
  begin

    -- Tokens begin at multiples of P, hence at banks that are multiples of the common divisor of P and the
    -- number of banks.
    return common_divisor(bank_count(micro_image_size, pixels), pixels);

  end function bank_step;

  function token_places (
    micro_image_size : positive;
    pixels           : positive
  ) return positive is
  begin

    return bank_count(micro_image_size, pixels) / bank_step(micro_image_size, pixels);

  end function token_places;

  function entering_offset (
    geometry     : geometry_t;
    slice        : natural;
    output_phase : natural
  ) return integer is

    variable phase : natural;

  begin

    phase := entering_phase(geometry, slice, output_phase);

    return geometry.output_delay -
           entering_age(geometry, slice, phase);

  end function entering_offset;

  function entering_index (
    geometry : geometry_t;
    slice    : natural;
    place    : integer
  ) return integer is
  begin

    return place + entering_offset(geometry, slice, place mod geometry.micro_image_size);

  end function entering_index;

  function entering_bank (
    geometry : geometry_t;
    pixels   : positive;
    slice    : natural;
    place    : natural
  ) return natural is
  begin

    return entering_index(geometry, slice, place) mod bank_count(geometry.micro_image_size, pixels);

  end function entering_bank;

  function entering_row (
    geometry : geometry_t;
    pixels   : positive;
    slice    : natural;
    place    : natural
  ) return integer is
  begin

    return floor_divided(entering_index(geometry, slice, place),
                         bank_count(geometry.micro_image_size, pixels));

  end function entering_row;

  function left_pixel (
    geometry : geometry_t;
    pixels   : positive;
    slice    : natural;
    place    : natural
  ) return left_t is

    constant BANKS : positive := bank_count(geometry.micro_image_size, pixels);

    variable index : integer;

  begin

    -- The pixel that entered with the output B before.
    index := entering_index(geometry, slice, place - geometry.boxes(slice));

    return
    (
      bank => index mod BANKS,
      rows => floor_divided(index, BANKS) - entering_row(geometry, pixels, slice, place)
    );

  end function left_pixel;

  function row_range (
    geometry : geometry_t;
    pixels   : positive
  ) return row_range_t is

    variable row  : integer;
    variable rows : row_range_t;

  begin

    row  := entering_row(geometry, pixels, 0, 0);
    rows := (lowest => row, highest => row);

    for s in 0 to geometry.slices - 1 loop

      for r in 0 to bank_count(geometry.micro_image_size, pixels) - 1 loop

        row := entering_row(geometry, pixels, s, r);

        -- The least of all rows, as the negated largest of the negated rows.
        rows.lowest  := -larger(-rows.lowest, -row);
        rows.highest := larger(rows.highest, row);

      end loop;

    end loop;

    return rows;

  end function row_range;

  function is_ahead (
    geometry : geometry_t;
    slice    : natural;
    index    : natural;
    held     : boolean
  ) return boolean is

    variable last   : integer;
    variable output : integer;

  begin

    last := -1;

    if held then
      -- The first output of output 0's group.
      last := -(centre_offset(geometry, slice) mod group_size(geometry, slice));
    end if;

    -- The output with which this pixel enters.
    output := index + entering_age(geometry, slice, index mod geometry.micro_image_size) -
              geometry.output_delay;

    -- The pixel has entered by the line's first output and has not left again.
    return output <= last and output > last - geometry.boxes(slice);

  end function is_ahead;

  function bank_rows (
    geometry : geometry_t;
    pixels   : positive
  ) return positive is

    variable oldest : natural;

  begin

    oldest := lane_delay(geometry, pixels) * pixels -
              geometry.output_delay + pixels - 1 + reach(geometry);

    -- A power of two lets row numbers wrap round.
    return 2 ** bits_for(divide_up(oldest, bank_count(geometry.micro_image_size, pixels)) + 2);

  end function bank_rows;

  function to_lanes (
    geometry   : geometry_t;
    pixels     : positive;
    channels   : positive;
    pixel_bits : positive
  ) return lanes_build_t is

    constant M    : positive    := geometry.micro_image_size;
    constant ROWS : row_range_t := row_range(geometry, pixels);

  begin

    return
    (
      geometry   => geometry,
      pixels     => pixels,
      channels   => channels,
      pixel_bits => pixel_bits,
      places     => token_places(M, pixels),
      banks      => bank_count(M, pixels),
      row_bits   => bits_for(bank_rows(geometry, pixels) - 1),
      most_rows  => larger(2 - ROWS.lowest, 1),
      ROWS       => ROWS
    );

  end function to_lanes;

  function lane_stage_latency (
    geometry : geometry_t;
    pixels   : positive
  ) return positive is
  begin

    -- Control 1, differences 5, running sum 1, and a level of adders for each doubling of P.
    return 7 + bits_for(pixels - 1) + choose(geometry.slices > 1, 1, 0) +
           choose(holds_outputs(geometry), 1, 0);

  end function lane_stage_latency;

end package body sum_lanes_pkg;
