-- SPDX-License-Identifier: Apache-2.0
-- The picture that a board shows without a source: the stored light field (stored_pkg), or a test pattern with three
-- planes.
--
-- Latency: 4 clocks, of the pattern 2 clocks. Throughput: one pixel each clock.
-- Equation: that of stored_light_field or light_field_pattern.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.stored_pkg.all;
use work.video_pkg.all;

entity own_light_field is
  generic (
    -- Micro image size and slices.
    GEOMETRY : geometry_t;
    -- Size of the frame.
    FRAME_COLUMNS : positive range 3 to 4095;
    FRAME_ROWS    : positive range 1 to 4095
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Video timing to draw; its frames have the size above.
    timing : in    timing_t;
    -- The light field.
    video : out   video_t
  );
end entity own_light_field;

architecture rtl of own_light_field is

  constant SLICES : positive := GEOMETRY.slices;

  -- Depths of the test pattern: first, middle and last slice, so that a sweep makes one band after the other sharp. A
  -- set of one slice also gets two depths that it blurs.
  constant LEFT_SHIFT   : integer := GEOMETRY.shifts(0);
  constant MIDDLE_SHIFT : integer := choose(SLICES > 2, GEOMETRY.shifts(SLICES / 2), 0);
  constant RIGHT_SHIFT  : integer := choose(SLICES > 1, GEOMETRY.shifts(SLICES - 1), -LEFT_SHIFT);

begin

  stored : if WITH_STORED generate

    light_field : entity work.stored_light_field
      generic map (
        MICRO_IMAGE_SIZE => GEOMETRY.micro_image_size,
        FRAME_COLUMNS    => FRAME_COLUMNS,
        FRAME_ROWS       => FRAME_ROWS
      )
      port map (
        clk    => clk,
        reset  => reset,
        timing => timing,
        video  => video
      );

  end generate stored;

  drawn : if not WITH_STORED generate

    pattern : entity work.light_field_pattern
      generic map (
        MICRO_IMAGE_SIZE => GEOMETRY.micro_image_size,
        LEFT_SHIFT       => LEFT_SHIFT,
        MIDDLE_SHIFT     => MIDDLE_SHIFT,
        RIGHT_SHIFT      => RIGHT_SHIFT,
        MIDDLE_BEGIN     => FRAME_COLUMNS / 3,
        RIGHT_BEGIN      => 2 * FRAME_COLUMNS / 3
      )
      port map (
        clk    => clk,
        reset  => reset,
        timing => timing,
        video  => video
      );

  end generate drawn;

end architecture rtl;
