-- SPDX-License-Identifier: Apache-2.0
-- Control of a board with HDMI input and output: clocks, buttons, serial port, EDID, LEDs.
--
-- Runs from the board's oscillator, so it works without an input clock. Settings and reports cross to and from the
-- pixel clock here.
--
-- LEDs: 0 TMDS clock in range, 1 following (timing understood, picture refocused), 2 to 4 channels
-- aligned, 5 error since the last clearing, 6 and 7 slice.
--
-- Latency: a setting takes about 10 clocks. Throughput: not applicable.
-- Equation: none; see link_supervisor, board_control, i2c_rom_slave and monitor_edid.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.hdmi_pkg.all;
use work.math_pkg.all;
use work.number_pkg.all;
use work.screen_pkg.all;
use work.sensor_pkg.all;
use work.status_pkg.all;
use work.tmds_pkg.all;

entity hdmi_control is
  generic (
    -- Number of slices of the refocuser.
    SLICES : positive range 1 to 256;
    -- Longest line in pixels: longer modes are not offered.
    MAX_COLUMNS : positive range 1 to 8192;
    -- 0: pixel clocks from 24 MHz on with two settings of the PLLs. Otherwise from 82 to 158 MHz divided by it, less
    -- than the ends of what a fixed PLL takes (80 and 160), and only such modes are offered. At most 74.3 MHz.
    CLOCK_RANGE : natural range 0 to 4 := 0;
    -- Frequency of clk.
    CONTROL_MHZ : positive range 5 to 1000 := 100;
    -- Times in 10 ns, see clock_meter, link_supervisor, debouncer, uart_receiver and
    -- monitor_edid; DATA_PATIENCE is in windows of the meter.
    METER_WINDOW  : positive range 1 to 200000000;
    LOCK_TIMEOUT  : positive range 1 to 200000000;
    DATA_PATIENCE : positive;
    BUTTON_STABLE : positive range 1 to 200000000;
    BIT_TIME      : positive range 1 to 200000000;
    DDC_QUARTER   : positive range 1 to 200000000;
    DDC_PAUSE     : positive range 1 to 200000000;
    -- Frames for each slice of a sweep by the switch.
    SWITCH_FRAMES : positive range 1 to 255
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The clock of the HDMI input, to be measured, and the one that the pixels have.
    tmds_clk  : in    std_logic;
    pixel_clk : in    std_logic;
    -- The board's own pixel clock runs, the PLLs have locked; from any clock.
    own_ready       : in    std_logic;
    receive_locked  : in    std_logic;
    transmit_locked : in    std_logic;
    -- Take the board's own pixel clock.
    use_own : out   std_logic;
    -- Write the settings of both PLLs (high: those for 40 to 100 MHz); configured: they are written.
    configure    : out   std_logic;
    setting_high : out   std_logic;
    configured   : in    std_logic;
    -- Resets of the PLLs, and release of all that their clocks drive.
    receive_reset  : out   std_logic;
    transmit_reset : out   std_logic;
    run            : out   std_logic;
    -- Display data channels of the input and of the output; low: pull the line low (open drain).
    in_scl      : in    std_logic;
    in_sda      : in    std_logic;
    in_sda_low  : out   std_logic;
    out_scl     : in    std_logic;
    out_sda     : in    std_logic;
    out_scl_low : out   std_logic;
    out_sda_low : out   std_logic;
    -- Serial port, buttons, switches and LEDs.
    uart_rx        : in    std_logic;
    uart_tx        : out   std_logic;
    button_up      : in    std_logic;
    button_down    : in    std_logic;
    button_clear   : in    std_logic;
    switch_pattern : in    std_logic;
    switch_pass    : in    std_logic;
    switch_sweep   : in    std_logic;
    led            : out   std_logic_vector(7 downto 0);
    -- A button that steps through the outputs, switches that hide the text or put it at the bottom; a board may lack
    -- them.
    -- vsg_off port_012
    button_output : in    std_logic := '0';
    switch_hide   : in    std_logic := '0';
    switch_bottom : in    std_logic := '0';
    -- vsg_on port_012
    -- From the delay lines of the receiver, see phase_detector_control: in pixel_clk or a multiple of it that
    -- is made with it.
    tracking    : in    std_logic_vector(CHANNELS - 1 downto 0);
    taps        : in    std_logic_vector(TAP_BITS * CHANNELS - 1 downto 0);
    hung_toggle : in    std_logic_vector(CHANNELS - 1 downto 0);
    -- To and from the video path, in pixel_clk.
    settings : out   video_settings_t;
    state    : in    video_state_t
  );
