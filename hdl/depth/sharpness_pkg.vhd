-- SPDX-License-Identifier: Apache-2.0
-- Widths and clocks of the depth index of a focal stack.
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

  -- Where a token's pixels lie in the micro images of a picture: in one, or in two of which the token ends the first.
  type lens_place_t is record
    -- Pixels are here.
    active : std_logic;
    -- Micro images of the first pixel and of the last one in the line, of 4096 at most: 8192 columns, M = 2.
    lens      : unsigned(11 downto 0);
    last_lens : unsigned(11 downto 0);
    -- The first pixel begins its micro image; one ends here; besides that, the line's last one begins and ends here.
    lens_first : std_logic;
    lens_last  : std_logic;
    tail       : std_logic;
    -- The line is the first or the last one of its micro images.
    row_first : std_logic;
    row_last  : std_logic;
    -- The row of micro images is of the picture, and the first one.
    row_live   : std_logic;
    row_starts : std_logic;
  end record lens_place_t;

  -- Bits of the place of a depth between two slices.
  constant FRACTION_BITS : positive := 8;

  -- A depth between slices, see depth_fraction.
  type depth_t is record
    fraction : std_logic_vector(FRACTION_BITS - 1 downto 0);
    -- 0: it is that of the slice.
    confidence : std_logic_vector(FRACTION_BITS - 1 downto 0);
  end record depth_t;

  constant NO_DEPTH : depth_t := (fraction => "10000000", confidence => "00000000");

  -- What a depth index is built for, and the sizes that follow from it, computed once.
  type index_build_t is record
    micro_image_size : positive range 2 to 128;
    slices           : positive range 1 to 256;
    -- Pixels of a token, M at most; tokens and micro images of the longest line.
    pixels : positive range 1 to 32;
    tokens : positive;
    lenses : positive;
    -- 1 (grey) or 3 (RGB); the width of one, and of a pixel with all of them.
    channels    : positive range 1 to 3;
    pixel_bits  : positive range 1 to 16;
    pixel_width : positive;
    -- Micro images from the middle of a window to its edge: of sharpness, and of the votes on it.
    radius      : natural range 0 to 8;
    vote_radius : natural range 0 to 4;
    -- How far the sharpness of the sharpest and the dullest slice are apart where there is texture.
    confidence : natural;
    -- Whether frames may have lines below the picture; whether a depth between slices goes with an index, the pixel of
    -- the sharpest slice, and beside this that of the slice that the frame has chosen.
    cropped    : boolean;
    between    : boolean;
    picture    : boolean;
    chosen_too : boolean;
    -- Width of a micro image's sum, of a row of Laplacians, and of a sharpness.
    sum_bits       : positive;
    row_bits       : positive;
    sharpness_bits : positive;
    -- Lines from a pixel to the first one that is judged with the index of its micro image; clocks from the last token
    -- of a row of micro images until the index of the first one is written.
    ring_lines    : positive;
    index_latency : positive;
  end record index_build_t;

  -- Stops elaboration, by a message that begins with a name, if the index cannot be built; else true.
  function takes_index (
    name             : string;
    micro_image_size : positive;
    slices           : positive;
    radius           : natural;
    vote_radius      : natural;
    max_columns      : positive;
    pixels           : positive;
    channels         : positive;
    pixel_bits       : positive
  ) return boolean;

  -- The same if there can be no depth between the slices; without SHIFTS there need be none.
  function takes_between (
    name   : string;
    shifts : string;
    slices : positive
  ) return boolean;

  -- Sixteenths by which the sharpness of a slice counts, 12, 15 or 16: with a whole a nothing is interpolated in sums
  -- over micro images, so such a slice is sharper than its neighbours.
  function slice_weight (
    micro_image_size : positive;
    shift            : integer
  ) return positive;

  -- Of two steps between slices, that to the slice behind one, or from the one before it, without what both have in
  -- common.
  function step_weight (
    shifts    : string;
    slice     : positive;
    to_behind : boolean
  ) return positive;

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
  function lens_sum_latency (
    pixels : positive
  ) return positive;

  -- Clocks from a line sum to the sharpness of the micro image 1 + radius before it.
  constant SHARPNESS_LATENCY : positive := 5;

  -- Clocks from the sharpest slice of a micro image to its vote; none without votes.
  function vote_latency (
    slices      : positive;
    vote_radius : natural
  ) return natural;

  -- Clocks from the sharpest slice of a micro image to its depth between slices.
  constant FRACTION_LATENCY : positive := 3 + FRACTION_BITS;

  -- Clocks from the last token of a row of micro images until the index of the first one is written.
  function index_latency (
    slices      : positive;
    radius      : natural;
    vote_radius : natural;
    between     : boolean;
    pixels      : positive
  ) return positive;

  -- A pixel, if there is a picture, its index, its depth between slices, if there is one, and the pixel of a chosen
  -- slice, if it goes beside.
  function pixel_word_bits (
    data_bits  : positive;
    between    : boolean;
    chosen_too : boolean;
    picture    : boolean := true
  ) return positive;

  -- The same; depth if there are SHIFTS.
  function index_word_bits (
    channels   : positive;
    pixel_bits : positive;
    shifts     : string;
    chosen_too : boolean;
    picture    : boolean := true
  ) return positive;

