-- SPDX-License-Identifier: Apache-2.0
-- Bilinear interpolation between four pixels of a channel.
--
-- Latency: SAMPLE_LATENCY clocks. Throughput: one sample each clock.
-- Equation: F = WEIGHT_BITS, G = GUARD_BITS: sum = (2**F - wy) ((2**F - wx) p00 + wx p01) + wy ((2**F - wx) p10 + wx
--   p11); sample = floor(sum / 2**(2 F - G) + 1/2).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.resample_pkg.all;

entity pixel_sample is
  generic (
    -- Sizes of the resampler.
    BUILD : resample_build_t
  );
  port (
    clk : in    std_logic;
    -- Pixels (line, column), and the weights of line 1 and column 1.
    pixel_00 : in    unsigned(BUILD.pixel_bits - 1 downto 0);
    pixel_01 : in    unsigned(BUILD.pixel_bits - 1 downto 0);
    pixel_10 : in    unsigned(BUILD.pixel_bits - 1 downto 0);
    pixel_11 : in    unsigned(BUILD.pixel_bits - 1 downto 0);
    weight_y : in    unsigned(BUILD.weight_bits - 1 downto 0);
    weight_x : in    unsigned(BUILD.weight_bits - 1 downto 0);
    -- The sample.
    sample : out   unsigned(BUILD.sample_bits - 1 downto 0)
  );
end entity pixel_sample;

architecture rtl of pixel_sample is

  constant COLUMN_BITS : positive := BUILD.pixel_bits + BUILD.weight_bits;
  constant SUM_BITS    : positive := BUILD.pixel_bits + 2 * BUILD.weight_bits;
  constant DROP_BITS   : positive := 2 * BUILD.weight_bits - BUILD.guard_bits;

  -- A difference times a weight, signed, and the value that it is added to.
  subtype step_t is signed(COLUMN_BITS + 1 downto 0);

  subtype column_t is unsigned(COLUMN_BITS - 1 downto 0);

  subtype sum_t is unsigned(SUM_BITS - 1 downto 0);

  -- Clock 1: the steps between the lines, for both columns. Clock 2: both columns. Clock 3: the step between the
  -- columns. Clock 4: the sum. Clock 5: rounding.
  signal step_0     : step_t                                   := (others => '0');
  signal step_1     : step_t                                   := (others => '0');
  signal from_0     : unsigned(BUILD.pixel_bits - 1 downto 0)  := (others => '0');
  signal from_1     : unsigned(BUILD.pixel_bits - 1 downto 0)  := (others => '0');
  signal weight_x_1 : unsigned(BUILD.weight_bits - 1 downto 0) := (others => '0');
  signal weight_x_2 : unsigned(BUILD.weight_bits - 1 downto 0) := (others => '0');
  signal column_0   : column_t                                 := (others => '0');
  signal column_1   : column_t                                 := (others => '0');
  signal column_0_3 : column_t                                 := (others => '0');
  signal step_3     : signed(SUM_BITS + 1 downto 0)            := (others => '0');
  signal sum        : sum_t                                    := (others => '0');

  -- (b - a) times the weight.
  function step (
    a      : unsigned;
    b      : unsigned;
    weight : unsigned
  ) return signed is

    variable difference : signed(a'length downto 0);
    variable factor     : signed(weight'length downto 0);

  begin

    -- The difference is signed.
    difference := signed('0' & b) - signed('0' & a);
    factor     := signed('0' & weight);

    return difference * factor;

  end function step;

begin

  interpolate : process (clk) is
  begin

    if rising_edge(clk) then
      step_0     <= step(pixel_00, pixel_10, weight_y);
      step_1     <= step(pixel_01, pixel_11, weight_y);
      from_0     <= pixel_00;
      from_1     <= pixel_01;
      weight_x_1 <= weight_x;

      -- Line 0 plus the step. The result lies between both pixels, so the top bits of the sum are not needed.
      column_0   <= resize(unsigned(signed('0' & from_0 & to_unsigned(0, BUILD.weight_bits)) + step_0), COLUMN_BITS);
      column_1   <= resize(unsigned(signed('0' & from_1 & to_unsigned(0, BUILD.weight_bits)) + step_1), COLUMN_BITS);
      weight_x_2 <= weight_x_1;

      step_3     <= step(column_0, column_1, weight_x_2);
      column_0_3 <= column_0;

      sum <= resize(unsigned(signed('0' & column_0_3 & to_unsigned(0, BUILD.weight_bits)) + step_3), SUM_BITS);

      -- The bits that are cut off are those that the weights have beyond the guard bits.
      sample <= resize(shift_right(sum + 2 ** (DROP_BITS - 1), DROP_BITS), BUILD.sample_bits);
    end if;

  end process interpolate;

end architecture rtl;
