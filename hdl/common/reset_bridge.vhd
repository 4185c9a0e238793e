-- SPDX-License-Identifier: Apache-2.0
-- Brings a reset into a clock: it takes effect at once, even while the clock stands still, and ends in step with it.
--
-- Use it for requests without glitches: a flip-flop, or the lock of a PLL. reset_filter is for buttons and other
-- unsteady requests but needs a running clock; it may stand in front.
--
-- Latency: 0 clocks to assert, 4 clocks to release.
-- Equation: reset(t) = '1' while request was '1' at any of the last 4 clocks.
-- Cost: 4 flip-flops.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.crossing_pkg.all;

entity reset_bridge is
  port (
    clk : in    std_logic;
    -- Active high, from any clock.
    request : in    std_logic;
    -- Active high, released in clk.
    reset : out   std_logic
  );
end entity reset_bridge;

architecture rtl of reset_bridge is

  signal crossing_reset : std_logic_vector(3 downto 0) := (others => '1');

  -- A shift register in a LUT cannot be set asynchronously, so these stay flip-flops.
  attribute async_reg of crossing_reset                   : signal is "TRUE";
  attribute keep of crossing_reset                        : signal is "TRUE";
  attribute equivalent_register_removal of crossing_reset : signal is "no";
  attribute preserve of crossing_reset                    : signal is true;
  attribute dont_merge of crossing_reset                  : signal is true;
  attribute syn_preserve of crossing_reset                : signal is 1;
  attribute shreg_extract of crossing_reset               : signal is "no";
  attribute syn_srlstyle of crossing_reset                : signal is "registers";

begin

  reset <= crossing_reset(3);

  shift_out : process (clk, request) is
  begin

    if request = '1' then
      crossing_reset <= (others => '1');
    elsif rising_edge(clk) then
      crossing_reset <= crossing_reset(2 downto 0) & '0';
    end if;

  end process shift_out;

end architecture rtl;
