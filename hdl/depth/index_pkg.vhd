-- SPDX-License-Identifier: Apache-2.0
-- What a depth index is built for: from its generics to its record, with every refusal.
--
-- depth_index, or a picture with all slices, makes one constant of type index_build_t; all entities inside take this
-- constant whole. All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.number_set_pkg.all;
use work.refocus_pkg.all;
use work.sharpness_pkg.all;

package index_pkg is

  -- Generics of a depth index, and the sizes that follow from them, computed once.
  type index_build_t is record
    micro_image_size : positive range 2 to 128;
    slices           : positive range 1 to 256;
    -- Pictures of each slice that come in: 1, with a box of M samples; 2, beside it one with a smaller box.
    boxes : positive range 1 to 2;
    -- The shift of each slice, for the depth between them.
    shifts : shifts_t;
    -- Longest line in pixels; pixels of a token, at most M; tokens and micro images of the longest line.
    columns : positive;
    pixels  : positive range 1 to 32;
    tokens  : positive;
    lenses  : positive;
    -- Channels: 1 (grey) or 3 (RGB); the width of a channel, of a pixel with all channels, and of a pixel in all
    -- pictures of all slices.
    channels    : positive range 1 to 3;
    pixel_bits  : positive range 1 to 16;
    pixel_width : positive;
    stack_width : positive;
    -- Micro images from the middle of a window to its edge: of sharpness, and of the votes.
    radius      : natural range 0 to 8;
    vote_radius : natural range 0 to 4;
    -- Least difference of sharpness between the sharpest and the dullest slice of a micro image with texture.
    confidence : natural;
    -- cropped: frames may have lines below the picture. between: a depth between slices goes with an index. picture:
    -- the pixel of the sharpest slice comes out. chosen_too: the pixel of the slice chosen for the frame comes out
    -- beside it.
    cropped    : boolean;
    between    : boolean;
    picture    : boolean;
    chosen_too : boolean;
    -- Widths of a micro image's sum, of a row of Laplacians, of a sharpness.
    sum_bits       : positive;
    row_bits       : positive;
    sharpness_bits : positive;
    -- ring_lines: lines from a pixel to the first line that is judged with the index of its micro image. index_latency:
    -- clocks from the last token of a row of micro images until the first index is written.
    ring_lines    : positive;
    index_latency : positive;
  end record index_build_t;

  -- The index that these numbers describe. Stops elaboration if the index cannot be built; the message begins with the
  -- name.
  function index_of (
    name             : string;
    micro_image_size : positive;
    slices           : positive;
    shifts           : shifts_t;
    between          : boolean;
    radius           : natural;
    confidence       : natural;
    vote_radius      : natural;
    max_columns      : positive;
    pixels           : positive := 1;
    channels         : positive := 3;
    pixel_bits       : positive := 8;
    cropped          : boolean;
    picture          : boolean  := true;
    chosen_too       : boolean;
    boxes            : positive := 1
  ) return index_build_t;

  -- The number of slices that an index judges, where a stack's shifts name each slice once for each of its boxes.
  -- Stops elaboration if they do not; the message begins with the name.
  function judged_slices (
    name   : string;
    shifts : string;
    boxes  : positive
  ) return positive;

  -- The shifts of a stack as a depth between its slices needs them; none, if the text is empty. The text names each as
  -- often as it has boxes. Stops elaboration if the text allows no such depth; the message begins with the name.
  function ordered_shifts (
    name   : string;
    shifts : string;
    slices : positive;
    boxes  : positive := 1
  ) return shifts_t;

  -- Width of a token's stack, and of its output.
  function token_bits (
    build : index_build_t
  ) return positive;

  function out_bits (
    build : index_build_t
  ) return positive;

end package index_pkg;

