-- SPDX-License-Identifier: Apache-2.0
-- The video path of a board: TMDS bits in, refocused, TMDS words out, with nothing of a family in it.
--
-- The input is the receiver's, as full-range RGB, or a test pattern with three planes. What is shown besides the
-- refocused slice, and whether there is a text over it, stands in screen_pkg; whether the input is a
-- sensor's raw frames, in sensor_pkg. The board gives the clocks, collects ten bits a clock and serialises words.
--
-- Latency: see refocus_video, and about 40 pixels of the link. Throughput: one pixel each clock.
-- Equation: out picture = refocus(in picture), see raster_refocuser.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.hdmi_pkg.all;
use work.picture_pkg.all;
use work.screen_pkg.all;
use work.sensor_pkg.all;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.tmds_pkg.all;
use work.video_pkg.all;

entity hdmi_refocuser is
  generic (
    -- M, the slices, and how they are computed; see raster_refocuser.
    MICRO_IMAGE_SIZE    : positive range 1 to 128;
    SHIFTS              : string;
    INTERPOLATION_ORDER : natural range 0 to 3;
    HOLD                : boolean;
    MAX_COLUMNS         : positive range 1 to 8192;
    EXACT               : boolean;
    FRACTION_BITS       : natural range 0 to 12;
    GUARD_BITS          : natural range 0 to 12;
    BROADCAST_TAPS      : natural;
    ENGINE              : string;
    -- Timing of the test pattern, see mode_timing.
    PATTERN_H_ACTIVE : positive range 3 to 4095;
    PATTERN_H_FRONT  : positive range 1 to 4095;
    PATTERN_H_SYNC   : positive range 1 to 4095;
    PATTERN_H_BACK   : positive range 1 to 4095;
    PATTERN_V_ACTIVE : positive range 1 to 4095;
    PATTERN_V_FRONT  : positive range 1 to 4095;
    PATTERN_V_SYNC   : positive range 1 to 4095;
    PATTERN_V_BACK   : positive range 1 to 4095;
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
    -- The next ten bits of each channel, in clk, wherever its words begin: channel 0 (blue) in the low bits, bit 0
    -- came first.
    in_bits : in    std_logic_vector(10 * CHANNELS - 1 downto 0);
    -- Words of the channels and, in the high bits, of the clock lane, in tx_clk; bit 0 is sent first.
    out_words : out   std_logic_vector(10 * CHANNELS + 9 downto 0);
    -- From and to the control, in clk.
    settings : in    video_settings_t;
    state    : out   video_state_t
  );
end entity hdmi_refocuser;

