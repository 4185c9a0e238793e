-- SPDX-License-Identifier: Apache-2.0
-- Brings the three channels to the same pixel: removes the skew of cables and of the word alignment.
--
-- Each channel runs through a delay line with a selectable tap. The first data word behind a run of control tokens (the
-- beginning of a line) marks the same pixel in all channels. The distances of these marks, equal in two lines in a row,
-- set the taps. Lines that do not agree with the taps in use are counted; the same deviation twice moves the taps.
--
-- Latency: 2 clocks for the latest channel. Throughput: one word of each channel each clock.
-- Equation: out_words(t) of channel c = words(t - 2 - tap(c)), tap(c) = last arrival - arrival(c).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.tmds_pkg.all;

entity tmds_deskew is
  generic (
    -- Words without a confirming line after which the taps are lost; more than a frame's blanking.
    TIMEOUT : positive := 262143
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Words of the channels; which words are control tokens; which channels are aligned.
    words   : in    words_t;
    tokens  : in    std_logic_vector(CHANNELS - 1 downto 0);
    aligned : in    std_logic_vector(CHANNELS - 1 downto 0);
    -- Words that belong to the same pixel.
    out_words : out   words_t;
    -- All channels are aligned, and their delays were confirmed within TIMEOUT words.
    locked : out   std_logic := '0'
  );
end entity tmds_deskew;

architecture rtl of tmds_deskew is

  -- Words by which channels may be apart: far more than cables and word alignment cause.
  constant DEPTH : positive := 16;
  -- Tokens required in front of a mark, so that a single wrong token makes no mark.
  constant BEFORE_MARK : positive := 4;

  subtype tap_t is natural range 0 to DEPTH - 1;

  type taps_t is array (0 to CHANNELS - 1) of tap_t;

  type line_t is array (0 to DEPTH - 1) of tmds_word_t;

  type lines_t is array (0 to CHANNELS - 1) of line_t;

  type runs_t is array (0 to CHANNELS - 1) of natural range 0 to BEFORE_MARK;

  signal taps : taps_t := (others => 0);
  -- Tokens in a row for each channel; marks: the first word behind enough of them.
  signal runs  : runs_t := (others => 0);
  signal marks : std_logic_vector(CHANNELS - 1 downto 0);
  -- The marks of one line: which have arrived; when, counted from the first; words since then.
  signal arrived  : std_logic_vector(CHANNELS - 1 downto 0) := (others => '0');
  signal arrivals : taps_t                                  := (others => 0);
  signal age      : tap_t                                   := 0;
  -- Taps that the last line asks for (measured: for one clock), and the taps of the line before.
  signal candidate : taps_t                     := (others => 0);
  signal measured  : std_logic                  := '0';
  signal previous  : taps_t                     := (others => 0);
  signal patience  : natural range 0 to TIMEOUT := 0;

begin

  mark : for c in 0 to CHANNELS - 1 generate
    -- The end of a long run of tokens is the one moment that all channels have in common.
    marks(c) <= '1' when runs(c) = BEFORE_MARK and tokens(c) = '0' else
                '0';
  end generate mark;

  -- The delay lines have no reset, so that they fit shift registers; they are variables, because simulators keep an
  -- event for each bit of a signal.
  delay : process (clk) is

    variable lines : lines_t := (others => (others => (others => '0')));

  begin

    if rising_edge(clk) then

      for c in 0 to CHANNELS - 1 loop

        -- The tap is read before the line moves, so tap 0 is the word of the clock before.
        out_words(c) <= lines(c)(taps(c));

        for i in DEPTH - 1 downto 1 loop

          lines(c)(i) := lines(c)(i - 1);

        end loop;

        lines(c)(0) := words(c);

      end loop;

    end if;

  end process delay;

  measure : process (clk) is

    variable now_arrived : std_logic_vector(CHANNELS - 1 downto 0);

  begin

    if rising_edge(clk) then

      for c in 0 to CHANNELS - 1 loop

        if tokens(c) = '0' then
          runs(c) <= 0;
        elsif runs(c) /= BEFORE_MARK then
          runs(c) <= runs(c) + 1;
        end if;

      end loop;

      -- Arrivals, counted from the first one; an incomplete set is dropped.
      measured    <= '0';
      now_arrived := arrived or marks;

      for c in 0 to CHANNELS - 1 loop

        -- The first mark of a line has age 0.
        if marks(c) = '1' and arrived(c) = '0' then
          arrivals(c) <= age;
        end if;

      end loop;

      -- The channel that came last is not delayed; the others are delayed by as much as they were early.
      if now_arrived = "111" then

        for c in 0 to CHANNELS - 1 loop

          if arrived(c) = '1' then
            candidate(c) <= age - arrivals(c);
          else
            candidate(c) <= 0;
          end if;

        end loop;

        measured <= '1';
        arrived  <= (others => '0');
        age      <= 0;
      elsif now_arrived = "000" or age = DEPTH - 1 then
        -- No mark has come, or the others have not come within the depth of the delay lines.
        arrived <= (others => '0');
        age     <= 0;
      else
        arrived <= now_arrived;
        age     <= age + 1;
      end if;

      -- Confirm the taps, or move them.
      if patience /= 0 then
        patience <= patience - 1;
      else
        locked <= '0';
      end if;
      if measured = '1' then
        previous <= candidate;
        -- Equal taps twice are required, because a damaged word may end a run in one channel too soon.
        if candidate = previous then
          taps     <= candidate;
          locked   <= '1';
          patience <= TIMEOUT;
        end if;
      end if;

      -- Without aligned channels nothing can be measured, and earlier measurements may belong to another source.
      if aligned /= "111" then
        locked   <= '0';
        patience <= 0;
        measured <= '0';
        arrived  <= (others => '0');
        age      <= 0;
      end if;

      if reset = '1' then
        locked   <= '0';
        patience <= 0;
        measured <= '0';
        arrived  <= (others => '0');
        age      <= 0;
        taps     <= (others => 0);
        runs     <= (others => 0);
      end if;
    end if;

  end process measure;

end architecture rtl;
