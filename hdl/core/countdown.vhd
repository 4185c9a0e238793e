-- SPDX-License-Identifier: Apache-2.0
-- Counts down to 0. A register says whether it has got there, so that a decision needs no comparison.
--
-- Latency: 1 clock. Throughput: one step each clock.
-- Equation: left = start where load, left - 1 where step and left > 0; due = left > 0.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;

entity countdown is
  generic (
    -- The largest start; with 0 nothing is ever due.
    MOST : natural
  );
  port (
    clk : in    std_logic;
    -- Nothing is left.
    reset : in    std_logic;
    -- Sets what is left, whether or not there is a step; `some` says whether start is above 0, because whoever makes it
    -- knows that without a comparison.
    load  : in    std_logic;
    start : in    natural range 0 to larger(MOST, 1);
    some  : in    std_logic;
    -- Takes one off, if any are left.
    step : in    std_logic;
    -- Some are left.
    due : out   std_logic
  );
end entity countdown;

architecture rtl of countdown is

  signal left     : natural range 0 to larger(MOST, 1) := 0;
  signal some_due : std_logic                          := '0';

begin

  due <= some_due;

  count : process (clk) is
  begin

    if rising_edge(clk) then
      if load = '1' then
        left     <= start;
        some_due <= some;
      elsif step = '1' and some_due = '1' then
        left     <= left - 1;
        some_due <= to_logic(left > 1);
      end if;
      if reset = '1' then
        left     <= 0;
        some_due <= '0';
      end if;
    end if;

  end process count;

end architecture rtl;
