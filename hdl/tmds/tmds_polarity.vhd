-- SPDX-License-Identifier: Apache-2.0
-- Inverts the words of channels whose pair has its wires swapped, and finds these channels.
--
-- A swapped pair delivers every word inverted. Inverted control tokens are other tokens, and an inverted data word is
-- one that an encoder sends for another byte (bits 1 to 7 inverted), so neither shows the polarity: a DVI source may
-- send any control bits in channels 1 and 2 (DVI 1.0, CTL0 to CTL3), and syncs have any polarity. The beginning of an
-- HDMI line shows it (HDMI 1.4, section 5.2.2.1): in the guard band, channels 0 and 2 have the inverse of channel 1's
-- word. A guard band counts behind a preamble of exactly 8 words in channel 1, with both of its words right in all
-- channels. With a DVI source no channel is inverted unless the input asks for it.
--
-- The aligned words are judged when all channels are in step; from then on the polarity holds up to a reset.
--
-- Latency: 0 clocks. Throughput: one word of each channel each clock.
-- Equation: out_words(c) = words(c), inverted where inverted(c).

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.tmds_pkg.all;

entity tmds_polarity is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Channels to invert; the highest bit: find the swapped channels.
    polarity : in    polarity_t;
    -- Aligned words of all channels.
    words : in    words_t;
    -- Words with the right polarity; and these words again, behind the deskew, in step with each other.
    out_words  : out   words_t;
    step_words : in    words_t;
    -- Channels that are inverted.
    inverted : out   std_logic_vector(CHANNELS - 1 downto 0)
  );
end entity tmds_polarity;

architecture rtl of tmds_polarity is

  subtype channels_t is std_logic_vector(CHANNELS - 1 downto 0);

  -- Guard band of video: bit 9 of each channel's word.
  constant GUARD_LEVELS : channels_t := "101";

  -- Channels that were found to be swapped; channels that are inverted.
  signal swapped : channels_t := (others => '0');
  signal used    : channels_t;

  -- Bit 9 of the words now, and before; channels whose word belongs to a guard band; channel 1 has token 00 or 01.
  signal levels  : channels_t;
  signal earlier : channels_t := (others => '0');
  signal guards  : channels_t;
  signal plain   : std_logic;

  -- Equal tokens 00 or 01 in a row in channel 1, counted to one more than a preamble has.
  signal run : natural range 0 to PREAMBLE_WORDS + 1 := 0;
  -- The word before was the first one of a guard band.
  signal first : std_logic := '0';

begin

  used     <= swapped when polarity(CHANNELS) = '1' else
              polarity(CHANNELS - 1 downto 0);
  inverted <= used;

  channel : for c in 0 to CHANNELS - 1 generate

    out_words(c) <= not words(c) when used(c) = '1' else
                    words(c);

    levels(c) <= step_words(c)(9);
    guards(c) <= to_logic(step_words(c) = ISLAND_GUARD or step_words(c) = not ISLAND_GUARD);

  end generate channel;

  plain <= to_logic(step_words(1) = TOKEN_00 or step_words(1) = TOKEN_01);

  judge : process (clk) is
  begin

    if rising_edge(clk) then
      earlier <= levels;

      if plain = '0' then
        run <= 0;
      elsif run = 0 or levels(1) /= earlier(1) then
        -- If channel 2 changes too, these are syncs and no preamble.
        run <= 1;
        if run /= 0 and levels(2) /= earlier(2) then
          run <= PREAMBLE_WORDS + 1;
        end if;
      elsif run <= PREAMBLE_WORDS then
        run <= run + 1;
      end if;

      -- In both preambles the words have the same level as in their guard bands.
      first <= '0';
      if guards = "111" and levels(2 downto 1) = earlier(2 downto 1) then
        first <= to_logic(run = PREAMBLE_WORDS);
        if first = '1' and levels(0) = earlier(0) and polarity(CHANNELS) = '1' then
          swapped <= swapped xor levels xor GUARD_LEVELS;
        end if;
      end if;

      if reset = '1' then
        run     <= 0;
        first   <= '0';
        swapped <= (others => '0');
      end if;
    end if;

  end process judge;

end architecture rtl;
