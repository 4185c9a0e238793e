-- SPDX-License-Identifier: Apache-2.0
-- Skew registers: delay each of N words side by side by one token more than the word before it.
--
-- Latency: i tokens for word i. Throughput: one word of each row each clock.
-- Equation: data_out(lane i, token t) = data_in(lane i, token t - i).

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.delay_pkg.all;

entity lane_skew is
  generic (
    -- N, words side by side.
    LANES : positive;
    -- Width of a word.
    WIDTH : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic := '0';
    -- There is a token.
    enable : in    std_logic;
    -- The words side by side, word 0 in the low bits.
    data_in  : in    std_logic_vector(LANES * WIDTH - 1 downto 0);
    data_out : out   std_logic_vector(LANES * WIDTH - 1 downto 0)
  );
end entity lane_skew;

architecture rtl of lane_skew is

begin

  -- Word 0 is a wire. Each word has a chain of its own: shift registers in LUTs have no taps, so a shared chain would
  -- consist of flip-flops.
  lane : for i in 0 to LANES - 1 generate

    signal word  : std_logic_vector(WIDTH - 1 downto 0);
    signal words : std_logic_vector(delay_bits(WIDTH, i) - 1 downto 0) := (others => '0');

  begin

    word <= data_in((i + 1) * WIDTH - 1 downto i * WIDTH);

    move : process (clk) is
    begin

      if rising_edge(clk) then
        words <= moved_on(words, word, enable, reset);
      end if;

    end process move;

    data_out((i + 1) * WIDTH - 1 downto i * WIDTH) <= delayed(words, word, i);

  end generate lane;

end architecture rtl;
