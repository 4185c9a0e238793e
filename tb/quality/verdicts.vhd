-- SPDX-License-Identifier: Apache-2.0
-- Entities with the generics of the tops that refuse what these refuse, and build nothing.

library work;
use work.refocus_pkg.all;
use work.arithmetic_pkg.all;
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

  -- The checks are constants, so elaboration makes them, and nothing else is built.
  constant GEOMETRY : geometry_t := geometry_of("raster_refocuser", MICRO_IMAGE_SIZE, SHIFTS, CENTRED);

  constant ARITHMETIC : arithmetic_t :=
  (
    EXACT            => EXACT,
    MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
    PIXEL_BITS       => PIXEL_BITS,
    FRACTION_BITS    => FRACTION_BITS,
    GUARD_BITS       => GUARD_BITS,
    passes           => INTERPOLATION_ORDER + 1
  );

  constant REFUSED : boolean := not takes_refocuser("raster_refocuser", ARITHMETIC, GEOMETRY, HOLD, PARALLEL_ROWS,
                                                    PIXELS_PER_CLOCK, MAX_COLUMNS, CHANNELS, ENGINE, ANY_ROWS,
                                                    SHARPENING, BORDER_NORMALISED);

begin

end architecture rtl;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.focal_stack_pkg.all;

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

  constant GEOMETRY : geometry_t := geometry_of("focal_stack", MICRO_IMAGE_SIZE, SHIFTS, CENTRED);
  constant REFUSED  : boolean    := not takes_stack("focal_stack", GEOMETRY, PIXELS_PER_CLOCK, MAX_COLUMNS, CHANNELS,
                                                    PIXEL_BITS);
  constant WEIGHED  : boolean    := not takes(PIXELS_PER_CLOCK = 1 or not BORDER_NORMALISED,
                                              "focal_stack: BORDER_NORMALISED needs a PIXELS_PER_CLOCK of 1");

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
