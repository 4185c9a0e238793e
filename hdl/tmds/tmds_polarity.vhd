-- SPDX-License-Identifier: Apache-2.0
-- Finds channels whose pair has its wires swapped, and inverts their words.
--
-- A swapped pair delivers every word inverted. Of the four control tokens, 00 and 01 become each other, and so do 10
-- and 11, so words are found as usual; and an inverted data word is one that an encoder may send. The polarity shows in
-- the first tokens of a blanking, where channels 1 and 2 carry 00 (DVI 1.0: their control bits are 0; HDMI 1.4, section
-- 5.2.1.1: all but the preamble, of 8 words): RUN tokens 01 in a row are 00 inverted. Channel 0 carries the syncs, in
-- any polarity. It counts as inverted if both others are, because a connector the wrong way round swaps all of its
-- pairs.
--
-- Latency: no clock for the words; a run of tokens until a polarity is known, which then holds. Throughput: one word
--   of each channel each clock.
-- Equation: out_words(c) = words(c), inverted where inverted(c).

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.tmds_pkg.all;

entity tmds_polarity is
  generic (
    -- Equal tokens in a row that tell a polarity; more than a preamble.
    RUN : positive range 9 to 31 := 16
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Aligned words of all channels.
    words : in    words_t;
    -- The same with the right polarity.
    out_words : out   words_t;
    -- Channels that come inverted.
    inverted : out   std_logic_vector(CHANNELS - 1 downto 0)
  );
end entity tmds_polarity;

architecture rtl of tmds_polarity is

  subtype run_t is natural range 0 to RUN - 1;

  signal swapped : std_logic_vector(CHANNELS - 1 downto 0) := (others => '0');

begin

  inverted   <= swapped;
  swapped(0) <= swapped(1) and swapped(2);

  channel : for c in 0 to CHANNELS - 1 generate

    out_words(c) <= not words(c) when swapped(c) = '1' else
                    words(c);

  end generate channel;

  judged : for c in 1 to CHANNELS - 1 generate

    -- Tokens 00 and 01 in a row.
    signal right_run : run_t := 0;
    signal wrong_run : run_t := 0;

  begin

    judge : process (clk) is
    begin

      if rising_edge(clk) then
        if words(c) /= TOKEN_00 then
          right_run <= 0;
        elsif right_run /= RUN - 1 then
          right_run <= right_run + 1;
        else
          swapped(c) <= '0';
        end if;

        if words(c) /= TOKEN_01 then
          wrong_run <= 0;
        elsif wrong_run /= RUN - 1 then
          wrong_run <= wrong_run + 1;
        else
          swapped(c) <= '1';
        end if;

        if reset = '1' then
          right_run  <= 0;
          wrong_run  <= 0;
          swapped(c) <= '0';
        end if;
      end if;

    end process judge;

  end generate judged;

end architecture rtl;
