-- SPDX-License-Identifier: Apache-2.0
-- Distributes the pixels of N skewed rows to N column modules, and those of N modules back to the rows.
--
-- Rows that are skewed by one token each reach a column one after the other. All pixels of column k belong to module
-- k mod N. Row r works on the column that row 0 had r tokens before, and module m takes the row that module 0 took m
-- tokens before. Let c be the pixel counter of row 0 and module 0. Then module m takes its pixel from row c(m tokens
-- ago); these are the demultiplexers of the thesis. Row r takes its sum from module c(r tokens ago). Both directions
-- are the same circuit.
--
-- Latency: 0 clocks. Throughput: one word of each lane each clock.
-- Equation: data_out(lane i, token t) = data_in(lane count(t - i), token t).

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;

entity lane_exchange is
  generic (
    -- N, rows or modules.
    LANES : positive;
    -- Width of a row's or module's word.
    WIDTH : positive
  );
  port (
    clk : in    std_logic;
    -- There is a token.
    strobe : in    std_logic;
    -- Pixel counter of row 0 or module 0.
    count : in    natural range 0 to larger(LANES - 1, 1);
    -- A word of each row or module, number 0 in the low bits.
    data_in  : in    std_logic_vector(LANES * WIDTH - 1 downto 0);
    data_out : out   std_logic_vector(LANES * WIDTH - 1 downto 0)
  );
end entity lane_exchange;

architecture rtl of lane_exchange is

  type lanes_t is array (natural range 0 to LANES - 1) of std_logic_vector(WIDTH - 1 downto 0);

  type counts_t is array (natural range 0 to LANES - 1) of natural range 0 to LANES - 1;

  signal lanes_in : lanes_t;
  signal source   : counts_t;
  signal earlier  : counts_t := (others => 0);

begin

  source(0) <= count;

  follow : process (clk) is
  begin

    if rising_edge(clk) then
      if strobe = '1' then
        earlier <= source;
      end if;
    end if;

  end process follow;

  lane : for i in 0 to LANES - 1 generate
    lanes_in(i) <= data_in((i + 1) * WIDTH - 1 downto i * WIDTH);

    data_out((i + 1) * WIDTH - 1 downto i * WIDTH) <= lanes_in(source(i));

    follower : if i > 0 generate
      source(i) <= earlier(i - 1);
    end generate follower;

  end generate lane;

end architecture rtl;
