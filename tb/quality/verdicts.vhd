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
    BOX                 : string  := "";
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
                              micro_image_size    => MICRO_IMAGE_SIZE,
                              shifts              => SHIFTS,
                              centred             => CENTRED,
                              interpolation_order => INTERPOLATION_ORDER,
                              hold                => HOLD,
                              parallel_rows       => PARALLEL_ROWS,
                              pixels_per_clock    => PIXELS_PER_CLOCK,
                              max_columns         => MAX_COLUMNS,
                              channels            => CHANNELS,
                              pixel_bits          => PIXEL_BITS,
                              exact               => EXACT,
                              fraction_bits       => FRACTION_BITS,
                              guard_bits          => GUARD_BITS,
                              engine              => ENGINE,
                              any_rows            => ANY_ROWS,
                              sharpening          => SHARPENING,
                              border_normalised   => BORDER_NORMALISED,
                              broadcast_taps      => BROADCAST_TAPS,
                              box                 => BOX
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
    BOX               : string  := "";
    CENTRED           : boolean;
    BORDER_NORMALISED : boolean := false
  );
end entity stack_verdict;

architecture rtl of stack_verdict is

  constant CORE : core_t := stack_of
                            (
                              name              => "focal_stack",
                              micro_image_size  => MICRO_IMAGE_SIZE,
                              shifts            => SHIFTS,
                              centred           => CENTRED,
                              max_columns       => MAX_COLUMNS,
                              pixels_per_clock  => PIXELS_PER_CLOCK,
                              channels          => CHANNELS,
                              pixel_bits        => PIXEL_BITS,
                              border_normalised => BORDER_NORMALISED,
                              box               => BOX
                            );

begin

end architecture rtl;

library work;
use work.math_pkg.all;
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
    SHIFTS           : string  := "";
    SHARP_TOO        : boolean := false
  );
end entity index_verdict;

architecture rtl of index_verdict is

  constant BUILD : index_build_t := index_of
                                    (
                                      name             => "depth_index",
                                      micro_image_size => MICRO_IMAGE_SIZE,
                                      slices           => SLICES,
                                      shifts           => ordered_shifts("depth_index", SHIFTS, SLICES),
                                      between          => SHIFTS'length > 0,
                                      radius           => RADIUS,
                                      confidence       => CONFIDENCE,
                                      vote_radius      => VOTE_RADIUS,
                                      max_columns      => MAX_COLUMNS,
                                      pixels           => PIXELS_PER_CLOCK,
                                      channels         => CHANNELS,
                                      pixel_bits       => PIXEL_BITS,
                                      cropped          => false,
                                      chosen_too       => false,
                                      boxes            => choose(SHARP_TOO, 2, 1)
                                    );

begin

end architecture rtl;
