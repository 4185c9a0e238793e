-- SPDX-License-Identifier: Apache-2.0
-- Levels and edges of buttons and switches.
--
-- Latency: STABLE clocks.
-- Equation: level changes when the contact has differed from it for STABLE clocks.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;

entity debouncer is
  generic (
    -- Contacts side by side.
    WIDTH : positive := 1;
    -- Clocks that a contact must be stable; the default is 10 ms at 100 MHz.
    STABLE : positive := 1000000
  );
  port (
    clk : in    std_logic;
    -- From the pins, active high.
    contacts : in    std_logic_vector(WIDTH - 1 downto 0);
    -- Each contact after STABLE equal samples.
    levels : out   std_logic_vector(WIDTH - 1 downto 0);
    -- High for one clock: the contact's level became high.
    pressed : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity debouncer;

architecture rtl of debouncer is

  signal arrived    : std_logic_vector(WIDTH - 1 downto 0);
  signal levels_now : std_logic_vector(WIDTH - 1 downto 0) := (others => '0');

begin

  levels <= levels_now;

  crossing : entity work.synchroniser
    generic map (
      WIDTH => WIDTH
    )
    port map (
      clk         => clk,
      level       => contacts,
      synchronous => arrived
    );

  contact : for i in 0 to WIDTH - 1 generate

    -- Clocks for which the contact has differed from its level. Each contact has a counter, so that one that bounces,
    -- or is open, does not disturb the others.
    signal clocks : natural range 0 to larger(STABLE - 1, 1) := 0;

  begin

    debounce : process (clk) is
    begin

      if rising_edge(clk) then
        pressed(i) <= '0';
        if arrived(i) = levels_now(i) then
          clocks <= 0;
        elsif clocks = STABLE - 1 then
          clocks        <= 0;
          levels_now(i) <= arrived(i);
          -- Only a contact that closes is a press. Without a reset, a button held down from the start counts as pressed
          -- once.
          pressed(i) <= arrived(i);
        else
          clocks <= clocks + 1;
        end if;
      end if;

    end process debounce;

  end generate contact;

end architecture rtl;
