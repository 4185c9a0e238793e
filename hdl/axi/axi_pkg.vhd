-- SPDX-License-Identifier: Apache-2.0
-- Records between registers, core and bus; contents of the read-only registers, computed from a core's generics; widths
-- of the streams. All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.number_set_pkg.all;
use work.sharpness_pkg.all;
use work.register_map_pkg.all;

package axi_pkg is

  -- Signals that the master of AXI4-Lite drives, with addresses for 4 KiB. No register is protected, so awprot and
  -- arprot are ignored.
  type bus_request_t is record
    awaddr  : std_logic_vector(11 downto 0);
    awprot  : std_logic_vector(2 downto 0);
    awvalid : std_logic;
    wdata   : std_logic_vector(31 downto 0);
    wstrb   : std_logic_vector(3 downto 0);
    wvalid  : std_logic;
    bready  : std_logic;
    araddr  : std_logic_vector(11 downto 0);
    arprot  : std_logic_vector(2 downto 0);
    arvalid : std_logic;
    rready  : std_logic;
  end record bus_request_t;

  -- Signals that the slave of AXI4-Lite drives.
  type bus_answer_t is record
    awready : std_logic;
    wready  : std_logic;
    bresp   : std_logic_vector(1 downto 0);
    bvalid  : std_logic;
    arready : std_logic;
    rdata   : std_logic_vector(31 downto 0);
    rresp   : std_logic_vector(1 downto 0);
    rvalid  : std_logic;
  end record bus_answer_t;

  -- Orders of software to a core: the core's ports of these names; restart is the core's reset.
  type orders_t is record
    restart      : std_logic;
    columns      : std_logic_vector(15 downto 0);
    rows         : std_logic_vector(15 downto 0);
    slice        : std_logic_vector(7 downto 0);
    sweep        : std_logic;
    sweep_frames : std_logic_vector(7 downto 0);
    red_place    : std_logic_vector(1 downto 0);
  end record orders_t;

  -- A stream that goes out, without its data; tid: the slice.
  type watched_t is record
    tvalid : std_logic;
    tready : std_logic;
    tuser  : std_logic_vector(0 downto 0);
    tid    : std_logic_vector(7 downto 0);
    tlast  : std_logic;
  end record watched_t;

  -- Events, each high for one clock: a frame or a line begins to go in (frame_in, line_in); a frame begins to come out,
  -- a line has come out; the source had to wait, the core had to wait; a transfer belongs to no frame.
  type traffic_t is record
    frame_in  : std_logic;
    line_in   : std_logic;
    frame_out : std_logic;
    line_out  : std_logic;
    stall_in  : std_logic;
    stall_out : std_logic;
    dropped   : std_logic;
  end record traffic_t;

  -- A bit for each register.
  subtype registers_t is std_logic_vector(0 to REGISTERS_TOTAL - 1);

  -- The registers of `modes` that exist in a core with these parts; parts is the content of the register `parts`.
  function present_registers (
    parts : natural;
    modes : registers_t
  ) return registers_t;

  -- The given registers, and all that share 8 bytes with one of them.
  function in_pairs (
    registers : registers_t
  ) return registers_t;

  -- Bits of a stream's data: whole bytes, as AXI4-Stream requires.
  function stream_bits (
    bits : positive
  ) return positive;

  -- Bits of the pixels in one transfer of stack_axi: all slices, or the output of depth_index.
  function stack_output_bits (
    depth_index : boolean;
    shifts      : string;
    channels    : positive;
    pixel_bits  : positive;
    pixels      : positive
  ) return positive;

  -- Bits of the stream with these pixels.
  function stack_stream_bits (
    depth_index : boolean;
    shifts      : string;
    channels    : positive;
    pixel_bits  : positive;
    pixels      : positive
  ) return positive;

  -- Content of the register `geometry`.
  function geometry_word (
    micro_image_size : positive;
    slices           : natural;
    channels         : positive;
    pixel_bits       : positive;
    pixels_per_clock : positive
  ) return natural;

  -- Content of the register `limits`.
  function limits_word (
    max_columns   : positive;
    parallel_rows : positive
  ) return natural;

  -- Content of the register `engine`.
  function engine_word (
    moving_sum    : boolean;
    exact         : boolean;
    centred       : boolean;
    hold          : boolean;
    any_rows      : boolean;
    order         : natural;
    fraction_bits : natural;
    guard_bits    : natural;
    normalised    : boolean
  ) return natural;

  -- Content of the register `sharpness`.
  function sharpness_word (
    radius      : natural;
    vote_radius : natural;
    sharp_too   : boolean
  ) return natural;

  -- Content of the register `resampler`.
  function resampler_word (
    hexagonal     : boolean;
    moves         : boolean;
    gains         : boolean;
    lines         : positive;
    fraction_bits : positive;
    weight_bits   : positive;
    guard_bits    : positive;
    gain_bits     : positive;
    skewed        : boolean
  ) return natural;

end package axi_pkg;

