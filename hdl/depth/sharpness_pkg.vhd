-- SPDX-License-Identifier: Apache-2.0
-- Widths and latencies of the depth index of a focal stack.
--
-- Sharpness is computed between micro images: the luma of each micro image is summed over its pixels, and around each
-- sum the absolute Laplacians of a window of (2 RADIUS + 1) x (2 RADIUS + 1) micro images are added.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;

package sharpness_pkg is

  -- Where the pixels of a token lie: in one micro image, or in two of which the first ends within the token.
  type lens_place_t is record
    -- The token has pixels.
    active : std_logic;
    -- Number of the micro image of the first pixel, and of the line's last pixel; at most 4096 (8192 columns, M = 2).
    lens      : unsigned(11 downto 0);
    last_lens : unsigned(11 downto 0);
    -- lens_first: the first pixel begins its micro image; lens_last: a micro image ends in this token; tail: the line's
    -- last micro image also begins and ends here.
    lens_first : std_logic;
    lens_last  : std_logic;
    tail       : std_logic;
    -- The line is the first, or the last, of its row of micro images.
    row_first : std_logic;
    row_last  : std_logic;
    -- The row of micro images belongs to the picture; it is the picture's first row.
    row_live   : std_logic;
    row_starts : std_logic;
  end record lens_place_t;

  -- Bits of the place between two slices.
  constant FRACTION_BITS : positive := 8;

  -- A depth between slices (depth_fraction).
  type depth_t is record
    fraction : std_logic_vector(FRACTION_BITS - 1 downto 0);
    -- 0: the depth is that of the slice itself.
    confidence : std_logic_vector(FRACTION_BITS - 1 downto 0);
  end record depth_t;

  constant NO_DEPTH : depth_t := (fraction => "10000000", confidence => "00000000");

  -- Weight of a slice's sharpness in sixteenths: 12, 15 or 16. With an integer a, sums over micro images interpolate
  -- nothing, so such a slice looks sharper than its neighbours.
  function slice_weight (
    micro_image_size : positive;
    shift            : integer
  ) return positive;

  -- Step from a slice to the slice behind it (to_behind), or from the slice before it, without the common factor of
  -- both steps.
  function step_weight (
    shifts    : shifts_t;
    slice     : positive;
    to_behind : boolean
  ) return positive;

  -- Micro images of a line.
  function lens_count (
    columns          : positive;
    micro_image_size : positive
  ) return positive;

  -- Width of the luma of a micro image; the luma of RGB is R + 2 G + B.
  function lens_bits (
    micro_image_size : positive;
    channels         : positive;
    pixel_bits       : positive
  ) return positive;

  -- Width of a sum of 2 radius + 1 absolute Laplacians.
  function row_sharpness_bits (
    micro_image_size : positive;
    channels         : positive;
    pixel_bits       : positive;
    radius           : natural
  ) return positive;

  -- Width of a sharpness.
  function sharpness_bits (
    micro_image_size : positive;
    channels         : positive;
    pixel_bits       : positive;
    radius           : natural
  ) return positive;

  -- Lines from a pixel to the first line that is judged when its micro image's sharpness is known.
  function sharpness_delay (
    micro_image_size : positive;
    radius           : natural;
    vote_radius      : natural
  ) return positive;

  -- Clocks from the last token of a row of micro images to its sums, as read from memory.
  function lens_sum_latency (
    pixels : positive
  ) return positive;

  -- Clocks from a sum to the sharpness of the micro image 1 + radius before it.
  constant SHARPNESS_LATENCY : positive := 5;

  -- Whether a micro image has texture: its sharpest slice is that much sharper than its dullest one.
  function has_texture (
    most       : unsigned;
    least      : unsigned;
    confidence : natural
  ) return std_logic;

  -- Clocks from the sharpest slice of a micro image to its vote. Without votes a second box takes one, for the texture.
  function vote_latency (
    slices      : positive;
    vote_radius : natural;
    boxes       : positive
  ) return natural;

  -- Clocks from the sharpest slice of a micro image to its depth between slices.
  constant FRACTION_LATENCY : positive := 3 + FRACTION_BITS;

  -- Clocks from the last token of a row of micro images until the first index is written.
  function index_latency (
    slices      : positive;
    radius      : natural;
    vote_radius : natural;
    between     : boolean;
    pixels      : positive;
    boxes       : positive := 1
  ) return positive;

  -- Width of a pixel's output: the pixel if there is a picture, its index, its depth between slices if there is one,
  -- the pixel of a chosen slice if that goes beside.
  function pixel_word_bits (
    data_bits  : positive;
    between    : boolean;
    chosen_too : boolean;
    picture    : boolean := true
  ) return positive;

  -- Width of a pixel's output, from a depth_index's generics; there is a depth if there are SHIFTS.
  function index_word_bits (
    channels   : positive;
    pixel_bits : positive;
    shifts     : string;
    chosen_too : boolean;
    picture    : boolean := true
  ) return positive;

end package sharpness_pkg;

