-- SPDX-License-Identifier: Apache-2.0
-- Skew registers: delays each of N lanes by one token more than the lane before it.
--
-- Latency: lane i comes i tokens later (REVERSED: LANES-1-i tokens). Throughput: one word of each lane each clock.
-- Equation: data_out(lane i, token t) = data_in(lane i, token t - i).

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.delay_pkg.all;
use work.math_pkg.all;

entity lane_skew is
  generic (
    -- N.
    LANES : positive;
    -- Bits of a lane.
    WIDTH : positive;
    -- Whether the last lane is the one without delay.
    REVERSED : boolean := false
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic := '0';
    -- A token.
    enable : in    std_logic;
    -- A word of each lane, lane 0 in the low bits.
    data_in  : in    std_logic_vector(LANES * WIDTH - 1 downto 0);
    data_out : out   std_logic_vector(LANES * WIDTH - 1 downto 0)
  );
end entity lane_skew;

architecture rtl of lane_skew is

begin

  -- Lane 0 (REVERSED: the last lane) is a wire. A chain for each lane: shift registers of LUTs have no taps, so a
  -- shared one would be made of flip-flops.
  lane : for i in 0 to LANES - 1 generate

    constant LENGTH : natural := choose(REVERSED, LANES - 1 - i, i);

    signal word  : std_logic_vector(WIDTH - 1 downto 0);
    signal words : std_logic_vector(delay_bits(WIDTH, LENGTH) - 1 downto 0) := (others => '0');

  begin

    word <= data_in((i + 1) * WIDTH - 1 downto i * WIDTH);

    move : process (clk) is
    begin

      if rising_edge(clk) then
        words <= moved_on(words, word, enable, reset);
      end if;

    end process move;

    data_out((i + 1) * WIDTH - 1 downto i * WIDTH) <= delayed(words, word, LENGTH);

  end generate lane;

end architecture rtl;
