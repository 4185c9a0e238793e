-- SPDX-License-Identifier: Apache-2.0
-- The weights that divide the sums of an engine, so that a picture does not get darker towards its border.
--
-- The entity stands beside an engine. Tokens pass through it to the engine, delayed so that the weights meet the sums.
--
-- Latency: border_wait clocks for tokens; weights come sum_clocks behind the tokens that the engine gets, in the
-- clock of the sums of the same pixels. Throughput: that of border_counts.
-- Equation: weight = refocusing sum of a frame of ones: the product of the numbers of views that reach the output along
-- rows and along columns, each view weighted by the interpolation.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.delay_pkg.all;
use work.math_pkg.all;
use work.core_pkg.all;
use work.token_pkg.all;
use work.border_pkg.all;

entity border_weights is
  generic (
    -- The core whose sums are divided.
    CORE : core_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token, its data; and which pixels a line's last token has.
    token      : in    token_t;
    token_data : in    std_logic_vector(row_bits(CORE) - 1 downto 0);
    line_end   : in    std_logic_vector(CORE.pixels - 1 downto 0);
    -- Token and data for the engine.
    engine_token : out   token_t;
    engine_data  : out   std_logic_vector(row_bits(CORE) - 1 downto 0);
    -- The weights, pixel 0 in the low bits; all pixels of slice 0, then those of the other slices.
    weights : out   std_logic_vector(weights_bits(CORE) - 1 downto 0)
  );
end entity border_weights;

architecture rtl of border_weights is

  constant SLICES : positive := slices_at_once(CORE);
  constant BITS   : positive := CORE.pixels * weight_bits(CORE);
  constant AHEAD  : natural  := border_wait(CORE);
  constant BEHIND : natural  := AHEAD + CORE.plan.sum_clocks - border_latency(CORE);

  signal counted : std_logic_vector(SLICES * BITS - 1 downto 0);
  signal waiting : std_logic_vector(delay_bits(SLICES * BITS, BEHIND) - 1 downto 0) := (others => '0');

begin

  slice : for s in 0 to SLICES - 1 generate

    counts : entity work.border_counts
      generic map (
        CORE        => CORE,
        FIXED_SLICE => choose(SLICES > 1, s, - 1)
      )
      port map (
        clk      => clk,
        reset    => reset,
        token    => token,
        line_end => line_end,
        weights  => counted((s + 1) * BITS - 1 downto s * BITS)
      );

  end generate slice;

  -- Either AHEAD or BEHIND is zero.
  weights <= delayed(waiting, counted, BEHIND);

  delay_weights : process (clk) is
  begin

    if rising_edge(clk) then
      waiting <= moved_on(waiting, counted);
    end if;

  end process delay_weights;

  -- If the engine is slower than the weights, weights wait (BEHIND); otherwise tokens wait (AHEAD).
  pass : if AHEAD = 0 generate
    engine_token <= token;
    engine_data  <= token_data;
  end generate pass;

  wait_for_weights : if AHEAD > 0 generate

    type data_t is array (natural range <>) of std_logic_vector(row_bits(CORE) - 1 downto 0);

    signal token_at : tokens_t(1 to AHEAD) := (others => NO_TOKEN);
    signal data_at  : data_t(1 to AHEAD)   := (others => (others => '0'));

  begin

    move : process (clk) is
    begin

      if rising_edge(clk) then
        token_at(1) <= token;
        data_at(1)  <= token_data;

        for i in 2 to AHEAD loop

          token_at(i) <= token_at(i - 1);
          data_at(i)  <= data_at(i - 1);

        end loop;

        if reset = '1' then

          for i in 1 to AHEAD loop

            -- Only strobe needs a reset, because it validates the other bits and the pixels.
            token_at(i).strobe <= '0';

          end loop;

        end if;
      end if;

    end process move;

    engine_token <= token_at(AHEAD);
    engine_data  <= data_at(AHEAD);

  end generate wait_for_weights;

end architecture rtl;
