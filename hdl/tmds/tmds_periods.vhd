-- SPDX-License-Identifier: Apache-2.0
-- Follows the periods of a DVI or HDMI source: control, video, data islands.
--
-- Two of three channels decide between tokens and other words, so that one wrong word does not tear a line. Preamble
-- and guard band tell which period begins behind tokens; it lasts until tokens come again. The control bits of a DVI
-- source may imitate a preamble, and its pixels a guard band; an HDMI source is therefore recognised by a preamble of
-- exactly 8 words and all six words of a guard band. Once a source is recognised, less is enough, so that wrong bits
-- change nothing: channels 1 and 2 count the tokens of a preamble up to 8 and back, and 4 are enough; so are three
-- words of the guard band. Everything else is video without a guard band, as from a DVI source.
--
-- Latency: 2 clocks. Throughput: one word of each channel each clock.
-- Equation: HDMI 1.4, section 5.2; DVI 1.0, section 3.3.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.tmds_pkg.all;
use work.video_pkg.all;

entity tmds_periods is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The word of each channel, from its decoder.
    words : in    decoded_words_t;
    -- Video; black where not active.
    video : out   video_t := NO_VIDEO;
    -- Channels whose word cannot occur in this period.
    errors : out   std_logic_vector(CHANNELS - 1 downto 0);
    -- The source sends guard bands or islands.
    hdmi : out   std_logic;
    -- Words of data islands.
    island : out   island_t
  );
end entity tmds_periods;

architecture rtl of tmds_periods is

  -- Lines and islands in a row without whole guard bands after which the source counts as DVI.
  constant PLAIN_LINES : positive := 16;

  -- Tokens of a preamble in channels 1 and 2: in front of an island both have 01, in front of video only channel 1 has.
  constant PREAMBLE      : std_logic_vector(1 downto 0) := "01";
  constant ENOUGH_WORDS  : positive                     := 4;
  constant ENOUGH_GUARDS : positive                     := 3;
  constant ALL_GUARDS    : positive                     := 6;

  subtype votes_t is natural range 0 to PREAMBLE_WORDS;

  -- Period of the word before; behind the second word of a guard band already the period of the next word.
  type period_t is (control, video_guard, picture, island_guard, data_island);

  subtype channels_t is std_logic_vector(CHANNELS - 1 downto 0);

  -- Channels whose word can belong to a guard band, now and in clock 1; and the words of clock 1. A guard band is
  -- decided when its first word is in clock 1 and its second word comes: six words vote.
  signal video_marks    : channels_t;
  signal island_marks   : channels_t;
  signal video_marks_1  : channels_t      := (others => '0');
  signal island_marks_1 : channels_t      := (others => '0');
  signal words_1        : decoded_words_t := (others => NO_WORD);
  signal active_1       : channels_t;

  signal period      : period_t := control;
  signal votes_green : votes_t  := 0;
  signal votes_red   : votes_t  := 0;
  -- Tokens of a preamble in a row in channel 1, counted to one more than a preamble has.
  signal run : natural range 0 to PREAMBLE_WORDS + 1 := 0;
  -- Lines and islands since the last one that began with a whole preamble and guard band.
  signal plain   : natural range 0 to larger(PLAIN_LINES - 1, 1) := 0;
  signal is_hdmi : std_logic                                     := '0';

  -- tokens: the words in clock 1 are tokens; now: their period; changes: they are the first words behind tokens.
  signal tokens  : std_logic;
  signal now     : period_t;
  signal changes : std_logic;
  -- Preamble and guard band in front of the words are whole.
  signal whole : std_logic;

  function count_marks (
    marks : std_logic_vector(2 * CHANNELS - 1 downto 0)
  ) return natural is

    variable count : natural range 0 to 2 * CHANNELS;

  begin

    count := 0;

    for i in marks'range loop

      if marks(i) = '1' then
        count := count + 1;
      end if;

    end loop;

    return count;

  end function count_marks;

  -- Votes for a preamble after one more token.

  function next_votes (
    votes : votes_t;
    token : std_logic_vector(1 downto 0)
  ) return votes_t is
  begin

    if token = PREAMBLE and votes /= PREAMBLE_WORDS then
      return votes + 1;
    elsif token /= PREAMBLE and votes /= 0 then
      return votes - 1;
    end if;

    return votes;

  end function next_votes;