end entity hdmi_control;

architecture rtl of hdmi_control is

  -- TMDS clocks that are accepted, in units of 100 kHz; constraints/atlys.ucf has the fastest one's period.
  constant ANY_SLOWEST : positive := 240;
  constant ANY_FASTEST : positive := 743;
  constant SLOWEST     : positive := choose(CLOCK_RANGE = 0, ANY_SLOWEST, 820 / larger(CLOCK_RANGE, 1));
  constant FASTEST     : positive := choose(CLOCK_RANGE < 3, ANY_FASTEST, 1580 / larger(CLOCK_RANGE, 1));

  -- Time that a line of the display data channel must be stable, in 10 ns.
  constant LINE_FILTER : positive := 20;

  -- Clocks of a time, which is a whole number of them.
  function clocks_of (
    hundredths_us : positive
  ) return natural is
  begin

    return hundredths_us / 100 * CONTROL_MHZ + hundredths_us mod 100 * CONTROL_MHZ / 100;

  end function clocks_of;

  constant NO_METER  : boolean := not takes(METER_WINDOW >= 160 and clocks_of(METER_WINDOW) >= 160,
                                            "hdmi_control: METER_WINDOW is below 1.6 us or 160 clocks");
  constant NO_SERIAL : boolean := not takes(clocks_of(BIT_TIME) >= 4 and clocks_of(BIT_TIME) < 65536,
                                            "hdmi_control: BIT_TIME is not 4 to 65535 clocks of CONTROL_MHZ");
  constant NO_TIMES  : boolean := not takes(clocks_of(LOCK_TIMEOUT) > 0 and clocks_of(BUTTON_STABLE) > 0 and
                                            clocks_of(DDC_PAUSE) > 0,
                                            "hdmi_control: LOCK_TIMEOUT, BUTTON_STABLE or DDC_PAUSE is no clock");
  constant NO_DDC    : boolean := not takes(clocks_of(DDC_QUARTER) >= 3 and clocks_of(DDC_QUARTER) < 65536,
                                            "hdmi_control: DDC_QUARTER is not 3 to 65535 clocks of CONTROL_MHZ");

  signal rate            : unsigned(11 downto 0) := (others => '0');
  signal rate_updated    : std_logic;
  signal lock_levels     : std_logic_vector(2 downto 0);
  signal locked_here     : std_logic_vector(2 downto 0);
  signal own_level       : std_logic;
  signal running         : std_logic;
  signal present         : std_logic;
  signal slice           : std_logic_vector(7 downto 0);
  signal sweep           : std_logic;
  signal sweep_frames    : std_logic_vector(7 downto 0);
  signal pass_through    : std_logic;
  signal pattern         : std_logic;
  signal clear_command   : std_logic;
  signal clear_button    : std_logic;
  signal clear_toggle    : std_logic             := '0';
  signal edid_byte       : std_logic;
  signal edid_bytes      : std_logic_vector(14 downto 0);
  signal clear           : std_logic;
  signal clear_or_reset  : std_logic;
  signal restarted       : std_logic;
  signal restarts        : std_logic_vector(RARE_BITS - 1 downto 0);
  signal state_here      : video_state_t;
  signal taps_here       : std_logic_vector(TAP_BITS * CHANNELS - 1 downto 0);
  signal tracking_here   : std_logic_vector(CHANNELS - 1 downto 0);
  signal tracks_last     : std_logic_vector(CHANNELS - 1 downto 0);
  signal hung_counts     : std_logic_vector(RARE_BITS * CHANNELS - 1 downto 0);
  signal aligned         : std_logic_vector(CHANNELS - 1 downto 0);
  signal data_here       : std_logic;
  signal following       : std_logic;
  signal unsupported     : std_logic;
  signal frame_rate      : std_logic_vector(14 downto 0);
  signal monitor_state   : std_logic_vector(1 downto 0);
  signal monitor_columns : std_logic_vector(11 downto 0);
  signal monitor_rows    : std_logic_vector(11 downto 0);
  signal monitor_rate    : std_logic_vector(11 downto 0);
  signal monitor_ok      : std_logic;
  signal status          : status_t;
  signal status_values   : status_vector_t;
  signal picture_place   : std_logic_vector(1 downto 0);
  signal text_place      : std_logic_vector(1 downto 0);
  signal settings_here   : video_settings_t;
  signal port_busy       : std_logic;
  signal port_write      : std_logic;
  signal port_word       : std_logic_vector(61 downto 0);

