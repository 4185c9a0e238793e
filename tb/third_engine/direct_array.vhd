-- SPDX-License-Identifier: Apache-2.0
-- The engine of direct sums: a pass over rows, then one over columns.
--
-- Latency: D lines, D tokens and sum_clocks clocks, D = output_delay. Throughput: one token each clock.
-- Equation: that of fir_array.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.arithmetic_pkg.all;
use work.core_pkg.all;
use work.token_pkg.all;

entity direct_array is
  generic (
    -- The core that the sums are built for.
    CORE : core_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token and its pixel.
    token      : in    token_t;
    token_data : in    std_logic_vector(row_bits(CORE) - 1 downto 0);
    -- The token behind the sums, and its sums.
    out_token : out   tokens_t(0 to 0);
    out_sums  : out   std_logic_vector(row_sums_bits(CORE) - 1 downto 0)
  );
end entity direct_array;

architecture rtl of direct_array is

  constant ROW : pass_t := pass_of(CORE.arithmetic, 0);

  signal row_token : token_t;
  signal row_data  : std_logic_vector(CORE.channels * ROW.result_bits - 1 downto 0);

begin

  rows : entity work.direct_pass
    generic map (
      GEOMETRY => CORE.geometry,
      SIZES    => ROW,
      COLUMNS  => false,
      DEPTH    => 1,
      CHANNELS => CORE.channels
    )
    port map (
      clk       => clk,
      reset     => reset,
      token     => token,
      data      => token_data,
      out_token => row_token,
      out_data  => row_data
    );

  columns : entity work.direct_pass
    generic map (
      GEOMETRY => CORE.geometry,
      SIZES    => pass_of(CORE.arithmetic, 1),
      COLUMNS  => true,
      DEPTH    => CORE.columns,
      CHANNELS => CORE.channels
    )
    port map (
      clk       => clk,
      reset     => reset,
      token     => row_token,
      data      => row_data,
      out_token => out_token(0),
      out_data  => out_sums
    );

end architecture rtl;
