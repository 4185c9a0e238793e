-- SPDX-License-Identifier: Apache-2.0
-- From the sums of an engine to pixels: one correctly rounded division, or nothing where stored products are pixels.
--
-- Latency: scaler_latency clocks with EXACT, else 0 clocks. Throughput: LANES values each clock.
-- Equation: pixel = round(sum / DIVISOR) with EXACT, round(sum / weight) with weights too; else pixel = sum.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.token_pkg.all;

entity result_scaler is
  generic (
    -- true: exact sums and one division at the end; false: stored products, which are rounded already.
    EXACT : boolean := true;
    -- Values side by side.
    LANES : positive;
    -- Width of a pixel.
    PIXEL_BITS : positive;
    -- The sum of an all-ones image is DIVISOR times the largest pixel.
    DIVISOR : positive;
    -- With EXACT: number of weights that come with the sums, each for several neighbouring lanes, and their
    -- width. Width 0: no weights.
    WEIGHT_COUNT : positive := 1;
    WEIGHT_BITS  : natural  := 0
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A result and its sums, lane 0 in the low bits.
    result : in    result_t;
    sums   : in    std_logic_vector(LANES * bits_for((2 ** PIXEL_BITS - 1) * DIVISOR) - 1 downto 0);
    -- The divisors of the sums, 1 to DIVISOR, or 0 where the sum is 0; the first lanes' weight is in the low bits.
    weights : in    std_logic_vector(WEIGHT_COUNT * larger(WEIGHT_BITS, 1) - 1 downto 0);
    -- The result with its sums divided to pixels.
    scaled : out   result_t;
    pixels : out   std_logic_vector(LANES * PIXEL_BITS - 1 downto 0)
  );
end entity result_scaler;

architecture rtl of result_scaler is

  constant SPLIT_LANES : boolean := not takes(LANES mod WEIGHT_COUNT = 0,
                                              "result_scaler: WEIGHT_COUNT must divide LANES");

  constant SUM_BITS : positive := bits_for((2 ** PIXEL_BITS - 1) * DIVISOR);

begin

  -- Stored products contain the division by M, so the sums of the last pass are pixels.
  stored_products : if not EXACT generate
    scaled <= result;
    pixels <= sums;
  end generate stored_products;

  exact_sums : if EXACT generate

    constant LATENCY : positive := scaler_latency(WEIGHT_BITS > 0, PIXEL_BITS);

    -- The reset clears only the flag that validates all others, because shift registers in LUTs have no reset.
    signal result_at : results_t(0 to LATENCY)   := (others => NO_RESULT);
    signal used_at   : std_logic_vector(0 to LATENCY) := (others => '0');

  begin

    result_at(0) <= result;
    used_at(0)   <= result.valid or result.skip;

    delay_result : process (clk) is
    begin

      if rising_edge(clk) then
        -- A result is delayed by as many clocks as its division takes.
        result_at(1 to LATENCY) <= result_at(0 to LATENCY - 1);
        used_at(1 to LATENCY)   <= used_at(0 to LATENCY - 1);
        if reset = '1' then
          used_at(1 to LATENCY) <= (others => '0');
        end if;
      end if;

    end process delay_result;

    give : process (result_at, used_at) is
    begin

      -- Only used_at is reset, so it decides about valid.
      scaled       <= result_at(LATENCY);
      scaled.valid <= used_at(LATENCY) and not result_at(LATENCY).skip;
      scaled.skip  <= used_at(LATENCY) and result_at(LATENCY).skip;

    end process give;

    -- With one constant divisor the division is a multiplication by its reciprocal and a shift.
    full_weight : if WEIGHT_BITS = 0 generate

      lane : for i in 0 to LANES - 1 generate

        divide : entity work.divide_round
          generic map (
            VALUE_MAX     => (2 ** PIXEL_BITS - 1) * DIVISOR,
            DIVISOR       => DIVISOR,
            QUOTIENT_BITS => PIXEL_BITS
          )
          port map (
            clk      => clk,
            value    => sums((i + 1) * SUM_BITS - 1 downto i * SUM_BITS),
            quotient => pixels((i + 1) * PIXEL_BITS - 1 downto i * PIXEL_BITS)
          );

      end generate lane;

    end generate full_weight;

    -- Each output has a divisor of its own, so the division goes bit by bit: there is no table of reciprocals.
    own_weights : if WEIGHT_BITS > 0 generate

      constant GROUP_LANES : positive := LANES / WEIGHT_COUNT;

    begin

      each_weight : for i in 0 to WEIGHT_COUNT - 1 generate

        divide : entity work.divide_weighted
          generic map (
            LANES         => GROUP_LANES,
            VALUE_BITS    => SUM_BITS,
            WEIGHT_MAX    => DIVISOR,
            QUOTIENT_BITS => PIXEL_BITS
          )
          port map (
            clk       => clk,
            values    => sums((i + 1) * GROUP_LANES * SUM_BITS - 1 downto i * GROUP_LANES * SUM_BITS),
            weight    => weights((i + 1) * WEIGHT_BITS - 1 downto i * WEIGHT_BITS),
            quotients => pixels((i + 1) * GROUP_LANES * PIXEL_BITS - 1 downto i * GROUP_LANES * PIXEL_BITS)
          );

      end generate each_weight;

    end generate own_weights;

  end generate exact_sums;

end architecture rtl;
