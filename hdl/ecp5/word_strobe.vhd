-- SPDX-License-Identifier: Apache-2.0
-- Says at which clock the fast side of a lane hands a word to the slow side or takes one from it.
--
-- One clock of clk_x5 in five is marked. Its place is found once after reset, by a bit that toggles with clk, and is
-- then kept. A word that changes with the clock after the mark is two or three clocks of clk_x5 away from each edge of
-- clk, on whichever side of an edge the bit was caught.
--
-- Latency: about 10 clocks of clk_x5 after reset, 20 for the lanes out. Throughput: a mark each clock of clk.
-- Equation: both strobes have the period of clk, at the same place.

library ieee;
use ieee.std_logic_1164.all;

entity word_strobe is
  port (
    -- Pixel clock and five times that, edges aligned.
    clk    : in    std_logic;
    clk_x5 : in    std_logic;
    -- In clk_x5.
    reset : in    std_logic;
    -- In clk_x5, a clock ahead of the mark, for the lanes in; for those out, which lie elsewhere on the device, by way
    -- of two words of registers: a hop across half of the device takes longer than a clock.
    in_strobe  : out   std_logic;
    out_strobe : out   std_logic
  );
end entity word_strobe;

architecture rtl of word_strobe is

  -- A level that changes with each clock of clk; the same, seen by clk_x5; a one that goes round
  -- five places; its place is found; the mark's way to the lanes out.
  signal even    : std_logic                    := '0';
  signal seen    : std_logic_vector(2 downto 0) := "000";
  signal places  : std_logic_vector(4 downto 0) := "00000";
  signal started : std_logic                    := '0';
  signal way     : std_logic_vector(9 downto 0) := (others => '0');

begin

  -- An edge of clk is in places(0) three clocks behind it, or two. What is loaded with the mark, two clocks behind
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
      -- The edges are aligned, so the first register may catch a change in either of two clocks;
      -- what follows allows for both. The others keep an undecided level out.
      seen   <= seen(1 downto 0) & even;
      places <= places(3 downto 0) & places(4);
      way    <= way(8 downto 0) & places(3);
      -- Once: from here on the one goes round by itself, and no jitter of a single edge moves it.
      if started = '0' then
        places(0) <= seen(2) xor seen(1);
        started   <= seen(2) xor seen(1);
      end if;
      -- While clk may not run, no mark: lanes then repeat what they have.
      if reset = '1' then
        places  <= "00000";
        started <= '0';
      end if;
    end if;

  end process count;

end architecture rtl;
