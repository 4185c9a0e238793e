-- SPDX-License-Identifier: Apache-2.0
-- Widths and clocks of the depth index of a focal stack.
--
-- Sharpness is judged between micro lenses: the luma of each micro image is summed over its pixels, and around each
-- sum the absolute Laplacians of a window of (2 RADIUS + 1) x (2 RADIUS + 1) micro images are added.

library work;
use work.math_pkg.all;

package sharpness_pkg is

  -- Micro images of a line.
  function lens_count (
    columns          : positive;
    micro_image_size : positive
  ) return positive;

  -- Luma of a micro image; of RGB it is R + 2 G + B.
  function lens_bits (
    micro_image_size : positive;
    channels         : positive;
    pixel_bits       : positive
  ) return positive;

  -- Sums of 2 radius + 1 absolute Laplacians.
  function row_sharpness_bits (
    micro_image_size : positive;
    channels         : positive;
    pixel_bits       : positive;
    radius           : natural
  ) return positive;

  -- Sharpness.
  function sharpness_bits (
    micro_image_size : positive;
    channels         : positive;
    pixel_bits       : positive;
    radius           : natural
  ) return positive;

  -- Lines from a pixel to the first line that is judged when the sharpness of its micro image is known.
  function sharpness_delay (
    micro_image_size : positive;
    radius           : natural;
    vote_radius      : natural
  ) return positive;

  -- Clocks from the last token of a row of micro images to its line sums, read from memory.
  constant LENS_SUM_LATENCY : positive := 6;

  -- Clocks from a line sum to the sharpness of the micro image 1 + radius before it.
  constant SHARPNESS_LATENCY : positive := 5;

  -- Clocks from the sharpest slice of a micro image to its vote; none without votes.
  function vote_latency (
    slices      : positive;
    vote_radius : natural
  ) return natural;

  -- Clocks from the last token of a row of micro images until the index of the first one is written.
  function index_latency (
    slices      : positive;
    radius      : natural;
    vote_radius : natural
  ) return positive;

  -- A pixel and its index, and the pixel of a chosen slice, if it goes beside.
  function index_word_bits (
    channels   : positive;
    pixel_bits : positive;
    chosen_too : boolean
  ) return positive;

end package sharpness_pkg;

package body sharpness_pkg is

  function lens_count (
    columns          : positive;
    micro_image_size : positive
  ) return positive is
  begin

    return (columns + micro_image_size - 1) / micro_image_size;

  end function lens_count;

  function lens_bits (
    micro_image_size : positive;
    channels         : positive;
    pixel_bits       : positive
  ) return positive is
  begin

    return bits_for(choose(channels = 1, 1, 4) * (2 ** pixel_bits - 1) * micro_image_size * micro_image_size);

  end function lens_bits;

  function row_sharpness_bits (
    micro_image_size : positive;
    channels         : positive;
    pixel_bits       : positive;
    radius           : natural
  ) return positive is
  begin

    return lens_bits(micro_image_size, channels, pixel_bits) + 2 + bits_for(2 * radius);

  end function row_sharpness_bits;

  function sharpness_bits (
    micro_image_size : positive;
    channels         : positive;
    pixel_bits       : positive;
    radius           : natural
  ) return positive is
  begin

    return row_sharpness_bits(micro_image_size, channels, pixel_bits, radius) + bits_for(2 * radius);

  end function sharpness_bits;

  function sharpness_delay (
    micro_image_size : positive;
    radius           : natural;
    vote_radius      : natural
  ) return positive is
  begin

    return (radius + 2 + vote_radius) * micro_image_size;

  end function sharpness_delay;

  function vote_latency (
    slices      : positive;
    vote_radius : natural
  ) return natural is
  begin

    return choose(vote_radius = 0, 0, vote_radius + slices + 5);

  end function vote_latency;

  function index_latency (
    slices      : positive;
    radius      : natural;
    vote_radius : natural
  ) return positive is
  begin

    return LENS_SUM_LATENCY + 1 + radius + SHARPNESS_LATENCY + slices - 1 + vote_latency(slices, vote_radius);

  end function index_latency;

  function index_word_bits (
    channels   : positive;
    pixel_bits : positive;
    chosen_too : boolean
  ) return positive is
  begin

    return choose(chosen_too, 2, 1) * channels * pixel_bits + 8;

  end function index_word_bits;

end package body sharpness_pkg;
