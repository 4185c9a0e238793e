-- SPDX-License-Identifier: Apache-2.0
-- Follows the periods of a DVI or HDMI source: control, video, data islands.
--
-- Two of three channels decide between tokens and anything else, so that one wrong word does not tear a
-- line. What comes behind tokens is told by the preamble and the guard band: channels 1 and 2 count
-- the tokens of a preamble up to 8 and back, 4 are enough; of the guard band three of six words are
-- enough. It lasts until tokens come again. Everything else is video without a guard band, as of a DVI source.
--
-- Latency: 2 clocks. Throughput: one word of each channel each clock.
-- Equation: HDMI 1.4, section 5.2; DVI 1.0, section 3.3.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.tmds_pkg.all;

entity tmds_periods is
  generic (
    -- Lines in a row without guard bands that make the source one of DVI.
    PLAIN_LINES : positive := 16
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- From the decoders, channel 0 in the low bits; see tmds_decoder.
    word_active    : in    std_logic_vector(CHANNELS - 1 downto 0);
    word_control   : in    std_logic_vector(2 * CHANNELS - 1 downto 0);
    word_data      : in    std_logic_vector(8 * CHANNELS - 1 downto 0);
    word_error     : in    std_logic_vector(CHANNELS - 1 downto 0);
    word_is_nibble : in    std_logic_vector(CHANNELS - 1 downto 0);
    word_nibble    : in    std_logic_vector(4 * CHANNELS - 1 downto 0);
    word_is_guard  : in    std_logic_vector(CHANNELS - 1 downto 0);
    -- Video: red in the low bits of pixel, black where not active.
    active : out   std_logic;
    h_sync : out   std_logic;
    v_sync : out   std_logic;
    pixel  : out   std_logic_vector(23 downto 0);
    -- Channels whose word is not one that this period can have.
    errors : out   std_logic_vector(CHANNELS - 1 downto 0);
    -- Lines begin with guard bands.
    hdmi : out   std_logic;
    -- A data island begins; one of its words: a bit of the header, two of each subpacket.
    island_start  : out   std_logic;
    island_valid  : out   std_logic;
    island_header : out   std_logic;
    island_even   : out   std_logic_vector(3 downto 0);
    island_odd    : out   std_logic_vector(3 downto 0)
  );
end entity tmds_periods;