architecture rtl of hdmi_refocuser is

  constant H_TOTAL : positive := PATTERN_H_ACTIVE + PATTERN_H_FRONT + PATTERN_H_SYNC + PATTERN_H_BACK;
  constant V_TOTAL : positive := PATTERN_V_ACTIVE + PATTERN_V_FRONT + PATTERN_V_SYNC + PATTERN_V_BACK;

  constant REFUSED      : boolean := not takes_shifts("hdmi_refocuser", SHIFTS, MAX_COLUMNS);
  constant NO_H_COUNTER : boolean := not takes(H_TOTAL <= 4095,
                                               "hdmi_refocuser: PATTERN_H_ACTIVE and its blanking exceed 4095 pixels");
  constant NO_V_COUNTER : boolean := not takes(V_TOTAL <= 4095,
                                               "hdmi_refocuser: PATTERN_V_ACTIVE and its blanking exceed 4095 lines");

  constant SLICES : positive := slice_count(SHIFTS);

  -- Depths of the test pattern: first, middle and last slice; of one slice alone, also those that it blurs.
  constant LEFT_SHIFT   : integer := slice_shift(SHIFTS, 0);
  constant MIDDLE_SHIFT : integer := choose(SLICES > 2, slice_shift(SHIFTS, SLICES / 2), 0);
  constant RIGHT_SHIFT  : integer := choose(SLICES > 1, slice_shift(SHIFTS, SLICES - 1), -LEFT_SHIFT);

  constant PATTERN_TIMING : timing_t := mode_timing
                                        (
                                          PATTERN_H_ACTIVE,
                                          PATTERN_H_FRONT,
                                          PATTERN_H_SYNC,
                                          PATTERN_H_BACK,
                                          PATTERN_V_ACTIVE,
                                          PATTERN_V_FRONT,
                                          PATTERN_V_SYNC,
                                          PATTERN_V_BACK,
                                          false,
                                          false
                                        );

  signal stop     : std_logic;
  signal reset    : std_logic;
  signal tx_reset : std_logic;

  signal link_active  : std_logic;
  signal link_h_sync  : std_logic;
  signal link_v_sync  : std_logic;
  signal link_pixel   : std_logic_vector(23 downto 0);
  signal link_aligned : std_logic_vector(CHANNELS - 1 downto 0);
  signal link_locked  : std_logic;
  signal link_errors  : std_logic_vector(CHANNELS - 1 downto 0);

  signal hdmi         : std_logic;
  signal informed     : std_logic;
  signal colour       : std_logic_vector(1 downto 0);
  signal limited      : std_logic;
  signal bt601        : std_logic;
  signal format_code  : std_logic_vector(7 downto 0);
  signal packet_error : std_logic;
  signal sum_error    : std_logic;
  signal rgb_active   : std_logic;
  signal rgb_h_sync   : std_logic;
  signal rgb_v_sync   : std_logic;
  signal rgb_pixel    : std_logic_vector(23 downto 0);

  signal pattern_vector : std_logic_vector(TIMING_BITS - 1 downto 0);
  signal pattern_reset  : std_logic;
  signal drawn_active   : std_logic;
  signal drawn_h_sync   : std_logic;
  signal drawn_v_sync   : std_logic;
  signal drawn_pixel    : std_logic_vector(23 downto 0);
  signal video_active   : std_logic                             := '0';
  signal video_h_sync   : std_logic                             := '0';
  signal video_v_sync   : std_logic                             := '0';
  signal video_pixel    : std_logic_vector(23 downto 0)         := (others => '0');
  signal bare_active    : std_logic;
  signal bare_h_sync    : std_logic;
  signal bare_v_sync    : std_logic;
  signal bare_pixel     : std_logic_vector(23 downto 0);
  signal bare_slice     : std_logic_vector(7 downto 0);
  signal bare_shown     : std_logic_vector(1 downto 0);
  signal bare_raw       : std_logic;
  signal shown_active   : std_logic;
  signal shown_h_sync   : std_logic;
  signal shown_v_sync   : std_logic;
  signal shown_pixel    : std_logic_vector(23 downto 0);
  signal following      : std_logic;
  signal unsupported    : std_logic;
  signal video_timing   : timing_vector_t;
  signal timing         : timing_t;
  signal video_errors   : std_logic_vector(3 downto 0);
  signal errors_now     : std_logic_vector(ERRORS - 1 downto 0) := (others => '0');
  signal clear_seen     : std_logic                             := '0';
  signal clear          : std_logic;
  signal load_seen      : std_logic                             := '0';
  signal load_write     : std_logic;
  signal word_errors    : std_logic_vector(WORD_ERROR_BITS * CHANNELS - 1 downto 0);
  signal packet_errors  : std_logic_vector(PACKET_ERROR_BITS - 1 downto 0);
  signal sum_errors     : std_logic_vector(PACKET_ERROR_BITS - 1 downto 0);

