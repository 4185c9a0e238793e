-- SPDX-License-Identifier: Apache-2.0
-- Entities with the generics of the tops that refuse what these refuse, and build nothing.

library work;
use work.core_pkg.all;
use work.refocuser_pkg.all;

entity core_verdict is
  generic (
    MICRO_IMAGE_SIZE    : natural := 1;
    INTERPOLATION_ORDER : natural := 1;
    PARALLEL_ROWS       : natural := 1;
    PIXELS_PER_CLOCK    : natural := 1;
    MAX_COLUMNS         : natural := 1;
    CHANNELS            : natural := 1;
    PIXEL_BITS          : natural := 1;
    FRACTION_BITS       : natural := 1;
    GUARD_BITS          : natural := 1;
    BROADCAST_TAPS      : natural := 1;
    SHIFTS              : string  := "";
    SHARPENING          : string  := "";
    ENGINE              : string  := "fir";
    CENTRED             : boolean := false;
    HOLD                : boolean := false;
    EXACT               : boolean := false;
    ANY_ROWS            : boolean := false;
    BORDER_NORMALISED   : boolean := false
  );
end entity core_verdict;

architecture rtl of core_verdict is

  -- The core is a constant, so elaboration checks it, and nothing else is built.
  constant CORE : core_t := core_of
                            (
                              name                => "raster_refocuser",
                              MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
                              SHIFTS              => SHIFTS,
                              CENTRED             => CENTRED,
                              INTERPOLATION_ORDER => INTERPOLATION_ORDER,
                              HOLD                => HOLD,
                              PARALLEL_ROWS       => PARALLEL_ROWS,
                              PIXELS_PER_CLOCK    => PIXELS_PER_CLOCK,
                              MAX_COLUMNS         => MAX_COLUMNS,
                              CHANNELS            => CHANNELS,
                              PIXEL_BITS          => PIXEL_BITS,
                              EXACT               => EXACT,
                              FRACTION_BITS       => FRACTION_BITS,
                              GUARD_BITS          => GUARD_BITS,
                              ENGINE              => ENGINE,
                              ANY_ROWS            => ANY_ROWS,
                              SHARPENING          => SHARPENING,
                              BORDER_NORMALISED   => BORDER_NORMALISED,
                              BROADCAST_TAPS      => BROADCAST_TAPS
                            );

begin

end architecture rtl;

library work;
use work.core_pkg.all;
use work.refocuser_pkg.all;

entity stack_verdict is
  generic (
    MICRO_IMAGE_SIZE  : natural := 1;
    MAX_COLUMNS       : natural := 1;
    CHANNELS          : natural := 1;
    PIXEL_BITS        : natural := 1;
    INPUT_LINES       : natural := 1;
    PIXELS_PER_CLOCK  : natural := 1;
    SHIFTS            : string;
    CENTRED           : boolean;
    BORDER_NORMALISED : boolean := false
  );
end entity stack_verdict;

architecture rtl of stack_verdict is

  constant CORE : core_t := stack_of
                            (
                              name              => "focal_stack",
                              MICRO_IMAGE_SIZE  => MICRO_IMAGE_SIZE,
                              SHIFTS            => SHIFTS,
                              CENTRED           => CENTRED,
                              MAX_COLUMNS       => MAX_COLUMNS,
                              PIXELS_PER_CLOCK  => PIXELS_PER_CLOCK,
                              CHANNELS          => CHANNELS,
                              PIXEL_BITS        => PIXEL_BITS,
                              BORDER_NORMALISED => BORDER_NORMALISED
                            );

begin

end architecture rtl;

library work;
use work.index_pkg.all;

entity index_verdict is
  generic (
    MICRO_IMAGE_SIZE : natural;
    MAX_COLUMNS      : natural;
    PIXELS_PER_CLOCK : natural := 1;
    CHANNELS         : natural := 1;
    PIXEL_BITS       : natural := 8;
    SLICES           : natural;
    RADIUS           : natural := 1;
    CONFIDENCE       : natural := 0;
    VOTE_RADIUS      : natural := 0;
    SHIFTS           : string  := ""
  );
end entity index_verdict;

architecture rtl of index_verdict is

  constant BUILD : index_build_t := index_of
                                    (
                                      name             => "depth_index",
                                      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
                                      SLICES           => SLICES,
                                      SHIFTS           => ordered_shifts("depth_index", SHIFTS, SLICES),
                                      between          => SHIFTS'length > 0,
                                      RADIUS           => RADIUS,
                                      CONFIDENCE       => CONFIDENCE,
                                      VOTE_RADIUS      => VOTE_RADIUS,
                                      MAX_COLUMNS      => MAX_COLUMNS,
                                      pixels           => PIXELS_PER_CLOCK,
                                      CHANNELS         => CHANNELS,
                                      PIXEL_BITS       => PIXEL_BITS,
                                      cropped          => false,
                                      chosen_too       => false
                                    );

begin

end architecture rtl;
