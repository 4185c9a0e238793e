-- SPDX-License-Identifier: Apache-2.0
-- Level and edge of a button or switch.
--
-- Latency: STABLE clocks. Throughput: not applicable.
-- Equation: level changes when the contact has differed from it for STABLE clocks.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;

entity debouncer is
  generic (
    -- 10 ms of 100 MHz.
    STABLE : positive := 1000000
  );
  port (
    clk : in    std_logic;
    -- From the pin, active high.
    contact : in    std_logic;
    -- The contact after STABLE equal samples.
    level : out   std_logic;
    -- The level became high, for a clock.
    pressed : out   std_logic
  );
end entity debouncer;

architecture rtl of debouncer is

  signal pin       : std_logic_vector(0 downto 0);
  signal arrived   : std_logic_vector(0 downto 0);
  signal level_now : std_logic                                := '0';
  signal clocks    : natural range 0 to larger(STABLE - 1, 1) := 0;

begin

  level  <= level_now;
  pin(0) <= contact;

  cross : entity work.synchroniser
    port map (
      clk         => clk,
      level       => pin,
      synchronous => arrived
    );

  debounce : process (clk) is
  begin

    if rising_edge(clk) then
      pressed <= '0';
      if arrived(0) = level_now then
        clocks <= 0;
      elsif clocks = STABLE - 1 then
        clocks    <= 0;
        level_now <= arrived(0);
        pressed   <= arrived(0);
      else
        clocks <= clocks + 1;
      end if;
    end if;

  end process debounce;

end architecture rtl;
