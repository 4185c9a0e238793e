-- SPDX-License-Identifier: Apache-2.0
-- The register map of a core behind a bus. Built by scripts/build_registers.py from hdl/axi/registers.toml.

library ieee;
use ieee.std_logic_1164.all;

package register_map_pkg is

  subtype word_t is std_logic_vector(31 downto 0);

  type words_t is array (natural range <>) of word_t;

  type naturals_t is array (natural range <>) of natural;

  -- Number of registers.
  constant REGISTERS_TOTAL : positive := 33;

  -- Constant contents of registers.
  constant IDENTIFICATION_WORD : word_t := x"506C6E66";
  constant VERSION_WORD        : word_t := x"01000300";

  -- Places of the registers: a quarter of the address in bytes.
  constant AT_IDENTIFICATION   : natural := 0;
  constant AT_VERSION          : natural := 1;
  constant AT_PARTS            : natural := 2;
  constant AT_GEOMETRY         : natural := 3;
  constant AT_LIMITS           : natural := 4;
  constant AT_ENGINE           : natural := 5;
  constant AT_SHARPNESS        : natural := 6;
  constant AT_CONFIDENCE       : natural := 7;
  constant AT_RESAMPLER        : natural := 8;
  constant AT_LENSES           : natural := 9;
  constant AT_ASKED_SLICE      : natural := 10;
  constant AT_SLICE_SHIFT      : natural := 11;
  constant AT_CONTROL          : natural := 12;
  constant AT_COMMAND          : natural := 13;
  constant AT_SLICE            : natural := 14;
  constant AT_SWEEP_FRAMES     : natural := 15;
  constant AT_FRAME_SIZE       : natural := 16;
  constant AT_RED_PLACE        : natural := 17;
  constant AT_STATUS           : natural := 18;
  constant AT_RASTER_SIZE      : natural := 19;
  constant AT_ERRORS           : natural := 20;
  constant AT_INTERRUPT_STATUS : natural := 21;
  constant AT_INTERRUPT_MASK   : natural := 22;
  constant AT_FRAMES_IN        : natural := 23;
  constant AT_FRAMES_OUT       : natural := 24;
  constant AT_LINES_IN         : natural := 25;
  constant AT_LINES_OUT        : natural := 26;
  constant AT_STALLS_IN        : natural := 27;
  constant AT_STALLS_OUT       : natural := 28;
  constant AT_DROPPED          : natural := 29;
  constant AT_LOAD_PLACE       : natural := 30;
  constant AT_LOAD_HIGH        : natural := 31;
  constant AT_LOAD_WORD        : natural := 32;

  -- Fields of the registers: the first bit, and the number of bits above 1.

  -- version: Release of plenofir, and number of the map.
  constant VERSION_PATCH      : natural  := 0;
  constant VERSION_PATCH_BITS : positive := 8;
  constant VERSION_MINOR      : natural  := 8;
  constant VERSION_MINOR_BITS : positive := 8;
  constant VERSION_MAJOR      : natural  := 16;
  constant VERSION_MAJOR_BITS : positive := 8;
  constant VERSION_MAP        : natural  := 24;
  constant VERSION_MAP_BITS   : positive := 8;

  -- parts: The parts that are built.
  constant PARTS_REFOCUSER   : natural := 0;
  constant PARTS_STACK       : natural := 1;
  constant PARTS_DEPTH_INDEX : natural := 2;
  constant PARTS_RESAMPLER   : natural := 3;
  constant PARTS_MOSAIC      : natural := 4;

  -- geometry: Structure of frames.
  constant GEOMETRY_MICRO_IMAGE_SIZE      : natural  := 0;
  constant GEOMETRY_MICRO_IMAGE_SIZE_BITS : positive := 8;
  constant GEOMETRY_SLICES                : natural  := 8;
  constant GEOMETRY_SLICES_BITS           : positive := 9;
  constant GEOMETRY_CHANNELS              : natural  := 17;
  constant GEOMETRY_CHANNELS_BITS         : positive := 2;
  constant GEOMETRY_PIXEL_BITS            : natural  := 19;
  constant GEOMETRY_PIXEL_BITS_BITS       : positive := 5;
  constant GEOMETRY_PIXELS_PER_CLOCK      : natural  := 24;
  constant GEOMETRY_PIXELS_PER_CLOCK_BITS : positive := 6;

  -- limits: Limits of frames.
  constant LIMITS_MAX_COLUMNS        : natural  := 0;
  constant LIMITS_MAX_COLUMNS_BITS   : positive := 16;
  constant LIMITS_PARALLEL_ROWS      : natural  := 16;
  constant LIMITS_PARALLEL_ROWS_BITS : positive := 7;

  -- engine: How slices are computed.
  constant ENGINE_MOVING_SUM         : natural  := 0;
  constant ENGINE_EXACT              : natural  := 1;
  constant ENGINE_CENTRED            : natural  := 2;
  constant ENGINE_HOLD               : natural  := 3;
  constant ENGINE_ANY_ROWS           : natural  := 4;
  constant ENGINE_ORDER              : natural  := 5;
  constant ENGINE_ORDER_BITS         : positive := 2;
  constant ENGINE_FRACTION_BITS      : natural  := 7;
  constant ENGINE_FRACTION_BITS_BITS : positive := 4;
  constant ENGINE_GUARD_BITS         : natural  := 11;
  constant ENGINE_GUARD_BITS_BITS    : positive := 4;
  constant ENGINE_BORDER_NORMALISED  : natural  := 15;

  -- sharpness: How the sharpest slice is found.
  constant SHARPNESS_RADIUS           : natural  := 0;
  constant SHARPNESS_RADIUS_BITS      : positive := 4;
  constant SHARPNESS_VOTE_RADIUS      : natural  := 4;
  constant SHARPNESS_VOTE_RADIUS_BITS : positive := 3;
  constant SHARPNESS_SHARP_TOO        : natural  := 7;

  -- confidence: Threshold of texture.
  constant CONFIDENCE_LEVEL      : natural  := 0;
  constant CONFIDENCE_LEVEL_BITS : positive := 30;

  -- resampler: How the resampler is built.
  constant RESAMPLER_HEXAGONAL          : natural  := 0;
  constant RESAMPLER_MOVES              : natural  := 1;
  constant RESAMPLER_GAINS              : natural  := 2;
  constant RESAMPLER_LINES              : natural  := 3;
  constant RESAMPLER_LINES_BITS         : positive := 9;
  constant RESAMPLER_FRACTION_BITS      : natural  := 12;
  constant RESAMPLER_FRACTION_BITS_BITS : positive := 5;
  constant RESAMPLER_WEIGHT_BITS        : natural  := 17;
  constant RESAMPLER_WEIGHT_BITS_BITS   : positive := 4;
  constant RESAMPLER_GUARD_BITS         : natural  := 21;
  constant RESAMPLER_GUARD_BITS_BITS    : positive := 2;
  constant RESAMPLER_GAIN_BITS          : natural  := 23;
  constant RESAMPLER_GAIN_BITS_BITS     : positive := 4;
  constant RESAMPLER_SKEWED             : natural  := 27;

  -- lenses: Size of the table of lenses.
  constant LENSES_COUNT      : natural  := 0;
  constant LENSES_COUNT_BITS : positive := 21;

  -- asked_slice: Selects the slice that `slice_shift` describes.
  constant ASKED_SLICE_NUMBER      : natural  := 0;
  constant ASKED_SLICE_NUMBER_BITS : positive := 8;

  -- slice_shift: Focus setting of the slice `asked_slice`; 0 for numbers beyond the set.
  constant SLICE_SHIFT_SHIFT           : natural  := 0;
  constant SLICE_SHIFT_SHIFT_BITS      : positive := 14;
  constant SLICE_SHIFT_SHARPENING      : natural  := 14;
  constant SLICE_SHIFT_SHARPENING_BITS : positive := 5;
  constant SLICE_SHIFT_BOX             : natural  := 19;
  constant SLICE_SHIFT_BOX_BITS        : positive := 8;

  -- control: Switches the core on and off.
  constant CONTROL_ENABLE : natural := 0;
  constant CONTROL_SWEEP  : natural := 1;

  -- command: Commands; writing a 1 carries one out.
  constant COMMAND_RESTART : natural := 0;
  constant COMMAND_COMMIT  : natural := 1;

  -- slice: The slice to show.
  constant SLICE_NUMBER      : natural  := 0;
  constant SLICE_NUMBER_BITS : positive := 8;

  -- sweep_frames: Speed of a sweep.
  constant SWEEP_FRAMES_COUNT      : natural  := 0;
  constant SWEEP_FRAMES_COUNT_BITS : positive := 8;

  -- frame_size: Size of the input frames. Writing a size restarts the core. It is refused (`errors.refused`) while
  -- `control.enable` is 1, with 0 columns or rows, with more columns than `limits` has, and unless all four bytes are
  -- written at once. Until one is written frames are dropped with `errors.frame_size`.
  constant FRAME_SIZE_COLUMNS      : natural  := 0;
  constant FRAME_SIZE_COLUMNS_BITS : positive := 16;
  constant FRAME_SIZE_ROWS         : natural  := 16;
  constant FRAME_SIZE_ROWS_BITS    : positive := 16;

  -- red_place: Place of the first red pixel.
  constant RED_PLACE_COLUMN : natural := 0;
  constant RED_PLACE_ROW    : natural := 1;

  -- status: State of the core.
  constant STATUS_SLICE      : natural  := 0;
  constant STATUS_SLICE_BITS : positive := 8;
  constant STATUS_INSIDE     : natural  := 8;

  -- raster_size: Size of the output frames; between two frames, that of the last one.
  constant RASTER_SIZE_COLUMNS      : natural  := 0;
  constant RASTER_SIZE_COLUMNS_BITS : positive := 16;
  constant RASTER_SIZE_ROWS         : natural  := 16;
  constant RASTER_SIZE_ROWS_BITS    : positive := 16;

  -- errors: Faults so far. Writing a 1 clears a bit.
  constant ERRORS_LINE_EARLY  : natural := 0;
  constant ERRORS_LINE_LATE   : natural := 1;
  constant ERRORS_FRAME_EARLY : natural := 2;
  constant ERRORS_FRAME_LATE  : natural := 3;
  constant ERRORS_FRAME_SIZE  : natural := 4;
  constant ERRORS_CALIBRATION : natural := 5;
  constant ERRORS_REFUSED     : natural := 6;

  -- interrupt_status: Events so far. Writing a 1 clears a bit.
  constant INTERRUPT_STATUS_FRAME_IN  : natural := 0;
  constant INTERRUPT_STATUS_FRAME_OUT : natural := 1;
  constant INTERRUPT_STATUS_ERROR     : natural := 2;

  -- interrupt_mask: Enables interrupts. The interrupt is high while a bit is 1 both here and in `interrupt_status`.
  constant INTERRUPT_MASK_FRAME_IN  : natural := 0;
  constant INTERRUPT_MASK_FRAME_OUT : natural := 1;
  constant INTERRUPT_MASK_ERROR     : natural := 2;

  -- load_place: Destination of the next word of a calibration. Refused unless all four bytes are written at once, and
  -- with kind 3.
  constant LOAD_PLACE_ADDRESS      : natural  := 0;
  constant LOAD_PLACE_ADDRESS_BITS : positive := 20;
  constant LOAD_PLACE_KIND         : natural  := 20;
  constant LOAD_PLACE_KIND_BITS    : positive := 2;

  -- load_high: High bits of the next words for `load_word`.
  constant LOAD_HIGH_BITS      : natural  := 0;
  constant LOAD_HIGH_BITS_BITS : positive := 8;

  -- Registers that can be read.
  constant READABLE : std_logic_vector(0 to 32) := "111111111111101111111111111111110";

  -- Registers that can be written.
  constant WRITABLE : std_logic_vector(0 to 32) := "000000000010111111001110000000111";

  -- Bits that a register keeps as written.
  constant KEPT : words_t(0 to 32) :=
  (
    AT_ASKED_SLICE    => x"000000FF",
    AT_CONTROL        => x"00000003",
    AT_SLICE          => x"000000FF",
    AT_SWEEP_FRAMES   => x"000000FF",
    AT_FRAME_SIZE     => x"FFFFFFFF",
    AT_RED_PLACE      => x"00000003",
    AT_INTERRUPT_MASK => x"00000007",
    AT_LOAD_HIGH      => x"000000FF",
    others            => x"00000000"
  );

  -- Bits of the register `parts` of which one must be set; 0: the register always exists.
  constant NEEDS : naturals_t(0 to 32) :=
  (
    AT_ENGINE       => 3,
    AT_SHARPNESS    => 4,
    AT_CONFIDENCE   => 4,
    AT_RESAMPLER    => 8,
    AT_LENSES       => 8,
    AT_ASKED_SLICE  => 3,
    AT_SLICE_SHIFT  => 3,
    AT_SLICE        => 1,
    AT_SWEEP_FRAMES => 1,
    AT_RED_PLACE    => 16,
    AT_RASTER_SIZE  => 8,
    AT_LOAD_PLACE   => 8,
    AT_LOAD_HIGH    => 8,
    AT_LOAD_WORD    => 8,
    others          => 0
  );

end package register_map_pkg;
