-- SPDX-License-Identifier: Apache-2.0
-- The video path of a board, independent of the FPGA family: TMDS bits in, refocused, TMDS words out.
--
-- The input is that of the receiver, as full-range RGB, or the board's own: a stored light field (stored_pkg) or a test
-- pattern with three planes. screen_pkg has the outputs besides the refocused slice, and whether a text is shown;
-- sensor_pkg says whether the input is a sensor's raw frames. The board provides the clocks, collects ten bits each
-- clock, and serialises words.
--
-- Latency: that of refocus_video, and about 40 pixels of the link. Throughput: one pixel each clock.
-- Equation: out picture = refocus(in picture).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.core_pkg.all;
use work.count_pkg.all;
use work.fault_pkg.all;
use work.hdmi_pkg.all;
use work.resample_pkg.all;
use work.tmds_pkg.all;
use work.video_pkg.all;

entity hdmi_refocuser is
  generic (
    -- The core of the picture (picture_core_of).
    CORE : core_t;
    -- Size of the board's own picture.
    PATTERN_COLUMNS : positive range 3 to 4095;
    PATTERN_ROWS    : positive range 1 to 4095;
    -- Words without control tokens after which a channel is lost.
    ALIGN_TIMEOUT : positive
  );
  port (
    -- Pixel clock.
    clk : in    std_logic;
    -- Clock of the transmitter, with the frequency of clk and any phase to it.
    tx_clk : in    std_logic;
    -- High while all clocks run; from any clock.
    run : in    std_logic;
    -- The next ten bits of each channel, in clk, wherever words begin: channel 0 (blue) in the low bits; bit 0 came
    -- first.
    in_bits : in    std_logic_vector(10 * CHANNELS - 1 downto 0);
    -- Words of the channels and, in the high bits, of the clock lane, in tx_clk; bit 0 is sent first.
    out_words : out   std_logic_vector(10 * CHANNELS + 9 downto 0);
    -- Timing of the test pattern; must be constant.
    pattern_timing : in    timing_t;
    -- Settings from the control and reports to it, in clk.
    settings : in    video_settings_t;
    state    : out   video_state_t;
    -- Channels with a wrong word (one that no encoder sends), in clk: bits may no longer be sampled well.
    wrong : out   std_logic_vector(CHANNELS - 1 downto 0)
  );
end entity hdmi_refocuser;

architecture rtl of hdmi_refocuser is

  -- Resets of pixels and of the transmitter's words: both start with the link, and are in reset without it.
  signal stop     : std_logic;
  signal reset    : std_logic;
  signal tx_reset : std_logic;

  -- Outputs of the receiver.
  signal link         : video_t;
  signal aligned      : std_logic_vector(CHANNELS - 1 downto 0);
  signal inverted     : std_logic_vector(CHANNELS - 1 downto 0);
  signal wrong_words  : std_logic_vector(CHANNELS - 1 downto 0);
  signal hdmi         : std_logic;
  signal info         : picture_info_t;
  signal packet_error : std_logic;
  signal sum_error    : std_logic;

  -- Video: as RGB; the board's own; the chosen source; as shown.
  signal rgb           : video_t;
  signal drawn         : video_t;
  signal pattern_reset : std_logic;
  signal source        : video_t := NO_VIDEO;
  signal shown         : video_t;
  signal marked        : video_t;
  signal marks         : std_logic_vector(1 downto 0);

  signal following    : std_logic;
  signal unsupported  : std_logic;
  signal varying      : std_logic;
  signal timing       : timing_t;
  signal video_errors : std_logic_vector(VIDEO_ERROR_BITS - 1 downto 0);

  -- Toggles of the settings as last seen, and the orders that their changes mean.
  signal clear_seen : std_logic := '0';
  signal clear      : std_logic;
  signal load_seen  : std_logic := '0';
  signal load       : load_t;

  signal errors_now    : std_logic_vector(ERRORS - 1 downto 0)                     := (others => '0');
  signal word_errors   : std_logic_vector(WORD_ERROR_BITS * CHANNELS - 1 downto 0) := (others => '0');
  signal packet_errors : std_logic_vector(PACKET_ERROR_BITS - 1 downto 0)          := (others => '0');
  signal sum_errors    : std_logic_vector(PACKET_ERROR_BITS - 1 downto 0)          := (others => '0');