package body axi_pkg is

  function present_registers (
    parts : natural;
    modes : registers_t
  ) return registers_t is

    variable found : registers_t;
    variable part  : natural;
    variable there : natural;

  begin

    -- A register without a need keeps its mode; the others exist only if one of the parts that need them is built.
    found := modes;

    for i in 0 to REGISTERS_TOTAL - 1 loop

      if NEEDS(i) > 0 then
        found(i) := '0';
        there    := parts;
        part     := NEEDS(i);

        -- VHDL-93 has no bits of naturals, so both numbers are halved bit by bit; one part in common is enough.
        for bit_number in 0 to PARTS_MOSAIC loop

          if there mod 2 = 1 and part mod 2 = 1 then
            found(i) := modes(i);
          end if;
          there := there / 2;
          part  := part / 2;

        end loop;

      end if;

    end loop;

    return found;

  end function present_registers;

  function in_pairs (
    registers : registers_t
  ) return registers_t is

    variable pairs : registers_t;

  begin

    pairs := registers;

    for i in 0 to REGISTERS_TOTAL - 1 loop

      for j in 0 to REGISTERS_TOTAL - 1 loop

        if i / 2 = j / 2 and registers(j) = '1' then
          pairs(i) := '1';
        end if;

      end loop;

    end loop;

    return pairs;

  end function in_pairs;

  function stream_bits (
    bits : positive
  ) return positive is
  begin

    -- Zeros fill up the last byte.
    return 8 * divide_up(bits, 8);

  end function stream_bits;

  function stack_output_bits (
    depth_index : boolean;
    shifts      : string;
    channels    : positive;
    pixel_bits  : positive;
    pixels      : positive
  ) return positive is
  begin

    -- The output of depth_index has the index beside the pixel in focus; without depth_index all slices lie side by
    -- side.
    return pixels * choose(depth_index, index_word_bits(channels, pixel_bits, "", false),
                           slice_count(shifts) * channels * pixel_bits);

  end function stack_output_bits;

  function stack_stream_bits (
    depth_index : boolean;
    shifts      : string;
    channels    : positive;
    pixel_bits  : positive;
    pixels      : positive
  ) return positive is
  begin

    return stream_bits(stack_output_bits(depth_index, shifts, channels, pixel_bits, pixels));

  end function stack_stream_bits;

  function geometry_word (
    micro_image_size : positive;
    slices           : natural;
    channels         : positive;
    pixel_bits       : positive;
    pixels_per_clock : positive
  ) return natural is
  begin

    -- The fields of a word do not overlap, so their sum is the word. All fields end below bit 31, as far as naturals
    -- reach.
    return micro_image_size * 2 ** GEOMETRY_MICRO_IMAGE_SIZE + slices * 2 ** GEOMETRY_SLICES +
           channels * 2 ** GEOMETRY_CHANNELS + pixel_bits * 2 ** GEOMETRY_PIXEL_BITS +
           pixels_per_clock * 2 ** GEOMETRY_PIXELS_PER_CLOCK;

  end function geometry_word;

  function limits_word (
    max_columns   : positive;
    parallel_rows : positive
  ) return natural is
  begin

    return max_columns * 2 ** LIMITS_MAX_COLUMNS + parallel_rows * 2 ** LIMITS_PARALLEL_ROWS;

  end function limits_word;

  function engine_word (
    moving_sum    : boolean;
    exact         : boolean;
    centred       : boolean;
    hold          : boolean;
    any_rows      : boolean;
    order         : natural;
    fraction_bits : natural;
    guard_bits    : natural;
    normalised    : boolean
  ) return natural is
  begin

    -- A flag adds the power of two of its bit.
    return choose(moving_sum, 2 ** ENGINE_MOVING_SUM, 0) + choose(exact, 2 ** ENGINE_EXACT, 0) +
           choose(centred, 2 ** ENGINE_CENTRED, 0) + choose(hold, 2 ** ENGINE_HOLD, 0) +
           choose(any_rows, 2 ** ENGINE_ANY_ROWS, 0) + order * 2 ** ENGINE_ORDER +
           fraction_bits * 2 ** ENGINE_FRACTION_BITS + guard_bits * 2 ** ENGINE_GUARD_BITS +
           choose(normalised, 2 ** ENGINE_BORDER_NORMALISED, 0);

  end function engine_word;

  function sharpness_word (
    radius      : natural;
    vote_radius : natural;
    sharp_too   : boolean
  ) return natural is
  begin

    return radius * 2 ** SHARPNESS_RADIUS + vote_radius * 2 ** SHARPNESS_VOTE_RADIUS +
           choose(sharp_too, 2 ** SHARPNESS_SHARP_TOO, 0);

  end function sharpness_word;

  function resampler_word (
    hexagonal     : boolean;
    moves         : boolean;
    gains         : boolean;
    lines         : positive;
    fraction_bits : positive;
    weight_bits   : positive;
    guard_bits    : positive;
    gain_bits     : positive;
    skewed        : boolean
  ) return natural is
  begin

    return choose(hexagonal, 2 ** RESAMPLER_HEXAGONAL, 0) + choose(moves, 2 ** RESAMPLER_MOVES, 0) +
           choose(gains, 2 ** RESAMPLER_GAINS, 0) + lines * 2 ** RESAMPLER_LINES +
           fraction_bits * 2 ** RESAMPLER_FRACTION_BITS + weight_bits * 2 ** RESAMPLER_WEIGHT_BITS +
           guard_bits * 2 ** RESAMPLER_GUARD_BITS + gain_bits * 2 ** RESAMPLER_GAIN_BITS +
           choose(skewed, 2 ** RESAMPLER_SKEWED, 0);

  end function resampler_word;

end package body axi_pkg;