package body sharpness_pkg is

  function slice_weight (
    micro_image_size : positive;
    shift            : integer
  ) return positive is

    variable fractions : positive;

  begin

    -- Number of places between micro images at which views are taken. The fewer they are, the less interpolation blurs
    -- a slice, and the sharper it looks; the weights compensate for that.
    fractions := micro_image_size / common_divisor(micro_image_size, abs shift);

    if fractions = 1 then
      return 12;
    elsif fractions = 2 then
      return 15;
    end if;

    return 16;

  end function slice_weight;

  function step_weight (
    shifts    : shifts_t;
    slice     : positive;
    to_behind : boolean
  ) return positive is

    variable from_before : positive;
    variable behind      : positive;

  begin

    -- Distance to each neighbour, whatever the direction of the shifts.
    from_before := abs (shifts(slice) - shifts(slice - 1));
    behind      := abs (shifts(slice + 1) - shifts(slice));

    -- A common factor would only make the products wider.
    return choose(to_behind, behind, from_before) / common_divisor(from_before, behind);

  end function step_weight;

  function lens_count (
    columns          : positive;
    micro_image_size : positive
  ) return positive is
  begin

    -- A line's last micro image may be cut off; it counts too.
    return (columns + micro_image_size - 1) / micro_image_size;

  end function lens_count;

  function lens_bits (
    micro_image_size : positive;
    channels         : positive;
    pixel_bits       : positive
  ) return positive is
  begin

    -- Two bits more are a factor of four, for R + 2 G + B. The sum itself may exceed an integer.
    return bits_for((2 ** pixel_bits - 1) * micro_image_size * micro_image_size) + choose(channels = 1, 0, 2);

  end function lens_bits;

  function row_sharpness_bits (
    micro_image_size : positive;
    channels         : positive;
    pixel_bits       : positive;
    radius           : natural
  ) return positive is
  begin

    -- A Laplacian of four neighbours has two bits more, and the window of a row adds 2 r + 1 of them.
    return lens_bits(micro_image_size, channels, pixel_bits) + 2 + bits_for(2 * radius);

  end function row_sharpness_bits;

  function sharpness_bits (
    micro_image_size : positive;
    channels         : positive;
    pixel_bits       : positive;
    radius           : natural
  ) return positive is
  begin

    -- The window adds 2 r + 1 rows.
    return row_sharpness_bits(micro_image_size, channels, pixel_bits, radius) + bits_for(2 * radius);

  end function sharpness_bits;

  function sharpness_delay (
    micro_image_size : positive;
    radius           : natural;
    vote_radius      : natural
  ) return positive is
  begin

    -- A row of micro images is judged when the window below it is complete; its Laplacian needs one row more.
    return (radius + 2 + vote_radius) * micro_image_size;

  end function sharpness_delay;

  function lens_sum_latency (
    pixels : positive
  ) return positive is
  begin

    -- Adding several pixels takes a clock of its own.
    return choose(pixels = 1, 6, 7);

  end function lens_sum_latency;

  function has_texture (
    most       : unsigned;
    least      : unsigned;
    confidence : natural
  ) return std_logic is

    -- The confidence may exceed any sharpness.
    constant BITS : positive := larger(most'length, bits_for(confidence)) + 1;

  begin

    -- The confidence is added to the least sharpness rather than taken from the most, so nothing becomes negative.
    return to_logic(most >= resize(least, BITS) + to_unsigned(confidence, BITS));

  end function has_texture;

  function vote_latency (
    slices      : positive;
    vote_radius : natural;
    boxes       : positive
  ) return natural is
  begin

    -- Columns to the middle of the window, a comparison for each slice, then memory, counts and choice.
    return choose(vote_radius = 0, boxes - 1, vote_radius + slices + 5);

  end function vote_latency;

  function index_latency (
    slices      : positive;
    radius      : natural;
    vote_radius : natural;
    between     : boolean;
    pixels      : positive;
    boxes       : positive := 1
  ) return positive is

    constant VOTE : natural := vote_latency(slices, vote_radius, boxes);

  begin

    -- Sums, window to its middle, sharpness, a comparison for each slice but the first; with a depth between slices a
    -- clock for the weights, then votes or depth, whichever takes longer.
    return lens_sum_latency(pixels) + 1 + radius + SHARPNESS_LATENCY + slices - 1 +
           choose(between, 1 + larger(VOTE, FRACTION_LATENCY), VOTE);

  end function index_latency;

  function pixel_word_bits (
    data_bits  : positive;
    between    : boolean;
    chosen_too : boolean;
    picture    : boolean := true
  ) return positive is
  begin

    -- The index is always a byte, so that software reads every configuration alike.
    return choose(picture, data_bits, 0) + choose(chosen_too, data_bits, 0) + 8 +
           choose(between, 2 * FRACTION_BITS, 0);

  end function pixel_word_bits;

  function index_word_bits (
    channels   : positive;
    pixel_bits : positive;
    shifts     : string;
    chosen_too : boolean;
    picture    : boolean := true
  ) return positive is
  begin

    return pixel_word_bits(channels * pixel_bits, shifts'length > 0, chosen_too, picture);

  end function index_word_bits;

end package body sharpness_pkg;