begin

  stop  <= not run;
  wrong <= wrong_words;

  -- Both clocks may stop with the source. The resets begin without a clock and end in step with one, so nothing starts
  -- in part.
  reset_of_pixels : entity work.reset_bridge
    port map (
      clk     => clk,
      request => stop,
      reset   => reset
    );

  reset_of_tx : entity work.reset_bridge
    port map (
      clk     => tx_clk,
      request => stop,
      reset   => tx_reset
    );

  -- `locked` is not used: the control judges by the channels, which its report names.
  receiver : entity work.tmds_receiver
    generic map (
      ALIGN_TIMEOUT => ALIGN_TIMEOUT
    )
    port map (
      clk          => clk,
      reset        => reset,
      bits         => in_bits,
      polarity     => settings.polarity,
      video        => link,
      aligned      => aligned,
      inverted     => inverted,
      errors       => wrong_words,
      hdmi         => hdmi,
      info         => info,
      packet_error => packet_error,
      sum_error    => sum_error
    );

  -- The conversion comes first, so that everything behind it has full-range RGB whatever the source sends.
  convert : entity work.full_range_rgb
    port map (
      clk       => clk,
      colour    => info.colour,
      limited   => info.limited,
      bt601     => info.bt601,
      in_video  => link,
      out_video => rgb
    );

  -- The pattern restarts when it is chosen, so its first frame is whole.
  pattern_reset <= reset or not settings.show_pattern;

  -- A picture without a source, to try output and refocuser with nothing plugged in.
  own : entity work.own_light_field
    generic map (
      GEOMETRY      => CORE.geometry,
      FRAME_COLUMNS => PATTERN_COLUMNS,
      FRAME_ROWS    => PATTERN_ROWS
    )
    port map (
      clk    => clk,
      reset  => pattern_reset,
      timing => pattern_timing,
      video  => drawn
    );

  choose_source : process (clk) is
  begin

    if rising_edge(clk) then
      -- A register: from here on it is one video, whatever the source.
      source <= rgb;
      if settings.show_pattern = '1' then
        source <= drawn;
      end if;
      -- During the reset no pixel counts. The syncs need no reset, because the timing is measured again behind it.
      if reset = '1' then
        source.active <= '0';
      end if;
    end if;

  end process choose_source;

  picture : entity work.refocus_video
    generic map (
      CORE => CORE
    )
    port map (
      clk         => clk,
      reset       => reset,
      choice      => settings.choice,
      text_place  => settings.text_place,
      text_errors => errors_now,
      load        => load,
      in_video    => source,
      out_video   => shown,
      on_show     => open,
      following   => following,
      unsupported => unsupported,
      varying     => varying,
      timing      => timing,
      errors      => video_errors
    );

  -- Marks are searched in the incoming video; the result is drawn into the outgoing video.
  watch_marks : entity work.picture_marks
    generic map (
      LINES => CORE.geometry.micro_image_size
    )
    port map (
      clk         => clk,
      reset       => reset,
      in_video    => source,
      shown_video => shown,
      out_video   => marked,
      marks       => marks
    );

  -- A toggle crosses between clocks where a pulse could be lost.
  clear <= clear_seen xor settings.clear_toggle;
  load  <= to_load(load_seen xor settings.load_toggle, settings.load_word);

  collect_errors : process (clk) is
  begin

    if rising_edge(clk) then
      clear_seen <= settings.clear_toggle;
      load_seen  <= settings.load_toggle;
      if clear = '1' then
        errors_now <= (others => '0');
      elsif reset = '0' then
        -- A restart of the link clears no error, so that its cause stays visible.
        errors_now(VIDEO_ERROR_BITS - 1 downto 0) <= errors_now(VIDEO_ERROR_BITS - 1 downto 0) or video_errors;
        -- Without a picture, and with the pattern, wrong words are no fault: an input without a source receives noise.
        if following = '1' and wrong_words /= "000" and settings.show_pattern = '0' then
          errors_now(WRONG_WORD) <= '1';
        end if;
      end if;

      -- A counter for each channel, because a bad contact shows in one of them.
      word_errors <= each_counted(word_errors, wrong_words, clear);
      -- Two counters: wrong check bits point to the cable, a wrong checksum points to the source.
      packet_errors <= counted(packet_errors, packet_error, clear);
      sum_errors    <= counted(sum_errors, sum_error, clear);
    end if;

  end process collect_errors;

  -- The transmitter's clock has the frequency of the pixels in any phase; an elastic buffer in tmds_transmitter bridges
  -- the difference.
  transmitter : entity work.tmds_transmitter
    port map (
      clk      => clk,
      reset    => reset,
      video    => marked,
      tx_clk   => tx_clk,
      tx_reset => tx_reset,
      tx_words => out_words
    );

  -- Reports to the control.
  state <=
  (
    aligned       => aligned,
    inverted      => inverted,
    following     => following,
    unsupported   => unsupported,
    varying       => varying,
    errors        => errors_now,
    word_errors   => word_errors,
    hdmi          => hdmi,
    info          => info,
    packet_errors => packet_errors,
    sum_errors    => sum_errors,
    columns       => timing.columns,
    rows          => timing.rows,
    h_sync        => timing.h_sync_level,
    v_sync        => timing.v_sync_level,
    v_sync_now    => source.v_sync,
    load_seen     => load_seen,
    marks         => marks
  );

end architecture rtl;