begin

  --------------------------------------------------------------------------------------------------
  -- Clocks.

  meter : entity work.clock_meter
    generic map (
      WINDOW => clocks_of(METER_WINDOW)
    )
    port map (
      clk          => clk,
      measured_clk => tmds_clk,
      count        => rate,
      updated      => rate_updated
    );

  lock_levels <= own_ready & transmit_locked & receive_locked;

  lock_crossing : entity work.synchroniser
    generic map (
      WIDTH => 3
    )
    port map (
      clk         => clk,
      level       => lock_levels,
      synchronous => locked_here
    );

  supervisor : entity work.link_supervisor
    generic map (
      COUNTS_10_MHZ => METER_WINDOW / 160,
      TIMEOUT       => clocks_of(LOCK_TIMEOUT),
      PATIENCE      => DATA_PATIENCE,
      SLOWEST       => SLOWEST,
      FASTEST       => FASTEST
    )
    port map (
      clk             => clk,
      reset           => reset,
      want_own        => pattern,
      own_ready       => locked_here(2),
      rate            => rate,
      rate_updated    => rate_updated,
      use_own         => own_level,
      configure       => configure,
      high            => setting_high,
      configured      => configured,
      data            => data_here,
      receive_reset   => receive_reset,
      receive_locked  => locked_here(0),
      transmit_reset  => transmit_reset,
      transmit_locked => locked_here(1),
      run             => running,
      restarted       => restarted,
      present         => present
    );

  use_own <= own_level;
  run     <= running;

  --------------------------------------------------------------------------------------------------
  -- Panel, EDID.

  panel : entity work.board_control
    generic map (
      SLICES        => SLICES,
      OUTPUTS       => OUTPUTS'length,
      WITH_TEXT     => WITH_TEXT,
      WITH_LOAD     => WITH_SENSOR,
      DESCRIPTION   => RESAMPLER,
      STATUS        => STATUS_LINE,
      FIELDS        => STATUS_NUMBERS,
      BIT_CLOCKS    => clocks_of(BIT_TIME),
      STABLE        => clocks_of(BUTTON_STABLE),
      SWITCH_FRAMES => SWITCH_FRAMES
    )
    port map (
      clk            => clk,
      reset          => reset,
      line_in        => uart_rx,
      line_out       => uart_tx,
      button_up      => button_up,
      button_down    => button_down,
      switch_pattern => switch_pattern,
      switch_pass    => switch_pass,
      switch_sweep   => switch_sweep,
      button_output  => button_output,
      switch_hide    => switch_hide,
      switch_bottom  => switch_bottom,
      status_values  => status_values,
      slice          => slice,
      sweep          => sweep,
      sweep_frames   => sweep_frames,
      pass_through   => pass_through,
      pattern        => pattern,
      picture_place  => picture_place,
      text_place     => text_place,
      clear_errors   => clear_command,
      load_busy      => port_busy,
      load_write     => port_write,
      load_word      => port_word
    );

  debounce_clear : entity work.debouncer
    generic map (
      STABLE => clocks_of(BUTTON_STABLE)
    )
    port map (
      clk     => clk,
      contact => button_clear,
      level   => open,
      pressed => clear_button
    );

  edid : entity work.i2c_rom_slave
    generic map (
      FILTER      => clocks_of(LINE_FILTER),
      MAX_COLUMNS => MAX_COLUMNS,
      CLOCK_RANGE => CLOCK_RANGE
    )
    port map (
      clk       => clk,
      reset     => reset,
      scl       => in_scl,
      sda       => in_sda,
      sda_low   => in_sda_low,
      read_byte => edid_byte
    );

  monitor : entity work.monitor_edid
    generic map (
      QUARTER => clocks_of(DDC_QUARTER),
      PAUSE   => clocks_of(DDC_PAUSE)
    )
    port map (
      clk           => clk,
      reset         => reset,
      scl           => out_scl,
      sda           => out_sda,
      scl_low       => out_scl_low,
      sda_low       => out_sda_low,
      shown_columns => state_here.columns,
      shown_rows    => state_here.rows,
      shown_rate    => frame_rate,
      state         => monitor_state,
      columns       => monitor_columns,
      rows          => monitor_rows,
      rate          => monitor_rate,
      offered       => monitor_ok
    );

  clear <= clear_command or clear_button;

  pass_clear : process (clk) is
  begin

    if rising_edge(clk) then
      if clear = '1' then
        clear_toggle <= not clear_toggle;
      end if;
    end if;

  end process pass_clear;

  clear_or_reset <= clear or reset;

  count_edid : entity work.event_counter
    generic map (
      WIDTH => 15
    )
    port map (
      clk   => clk,
      clear => clear_or_reset,
      add   => edid_byte,
      count => edid_bytes
    );

  --------------------------------------------------------------------------------------------------
  -- To the video path.

  settings_here <=
  (
    pass_through => pass_through,
    slice        => slice,
    sweep        => sweep,
    sweep_frames => sweep_frames,
    shown        => picture_place,
    text_place   => text_place,
    show_pattern => own_level,
    clear_toggle => clear_toggle,
    load_word    => (others => '0'),
    load_toggle  => '0'
  );

  settings_to_pixels : entity work.settings_crossing
    port map (
      clk        => clk,
      reset      => reset,
      settings   => settings_here,
      port_write => port_write,
      port_word  => port_word,
      port_busy  => port_busy,
      seen       => state_here.load_seen,
      pixel_clk  => pixel_clk,
      arrived    => settings
    );

  --------------------------------------------------------------------------------------------------
  -- From the video path.

  report_from_pixels : entity work.report_crossing
    port map (
      pixel_clk   => pixel_clk,
      state       => state,
      tracking    => tracking,
      taps        => taps,
      hung_toggle => hung_toggle,
      clk         => clk,
      state_here  => state_here,
      tracks_last => tracks_last,
      taps_here   => taps_here,
      clear       => clear_or_reset,
      hung_counts => hung_counts
    );

  -- Without a pixel clock the last levels mean nothing.
  tracking_here <= tracks_last when running = '1' else
                   (others => '0');
  aligned       <= state_here.aligned when running = '1' else
                   (others => '0');
  data_here     <= '1' when (tracking_here and aligned) = "111" else
                   '0';
  following     <= state_here.following and running;
  unsupported   <= state_here.unsupported and running;

  frames : entity work.frame_rate_meter
    generic map (
      TICK => clocks_of(METER_WINDOW) / 160
    )
    port map (
      clk    => clk,
      reset  => reset,
      v_sync => state_here.v_sync_now,
      rate   => frame_rate
    );

  count_restarts : entity work.event_counter
    generic map (
      WIDTH => RARE_BITS
    )
    port map (
      clk   => clk,
      clear => clear_or_reset,
      add   => restarted,
      count => restarts
    );

  --------------------------------------------------------------------------------------------------
  -- What is shown.

  status <=
  (
    slice         => number(slice),
    SLICES        => std_logic_vector(to_unsigned(SLICES, 16)),
    sweep         => number(sweep_frames),
    output        => number(picture_place),
    OUTPUTS       => std_logic_vector(to_unsigned(OUTPUTS'length, 16)),
    text          => number(text_place),
    pass          => flag(pass_through),
    pattern       => flag(pattern),
    clock         => number(std_logic_vector(rate)),
    present       => flag(present),
    running       => flag(running),
    restarts      => number(restarts),
    tracking      => number(tracking_here),
    taps          => numbers(taps_here, true),
    hung          => numbers(hung_counts),
    aligned       => number(aligned),
    word_errors   => numbers(state_here.word_errors),
    hdmi          => flag(state_here.hdmi and running),
    avi           => flag(state_here.informed and running),
    colour        => number(state_here.colour),
    limited       => flag(state_here.limited),
    vic           => number(state_here.format_code),
    packet_errors => number(state_here.sum_errors) & number(state_here.packet_errors),
    following     => flag(following),
    unsupported   => flag(unsupported),
    columns       => number(std_logic_vector(state_here.columns)),
    rows          => number(std_logic_vector(state_here.rows)),
    rate          => number(frame_rate),
    hsync         => flag(state_here.h_sync),
    vsync         => flag(state_here.v_sync),
    errors        => number(state_here.errors),
    edid          => number(edid_bytes),
    monitor       => number(monitor_state),
    monitor_mode  => number(monitor_rate) & number(monitor_rows) & number(monitor_columns),
    monitor_ok    => flag(monitor_ok)
  );

  status_values <= to_vector(status);

  show : process (clk) is
  begin

    if rising_edge(clk) then
      led(0)          <= present;
      led(1)          <= following;
      led(4 downto 2) <= aligned;
      led(5)          <= '0';
      if state_here.errors /= "00000" then
        led(5) <= '1';
      end if;
      led(7 downto 6) <= slice(1 downto 0);
    end if;

  end process show;

end architecture rtl;
