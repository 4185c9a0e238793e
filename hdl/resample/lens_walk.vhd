-- SPDX-License-Identifier: Apache-2.0
-- Walks along a line of the raster from lens to lens, M pixels in each.
--
-- Latency: 1 clock. Throughput: one pixel each clock while credit = '1', also from line to line.
-- Equation: position(s, u) = line + s right + (0, u step_x), truncated to WEIGHT_BITS fraction bits.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.resample_pkg.all;

entity lens_walk is
  generic (
    -- Sizes of the resampler.
    BUILD : resample_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Lenses of a line, and the step from one to the next; the step from a pixel of a lens to the next.
    lenses  : in    unsigned(15 downto 0);
    right_y : in    position_t;
    right_x : in    position_t;
    step_x  : in    position_t;
    -- Lines of the raster, from lens_rows.
    raster_line : in    raster_line_t;
    line_valid  : in    std_logic;
    line_taken  : out   std_logic;
    -- The walk is on no line.
    at_rest : out   std_logic;
    -- The output has room for a pixel.
    credit : in    std_logic;
    -- A pixel of the raster.
    pixel : out   walked_t
  );
end entity lens_walk;

architecture rtl of lens_walk is

  constant LAST_PIXEL : natural := BUILD.micro_image_size - 1;

  -- active: on a line; starts: its first pixel comes next.
  signal active : std_logic := '0';
  signal starts : std_logic := '0';
  -- Positions of the current lens and of the current pixel. y changes from lens to lens only, because their lines
  -- lie along those of the sensor.
  signal y      : position_t := (others => '0');
  signal lens_x : position_t := (others => '0');
  signal x      : position_t := (others => '0');
  -- Lenses left in the line, the pixel within the lens, and the addresses in the tables.
  signal lenses_left  : unsigned(15 downto 0)                    := (others => '0');
  signal in_lens      : natural range 0 to larger(LAST_PIXEL, 1) := 0;
  signal lens_now     : lens_t                                   := (others => '0');
  signal line_profile : profile_t                                := (others => '0');
  signal profile_now  : profile_t                                := (others => '0');
  signal lens_ends    : std_logic;
  signal line_ends    : std_logic;
  signal take         : std_logic;

  -- Positions have more fraction bits than weights, so that a step added a thousand times stays exact. They are
  -- truncated where they are used, which rounds down by less than one unit of a weight.
  function cut (
    position : position_t
  ) return signed is
  begin

    return resize(shift_right(position, BUILD.fraction_bits - BUILD.weight_bits), 24);

  end function cut;

begin

  lens_ends <= '1' when in_lens = LAST_PIXEL else
               '0';
  line_ends <= '1' when lens_ends = '1' and lenses_left = 1 else
               '0';

  -- The next line is taken with the last pixel of this one, so that no clock is lost between two lines.
  take       <= line_valid and (not active or (credit and line_ends));
  line_taken <= take;
  at_rest    <= not active;

  walk : process (clk) is
  begin

    if rising_edge(clk) then
      -- Without credit no position is sent, and the walk stops.
      pixel.valid <= '0';

      -- The ring is addressed at this position before the next frame's first pixel; position 0 exists in every frame.
      if active = '0' then
        pixel.y <= (others => '0');
        pixel.x <= (others => '0');
      end if;

      if active = '1' and credit = '1' then
        pixel.valid   <= '1';
        pixel.first   <= starts;
        pixel.last    <= line_ends;
        pixel.y       <= cut(y);
        pixel.x       <= cut(x);
        pixel.lens    <= lens_now;
        pixel.profile <= profile_now;
        starts        <= '0';
        -- The next lens lies a step from the beginning of this one, so errors of pixels do not add up.
        if lens_ends = '1' then
          in_lens     <= 0;
          y           <= y + right_y;
          lens_x      <= lens_x + right_x;
          x           <= lens_x + right_x;
          lens_now    <= lens_now + 1;
          profile_now <= line_profile;
          lenses_left <= lenses_left - 1;
          if line_ends = '1' then
            active <= '0';
          end if;
        else
          in_lens     <= in_lens + 1;
          x           <= x + step_x;
          profile_now <= profile_now + 1;
        end if;
      end if;

      if take = '1' then
        active       <= '1';
        starts       <= raster_line.first;
        in_lens      <= 0;
        y            <= raster_line.y;
        lens_x       <= raster_line.x;
        x            <= raster_line.x;
        lens_now     <= raster_line.lens;
        line_profile <= raster_line.profile;
        profile_now  <= raster_line.profile;
        lenses_left  <= lenses;
      end if;

      if reset = '1' then
        active      <= '0';
        pixel.valid <= '0';
      end if;
    end if;

  end process walk;

end architecture rtl;
