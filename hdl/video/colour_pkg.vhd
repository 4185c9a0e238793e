-- Coefficients of full_range_rgb; built by scripts/build_hdl.py.
--
-- Conversions to full-range RGB: from RGB, YCbCr of BT.709 and YCbCr of BT.601, each with full
-- and with limited range.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package colour_pkg is

  -- Fraction bits of the coefficients.
  constant COLOUR_FRACTION : positive := 12;

  subtype coefficient_t is signed(14 downto 0);

  subtype offset_t is signed(21 downto 0);

  -- luma: channel 1 (green or Y) in green, and with shared_luma in red and blue. red, green_red:
  -- channel 2 (red or Cr) in red and green. blue, green_blue: channel 0 (blue or Cb) in blue and
  -- green. Then the offsets of the sums.

  type coefficients_t is record
    luma         : coefficient_t;
    red          : coefficient_t;
    green_red    : coefficient_t;
    green_blue   : coefficient_t;
    blue         : coefficient_t;
    red_offset   : offset_t;
    green_offset : offset_t;
    blue_offset  : offset_t;
    shared_luma  : std_logic;
  end record coefficients_t;

  subtype way_t is natural range 0 to 5;

  type ways_t is array (way_t) of coefficients_t;

  -- 0 and 1: RGB of full range, which is unchanged, and of limited range. 2 and 3: YCbCr of BT.709
  -- of full and of limited range. 4 and 5: YCbCr of BT.601, likewise. The offsets include the half
  -- that rounds.
  constant WAYS : ways_t :=
  (
    (
      luma         => to_signed(4096, 15),
      red          => to_signed(4096, 15),
      green_red    => to_signed(0, 15),
      green_blue   => to_signed(0, 15),
      blue         => to_signed(4096, 15),
      red_offset   => to_signed(2048, 22),
      green_offset => to_signed(2048, 22),
      blue_offset  => to_signed(2048, 22),
      shared_luma  => '0'
    ),
    (
      luma         => to_signed(4769, 15),
      red          => to_signed(4769, 15),
      green_red    => to_signed(0, 15),
      green_blue   => to_signed(0, 15),
      blue         => to_signed(4769, 15),
      red_offset   => to_signed(-74256, 22),
      green_offset => to_signed(-74256, 22),
      blue_offset  => to_signed(-74256, 22),
      shared_luma  => '0'
    ),
    (
      luma         => to_signed(4096, 15),
      red          => to_signed(6450, 15),
      green_red    => to_signed(-1917, 15),
      green_blue   => to_signed(-767, 15),
      blue         => to_signed(7601, 15),
      red_offset   => to_signed(-823552, 22),
      green_offset => to_signed(345600, 22),
      blue_offset  => to_signed(-970880, 22),
      shared_luma  => '1'
    ),
    (
      luma         => to_signed(4769, 15),
      red          => to_signed(7343, 15),
      green_red    => to_signed(-2183, 15),
      green_blue   => to_signed(-873, 15),
      blue         => to_signed(8652, 15),
      red_offset   => to_signed(-1014160, 22),
      green_offset => to_signed(316912, 22),
      blue_offset  => to_signed(-1181712, 22),
      shared_luma  => '1'
    ),
    (
      luma         => to_signed(4096, 15),
      red          => to_signed(5743, 15),
      green_red    => to_signed(-2925, 15),
      green_blue   => to_signed(-1410, 15),
      blue         => to_signed(7258, 15),
      red_offset   => to_signed(-733056, 22),
      green_offset => to_signed(556928, 22),
      blue_offset  => to_signed(-926976, 22),
      shared_luma  => '1'
    ),
    (
      luma         => to_signed(4769, 15),
      red          => to_signed(6537, 15),
      green_red    => to_signed(-3330, 15),
      green_blue   => to_signed(-1605, 15),
      blue         => to_signed(8263, 15),
      red_offset   => to_signed(-910992, 22),
      green_offset => to_signed(557424, 22),
      blue_offset  => to_signed(-1131920, 22),
      shared_luma  => '1'
    )
  );

end package colour_pkg;
