-- SPDX-License-Identifier: Apache-2.0
-- Types and constants of the resampler: positions, lines, registers, and the records between its entities.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

package resample_pkg is

  -- Generics of a resampler, and the widths that follow from them.
  type resample_build_t is record
    -- M, pixels of a micro image in each dimension.
    micro_image_size : positive range 1 to 128;
    -- Longest raw line in pixels; raw lines in the ring.
    max_columns : positive range 2 to 8192;
    held_lines  : positive range 4 to 256;
    -- lenses: lenses of the table; moves: the table moves lenses from the even grid; gains: the table has gains.
    lenses : positive range 2 to 1048576;
    moves  : boolean;
    gains  : boolean;
    -- Channels: 1 (grey) or 3 (RGB); the width of a channel, and of all.
    channels   : positive range 1 to 3;
    pixel_bits : positive range 1 to 16;
    data_bits  : positive range 1 to 48;
    -- Fraction bits of positions, weights, samples and gains.
    fraction_bits : positive range 8 to 17;
    weight_bits   : positive range 2 to 8;
    guard_bits    : positive range 1 to 3;
    gain_bits     : positive range 4 to 14;
    -- Width of an interpolated channel, and of one behind its gain.
    sample_bits : positive range 2 to 19;
    value_bits  : positive;
  end record resample_build_t;

  -- A position on the sensor in fixed point.
  subtype position_t is signed(31 downto 0);

  -- A line or column of the sensor, also beyond its borders; or a line in the ring's numbering without end.
  subtype place_t is signed(15 downto 0);

  -- Addresses of the tables.
  subtype lens_t is unsigned(19 downto 0);

  subtype profile_t is unsigned(13 downto 0);

  -- Addresses of the grid's registers. Rows of lenses (low half), and lenses sampled in a row (high half).
  constant REGISTER_LENSES : natural := 0;
  -- Micro images in a row of the raster.
  constant REGISTER_OUTPUTS : natural := 1;
  -- Top left pixel of the first lens; step to the next lens; steps from even and from odd rows of lenses to the next
  -- row.
  constant REGISTER_ORIGIN_Y    : natural := 2;
  constant REGISTER_ORIGIN_X    : natural := 3;
  constant REGISTER_RIGHT_Y     : natural := 4;
  constant REGISTER_RIGHT_X     : natural := 5;
  constant REGISTER_DOWN_EVEN_Y : natural := 6;
  constant REGISTER_DOWN_EVEN_X : natural := 7;
  constant REGISTER_DOWN_ODD_Y  : natural := 8;
  constant REGISTER_DOWN_ODD_X  : natural := 9;
  -- Lines from the first lens of a row to its highest lens (low half, signed) and to its lowest lens (high half,
  -- signed).
  constant REGISTER_REACH : natural := 10;
  -- Black level.
  constant REGISTER_BLACK : natural := 11;
  -- Hexagonal grids only: place of the first micro image in even and in odd rows of lenses; step to the next micro
  -- image.
  constant REGISTER_PLACE_EVEN : natural := 12;
  constant REGISTER_PLACE_ODD  : natural := 13;
  constant REGISTER_STEP       : natural := 14;
  -- Skewed grids only, in the same places: from a line of a micro image to the next; from a pixel to the next, along x.
  -- `lens_rows` takes a row's lines to end before the next row begins: M - 1 steps of a line are at most one DOWN step,
  -- and both DOWN steps are equal.
  constant REGISTER_LINE_Y  : natural := 12;
  constant REGISTER_LINE_X  : natural := 13;
  constant REGISTER_PIXEL_X : natural := 14;
  constant REGISTER_COUNT   : natural := 15;

  type registers_t is array (0 to REGISTER_COUNT - 1) of std_logic_vector(31 downto 0);

  -- A word at the load port as a record; written for one clock.
  type load_t is record
    write   : std_logic;
    kind    : std_logic_vector(1 downto 0);
    address : std_logic_vector(19 downto 0);
    data    : std_logic_vector(39 downto 0);
  end record load_t;

  constant NO_LOAD : load_t := ('0', "00", (others => '0'), (others => '0'));

  -- A word at the load port as bits, to cross between clocks; from the high end kind, address, data.
  subtype load_word_t is std_logic_vector(61 downto 0);

  function to_load (
    write : std_logic;
    word  : load_word_t
  ) return load_t;

  -- Kinds of words at the load port.
  constant LOAD_KIND_REGISTER : std_logic_vector(1 downto 0) := "00";
  constant LOAD_KIND_LENS     : std_logic_vector(1 downto 0) := "01";
  constant LOAD_KIND_PROFILE  : std_logic_vector(1 downto 0) := "10";
  -- A commit: the registers written so far (all of a grid) take effect with the next frame.
  constant LOAD_KIND_COMMIT : std_logic_vector(1 downto 0) := "11";

  -- Whether a load writes a word of this kind.
  function writes (
    load : load_t;
    kind : std_logic_vector(1 downto 0)
  ) return std_logic;

  -- Where raw_writer puts a pixel: line number, slot of the line in the ring (counted in pairs), column. The fields
  -- have the bits of the largest ring; bits that a smaller ring does not use are always 0.
  type ring_write_t is record
    enable : std_logic;
    line   : place_t;
    slot   : natural range 0 to 127;
    column : unsigned(12 downto 0);
  end record ring_write_t;

  -- State of the ring, from raw_writer to lens_rows. frame_waits: a frame waits for its reader; frame_base: its first
  -- line; lines_in: complete lines of the reader's frame (all of them while another frame waits).
  type ring_state_t is record
    frame_waits : std_logic;
    frame_base  : place_t;
    lines_in    : place_t;
  end record ring_state_t;

  -- Needs of the ring's reader. frame_taken: it takes the waiting frame; keep: the first line that must stay;
  -- keep_none: no line must.
  type ring_need_t is record
    frame_taken : std_logic;
    keep        : place_t;
    keep_none   : std_logic;
  end record ring_need_t;

  -- The frame that is read: number of its line 0, its last line and its last column.
  type raw_frame_t is record
    base        : place_t;
    last_line   : place_t;
    last_column : place_t;
  end record raw_frame_t;

  -- A pixel of the raster on its way through the samples: valid: there is one; first: a frame's first; last: a line's
  -- last; addresses of its lens and its profile; its position, with the fraction bits of weights (8 at most).
  type walked_t is record
    valid   : std_logic;
    first   : std_logic;
    last    : std_logic;
    lens    : lens_t;
    profile : profile_t;
    y       : signed(23 downto 0);
    x       : signed(23 downto 0);
  end record walked_t;

  -- A line of the raster.
  type raster_line_t is record
    -- Position of the line's first pixel.
    y : position_t;
    x : position_t;
    -- Addresses of the line's first lens, and of its first pixel in the profile.
    lens    : lens_t;
    profile : profile_t;
    -- The first line of a frame.
    first : std_logic;
  end record raster_line_t;

  -- Integer bits of a gain, and the largest gain.
  constant GAIN_INTEGER_BITS : positive := 4;
  constant LARGEST_GAIN      : positive := 10;

  -- Latencies in clocks: of raw_window, of pixel_sample, of sample_gain.
  constant WINDOW_LATENCY : positive := 8;
  constant SAMPLE_LATENCY : positive := 5;
  constant GAIN_LATENCY   : positive := 3;

  -- The column (line) inside the sensor that stands for one outside: mirrored at the first and the last.
  function mirrored (
    place : place_t;
    last  : place_t
  ) return place_t;

end package resample_pkg;

package body resample_pkg is

  function to_load (
    write : std_logic;
    word  : load_word_t
  ) return load_t is
  begin

    return (write, word(61 downto 60), word(59 downto 40), word(39 downto 0));

  end function to_load;

  function writes (
    load : load_t;
    kind : std_logic_vector(1 downto 0)
  ) return std_logic is
  begin

    return load.write and to_logic(load.kind = kind);

  end function writes;

  function mirrored (
    place : place_t;
    last  : place_t
  ) return place_t is
  begin

    if place < 0 then
      return -place;
    elsif place > last then
      return shift_left(last, 1) - place;
    end if;

    return place;

  end function mirrored;

end package body resample_pkg;
