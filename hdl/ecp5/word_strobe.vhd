-- SPDX-License-Identifier: Apache-2.0
-- Marks the clock of clk_x5 at which the lanes hand words to clk, or take words from it.
--
-- One clock of clk_x5 in five is marked. The place of the mark is found once after reset, by a bit that toggles with
-- clk, and then kept. A word that changes with the clock behind the mark is two or three clocks of clk_x5 away from
-- each edge of clk, on whichever side of an edge the bit was sampled.
--
-- Latency: about 10 clocks of clk_x5 after reset, 20 clocks of clk_x5 for the output lanes. Throughput: a mark each
-- clock of clk.
-- Equation: both marks have the period of clk and a fixed place in it.

library ieee;
use ieee.std_logic_1164.all;

entity word_strobe is
  port (
    -- Pixel clock, and five times that with aligned edges.
    clk    : in    std_logic;
    clk_x5 : in    std_logic;
    -- Reset in clk_x5.
    reset : in    std_logic;
    -- Marks in clk_x5. in_strobe: a clock ahead of the mark, for the input lanes. out_strobe: through ten more
    -- registers, for the output lanes elsewhere on the device: half of the device takes longer than a clock.
    in_strobe  : out   std_logic;
    out_strobe : out   std_logic
  );
end entity word_strobe;

architecture rtl of word_strobe is

  -- even: toggles with each clock of clk; seen: the same in clk_x5; places: a one that goes round five places; started:
  -- its place is found; way: registers towards the output lanes.
  signal even    : std_logic                    := '0';
  signal seen    : std_logic_vector(2 downto 0) := "000";
  signal places  : std_logic_vector(4 downto 0) := "00000";
  signal started : std_logic                    := '0';
  signal way     : std_logic_vector(9 downto 0) := (others => '0');

begin

  -- places(0) holds an edge of clk three clocks later, or two. A word loaded with the mark, two clocks behind
  -- places(3), changes three clocks behind an edge, or two.
  in_strobe  <= places(3);
  out_strobe <= way(9);

  toggle : process (clk) is
  begin

    if rising_edge(clk) then
      even <= not even;
    end if;

  end process toggle;

  count : process (clk_x5) is
  begin

    if rising_edge(clk_x5) then
      -- Edges are aligned, so the first register may sample a change in either of two clocks, which the place of the
      -- mark allows for. The other registers keep an undecided level out.
      seen   <= seen(1 downto 0) & even;
      places <= places(3 downto 0) & places(4);
      way    <= way(8 downto 0) & places(3);
      -- Done once: from here on the one goes round, and jitter of a single edge does not move it.
      if started = '0' then
        places(0) <= seen(2) xor seen(1);
        started   <= seen(2) xor seen(1);
      end if;
      -- There is no mark while clk may be stopped; lanes then repeat their words.
      if reset = '1' then
        places  <= "00000";
        started <= '0';
      end if;
    end if;

  end process count;

end architecture rtl;
