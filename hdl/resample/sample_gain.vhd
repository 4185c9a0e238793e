-- SPDX-License-Identifier: Apache-2.0
-- Black level and gain of a sample.
--
-- Latency: GAIN_LATENCY clocks. Throughput: one sample each clock.
-- Equation: value = floor(larger(sample - black, 0) gain / 2**GAIN_BITS + 1/2).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.resample_pkg.all;

entity sample_gain is
  generic (
    -- Sizes of the resampler.
    BUILD : resample_build_t
  );
  port (
    clk : in    std_logic;
    -- The sample, and the black level to subtract.
    sample : in    unsigned(BUILD.sample_bits - 1 downto 0);
    black  : in    unsigned(BUILD.sample_bits - 1 downto 0);
    -- The gain, a clock behind the sample.
    gain : in    unsigned(BUILD.gain_bits + GAIN_INTEGER_BITS - 1 downto 0);
    -- The value.
    value : out   unsigned(BUILD.sample_bits + GAIN_INTEGER_BITS - 1 downto 0)
  );
end entity sample_gain;

architecture rtl of sample_gain is

  constant VALUE_BITS : positive := BUILD.sample_bits + GAIN_INTEGER_BITS;

  -- The light above black, and its product with the gain.
  signal above   : unsigned(BUILD.sample_bits - 1 downto 0)            := (others => '0');
  signal product : unsigned(VALUE_BITS + BUILD.gain_bits - 1 downto 0) := (others => '0');

begin

  multiply : process (clk) is
  begin

    if rising_edge(clk) then
      -- Noise may lie below black, and a negative difference would wrap round.
      if sample > black then
        above <= sample - black;
      else
        above <= (others => '0');
      end if;

      product <= above * gain;

      -- No gain exceeds LARGEST_GAIN, so the half for rounding fits.
      value <= resize(shift_right(product + 2 ** (BUILD.gain_bits - 1), BUILD.gain_bits), VALUE_BITS);
    end if;

  end process multiply;

end architecture rtl;