architecture rtl of tmds_periods is

  -- Tokens of a preamble in channels 1 and 2: both have 01 in front of an island, channel 1 alone in
  -- front of video.
  constant PREAMBLE       : std_logic_vector(1 downto 0) := "01";
  constant PREAMBLE_WORDS : positive                     := 8;
  constant ENOUGH_WORDS   : positive                     := 4;
  constant ENOUGH_GUARDS  : positive                     := 3;

  subtype votes_t is natural range 0 to PREAMBLE_WORDS;

  -- What the word before belonged to; behind the second word of a guard band already what follows.
  type period_t is (control, video_guard, video, island_guard, island);

  signal video_marks    : std_logic_vector(CHANNELS - 1 downto 0);
  signal island_marks   : std_logic_vector(CHANNELS - 1 downto 0);
  signal video_marks_1  : std_logic_vector(CHANNELS - 1 downto 0)       := (others => '0');
  signal island_marks_1 : std_logic_vector(CHANNELS - 1 downto 0)       := (others => '0');
  signal active_1       : std_logic_vector(CHANNELS - 1 downto 0)       := (others => '0');
  signal control_1      : std_logic_vector(2 * CHANNELS - 1 downto 0)   := (others => '0');
  signal data_1         : std_logic_vector(8 * CHANNELS - 1 downto 0)   := (others => '0');
  signal error_1        : std_logic_vector(CHANNELS - 1 downto 0)       := (others => '0');
  signal island_1       : std_logic_vector(CHANNELS - 1 downto 0)       := (others => '0');
  signal is_nibble_1    : std_logic                                     := '0';
  signal nibble_1       : std_logic_vector(4 * CHANNELS - 1 downto 0)   := (others => '0');
  signal period         : period_t                                      := control;
  signal votes_green    : votes_t                                       := 0;
  signal votes_red      : votes_t                                       := 0;
  signal plain          : natural range 0 to larger(PLAIN_LINES - 1, 1) := 0;

  -- The words in stage 1 are tokens; what they belong to; they are the first ones behind tokens.
  signal tokens  : std_logic;
  signal now     : period_t;
  signal changes : std_logic;

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

  -- Votes for a preamble behind one more word of control.

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

  -- Words of the two guard bands.
  video_marks(0)  <= '1' when word_is_nibble(0) = '1' and word_nibble(3 downto 0) = VIDEO_GUARD_NIBBLE else
                     '0';
  video_marks(1)  <= word_is_guard(1);
  video_marks(2)  <= '1' when word_is_nibble(2) = '1' and word_nibble(11 downto 8) = VIDEO_GUARD_NIBBLE else
                     '0';
  island_marks(0) <= word_is_nibble(0) and word_nibble(3) and word_nibble(2);
  island_marks(1) <= word_is_guard(1);
  island_marks(2) <= word_is_guard(2);

  tokens  <= to_logic(active_1 = "000" or active_1 = "001" or active_1 = "010" or active_1 = "100");
  changes <= to_logic(period = control) and not tokens;

  tell_period : process (period, tokens, votes_green, votes_red, video_marks, video_marks_1, island_marks,
                         island_marks_1) is
  begin

    now <= period;

    if tokens = '1' then
      now <= control;
    elsif period = control then
      now <= video;
      if votes_green >= ENOUGH_WORDS then
        if votes_red >= ENOUGH_WORDS then
          if count_marks(island_marks & island_marks_1) >= ENOUGH_GUARDS then
            now <= island_guard;
          end if;
        elsif count_marks(video_marks & video_marks_1) >= ENOUGH_GUARDS then
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
      active_1       <= word_active;
      control_1      <= word_control;
      data_1         <= word_data;
      error_1        <= word_error;
      island_1       <= word_is_nibble or word_is_guard;
      is_nibble_1    <= word_is_nibble(0);
      nibble_1       <= word_nibble;
    end if;

  end process delay_words;

  -- What the next words depend on.
  follow : process (clk) is
  begin

    if rising_edge(clk) then
      -- A guard band is two words long.
      period <= now;
      if now = video_guard and period = video_guard then
        period <= video;
      elsif now = island_guard and period = island_guard then
        period <= island;
      end if;

      votes_green <= 0;
      votes_red   <= 0;
      if tokens = '1' then
        votes_green <= next_votes(votes_green, control_1(3 downto 2));
        votes_red   <= next_votes(votes_red, control_1(5 downto 4));
      end if;

      if changes = '1' and now = video_guard then
        hdmi  <= '1';
        plain <= 0;
      elsif changes = '1' and now = video then
        if plain = PLAIN_LINES - 1 then
          hdmi <= '0';
        else
          plain <= plain + 1;
        end if;
      end if;

      if reset = '1' then
        hdmi        <= '0';
        period      <= control;
        plain       <= 0;
        votes_green <= 0;
        votes_red   <= 0;
      end if;
    end if;

  end process follow;

  give : process (clk) is
  begin

    if rising_edge(clk) then
      active        <= '0';
      pixel         <= (others => '0');
      island_start  <= '0';
      island_valid  <= '0';
      island_header <= nibble_1(2);
      island_even   <= nibble_1(7 downto 4);
      island_odd    <= nibble_1(11 downto 8);

      case now is

        when control =>

          errors <= active_1;
          if active_1(0) = '0' then
            h_sync <= control_1(0);
            v_sync <= control_1(1);
          end if;

        when video_guard =>

          errors <= not video_marks_1;

        when video =>

          active <= '1';
          pixel  <= data_1(7 downto 0) & data_1(15 downto 8) & data_1(23 downto 16);
          errors <= error_1 or not active_1;

        when island_guard | island =>

          errors <= not island_1;
          if now = island then
            island_valid <= '1';
          else
            island_start <= '1';
          end if;
          if is_nibble_1 = '1' then
            h_sync <= nibble_1(0);
            v_sync <= nibble_1(1);
          end if;

      end case;

      if reset = '1' then
        active       <= '0';
        errors       <= (others => '0');
        island_valid <= '0';
      end if;
    end if;

  end process give;

end architecture rtl;
