-- SPDX-License-Identifier: Apache-2.0
-- Measures the frequency of a clock against this one; a clock that stands still measures 0.
--
-- The clock under test is divided by 16 in its own domain. The divided clock is sampled here, and its rising edges are
-- counted during WINDOW clocks. With 16000 clocks of 100 MHz the count is the frequency in units of 100 kHz.
--
-- Latency: WINDOW clocks. Throughput: one count each WINDOW clocks.
-- Equation: count = f(measured_clk) / 16 * WINDOW / f(clk).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity clock_meter is
  generic (
    -- Clocks in which edges are counted.
    WINDOW : positive := 16000
  );
  port (
    clk : in    std_logic;
    -- Any clock slower than 4 times clk.
    measured_clk : in    std_logic;
    -- The last count; updated: high for one clock with each new count.
    count   : out   unsigned(11 downto 0);
    updated : out   std_logic
  );
end entity clock_meter;

architecture rtl of clock_meter is

  -- A clock cannot be sampled by one of about its own frequency. Divided by 16 it is slow enough for both of its levels
  -- to be seen. The divider is the only logic in that clock domain, so the clock may stop or change at any time.
  signal divider : unsigned(3 downto 0)                     := (others => '0');
  signal divided : std_logic_vector(0 downto 0);
  signal arrived : std_logic_vector(0 downto 0);
  signal former  : std_logic                                := '0';
  signal clocks  : natural range 0 to larger(WINDOW - 1, 1) := 0;
  signal edges   : unsigned(11 downto 0)                    := (others => '0');

begin

  divide : process (measured_clk) is
  begin

    if rising_edge(measured_clk) then
      divider <= divider + 1;
    end if;

  end process divide;

  divided(0) <= divider(3);

  crossing : entity work.synchroniser
    port map (
      clk         => clk,
      level       => divided,
      synchronous => arrived
    );

  count_edges : process (clk) is
  begin

    if rising_edge(clk) then
      former  <= arrived(0);
      updated <= '0';
      -- An edge in the last clock of the window is not counted. This, and the phase of the window, cause an error of
      -- one count, which users of the count allow for.
      if arrived(0) = '1' and former = '0' then
        edges <= edges + 1;
      end if;
      if clocks = WINDOW - 1 then
        clocks  <= 0;
        count   <= edges;
        updated <= '1';
        edges   <= (others => '0');
      else
        clocks <= clocks + 1;
      end if;
    end if;

  end process count_edges;

  watch_speed : process (clk) is

    variable before_former : std_logic := '0';

  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      -- A level of the divided clock that is seen in one clock only means that the measured clock is too fast.
      assert not (arrived(0) /= former and former /= before_former)
        report "clock_meter: measured_clk is not slower than 4 times clk"
        severity failure;
      before_former := former;
    end if;

  -- synthesis translate_on

  end process watch_speed;

end architecture rtl;