end package sharpness_pkg;

package body sharpness_pkg is

  function takes_index (
    name             : string;
    micro_image_size : positive;
    slices           : positive;
    radius           : natural;
    vote_radius      : natural;
    max_columns      : positive;
    pixels           : positive;
    channels         : positive;
    pixel_bits       : positive
  ) return boolean is

    variable lens_word : natural;
    variable stack     : natural;

  begin

    -- A luma is known of one channel and of three.
    assert channels /= 2
      report name & ": CHANNELS must be 1 or 3, of which there is a luma"
      severity failure;

    assert max_columns <= MOST_COLUMNS
      report name & ": MAX_COLUMNS must be at most 8192"
      severity failure;

    assert pixels <= micro_image_size and
           (pixels = 1 or pixels = 2 or pixels = 4 or pixels = 8 or pixels = 16 or pixels = 32)
      report name & ": PIXELS_PER_CLOCK must be 1, 2, 4, 8, 16 or 32 and at most MICRO_IMAGE_SIZE, " &
             "as one micro image is judged each clock"
      severity failure;

    -- What has to be stored: of all slices the lines of pixels that wait; of each micro image what
    -- judges it.
    stack     := slices * channels * pixel_bits * sharpness_delay(micro_image_size, radius, vote_radius);
    lens_word := slices * (4 * lens_bits(micro_image_size, channels, pixel_bits) +
                           2 * radius * row_sharpness_bits(micro_image_size, channels, pixel_bits, radius)) +
                 (2 * vote_radius + 1) * (bits_for(slices - 1) + 1);

    -- Divided rather than multiplied, as the products exceed an integer.
    assert stack * pixels <= MOST_LINE_BITS / divide_up(max_columns, pixels) and
           lens_word <= MOST_LINE_BITS / lens_count(max_columns, micro_image_size)
      report name & ": SLICES, MICRO_IMAGE_SIZE and MAX_COLUMNS need more than 64 Mbit of memory: " &
             "take fewer columns or slices"
      severity failure;

    return true;

  end function takes_index;

  function takes_between (
    name   : string;
    shifts : string;
    slices : positive
  ) return boolean is
  begin

    -- Without SHIFTS there is no depth between slices, and nothing to be refused.
    if shifts'length = 0 then
      return true;
    end if;

    assert takes_shifts(name, shifts, 1) and slice_count(shifts) = slices
      report name & ": SHIFTS """ & shifts & """ must be one for each of SLICES"
      severity failure;

    -- All steps have the direction of the first one, and none is 0.
    for s in 2 to slices - 1 loop

      assert (slice_shift(shifts, s) > slice_shift(shifts, s - 1)) =
             (slice_shift(shifts, 1) > slice_shift(shifts, 0)) and
             slice_shift(shifts, s) /= slice_shift(shifts, s - 1)
        report name & ": SHIFTS """ & shifts & """ must go up or down, as depth between slices needs neighbours"
        severity failure;

    end loop;

    return true;

  end function takes_between;

  function slice_weight (
    micro_image_size : positive;
    shift            : integer
  ) return positive is

    variable fractions : positive;

  begin

    -- Places between micro images at which views are taken.
    -- The fewer they are, the less a slice is blurred by interpolation, and the sharper it looks;
    -- the weights make up for it.
    fractions := micro_image_size / common_divisor(micro_image_size, abs shift);

    if fractions = 1 then
      return 12;
    elsif fractions = 2 then
      return 15;
    end if;

    return 16;

  end function slice_weight;

  function step_weight (
    shifts    : string;
    slice     : positive;
    to_behind : boolean
  ) return positive is

    variable from_before : positive;
    variable behind      : positive;

  begin

    -- How far it is to each neighbour, whichever way the slices go.
    from_before := abs (slice_shift(shifts, slice) - slice_shift(shifts, slice - 1));
    behind      := abs (slice_shift(shifts, slice + 1) - slice_shift(shifts, slice));

    -- Common factors would only make the products wider.
    return choose(to_behind, behind, from_before) / common_divisor(from_before, behind);

  end function step_weight;

  function lens_count (
    columns          : positive;
    micro_image_size : positive
  ) return positive is
  begin

    -- The last micro image of a line may be cut; it counts as one.
    return (columns + micro_image_size - 1) / micro_image_size;

  end function lens_count;

  function lens_bits (
    micro_image_size : positive;
    channels         : positive;
    pixel_bits       : positive
  ) return positive is
  begin

    -- Two bits more are four times as much: the sums of the widest pixels are no integers.
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

    -- The window adds as many rows.
    return row_sharpness_bits(micro_image_size, channels, pixel_bits, radius) + bits_for(2 * radius);

  end function sharpness_bits;

  function sharpness_delay (
    micro_image_size : positive;
    radius           : natural;
    vote_radius      : natural
  ) return positive is
  begin

    -- A row of micro images is judged when the window below it is complete, and a row more is needed for its
    -- Laplacian.
    return (radius + 2 + vote_radius) * micro_image_size;

  end function sharpness_delay;

  function lens_sum_latency (
    pixels : positive
  ) return positive is
  begin

    -- Several pixels are added in a clock of their own.
    return choose(pixels = 1, 6, 7);

  end function lens_sum_latency;

  function vote_latency (
    slices      : positive;
    vote_radius : natural
  ) return natural is
  begin

    -- The columns to the middle of the window, a comparison for each slice, and the memory, the
    -- counts and the choice.
    return choose(vote_radius = 0, 0, vote_radius + slices + 5);

  end function vote_latency;

  function index_latency (
    slices      : positive;
    radius      : natural;
    vote_radius : natural;
    between     : boolean;
    pixels      : positive
  ) return positive is
  begin

    -- For depth between slices they are weighed, a clock; it is found while they vote.
    -- The sums, the window to its middle, the sharpness, a comparison for each slice but the first,
    -- then votes or depth.
    return lens_sum_latency(pixels) + 1 + radius + SHARPNESS_LATENCY + slices - 1 +
           choose(between, 1 + larger(vote_latency(slices, vote_radius), FRACTION_LATENCY),
                  vote_latency(slices, vote_radius));

  end function index_latency;

  function pixel_word_bits (
    data_bits  : positive;
    between    : boolean;
    chosen_too : boolean;
    picture    : boolean := true
  ) return positive is
  begin

    -- The index has a byte whatever the number of slices, so that software reads it alike.
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
