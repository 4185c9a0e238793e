-- SPDX-License-Identifier: Apache-2.0
-- The records between registers, core and bus; the values of the read-only registers, from a core's generics; the width
-- of its streams. All functions are evaluated at elaboration only.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.sharpness_pkg.all;
use work.register_map_pkg.all;

package axi_pkg is

  -- What the master of AXI4-Lite drives, with an address for 4 KiB. Nothing here is protected, so awprot and arprot are
  -- of no account.
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

  -- What the slave drives.
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

  -- What software orders of a core: its ports of these names; restart is its reset.
  type orders_t is record
    restart      : std_logic;
    columns      : std_logic_vector(15 downto 0);
    rows         : std_logic_vector(15 downto 0);
    slice        : std_logic_vector(7 downto 0);
    sweep        : std_logic;
    sweep_frames : std_logic_vector(7 downto 0);
    red_place    : std_logic_vector(1 downto 0);
  end record orders_t;

  -- A stream that goes out, which is watched alone; tid: the slice.
  type watched_t is record
    tvalid : std_logic;
    tready : std_logic;
    tuser  : std_logic_vector(0 downto 0);
    tid    : std_logic_vector(7 downto 0);
    tlast  : std_logic;
  end record watched_t;

  -- For a clock each: a frame and a line begin to go in; a frame begins to come out, a line has come out; the source
  -- and the core had to wait; a transfer belongs to no frame.
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

  -- Those registers of `modes` that a core of some parts has; parts is the word of the register `parts`.
  function present_registers (
    parts : natural;
    modes : registers_t
  ) return registers_t;

  -- The registers given, and all that share 8 bytes with one of them.
  function in_pairs (
    registers : registers_t
  ) return registers_t;

  -- Bits of a stream's data: whole bytes, as AXI4-Stream has it.
  function stream_bits (
    bits : positive
  ) return positive;

  -- Bits of the pixels that stack_axi gives at once: all slices, or those of depth_index.
  function stack_output_bits (
    depth_index : boolean;
    shifts      : string;
    channels    : positive;
    pixel_bits  : positive;
    pixels      : positive
  ) return positive;

  -- Of the stream that has them.
  function stack_stream_bits (
    depth_index : boolean;
    shifts      : string;
    channels    : positive;
    pixel_bits  : positive;
    pixels      : positive
  ) return positive;

  -- The word of the register `geometry`.
  function geometry_word (
    micro_image_size : positive;
    slices           : natural;
    channels         : positive;
    pixel_bits       : positive;
    pixels_per_clock : positive
  ) return natural;

  -- Of `limits`.
  function limits_word (
    max_columns   : positive;
    parallel_rows : positive
  ) return natural;

  -- Of `engine`.
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

  -- Of `sharpness`.
  function sharpness_word (
    radius      : natural;
    vote_radius : natural
  ) return natural;

  -- Of `resampler`.
  function resampler_word (
    hexagonal     : boolean;
    moves         : boolean;
    gains         : boolean;
    lines         : positive;
    fraction_bits : positive;
    weight_bits   : positive;
    guard_bits    : positive;
    gain_bits     : positive
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

    -- A register without a need keeps its mode; the others are there only where a part that has
    -- them is built.
    found := modes;

    for i in 0 to REGISTERS_TOTAL - 1 loop

      if NEEDS(i) > 0 then
        found(i) := '0';
        there    := parts;
        part     := NEEDS(i);

        -- Naturals have no bits in VHDL-93, so both are taken apart by halving: one part in common is enough.
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

    -- Zeros fill the last byte up, see the entities.
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

    -- The index of depth_index has its word beside the pixel in focus; without it all slices lie
    -- side by side.
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

    -- The fields of a word do not overlap, so their sum is the word. All end below bit 31, as far
    -- as naturals reach.
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

    -- The same from flags and numbers: a flag is the power of two of its bit.
    return choose(moving_sum, 2 ** ENGINE_MOVING_SUM, 0) + choose(exact, 2 ** ENGINE_EXACT, 0) +
           choose(centred, 2 ** ENGINE_CENTRED, 0) + choose(hold, 2 ** ENGINE_HOLD, 0) +
           choose(any_rows, 2 ** ENGINE_ANY_ROWS, 0) + order * 2 ** ENGINE_ORDER +
           fraction_bits * 2 ** ENGINE_FRACTION_BITS + guard_bits * 2 ** ENGINE_GUARD_BITS +
           choose(normalised, 2 ** ENGINE_BORDER_NORMALISED, 0);

  end function engine_word;

  function sharpness_word (
    radius      : natural;
    vote_radius : natural
  ) return natural is
  begin

    return radius * 2 ** SHARPNESS_RADIUS + vote_radius * 2 ** SHARPNESS_VOTE_RADIUS;

  end function sharpness_word;

  function resampler_word (
    hexagonal     : boolean;
    moves         : boolean;
    gains         : boolean;
    lines         : positive;
    fraction_bits : positive;
    weight_bits   : positive;
    guard_bits    : positive;
    gain_bits     : positive
  ) return natural is
  begin

    return choose(hexagonal, 2 ** RESAMPLER_HEXAGONAL, 0) + choose(moves, 2 ** RESAMPLER_MOVES, 0) +
           choose(gains, 2 ** RESAMPLER_GAINS, 0) + lines * 2 ** RESAMPLER_LINES +
           fraction_bits * 2 ** RESAMPLER_FRACTION_BITS + weight_bits * 2 ** RESAMPLER_WEIGHT_BITS +
           guard_bits * 2 ** RESAMPLER_GUARD_BITS + gain_bits * 2 ** RESAMPLER_GAIN_BITS;

  end function resampler_word;

end package body axi_pkg;
