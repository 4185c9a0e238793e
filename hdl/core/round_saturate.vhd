-- SPDX-License-Identifier: Apache-2.0
-- Drops fraction bits with rounding and limits the result to what its width holds.
--
-- Latency: 1 clock. Throughput: one value each clock.
-- Equation: result = min(floor(value / 2**DROP_BITS + 1/2), 2**RESULT_BITS - 1).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity round_saturate is
  generic (
    -- Largest input.
    VALUE_MAX : natural;
    -- Fraction bits to drop.
    DROP_BITS : natural;
    -- Width of the result.
    RESULT_BITS : positive
  );
  port (
    clk : in    std_logic;
    -- Both are unsigned.
    value  : in    std_logic_vector(bits_for(VALUE_MAX) - 1 downto 0);
    result : out   std_logic_vector(RESULT_BITS - 1 downto 0)
  );
end entity round_saturate;

architecture rtl of round_saturate is

  constant HALF       : natural := 2 ** DROP_BITS / 2;
  constant RESULT_MAX : natural := 2 ** RESULT_BITS - 1;

begin

  round : process (clk) is

    variable rounded : natural range 0 to larger((VALUE_MAX + HALF) / 2 ** DROP_BITS, 1);

  begin

    if rising_edge(clk) then
      rounded := (to_integer(unsigned(value)) + HALF) / 2 ** DROP_BITS;
      if rounded > RESULT_MAX then
        result <= (others => '1');
      else
        result <= std_logic_vector(to_unsigned(rounded, RESULT_BITS));
      end if;
    end if;

  end process round;

end architecture rtl;
