-- SPDX-License-Identifier: Apache-2.0
-- Finds the word boundaries in a channel's bits by its control tokens, and keeps watching them.
--
-- All ten word phases are watched at the same time. RUN tokens in a row at one phase select it, at any time, even if
-- another one was selected before. Data words cannot imitate a run: they have too few transitions, and bits of two
-- neighbouring words imitate one word at most. After TIMEOUT words without a run the channel counts as not aligned, and
-- the search goes on.
--
-- Latency: 3 clocks at phase 0; a new phase is used a whole run later. Throughput: one word each clock.
-- Equation: word(t) = ten bits from bit 10 t + phase on.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.tmds_pkg.all;

entity tmds_word_align is
  generic (
    -- Control tokens in a row that confirm a phase.
    RUN : positive range 2 to 15 := 8;
    -- Words without such a run after which the channel is lost; more than a line's active pixels.
    TIMEOUT : positive := 8192
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Ten bits of the channel, bit 0 came first.
    bits : in    std_logic_vector(9 downto 0);
    -- The aligned word.
    word : out   std_logic_vector(9 downto 0);
    -- The word is a control token.
    token : out   std_logic;
    -- A run of tokens was seen within TIMEOUT words.
    aligned : out   std_logic
  );
end entity tmds_word_align;

architecture rtl of tmds_word_align is

  subtype phase_t is natural range 0 to 9;

  -- The newest word above the one before; a word of phase p begins at bit p. The tokens of all phases are known a clock
  -- later, so the words wait as long.
  signal window       : std_logic_vector(19 downto 0) := (others => '0');
  signal tokens       : std_logic_vector(9 downto 0)  := (others => '0');
  signal token_window : std_logic_vector(19 downto 0) := (others => '0');
  -- The phase in use; the phase whose tokens are counted, and their number.
  signal phase      : phase_t                := 0;
  signal run_phase  : phase_t                := 0;
  signal run_length : natural range 0 to RUN := 0;
  -- Words until the channel is lost; a run sets it to TIMEOUT.
  signal patience : natural range 0 to TIMEOUT := 0;

begin

  align : process (clk) is

    variable found : phase_t;

  begin

    if rising_edge(clk) then
      -- Two words side by side, so that a token is visible as a whole at every phase.
      window <= bits & window(19 downto 10);

      -- Tokens at all phases.
      token_window <= window;

      for p in 0 to 9 loop

        tokens(p) <= is_token(window(p + 9 downto p));

      end loop;

      -- The word of the selected phase. A register behind the comparison keeps word and token together at any phase.
      word  <= token_window(phase + 9 downto phase);
      token <= tokens(phase);

      -- Runs are counted at one phase at a time: the lowest phase with a token is followed until it has none. Ten
      -- counters would find a run a few words sooner, once after a cable is plugged in.
      found := 0;

      for p in 9 downto 0 loop

        if tokens(p) = '1' then
          found := p;
        end if;

      end loop;

      -- Each run restarts the count; when a cable is pulled, tokens stay away and the count ends.
      if patience /= 0 then
        patience <= patience - 1;
      else
        aligned <= '0';
      end if;

      if tokens(run_phase) = '1' then
        -- A run of this length never occurs in a picture, so the phase is taken at once.
        if run_length = RUN - 1 then
          phase    <= run_phase;
          aligned  <= '1';
          patience <= TIMEOUT;
        else
          run_length <= run_length + 1;
        end if;
      else
        run_phase  <= found;
        run_length <= 0;
        if tokens /= "0000000000" then
          run_length <= 1;
        end if;
      end if;

      if reset = '1' then
        phase      <= 0;
        run_phase  <= 0;
        run_length <= 0;
        patience   <= 0;
        aligned    <= '0';
        tokens     <= (others => '0');
      end if;
    end if;

  end process align;

end architecture rtl;
