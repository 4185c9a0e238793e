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
use work.sharpness_pkg.all;

entity index_verdict is
  generic (
    MICRO_IMAGE_SIZE : natural;
    MAX_COLUMNS      : natural;
    PIXELS_PER_CLOCK : natural := 1;
    CHANNELS         : natural;
    PIXEL_BITS       : natural;
    SLICES           : natural;
    RADIUS           : natural;
    CONFIDENCE       : natural;
    VOTE_RADIUS      : natural;
    SHIFTS           : string  := ""
  );
end entity index_verdict;

architecture rtl of index_verdict is

  constant REFUSED  : boolean := not takes_index("depth_index", MICRO_IMAGE_SIZE, SLICES, RADIUS, VOTE_RADIUS,
                                                 MAX_COLUMNS, PIXELS_PER_CLOCK, CHANNELS, PIXEL_BITS);
  constant NO_ORDER : boolean := not takes_between("depth_index", SHIFTS, SLICES);

begin

end architecture rtl;