begin

  hdmi <= is_hdmi;

  -- Words of the two guard bands. Each guard band has a fixed word in each channel: in some channels a word for four
  -- bits, in others a word of its own. In channel 0 the guard band of islands carries the syncs in its low bits.
  video_marks(0)  <= words(0).is_nibble and to_logic(words(0).nibble = VIDEO_GUARD_NIBBLE);
  video_marks(1)  <= words(1).is_guard;
  video_marks(2)  <= words(2).is_nibble and to_logic(words(2).nibble = VIDEO_GUARD_NIBBLE);
  island_marks(0) <= words(0).is_nibble and words(0).nibble(3) and words(0).nibble(2);
  island_marks(1) <= words(1).is_guard;
  island_marks(2) <= words(2).is_guard;

  active_1 <= words_1(2).active & words_1(1).active & words_1(0).active;

  -- Two of three channels decide: a damaged word in one channel must not end the blanking, or each error would destroy
  -- a line.
  tokens  <= to_logic(active_1 = "000" or active_1 = "001" or active_1 = "010" or active_1 = "100");
  changes <= to_logic(period = control) and not tokens;

  tell_period : process (period, tokens, votes_green, votes_red, run, is_hdmi, video_marks, video_marks_1,
                         island_marks, island_marks_1) is

    variable video_count  : natural range 0 to 2 * CHANNELS;
    variable island_count : natural range 0 to 2 * CHANNELS;
    variable whole_video  : boolean;
    variable whole_island : boolean;

  begin

    now          <= period;
    video_count  := count_marks(video_marks & video_marks_1);
    island_count := count_marks(island_marks & island_marks_1);
    -- Channel 1 has its preamble in front of both periods, channel 2 in front of islands only.
    whole_island := run = PREAMBLE_WORDS and votes_red = PREAMBLE_WORDS and island_count = ALL_GUARDS;
    whole_video  := run = PREAMBLE_WORDS and votes_red = 0 and video_count = ALL_GUARDS;
    whole        <= to_logic(whole_island or whole_video);

    -- Tokens end every period.
    if tokens = '1' then
      now <= control;
    elsif period = control then
      now <= picture;
      if whole_island then
        now <= island_guard;
      elsif whole_video then
        now <= video_guard;
      elsif is_hdmi = '1' and votes_green >= ENOUGH_WORDS then
        if votes_red >= ENOUGH_WORDS then
          if island_count >= ENOUGH_GUARDS then
            now <= island_guard;
          end if;
        elsif video_count >= ENOUGH_GUARDS then
          now <= video_guard;
        end if;
      end if;
    end if;

  end process tell_period;

  delay_words : process (clk) is
  begin

    if rising_edge(clk) then
      video_marks_1  <= video_marks;
      island_marks_1 <= island_marks;
      words_1        <= words;
    end if;

  end process delay_words;

  follow : process (clk) is
  begin

    if rising_edge(clk) then
      -- A guard band is two words long; behind the second word its period begins. Only the beginning of a period needs
      -- a vote; inside it words may be anything.
      period <= now;
      if now = video_guard and period = video_guard then
        period <= picture;
      elsif now = island_guard and period = island_guard then
        period <= data_island;
      end if;

      votes_green <= 0;
      -- The votes are counted in the blanking, and hold for its end.
      votes_red <= 0;
      run       <= 0;
      if tokens = '1' then
        votes_green <= next_votes(votes_green, words_1(1).control);
        votes_red   <= next_votes(votes_red, words_1(2).control);
        if words_1(1).control = PREAMBLE and run <= PREAMBLE_WORDS then
          run <= run + 1;
        elsif words_1(1).control = PREAMBLE then
          run <= run;
        end if;
      end if;

      if changes = '1' then
        -- A source that leaves HDMI mode stops sending guard bands; a few in a row that are not whole are no accident.
        if whole = '1' then
          is_hdmi <= '1';
          plain   <= 0;
        elsif plain = PLAIN_LINES - 1 then
          is_hdmi <= '0';
        else
          plain <= plain + 1;
        end if;
      end if;

      if reset = '1' then
        is_hdmi     <= '0';
        period      <= control;
        plain       <= 0;
        votes_green <= 0;
        votes_red   <= 0;
        run         <= 0;
      end if;
    end if;

  end process follow;

  give : process (clk) is
  begin

    if rising_edge(clk) then
      -- Nothing is shown and nothing is read unless the period allows it.
      video.active <= '0';
      video.pixel  <= (others => '0');
      island.start <= '0';
      island.valid <= '0';
      -- Places of a packet's bits in the words of an island; valid with island.valid.
      island.header <= words_1(0).nibble(2);
      island.even   <= words_1(1).nibble;
      island.odd    <= words_1(2).nibble;

      case now is

        when control =>

          errors <= active_1;
          -- If channel 0 has no token, its word is damaged: the syncs keep their levels, because a pulse with a hole
          -- would be measured as two.
          if active_1(0) = '0' then
            video.h_sync <= words_1(0).control(0);
            video.v_sync <= words_1(0).control(1);
          end if;

        when video_guard =>

          errors <= not video_marks_1;

        when picture =>

          video.active <= '1';
          video.pixel  <= words_1(0).data & words_1(1).data & words_1(2).data;

          -- A token is wrong here, though it is a valid word.
          for c in 0 to CHANNELS - 1 loop

            errors(c) <= words_1(c).error or not active_1(c);

          end loop;

        when island_guard | data_island =>

          -- Island and its guard band are not distinguished: a word is wrong if neither has it.
          for c in 0 to CHANNELS - 1 loop

            errors(c) <= not (words_1(c).is_nibble or words_1(c).is_guard);

          end loop;

          if now = data_island then
            island.valid <= '1';
          else
            island.start <= '1';
          end if;
          -- Inside an island the syncs are in channel 0.
          if words_1(0).is_nibble = '1' then
            video.h_sync <= words_1(0).nibble(0);
            video.v_sync <= words_1(0).nibble(1);
          end if;

      end case;

      if reset = '1' then
        video.active <= '0';
        errors       <= (others => '0');
        island.valid <= '0';
      end if;
    end if;

  end process give;

end architecture rtl;
