-- SPDX-License-Identifier: Apache-2.0
-- Geometry of the refocusing operator, and clock counts that more than one engine needs.
--
-- The refocusing operator of one dimension (M pixels a micro image, integer shift s):
--
--   S(k') = sum over input pixels k and n = 0 .. B-1 with k' = k + n + (k mod M) * (s - 1)
--
-- The box B is M, or fewer samples for a picture that is less blurred, but a multiple of gcd(s, M): at each output so
-- many pixels meet. Written as text it is one number for each slice ("3 5 3"), or one for all.
--
-- An engine serves a set of shifts, written as text with blanks in between ("-3 0 3"), from which a slice is
-- chosen while it runs. All slices have the same output delay, that of the slice which needs most. So slices
-- may change from line to line without a gap.
--
-- What users instantiate parses the text once, into a constant of type geometry_t that is a generic of all entities
-- inside. All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.number_set_pkg.all;

package refocus_pkg is

  -- Limits of what an engine can be built for: the largest shift to either side, slices in a set, the longest
  -- line, the bits of its column memories.
  constant MOST_SHIFT     : positive := 4096;
  constant MOST_SLICES    : positive := 256;
  constant MOST_COLUMNS   : positive := 8192;
  constant MOST_LINE_BITS : positive := 2 ** 26;

  -- Returns true, or stops elaboration if SHIFTS cannot be built; the message begins with the name.
  function takes_shifts (
    name   : string;
    shifts : string
  ) return boolean;

  -- Returns true, or stops elaboration if BOX cannot be built for SHIFTS; the message begins with the name.
  function takes_box (
    name             : string;
    box              : string;
    micro_image_size : positive;
    shifts           : string
  ) return boolean;

  -- Whether column memories are no larger than MOST_LINE_BITS: words of all channels, each of so many bits, and further
  -- bits beside them.
  function line_bits_fit (
    words : natural;
    bits  : natural;
    more  : natural
  ) return boolean;

  -- Shifts by slice. The length is fixed because VHDL-93 has no records with fields of unconstrained length.
  type shifts_t is array (natural range 0 to MOST_SLICES - 1) of integer range -MOST_SHIFT to MOST_SHIFT;

  -- Samples B of the box by slice.
  type boxes_t is array (natural range 0 to MOST_SLICES - 1) of natural range 0 to 128;

  -- The geometry that all schedules of an engine follow from.
  type geometry_t is record
    -- Micro image size M in pixels.
    micro_image_size : positive;
    -- slices: number of slices; shifts: the shift of each, 0 behind the last one.
    slices : positive range 1 to MOST_SLICES;
    shifts : shifts_t;
    -- The box of each slice, 0 behind the last one.
    boxes : boxes_t;
    -- Whether the picture stays put from slice to slice.
    centred : boolean;
    -- Steps between a pixel and the output of the same index, equal for all slices.
    output_delay : natural;
  end record geometry_t;

  -- The geometry that a core's generics describe. Stops elaboration if SHIFTS cannot be built; the message begins
  -- with the name.
  function geometry_of (
    name             : string;
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    box              : string := ""
  ) return geometry_t;

  -- The largest box of a slice.
  function largest_box (
    geometry : geometry_t
  ) return positive;

  -- Whether slices have boxes that differ.
  function boxes_differ (
    geometry : geometry_t
  ) return boolean;

  -- Whether all boxes are M.
  function boxes_of_m (
    geometry : geometry_t
  ) return boolean;

  -- The geometry of one pass: interpolation of order n appends n passes with the shift 1, each a moving sum of a box.
  -- Such a pass has one slice, or where boxes differ those of the set.
  function pass_geometry (
    geometry : geometry_t;
    pass     : natural
  ) return geometry_t;

  -- The geometry of one slice alone, with the output delay of the whole set; for slice -1 the whole geometry.
  function slice_geometry (
    geometry : geometry_t;
    slice    : integer
  ) return geometry_t;

  -- The output of index k is S(k + centre_offset): floor((M-1) * shift / 2) - floor((M-B) / 2) when centred, otherwise
  -- 0.
  function centre_offset (
    geometry : geometry_t;
    slice    : natural
  ) return integer;

  -- The output delay that an engine for this slice alone would have.
  function own_delay (
    geometry : geometry_t;
    slice    : natural
  ) return natural;

  -- output_delay summed over all passes of a dimension.
  function total_delay (
    geometry : geometry_t;
    order    : natural
  ) return natural;

  -- Clocks from reading a stream's partial sums to the next possible read: block RAM 2, add 1, write 1.
  constant PARTIAL_SUM_LOOP : positive := 4;

  -- Clocks of the raster core's streams, besides the array: input FIFO 3, sequencer 1, output FIFO 3.
  constant STREAM_LATENCY : positive := 7;

  -- Tokens of a line with so many columns.
  function line_tokens (
    columns : positive;
    pixels  : positive
  ) return positive;

  -- Clocks that divide_round takes.
  constant DIVIDE_LATENCY : positive := 3;

  -- Clocks of the division behind an engine: divide_weighted with weights, else divide_round.
  function scaler_latency (
    weighted   : boolean;
    pixel_bits : positive
  ) return positive;

end package refocus_pkg;

package body refocus_pkg is

  function takes_shifts (
    name   : string;
    shifts : string
  ) return boolean is
  begin

    assert is_set(shifts, -MOST_SHIFT, MOST_SHIFT)
      report name & ": SHIFTS """ & shifts & """ must be whole numbers from -4096 to 4096 with blanks in between"
      severity failure;

    assert slice_count(shifts) >= 1 and slice_count(shifts) <= MOST_SLICES
      report name & ": SHIFTS """ & shifts & """ must name 1 to 256 slices"
      severity failure;

    return true;

  end function takes_shifts;

  -- The box of a slice: its own number, the only one, or M without a number.
  function box_samples (
    box              : string;
    micro_image_size : positive;
    slice            : natural
  ) return natural is
  begin

    if slice_count(box) = 0 then
      return micro_image_size;
    end if;

    return slice_shift(box, choose(slice_count(box) = 1, 0, slice));

  end function box_samples;

  function takes_box (
    name             : string;
    box              : string;
    micro_image_size : positive;
    shifts           : string
  ) return boolean is

    variable shift   : integer;
    variable samples : natural;

  begin

    assert is_set(box, 0, micro_image_size) and box_samples(box, micro_image_size, 0) > 0
      report name & ": BOX """ & box & """ must be whole numbers from 1 to MICRO_IMAGE_SIZE with blanks in between"
      severity failure;

    assert slice_count(box) <= 1 or slice_count(box) = slice_count(shifts)
      report name & ": BOX """ & box & """ must have one number, a number for each slice of SHIFTS, or none"
      severity failure;

    for i in 0 to slice_count(shifts) - 1 loop

      shift   := slice_shift(shifts, i);
      samples := box_samples(box, micro_image_size, i);

      -- Pixels meet in groups; a box that ends within a group would show some of them.
      assert samples > 0 and samples mod common_divisor(micro_image_size, abs (shift)) = 0
        report name & ": BOX """ & box & """ must be a multiple of gcd(shift, MICRO_IMAGE_SIZE) for each of SHIFTS"
        severity failure;

    end loop;

    return true;

  end function takes_box;

  function line_bits_fit (
    words : natural;
    bits  : natural;
    more  : natural
  ) return boolean is

    variable left : integer;

  begin

    left := MOST_LINE_BITS;

    if words > 0 then
      if bits > MOST_LINE_BITS / words then
        left := -1;
      else
        left := MOST_LINE_BITS - words * bits;
      end if;
    end if;

    return more <= left;

  end function line_bits_fit;

  function centre_offset (
    geometry : geometry_t;
    slice    : natural
  ) return integer is

    variable span : integer;

  begin

    if not geometry.centred then
      return 0;
    end if;

    span := (geometry.micro_image_size - 1) * geometry.shifts(slice);

    -- A smaller box lacks samples on both sides; those in front of it would have come first.
    return floor_divided(span, 2) - (geometry.micro_image_size - geometry.boxes(slice)) / 2;

  end function centre_offset;

  function own_delay (
    geometry : geometry_t;
    slice    : natural
  ) return natural is

    variable offset : integer;

  begin

    offset := centre_offset(geometry, slice);

    if geometry.shifts(slice) >= 1 then
      return offset;
    end if;

    -- The last pixel of a micro image (n = M - 1) is added to outputs (M - 1) * (shift - 1) places away.
    return offset + (geometry.micro_image_size - 1) * (1 - geometry.shifts(slice));

  end function own_delay;

  function geometry_of (
    name             : string;
    micro_image_size : positive;
    shifts           : string;
    centred          : boolean;
    box              : string := ""
  ) return geometry_t is

    constant REFUSED : boolean := not (takes_shifts(name, shifts) and takes_box(name, box, micro_image_size, shifts));

    variable geometry : geometry_t;

  begin

    geometry.micro_image_size := micro_image_size;
    geometry.slices           := slice_count(shifts);
    geometry.shifts           := (others => 0);
    geometry.boxes            := (others => 0);
    geometry.centred          := centred;
    geometry.output_delay     := 0;

    for i in 0 to geometry.slices - 1 loop

      geometry.shifts(i)    := slice_shift(shifts, i);
      geometry.boxes(i)     := box_samples(box, micro_image_size, i);
      geometry.output_delay := larger(geometry.output_delay, own_delay(geometry, i));

    end loop;

    return geometry;

  end function geometry_of;

  function largest_box (
    geometry : geometry_t
  ) return positive is

    variable largest : positive;

  begin

    largest := 1;

    for i in 0 to geometry.slices - 1 loop

      largest := larger(largest, geometry.boxes(i));

    end loop;

    return largest;

  end function largest_box;

  function boxes_differ (
    geometry : geometry_t
  ) return boolean is
  begin

    for i in 1 to geometry.slices - 1 loop

      if geometry.boxes(i) /= geometry.boxes(0) then
        return true;
      end if;

    end loop;

    return false;

  end function boxes_differ;

  function boxes_of_m (
    geometry : geometry_t
  ) return boolean is
  begin

    return largest_box(geometry) = geometry.micro_image_size and not boxes_differ(geometry);

  end function boxes_of_m;

  function pass_geometry (
    geometry : geometry_t;
    pass     : natural
  ) return geometry_t is

    variable interpolation : geometry_t;

  begin

    if pass = 0 then
      return geometry;
    end if;

    interpolation              := geometry;
    interpolation.slices       := choose(boxes_differ(geometry), geometry.slices, 1);
    interpolation.shifts       := (others => 0);
    interpolation.output_delay := 0;

    for i in 0 to interpolation.slices - 1 loop

      interpolation.shifts(i)    := 1;
      interpolation.output_delay := larger(interpolation.output_delay, own_delay(interpolation, i));

    end loop;

    return interpolation;

  end function pass_geometry;

  function slice_geometry (
    geometry : geometry_t;
    slice    : integer
  ) return geometry_t is

    variable alone : geometry_t;

  begin

    if slice < 0 then
      return geometry;
    end if;

    alone        := geometry;
    alone.slices := 1;
    alone.shifts := (0 => geometry.shifts(slice), others => 0);
    alone.boxes  := (0 => geometry.boxes(slice), others => 0);

    return alone;

  end function slice_geometry;

  function total_delay (
    geometry : geometry_t;
    order    : natural
  ) return natural is
  begin

    return geometry.output_delay + order * pass_geometry(geometry, 1).output_delay;

  end function total_delay;

  function line_tokens (
    columns : positive;
    pixels  : positive
  ) return positive is
  begin

    if pixels = 1 then
      return columns;
    end if;

    -- A line memory has at least two columns: with one, its output would feed back a clock too early for the
    -- sum.
    return larger(divide_up(columns, pixels), 2);

  end function line_tokens;

  function scaler_latency (
    weighted   : boolean;
    pixel_bits : positive
  ) return positive is
  begin

    return choose(weighted, pixel_bits + 1, DIVIDE_LATENCY);

  end function scaler_latency;

end package body refocus_pkg;