package body index_pkg is

  -- Whether the index can be built; stops elaboration otherwise.
  function takes_index (
    name             : string;
    micro_image_size : positive;
    slices           : positive;
    boxes            : positive;
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

    -- Luma is defined for one channel and for three.
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

    -- Stored bits: stack: lines of pixels that wait, of all pictures; lens_word: what judges each micro image.
    stack     := slices * boxes * channels * pixel_bits * sharpness_delay(micro_image_size, radius, vote_radius);
    lens_word := slices * (4 * lens_bits(micro_image_size, channels, pixel_bits) +
                           2 * radius * row_sharpness_bits(micro_image_size, channels, pixel_bits, radius)) +
                 (2 * vote_radius + 1) * (bits_for(slices - 1) + 1);

    -- The test divides instead of multiplying, because the products exceed an integer.
    assert stack * pixels <= MOST_LINE_BITS / divide_up(max_columns, pixels) and
           lens_word <= MOST_LINE_BITS / lens_count(max_columns, micro_image_size)
      report name & ": SLICES, MICRO_IMAGE_SIZE and MAX_COLUMNS need more than 64 Mbit of memory: " &
             "take fewer columns or slices"
      severity failure;

    return true;

  end function takes_index;

  function index_of (
    name             : string;
    micro_image_size : positive;
    slices           : positive;
    shifts           : shifts_t;
    between          : boolean;
    radius           : natural;
    confidence       : natural;
    vote_radius      : natural;
    max_columns      : positive;
    pixels           : positive := 1;
    channels         : positive := 3;
    pixel_bits       : positive := 8;
    cropped          : boolean;
    picture          : boolean  := true;
    chosen_too       : boolean;
    boxes            : positive := 1
  ) return index_build_t is

    constant M       : positive := micro_image_size;
    constant REFUSED : boolean  := not takes_index(name, M, slices, boxes, radius, vote_radius, max_columns, pixels,
                                                   channels, pixel_bits);
    constant NO_RING : boolean  := not (takes(picture or not chosen_too, name & ": CHOSEN_TOO needs PICTURE") and
                                        takes(picture or boxes = 1, name & ": SHARP_TOO needs PICTURE"));

  begin

    return
    (
      micro_image_size => M,
      slices           => slices,
      boxes            => boxes,
      shifts           => shifts,
      columns          => max_columns,
      pixels           => pixels,
      tokens           => divide_up(max_columns, pixels),
      lenses           => lens_count(max_columns, M),
      channels         => channels,
      pixel_bits       => pixel_bits,
      pixel_width      => channels * pixel_bits,
      stack_width      => slices * boxes * channels * pixel_bits,
      radius           => radius,
      vote_radius      => vote_radius,
      confidence       => confidence,
      cropped          => cropped,
      between          => between,
      picture          => picture,
      chosen_too       => chosen_too,
      sum_bits         => lens_bits(M, channels, pixel_bits),
      row_bits         => row_sharpness_bits(M, channels, pixel_bits, radius),
      sharpness_bits   => sharpness_bits(M, channels, pixel_bits, radius),
      ring_lines       => sharpness_delay(M, radius, vote_radius),
      index_latency    => index_latency(slices, radius, vote_radius, between, pixels, boxes)
    );

  end function index_of;

  function judged_slices (
    name   : string;
    shifts : string;
    boxes  : positive
  ) return positive is

    constant REFUSED  : boolean  := not takes_shifts(name, shifts);
    constant PICTURES : positive := slice_count(shifts);

  begin

    for i in 0 to PICTURES - 1 loop

      -- The first picture of a slice is judged, so those behind it must be of the same slice.
      assert PICTURES mod boxes = 0 and slice_shift(shifts, i) = slice_shift(shifts, i - i mod boxes)
        report name & ": SHARP_TOO needs each slice of SHIFTS """ & shifts & """ twice"
        severity failure;

    end loop;

    return PICTURES / boxes;

  end function judged_slices;

  function ordered_shifts (
    name   : string;
    shifts : string;
    slices : positive;
    boxes  : positive := 1
  ) return shifts_t is

    variable ordered : shifts_t;

  begin

    ordered := (others => 0);

    -- Without SHIFTS there is no depth between slices, and nothing to be refused.
    if shifts'length = 0 then
      return ordered;
    end if;

    assert takes_shifts(name, shifts) and slice_count(shifts) = slices * boxes
      report name & ": SHIFTS """ & shifts & """ must be one for each of SLICES"
      severity failure;

    for s in 0 to slices - 1 loop

      ordered(s) := slice_shift(shifts, s * boxes);

    end loop;

    -- All steps have the sign of the first one, and none is 0.
    for s in 2 to slices - 1 loop

      assert (ordered(s) > ordered(s - 1)) = (ordered(1) > ordered(0)) and ordered(s) /= ordered(s - 1)
        report name & ": SHIFTS """ & shifts & """ must go up or down, as depth between slices needs neighbours"
        severity failure;

    end loop;

    return ordered;

  end function ordered_shifts;

  function token_bits (
    build : index_build_t
  ) return positive is
  begin

    return build.pixels * build.stack_width;

  end function token_bits;

  function out_bits (
    build : index_build_t
  ) return positive is
  begin

    return build.pixels * pixel_word_bits(build.pixel_width, build.between, build.chosen_too, build.picture);

  end function out_bits;

end package body index_pkg;
