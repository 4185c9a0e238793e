-- SPDX-License-Identifier: Apache-2.0
-- Control of a board with HDMI input and output: clocks, buttons, serial port, EDID, LEDs.
--
-- The entity runs from the board's oscillator, so it works without an input clock. Settings and reports cross to and
-- from the pixel clock here.
--
-- LEDs: 0 TMDS clock in range, 1 following (timing understood, picture refocused), 2 to 4 channels
-- aligned, 5 error since the last clearing, 6 and 7 slice.
--
-- Latency: about 10 clocks for a setting.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.count_pkg.all;
use work.hdmi_pkg.all;
use work.math_pkg.all;
use work.number_pkg.all;
use work.picture_pkg.all;
use work.resample_pkg.all;
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
    -- 0: pixel clocks from 24 MHz on, with two settings of the PLLs. Otherwise 82 to 158 MHz divided by this number, a
    -- little inside the range of a fixed PLL (80 to 160 MHz), and only such modes are offered. The limit is 74.3 MHz,
    -- with 3 50 MHz: 500 Mb/s a lane, see plenofir.fpga.hdmi.modes.
    CLOCK_RANGE : natural range 0 to 4 := 0;
    -- Frequency of clk in MHz.
    CONTROL_MHZ : positive range 5 to 1000 := 100;
    -- Times in 10 ns, for clock_meter, link_supervisor, debouncer, uart_receiver and monitor_edid; DATA_PATIENCE counts
    -- windows of the meter. The PLLs are in reset for a fiftieth of LOCK_TIMEOUT; hot plug is low for 20 times
    -- BUTTON_STABLE.
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
    -- The clock of the HDMI input, to be measured; and the pixel clock.
    tmds_clk  : in    std_logic;
    pixel_clk : in    std_logic;
    -- State of the clocks, and orders to them.
    clocks : in    clocks_state_t;
    order  : out   clocks_order_t;
    -- Display data channels of the input and of the output. The input's clock line is never pulled low, because the
    -- memory is as fast as its reader.
    in_ddc     : in    ddc_t;
    in_sda_low : out   std_logic;
    -- Hot plug detect of the input: low for a while after a reset, so that a connected source reads the EDID again.
    in_hot_plug : out   std_logic;
    out_ddc     : in    ddc_t;
    out_ddc_low : out   ddc_t;
    -- Serial port, buttons and switches, LEDs.
    uart_rx : in    std_logic;
    uart_tx : out   std_logic;
    panel   : in    panel_t;
    led     : out   std_logic_vector(7 downto 0);
    -- Reports of the receiver's delay lines, in pixel_clk or a multiple of it.
    lanes : in    lanes_t;
    -- Settings for the video path and its reports, in pixel_clk.
    settings : out   video_settings_t;
    state    : in    video_state_t
  );
end entity hdmi_control;

architecture rtl of hdmi_control is

  -- TMDS clocks that are accepted, in units of 100 kHz; constraints/atlys.ucf has the period of the fastest one.
  constant ANY_SLOWEST : positive := 240;
  constant ANY_FASTEST : positive := 743;
  constant SLOWEST     : positive := choose(CLOCK_RANGE = 0, ANY_SLOWEST, 820 / larger(CLOCK_RANGE, 1));
  constant FASTEST     : positive := choose(CLOCK_RANGE < 3, ANY_FASTEST, choose(CLOCK_RANGE = 3, 500, 395));

  -- Time that a line of the display data channel must be stable, in 10 ns.
  constant LINE_FILTER : positive := 20;
  -- Further time in 10 ns by which the data line is delayed, so that a change at the same time as the clock line's is
  -- seen behind it (i2c_lines).
  constant LINE_HOLD : positive := 32;
  -- A source that is silent for this time in the middle of a bit has gone away (SMBus 3.1: 25 to 35 ms). A monitor may
  -- hold the clock line low for as long.
  constant LINE_LET_GO : positive := 3000000;

  -- Clocks of a time, which is a whole number of clocks. The division comes first, because 2 s in 10 ns times the
  -- frequency exceeds an integer.
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

  -- The measured TMDS clock.
  signal rate         : unsigned(11 downto 0) := (others => '0');
  signal rate_updated : std_logic;
  -- The clocks' state: levels from any clock, and the same in clk.
  signal lock_levels : std_logic_vector(2 downto 0);
  signal locked_here : std_logic_vector(2 downto 0);
  signal clocks_here : clocks_state_t;
  signal order_now   : clocks_order_t;
  signal present     : std_logic;
  signal restarted   : std_logic;
  signal restarts    : std_logic_vector(RARE_BITS - 1 downto 0) := (others => '0');
  signal lock_failed : std_logic;
  signal lost_locks  : std_logic_vector(RARE_BITS - 1 downto 0) := (others => '0');

  -- Settings from the panel.
  signal choice         : picture_choice_t;
  signal pattern        : std_logic;
  signal text_place     : std_logic_vector(1 downto 0);
  signal polarity       : polarity_t;
  signal clear          : std_logic;
  signal clear_toggle   : std_logic := '0';
  signal clear_or_reset : std_logic;
  signal settings_here  : video_settings_t;
  signal port_busy      : std_logic;
  signal port_write     : std_logic;
  signal port_word      : load_word_t;

  -- Reports.
  signal state_here    : video_state_t;
  signal lanes_here    : lanes_t;
  signal tracking_here : std_logic_vector(CHANNELS - 1 downto 0);
  signal hung_counts   : std_logic_vector(RARE_BITS * CHANNELS - 1 downto 0);
  signal aligned       : std_logic_vector(CHANNELS - 1 downto 0);
  signal inverted      : std_logic_vector(CHANNELS - 1 downto 0);
  signal data_here     : std_logic;
  signal following     : std_logic;
  signal unsupported   : std_logic;
  signal varying       : std_logic;
  signal frame_rate    : std_logic_vector(14 downto 0);
  signal edid_byte     : std_logic;
  signal edid_bytes    : std_logic_vector(14 downto 0) := (others => '0');
  signal monitor       : monitor_t;
  signal status        : status_t;
  signal status_values : status_vector_t;

