-- SPDX-License-Identifier: Apache-2.0
-- Counts tokens modulo a constant, from 0 on at each restart.
--
-- Latency: 0 clocks. Throughput: one token each clock.
-- Equation: count = (tokens since the one with restart) mod MODULUS.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;

entity pixel_counter is
  generic (
    -- What it counts to.
    MODULUS : positive
  );
  port (
    clk : in    std_logic;
    -- A token.
    strobe : in    std_logic;
    -- With strobe: this token counts as 0.
    restart : in    std_logic;
    -- The number of the token.
    count : out   natural range 0 to larger(MODULUS - 1, 1)
  );
end entity pixel_counter;

architecture rtl of pixel_counter is

begin

  one : if MODULUS = 1 generate
    count <= 0;
  end generate one;

  many : if MODULUS > 1 generate

    -- Count of this token, and of the one before. A restart holds at once, without a clock of delay.
    signal count_now : natural range 0 to larger(MODULUS - 1, 1);
    signal count_d1  : natural range 0 to larger(MODULUS - 1, 1) := 0;

  begin

    count_now <= 0 when restart = '1' or count_d1 = MODULUS - 1 else
                 count_d1 + 1;

    count <= count_now;

    follow : process (clk) is
    begin

      if rising_edge(clk) then
        if strobe = '1' then
          count_d1 <= count_now;
        end if;
      end if;

    end process follow;

  end generate many;

end architecture rtl;