begin

  stop <= not run;

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

  receiver : entity work.tmds_receiver
    generic map (
      ALIGN_TIMEOUT => ALIGN_TIMEOUT
    )
    port map (
      clk          => clk,
      reset        => reset,
      bits         => in_bits,
      active       => link_active,
      h_sync       => link_h_sync,
      v_sync       => link_v_sync,
      pixel        => link_pixel,
      aligned      => link_aligned,
      locked       => link_locked,
      errors       => link_errors,
      hdmi         => hdmi,
      informed     => informed,
      colour       => colour,
      limited      => limited,
      bt601        => bt601,
      format_code  => format_code,
      packet_error => packet_error,
      sum_error    => sum_error
    );

  convert : entity work.full_range_rgb
    port map (
      clk        => clk,
      colour     => colour,
      limited    => limited,
      bt601      => bt601,
      in_active  => link_active,
      in_h_sync  => link_h_sync,
      in_v_sync  => link_v_sync,
      in_pixel   => link_pixel,
      out_active => rgb_active,
      out_h_sync => rgb_h_sync,
      out_v_sync => rgb_v_sync,
      out_pixel  => rgb_pixel
    );

  pattern_vector <= to_vector(PATTERN_TIMING);
  pattern_reset  <= reset or not settings.show_pattern;

  test_pattern : entity work.light_field_pattern
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      LEFT_SHIFT       => LEFT_SHIFT,
      MIDDLE_SHIFT     => MIDDLE_SHIFT,
      RIGHT_SHIFT      => RIGHT_SHIFT,
      MIDDLE_BEGIN     => PATTERN_H_ACTIVE / 3,
      RIGHT_BEGIN      => 2 * PATTERN_H_ACTIVE / 3
    )
    port map (
      clk    => clk,
      reset  => pattern_reset,
      timing => pattern_vector,
      active => drawn_active,
      h_sync => drawn_h_sync,
      v_sync => drawn_v_sync,
      pixel  => drawn_pixel
    );

  choose_source : process (clk) is
  begin

    if rising_edge(clk) then
      if settings.show_pattern = '1' then
        video_active <= drawn_active;
        video_h_sync <= drawn_h_sync;
        video_v_sync <= drawn_v_sync;
        video_pixel  <= drawn_pixel;
      else
        video_active <= rgb_active;
        video_h_sync <= rgb_h_sync;
        video_v_sync <= rgb_v_sync;
        video_pixel  <= rgb_pixel;
      end if;
      if reset = '1' then
        video_active <= '0';
      end if;
    end if;

  end process choose_source;

  video : entity work.refocus_video
    generic map (
      MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
      SHIFTS              => SHIFTS,
      INTERPOLATION_ORDER => INTERPOLATION_ORDER,
      HOLD                => HOLD,
      MAX_COLUMNS         => choose(WITH_SENSOR, RASTER_COLUMNS, MAX_COLUMNS),
      EXACT               => EXACT,
      FRACTION_BITS       => FRACTION_BITS,
      GUARD_BITS          => GUARD_BITS,
      BROADCAST_TAPS      => BROADCAST_TAPS,
      ENGINE              => ENGINE,
      OUTPUTS             => OUTPUTS,
      RADIUS              => SHARPNESS_RADIUS,
      CONFIDENCE          => CONFIDENCE,
      VOTE_RADIUS         => VOTE_RADIUS,
      COLOURS             => COLOURS,
      CHANNELS            => PIXEL_CHANNELS,
      SENSOR              => WITH_SENSOR,
      RAW_COLUMNS         => SENSOR_COLUMNS,
      RAW_ROWS            => SENSOR_ROWS,
      MOSAIC              => MOSAIC,
      RED_PLACE           => RED_PLACE,
      HEXAGONAL           => HEXAGONAL,
      LINES               => RING_LINES,
      LENSES              => LENSES,
      MOVES               => MOVES,
      GAINS               => GAINS
    )
    port map (
      clk          => clk,
      reset        => reset,
      pass_through => settings.pass_through,
      slice        => settings.slice,
      sweep        => settings.sweep,
      sweep_frames => settings.sweep_frames,
      shown        => settings.shown,
      load_write   => load_write,
      load_kind    => settings.load_word(61 downto 60),
      load_address => settings.load_word(59 downto 40),
      load_data    => settings.load_word(39 downto 0),
      in_active    => video_active,
      in_h_sync    => video_h_sync,
      in_v_sync    => video_v_sync,
      in_pixel     => video_pixel,
      out_active   => bare_active,
      out_h_sync   => bare_h_sync,
      out_v_sync   => bare_v_sync,
      out_pixel    => bare_pixel,
      out_slice    => bare_slice,
      out_shown    => bare_shown,
      out_raw      => bare_raw,
      following    => following,
      unsupported  => unsupported,
      timing       => video_timing,
      errors       => video_errors
    );

  no_text : if not WITH_TEXT generate
    shown_active <= bare_active;
    shown_h_sync <= bare_h_sync;
    shown_v_sync <= bare_v_sync;
    shown_pixel  <= bare_pixel;
  end generate no_text;

  text : if WITH_TEXT generate

    constant KINDS : kinds_t := output_kinds(OUTPUTS);

    signal show   : std_logic;
    signal bottom : std_logic;
    signal kind   : std_logic_vector(1 downto 0);
    signal rows   : std_logic_vector(11 downto 0);

  begin

    show   <= settings.text_place(0) or settings.text_place(1);
    bottom <= settings.text_place(1);
    kind   <= std_logic_vector(to_unsigned(KINDS(to_integer(unsigned(bare_shown))), 2));
    rows   <= std_logic_vector(timing.rows);

    overlay : entity work.text_overlay
      generic map (
        SLICES        => SLICES,
        FONT          => FONT,
        TEXTS         => TEXTS,
        TEXT_COLUMNS  => TEXT_COLUMNS,
        LABELS        => LABELS,
        LABEL_COLUMNS => LABEL_COLUMNS,
        COLOURS       => COLOURS
      )
      port map (
        clk        => clk,
        reset      => reset,
        show       => show,
        bottom     => bottom,
        rows       => rows,
        slice      => bare_slice,
        kind       => kind,
        raw        => bare_raw,
        errors     => errors_now,
        in_active  => bare_active,
        in_h_sync  => bare_h_sync,
        in_v_sync  => bare_v_sync,
        in_pixel   => bare_pixel,
        out_active => shown_active,
        out_h_sync => shown_h_sync,
        out_v_sync => shown_v_sync,
        out_pixel  => shown_pixel
      );

  end generate text;

  clear      <= clear_seen xor settings.clear_toggle;
  load_write <= load_seen xor settings.load_toggle;

  collect_errors : process (clk) is
  begin

    if rising_edge(clk) then
      clear_seen <= settings.clear_toggle;
      load_seen  <= settings.load_toggle;
      if clear = '1' then
        errors_now <= (others => '0');
      elsif reset = '0' then
        errors_now(3 downto 0) <= errors_now(3 downto 0) or video_errors;
        if following = '1' and link_errors /= "000" and settings.show_pattern = '0' then
          errors_now(WRONG_WORD) <= '1';
        end if;
      end if;
    end if;

  end process collect_errors;

  count_words : for c in 0 to CHANNELS - 1 generate

    words : entity work.event_counter
      generic map (
        WIDTH => WORD_ERROR_BITS
      )
      port map (
        clk   => clk,
        clear => clear,
        add   => link_errors(c),
        count => word_errors(WORD_ERROR_BITS * (c + 1) - 1 downto WORD_ERROR_BITS * c)
      );

  end generate count_words;

  count_packets : entity work.event_counter
    generic map (
      WIDTH => PACKET_ERROR_BITS
    )
    port map (
      clk   => clk,
      clear => clear,
      add   => packet_error,
      count => packet_errors
    );

  count_sums : entity work.event_counter
    generic map (
      WIDTH => PACKET_ERROR_BITS
    )
    port map (
      clk   => clk,
      clear => clear,
      add   => sum_error,
      count => sum_errors
    );

  transmitter : entity work.tmds_transmitter
    port map (
      clk      => clk,
      reset    => reset,
      active   => shown_active,
      h_sync   => shown_h_sync,
      v_sync   => shown_v_sync,
      pixel    => shown_pixel,
      tx_clk   => tx_clk,
      tx_reset => tx_reset,
      tx_words => out_words
    );

  timing <= to_timing(video_timing);

  state <=
  (
    aligned       => link_aligned,
    following     => following,
    unsupported   => unsupported,
    errors        => errors_now,
    word_errors   => word_errors,
    hdmi          => hdmi,
    informed      => informed,
    colour        => colour,
    limited       => limited,
    format_code   => format_code,
    packet_errors => packet_errors,
    sum_errors    => sum_errors,
    columns       => timing.columns,
    rows          => timing.rows,
    h_sync        => timing.h_sync_level,
    v_sync        => timing.v_sync_level,
    v_sync_now    => video_v_sync,
    load_seen     => load_seen
  );

end architecture rtl;