begin

  --------------------------------------------------------------------------------------------------
  -- Clocks.

  -- The TMDS clock is measured all the time, also while the board's own clock is used.
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

  -- Each level crosses by itself: the supervisor waits for one after the other, so they need not arrive together.
  lock_levels <= clocks.own_ready & clocks.transmit_locked & clocks.receive_locked;

  lock_crossing : entity work.synchroniser
    generic map (
      WIDTH => 3
    )
    port map (
      clk         => clk,
      level       => lock_levels,
      synchronous => locked_here
    );

  -- `configured` is in clk already, because the control writes the settings itself.
  clocks_here <= (locked_here(2), clocks.configured, locked_here(0), locked_here(1));

  -- The supervisor decides about the clocks only; what is shown follows from its orders.
  supervisor : entity work.link_supervisor
    generic map (
      COUNTS_10_MHZ => METER_WINDOW / 160,
      TIMEOUT       => clocks_of(LOCK_TIMEOUT),
      HOLD          => larger(clocks_of(LOCK_TIMEOUT) / 50, 16),
      PATIENCE      => DATA_PATIENCE,
      SLOWEST       => SLOWEST,
      FASTEST       => FASTEST
    )
    port map (
      clk          => clk,
      reset        => reset,
      want_own     => pattern,
      clocks       => clocks_here,
      order        => order_now,
      rate         => rate,
      rate_updated => rate_updated,
      data         => data_here,
      restarted    => restarted,
      lock_failed  => lock_failed,
      present      => present
    );

  order <= order_now;

  --------------------------------------------------------------------------------------------------
  -- Panel and EDID.

  -- Settings come from the board or a host; board_control collects both.
  settings_of_panel : entity work.board_control
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
      clk           => clk,
      reset         => reset,
      line_in       => uart_rx,
      line_out      => uart_tx,
      panel         => panel,
      status_values => status_values,
      choice        => choice,
      pattern       => pattern,
      text_place    => text_place,
      polarity      => polarity,
      clear_errors  => clear,
      load_busy     => port_busy,
      load_write    => port_write,
      load_word     => port_word
    );

  -- The EDID is served from the start, without a pixel clock: a source reads it before it sends anything.
  edid : entity work.i2c_rom_slave
    generic map (
      FILTER      => clocks_of(LINE_FILTER),
      HOLD        => clocks_of(LINE_HOLD),
      LET_GO      => clocks_of(LINE_LET_GO),
      MAX_COLUMNS => MAX_COLUMNS,
      CLOCK_RANGE => CLOCK_RANGE
    )
    port map (
      clk       => clk,
      reset     => reset,
      scl       => in_ddc.scl,
      sda       => in_ddc.sda,
      sda_low   => in_sda_low,
      read_byte => edid_byte
    );

  announce : entity work.hot_plug
    generic map (
      PAUSE => 20 * clocks_of(BUTTON_STABLE)
    )
    port map (
      clk     => clk,
      reset   => reset,
      present => in_hot_plug
    );

  ask_monitor : entity work.monitor_edid
    generic map (
      QUARTER => clocks_of(DDC_QUARTER),
      STRETCH => clocks_of(LINE_LET_GO),
      PAUSE   => clocks_of(DDC_PAUSE)
    )
    port map (
      clk           => clk,
      reset         => reset,
      scl           => out_ddc.scl,
      sda           => out_ddc.sda,
      scl_low       => out_ddc_low.scl,
      sda_low       => out_ddc_low.sda,
      shown_columns => state_here.columns,
      shown_rows    => state_here.rows,
      shown_rate    => frame_rate,
      monitor       => monitor
    );

  -- Counters here are cleared directly, those in the pixel clock by the toggle.
  clear_or_reset <= clear or reset;

  follow_clear : process (clk) is
  begin

    if rising_edge(clk) then
      -- A pulse could be lost on the way into the pixel clock; a change of level cannot.
      if clear = '1' then
        clear_toggle <= not clear_toggle;
      end if;
      edid_bytes <= counted(edid_bytes, edid_byte, clear_or_reset);
      restarts   <= counted(restarts, restarted, clear_or_reset);
      lost_locks <= counted(lost_locks, lock_failed, clear_or_reset);
    end if;

  end process follow_clear;

  --------------------------------------------------------------------------------------------------
  -- Towards the video path.

  -- The supervisor decides which clock runs, and the picture follows: the input is shown until the pattern's clock
  -- runs. settings_crossing adds the words for a sensor.
  settings_here <=
  (
    choice       => choice,
    text_place   => text_place,
    show_pattern => order_now.use_own,
    polarity     => polarity,
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
      lanes       => lanes,
      clk         => clk,
      state_here  => state_here,
      lanes_here  => lanes_here,
      clear       => clear_or_reset,
      hung_counts => hung_counts
    );

  -- The reports are registers in the pixel clock: if it has stopped, they keep their last values, which mean nothing.
  tracking_here <= lanes_here.tracking when order_now.run = '1' else
                   (others => '0');
  aligned       <= state_here.aligned when order_now.run = '1' else
                   (others => '0');
  inverted      <= state_here.inverted when order_now.run = '1' else
                   (others => '0');
  -- Whether every channel samples well and finds its words, for the supervisor.
  data_here   <= '1' when (tracking_here and aligned) = "111" else
                 '0';
  following   <= state_here.following and order_now.run;
  unsupported <= state_here.unsupported and order_now.run;
  varying     <= state_here.varying and order_now.run;

  -- The frame rate of the source, from its vertical sync; compared with the monitor's modes.
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

  --------------------------------------------------------------------------------------------------
  -- Status.

  -- The names are those of the status line, in its order. Reports of a link that does not run are masked where they
  -- would mislead; sizes and counters stay, to be read after a loss. In a field of several numbers the first is in the
  -- low bits, so at the right.
  status <=
  (
    slice         => number(choice.slice),
    SLICES        => std_logic_vector(to_unsigned(SLICES, 16)),
    sweep         => number(choice.sweep_frames),
    output        => number(choice.shown),
    OUTPUTS       => std_logic_vector(to_unsigned(OUTPUTS'length, 16)),
    text          => number(text_place),
    pass          => flag(choice.pass_through),
    pattern       => flag(pattern),
    clock         => number(std_logic_vector(rate)),
    present       => flag(present),
    running       => flag(order_now.run),
    restarts      => number(restarts),
    lost_locks    => number(lost_locks),
    tracking      => number(tracking_here),
    taps          => numbers(lanes_here.taps, true),
    hung          => numbers(hung_counts),
    aligned       => number(aligned),
    polarity      => number(polarity),
    inverted      => number(inverted),
    word_errors   => numbers(state_here.word_errors),
    hdmi          => flag(state_here.hdmi and order_now.run),
    avi           => flag(state_here.info.informed and order_now.run),
    colour        => number(state_here.info.colour),
    limited       => flag(state_here.info.limited),
    vic           => number(state_here.info.format_code),
    packet_errors => number(state_here.sum_errors) & number(state_here.packet_errors),
    following     => flag(following),
    unsupported   => flag(unsupported),
    varying       => flag(varying),
    columns       => number(std_logic_vector(state_here.columns)),
    rows          => number(std_logic_vector(state_here.rows)),
    rate          => number(frame_rate),
    hsync         => flag(state_here.h_sync),
    vsync         => flag(state_here.v_sync),
    marks         => number(state_here.marks),
    errors        => number(state_here.errors),
    edid          => number(edid_bytes),
    monitor       => number(monitor.state),
    monitor_mode  => number(monitor.rate) & number(monitor.rows) & number(monitor.columns),
    monitor_ok    => flag(monitor.offered)
  );

  status_values <= to_vector(status);

  show : process (clk) is
  begin

    if rising_edge(clk) then
      led(0)          <= present;
      led(1)          <= following;
      led(4 downto 2) <= aligned;
      led(5)          <= '0';
      -- One LED shows all errors; the serial port tells which.
      if state_here.errors /= "00000" then
        led(5) <= '1';
      end if;
      led(7 downto 6) <= choice.slice(1 downto 0);
    end if;

  end process show;

end architecture rtl;
