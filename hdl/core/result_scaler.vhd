-- SPDX-License-Identifier: Apache-2.0
-- From the sums of an engine to pixels: one correctly rounded division, or nothing where stored products are pixels.
--
-- Latency: scaler_latency clocks with EXACT, else 0. Throughput: one value of all lanes each clock.
-- Equation: pixel = round(sum / DIVISOR) with EXACT, with weights round(sum / weight); else pixel = sum.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.token_pkg.all;

entity result_scaler is
  generic (
    -- Exact sums and one division at the end, or stored products, which round.
    EXACT : boolean := true;
    -- Values side by side.
    LANES : positive;
    -- Width of a pixel.
    PIXEL_BITS : positive;
    -- Of a sum, the largest pixel's sum being the largest pixel times it.
    DIVISOR : positive;
    -- With EXACT: the weights that come with the sums, each for as many neighbouring lanes, and their width; 0: none.
    WEIGHT_COUNT : positive := 1;
    WEIGHT_BITS  : natural  := 0
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A result and its sums, lane 0 in the low bits.
    result : in    result_t;
    sums   : in    std_logic_vector(LANES * bits_for((2 ** PIXEL_BITS - 1) * DIVISOR) - 1 downto 0);
    -- What the sums are divided by, 1 to DIVISOR, or 0 where they are 0; that of the first lanes in the low bits.
    weights : in    std_logic_vector(WEIGHT_COUNT * larger(WEIGHT_BITS, 1) - 1 downto 0);
    -- The same as pixels.
    scaled : out   result_t;
    pixels : out   std_logic_vector(LANES * PIXEL_BITS - 1 downto 0)
  );
end entity result_scaler;

architecture rtl of result_scaler is

  constant SPLIT_LANES : boolean := not takes(LANES mod WEIGHT_COUNT = 0,
                                              "result_scaler: WEIGHT_COUNT must divide LANES");

  constant SUM_BITS : positive := bits_for((2 ** PIXEL_BITS - 1) * DIVISOR);

begin

  -- Stored products are divided by M in their tables, so the sums of the last pass are pixels already.
  stored_products : if not EXACT generate
    scaled <= result;
    pixels <= sums;
  end generate stored_products;

  exact_sums : if EXACT generate

    constant LATENCY : positive := scaler_latency(WEIGHT_BITS > 0, PIXEL_BITS);

    -- The reset clears only the flag that validates all others: shift registers of LUTs have no reset.
    signal result_at : results_t(0 to LATENCY)   := (others => NO_RESULT);
    signal used_at   : std_logic_vector(0 to LATENCY) := (others => '0');

  begin

    result_at(0) <= result;
    used_at(0)   <= result.valid or result.skip;

    delay_result : process (clk) is
    begin

      if rising_edge(clk) then
        -- In step with the division: a result is as late as its pixels.
        result_at(1 to LATENCY) <= result_at(0 to LATENCY - 1);
        used_at(1 to LATENCY)   <= used_at(0 to LATENCY - 1);
        if reset = '1' then
          used_at(1 to LATENCY) <= (others => '0');
        end if;
      end if;

    end process delay_result;

    give : process (result_at, used_at) is
    begin

      -- Of what is delayed only used_at has a reset, so it decides about both.
      scaled       <= result_at(LATENCY);
      scaled.valid <= used_at(LATENCY) and not result_at(LATENCY).skip;
      scaled.skip  <= used_at(LATENCY) and result_at(LATENCY).skip;

    end process give;

    -- One constant divisor: a multiplication by its reciprocal and a shift.
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

    -- A divisor for each output: digit by digit, as no reciprocal is at hand.
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
