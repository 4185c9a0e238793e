-- SPDX-License-Identifier: Apache-2.0
-- Input of one TMDS channel: delay line with the search of its delay, two bits each clock of clk_x5, words of ten bits.
--
-- The I/O standard of the port (constraints) makes its pins a differential receiver. During a search the output is 0,
-- because words that arrive then would look like a picture.
--
-- Latency: 3 to 4 clocks of clk. Throughput: ten bits each clock of clk.
-- Equation: bits = ten successive bits while tracking, else 0.

library ieee;
use ieee.std_logic_1164.all;

library ecp5u;
use ecp5u.components.all;

entity ddr_input is
  generic (
    -- TIMEOUT of phase_search.
    TIMEOUT : positive := 8192
  );
  port (
    -- Level of the channel's pins.
    data : in    std_logic;
    -- Pixel clock, and five times that with aligned edges; the mark of word_strobe.
    clk    : in    std_logic;
    clk_x5 : in    std_logic;
    strobe : in    std_logic;
    -- Reset in clk.
    reset : in    std_logic;
    -- Ten bits, in clk; bit 0 came first.
    bits : out   std_logic_vector(9 downto 0);
    -- In clk: a word of the channel was wrong (phase_search).
    wrong : in    std_logic;
    -- Reports of phase_search, in clk.
    tracking    : out   std_logic;
    taps        : out   std_logic_vector(7 downto 0);
    hung_toggle : out   std_logic
  );
end entity ddr_input;

architecture rtl of ddr_input is

  -- Controls of the delay line; the channel behind it; its two bits of a clock, the earlier one first.
  signal load_n  : std_logic;
  signal move    : std_logic;
  signal delayed : std_logic;
  signal first   : std_logic;
  signal second  : std_logic;
  -- The mark, a clock late; bits of the last five clocks; the held word; whether a delay is found; the word in the
  -- pixel clock.
  signal mark      : std_logic                    := '0';
  signal collected : std_logic_vector(9 downto 0) := (others => '0');
  signal held      : std_logic_vector(9 downto 0) := (others => '0');
  signal found     : std_logic;
  signal bits_now  : std_logic_vector(9 downto 0) := (others => '0');

begin

  tracking <= found;
  bits     <= bits_now when found = '1' else
              (others => '0');

  -- The delay grows with each MOVE.
  delay : component delayf
    generic map (
      DEL_MODE  => "USER_DEFINED",
      DEL_VALUE => 0
    )
    port map (
      a         => data,
      loadn     => load_n,
      move      => move,
      direction => '0',
      z         => delayed
    );

  sample : component iddrx1f
    port map (
      d    => delayed,
      sclk => clk_x5,
      rst  => '0',
      q0   => first,
      q1   => second
    );

  -- These registers have no reset: at five times the pixel clock it would be the slowest path, and words count only
  -- while a delay has been found.
  collect : process (clk_x5) is
  begin

    if rising_edge(clk_x5) then
      mark <= strobe;
      -- Bits come in at the left, two each clock, so the oldest of ten is in bit 0.
      collected <= second & first & collected(9 downto 2);
      -- Any one of five clocks will do, because tmds_word_align finds where words begin later. This one lies far from
      -- the edge of clk that takes the word.
      if mark = '1' then
        held <= collected;
      end if;
    end if;

  end process collect;

  take : process (clk) is
  begin

    if rising_edge(clk) then
      bits_now <= held;
    end if;

  end process take;

  search : entity work.phase_search
    generic map (
      TIMEOUT => TIMEOUT
    )
    port map (
      clk         => clk,
      reset       => reset,
      bits        => bits_now,
      wrong       => wrong,
      load_n      => load_n,
      move        => move,
      tracking    => found,
      taps        => taps,
      hung_toggle => hung_toggle
    );

end architecture rtl;
