-- SPDX-License-Identifier: Apache-2.0
-- Stored product: a ROM that holds the scaled quotient of every possible pixel value.
--
-- Latency: 1 clock. Throughput: one value each clock.
-- Equation: product = round(value * 2**SCALE_BITS / DIVISOR), halves up. DIVISOR is the box
--   B: the multiplier h0 = 1/M of the FIR filter, where B = M.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity stored_product is
  generic (
    -- Width of the input; the ROM has 2**VALUE_BITS words.
    VALUE_BITS : positive range 1 to 16;
    -- Width of a product.
    PRODUCT_BITS : positive;
    -- Fraction bits of the product above those of the value.
    SCALE_BITS : natural;
    -- The box B.
    DIVISOR : positive
  );
  port (
    clk : in    std_logic;
    -- Both words are unsigned.
    value   : in    std_logic_vector(VALUE_BITS - 1 downto 0);
    product : out   std_logic_vector(PRODUCT_BITS - 1 downto 0)
  );
end entity stored_product;

architecture rtl of stored_product is

  type products_t is array (natural range 0 to 2 ** VALUE_BITS - 1) of std_logic_vector(PRODUCT_BITS - 1 downto 0);

  function all_products return products_t is

    variable products : products_t;

  begin

    for v in products_t'range loop

      products(v) := std_logic_vector(to_unsigned(scaled_quotient(v, SCALE_BITS, DIVISOR), PRODUCT_BITS));

    end loop;

    return products;

  end function all_products;

  constant PRODUCTS : products_t := all_products;

begin

  look_up : process (clk) is
  begin

    if rising_edge(clk) then
      product <= PRODUCTS(to_integer(unsigned(value)));
    end if;

  end process look_up;

end architecture rtl;
