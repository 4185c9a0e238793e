-- SPDX-License-Identifier: Apache-2.0
-- Makes a steady reset from a request that comes and goes: a button that bounces, a lock signal with short gaps.
--
-- reset_bridge acts at once, even while the clock stands still. Behind this filter, one reset_bridge for each
-- further clock passes the reset on.
--
-- Latency: ASSERT_CLOCKS + 3 clocks to assert, RELEASE_CLOCKS + 3 clocks to release.
-- Equation: reset rises when request was '1' for ASSERT_CLOCKS, and falls when request was '0' for RELEASE_CLOCKS.
-- Cost: 3 flip-flops and a counter.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;

entity reset_filter is
  generic (
    -- The defaults are 1 us and 1 ms at 50 MHz.
    ASSERT_CLOCKS  : positive := 50;
    RELEASE_CLOCKS : positive := 50000
  );
  port (
    clk : in    std_logic;
    -- Active high, from any clock or pin.
    request : in    std_logic;
    -- Active high, in clk. High from configuration until request has been low for RELEASE_CLOCKS.
    reset : out   std_logic
  );
end entity reset_filter;

architecture rtl of reset_filter is

  signal requests : std_logic_vector(0 downto 0);
  signal arrived  : std_logic_vector(0 downto 0);
  signal held     : std_logic                                                := '1';
  signal clocks   : natural range 0 to larger(ASSERT_CLOCKS, RELEASE_CLOCKS) := 0;

begin

  reset       <= held;
  requests(0) <= request;

  crossing : entity work.synchroniser
    port map (
      clk         => clk,
      level       => requests,
      synchronous => arrived
    );

  filter : process (clk) is
  begin

    if rising_edge(clk) then
      -- A sample that agrees with the output restarts the counter: only an unbroken stretch of the other level
      -- changes the output.
      if arrived(0) = held then
        clocks <= 0;
      elsif (held = '0' and clocks = ASSERT_CLOCKS - 1) or (held = '1' and clocks = RELEASE_CLOCKS - 1) then
        clocks <= 0;
        held   <= arrived(0);
      else
        clocks <= clocks + 1;
      end if;
    end if;

  end process filter;

end architecture rtl;
