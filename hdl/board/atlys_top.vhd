-- Digilent Atlys (XC6SLX45): HDMI in on J3, refocused HDMI out on J2.
--
-- Clocks: clk_100 runs the control. The pixel clock is the TMDS clock of J3, or for the test pattern
-- one made on the board; a PLL makes it and its multiples for the receiver and the video path, a second
-- PLL, behind it, those of the transmitter. The domains: control (clk_100), pixels (receiver, video,
-- refocuser), receiver's halves, transmitter's words and halves; crossings are synchroniser,
-- bus_crossing, reset_bridge, elastic_buffer and the gearboxes.
--
-- LEDs: 0 TMDS clock in range, 1 following (timing understood, picture refocused), 2 to 4 channels
-- aligned, 5 error since the last clearing, 6 and 7 slice.
--
-- Latency: see refocus_video, and about 40 pixels of the link. Throughput: one pixel each clock.
-- Ports: pins of the board, see constraints/atlys.ucf; in_*: J3, out_*: J2.
-- Equation: out picture = refocus(in picture).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.tmds_pkg.all;
use work.video_pkg.all;

entity atlys_top is
  generic (
    -- As in raster_refocuser.
    MICRO_IMAGE_SIZE    : positive := 5;
    SHIFTS              : string   := "-3";
    INTERPOLATION_ORDER : natural  := 0;
    HOLD                : boolean  := false;
    MAX_COLUMNS         : positive := 1280;
    EXACT               : boolean  := false;
    FRACTION_BITS       : natural  := 4;
    GUARD_BITS          : natural  := 2;
    BROADCAST_TAPS      : natural  := 0;
    ENGINE              : string   := "fir";
    -- Test pattern: 640x480p60.
    PATTERN_H_ACTIVE : positive := 640;
    PATTERN_H_FRONT  : positive := 16;
    PATTERN_H_SYNC   : positive := 96;
    PATTERN_H_BACK   : positive := 48;
    PATTERN_V_ACTIVE : positive := 480;
    PATTERN_V_FRONT  : positive := 10;
    PATTERN_V_SYNC   : positive := 2;
    PATTERN_V_BACK   : positive := 33;
    -- Times in clocks of 100 MHz; a simulation shortens them.
    METER_WINDOW  : positive := 16000;
    LOCK_TIMEOUT  : positive := 1000000;
    BUTTON_STABLE : positive := 1000000;
    BIT_CLOCKS    : positive := 868;
    -- Frames for each slice of a sweep by the switch: half a second.
    SWITCH_FRAMES : positive range 1 to 255 := 30;
    -- Words without control tokens after which a channel is lost.
    ALIGN_TIMEOUT : positive := 8192
  );
  port (
    clk_100        : in    std_logic;
    reset_n        : in    std_logic;
    in_clk_p       : in    std_logic;
    in_clk_n       : in    std_logic;
    in_data_p      : in    std_logic_vector(2 downto 0);
    in_data_n      : in    std_logic_vector(2 downto 0);
    in_scl         : in    std_logic;
    in_sda         : inout std_logic;
    out_clk_p      : out   std_logic;
    out_clk_n      : out   std_logic;
    out_data_p     : out   std_logic_vector(2 downto 0);
    out_data_n     : out   std_logic_vector(2 downto 0);
    uart_rx        : in    std_logic;
    uart_tx        : out   std_logic;
    button_up      : in    std_logic;
    button_down    : in    std_logic;
    button_clear   : in    std_logic;
    switch_pattern : in    std_logic;
    switch_pass    : in    std_logic;
    switch_sweep   : in    std_logic;
    led            : out   std_logic_vector(7 downto 0)
  );
end entity atlys_top;

architecture rtl of atlys_top is

  constant SLICES : positive := slice_count(SHIFTS);

  -- Depths of the test pattern: first, middle and last slice; of one slice alone, also those that it blurs.
  constant LEFT_SHIFT   : integer := slice_shift(SHIFTS, 0);
  constant MIDDLE_SHIFT : integer := choose(SLICES > 2, slice_shift(SHIFTS, SLICES / 2), 0);
  constant RIGHT_SHIFT  : integer := choose(SLICES > 1, slice_shift(SHIFTS, SLICES - 1), -LEFT_SHIFT);

  -- Errors: of refocus_video, then words that no encoder sends.
  constant WRONG_WORD : natural  := 4;
  constant ERRORS     : positive := 5;

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

  constant LINK_STATUS  : string := "clock=# present=# running=# aligned=# following=# unsupported=# ";
  constant VIDEO_STATUS : string := "columns=# rows=# errors=# edid=#";

  constant FIELDS : positive := 10;

  -- Control domain.
  signal reset_request   : std_logic;
  signal reset           : std_logic;
  signal rate            : unsigned(11 downto 0)        := (others => '0');
  signal rate_updated    : std_logic;
  signal own_ready       : std_logic;
  signal use_own         : std_logic;
  signal configure       : std_logic;
  signal setting_high    : std_logic;
  signal configured      : std_logic;
  signal configured_each : std_logic_vector(1 downto 0);
  signal pll_reset       : std_logic_vector(1 downto 0);
  signal pll_locked      : std_logic_vector(1 downto 0);
  signal locked_here     : std_logic_vector(2 downto 0);
  signal lock_levels     : std_logic_vector(2 downto 0);
  signal run             : std_logic;
  signal present         : std_logic;
  signal slice           : std_logic_vector(7 downto 0);
  signal sweep           : std_logic;
  signal sweep_frames    : std_logic_vector(7 downto 0);
  signal pass_through    : std_logic;
  signal pattern         : std_logic;
  signal clear_command   : std_logic;
  signal clear_button    : std_logic;
  signal clear_toggle    : std_logic_vector(0 downto 0) := "0";
  signal status_values   : std_logic_vector(16 * FIELDS - 1 downto 0);
  signal status_levels   : std_logic_vector(ERRORS + 4 downto 0);
  signal status_here     : std_logic_vector(ERRORS + 4 downto 0);
  signal size_here       : std_logic_vector(2 * COUNT_BITS - 1 downto 0);
  signal sda_low         : std_logic;
  signal edid_byte       : std_logic;
  signal edid_bytes      : unsigned(15 downto 0)        := (others => '0');
  signal settings        : std_logic_vector(17 downto 0);

  -- Reconfiguration ports: receiver, transmitter.

  type addresses_t is array (0 to 1) of std_logic_vector(4 downto 0);

  type words_t is array (0 to 1) of std_logic_vector(15 downto 0);

  signal drp_enable  : std_logic_vector(1 downto 0);
  signal drp_write   : std_logic_vector(1 downto 0);
  signal drp_address : addresses_t;
  signal drp_in      : words_t;
  signal drp_out     : words_t;
  signal drp_ready   : std_logic_vector(1 downto 0);

  -- Clocks and resets.
  signal tmds_clk        : std_logic;
  signal tmds_clk_global : std_logic;
  signal source_clk      : std_logic;
  signal clk             : std_logic;
  signal clk_x2          : std_logic;
  signal io_clk          : std_logic;
  signal io_strobe       : std_logic;
  signal tx_clk          : std_logic;
  signal tx_clk_x2       : std_logic;
  signal tx_io_clk       : std_logic;
  signal tx_io_strobe    : std_logic;
  signal stop            : std_logic;
  signal pixel_reset     : std_logic;
  signal half_reset      : std_logic;
  signal tx_reset        : std_logic;
  signal tx_half_reset   : std_logic;

  -- Receiver.
  signal in_halves        : std_logic_vector(5 * CHANNELS - 1 downto 0);
  signal calibrate_master : std_logic_vector(CHANNELS - 1 downto 0);
  signal calibrate_slave  : std_logic_vector(CHANNELS - 1 downto 0);
  signal delay_reset      : std_logic_vector(CHANNELS - 1 downto 0);
  signal step             : std_logic_vector(CHANNELS - 1 downto 0);
  signal step_up          : std_logic_vector(CHANNELS - 1 downto 0);
  signal busy             : std_logic_vector(CHANNELS - 1 downto 0);
  signal valid            : std_logic_vector(CHANNELS - 1 downto 0);
  signal increase         : std_logic_vector(CHANNELS - 1 downto 0);
  signal link_active      : std_logic;
  signal link_h_sync      : std_logic;
  signal link_v_sync      : std_logic;
  signal link_pixel       : std_logic_vector(23 downto 0);
  signal link_aligned     : std_logic_vector(CHANNELS - 1 downto 0);
  signal link_locked      : std_logic;
  signal link_error       : std_logic;

  -- Video.
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
  signal shown_active   : std_logic;
  signal shown_h_sync   : std_logic;
  signal shown_v_sync   : std_logic;
  signal shown_pixel    : std_logic_vector(23 downto 0);
  signal following      : std_logic;
  signal unsupported    : std_logic;
  signal video_timing   : std_logic_vector(TIMING_BITS - 1 downto 0);
  signal video_errors   : std_logic_vector(3 downto 0);
  signal errors_now     : std_logic_vector(ERRORS - 1 downto 0) := (others => '0');
  signal pixel_settings : std_logic_vector(17 downto 0);
  signal pixel_pattern  : std_logic_vector(0 downto 0);
  signal own_level      : std_logic_vector(0 downto 0);
  signal clear_arrived  : std_logic_vector(0 downto 0);
  signal clear_seen     : std_logic_vector(0 downto 0)          := "0";
  signal size_now       : std_logic_vector(2 * COUNT_BITS - 1 downto 0);

  -- Transmitter.
  signal out_halves : std_logic_vector(5 * CHANNELS + 4 downto 0);

  -- The constraints name these nets.
  attribute keep : string;
  attribute keep of tmds_clk_global : signal is "TRUE";
  attribute keep of clk             : signal is "TRUE";
  attribute keep of clk_x2          : signal is "TRUE";
  attribute keep of tx_clk          : signal is "TRUE";
  attribute keep of tx_clk_x2       : signal is "TRUE";

  -- A number of the status line.
  function number (
    value : std_logic_vector
  ) return std_logic_vector is
  begin

    return std_logic_vector(resize(unsigned(value), 16));

  end function number;

begin

  --------------------------------------------------------------------------------------------------
  -- Control: clocks, settings, EDID.

  reset_request <= not reset_n;

  reset_of_control : entity work.reset_bridge
    port map (
      clk     => clk_100,
      request => reset_request,
      reset   => reset
    );

  clock_pins : entity work.clock_input
    port map (
      clk_p      => in_clk_p,
      clk_n      => in_clk_n,
      clk        => tmds_clk,
      clk_global => tmds_clk_global
    );

  meter : entity work.clock_meter
    generic map (
      WINDOW => METER_WINDOW
    )
    port map (
      clk          => clk_100,
      measured_clk => tmds_clk_global,
      count        => rate,
      updated      => rate_updated
    );

  clock_select : entity work.pixel_clock_select
    port map (
      clk_100   => clk_100,
      reset     => reset,
      tmds_clk  => tmds_clk,
      use_own   => use_own,
      clk       => source_clk,
      own_ready => lock_levels(2)
    );

  lock_levels(1 downto 0) <= pll_locked;

  lock_crossing : entity work.synchroniser
    generic map (
      WIDTH => 3
    )
    port map (
      clk         => clk_100,
      level       => lock_levels,
      synchronous => locked_here
    );

  own_ready  <= locked_here(2);
  configured <= configured_each(0) and configured_each(1);

  supervisor : entity work.link_supervisor
    generic map (
      COUNTS_10_MHZ => METER_WINDOW / 160,
      TIMEOUT       => LOCK_TIMEOUT
    )
    port map (
      clk             => clk_100,
      reset           => reset,
      want_own        => pattern,
      own_ready       => own_ready,
      rate            => rate,
      rate_updated    => rate_updated,
      use_own         => use_own,
      configure       => configure,
      high            => setting_high,
      configured      => configured,
      receive_reset   => pll_reset(0),
      receive_locked  => locked_here(0),
      transmit_reset  => pll_reset(1),
      transmit_locked => locked_here(1),
      run             => run,
      present         => present
    );

  pll_port : for i in 0 to 1 generate

    configurator : entity work.pll_configure
      port map (
        clk         => clk_100,
        reset       => reset,
        start       => configure,
        high        => setting_high,
        done        => configured_each(i),
        drp_enable  => drp_enable(i),
        drp_write   => drp_write(i),
        drp_address => drp_address(i),
        drp_in      => drp_in(i),
        drp_out     => drp_out(i),
        drp_ready   => drp_ready(i)
      );

  end generate pll_port;

  panel : entity work.board_control
    generic map (
      SLICES        => SLICES,
      STATUS        => LINK_STATUS & VIDEO_STATUS,
      FIELDS        => FIELDS,
      BIT_CLOCKS    => BIT_CLOCKS,
      STABLE        => BUTTON_STABLE,
      SWITCH_FRAMES => SWITCH_FRAMES
    )
    port map (
      clk            => clk_100,
      reset          => reset,
      line_in        => uart_rx,
      line_out       => uart_tx,
      button_up      => button_up,
      button_down    => button_down,
      switch_pattern => switch_pattern,
      switch_pass    => switch_pass,
      switch_sweep   => switch_sweep,
      status_values  => status_values,
      slice          => slice,
      sweep          => sweep,
      sweep_frames   => sweep_frames,
      pass_through   => pass_through,
      pattern        => pattern,
      clear_errors   => clear_command
    );

  debounce_clear : entity work.debouncer
    generic map (
      STABLE => BUTTON_STABLE
    )
    port map (
      clk     => clk_100,
      contact => button_clear,
      level   => open,
      pressed => clear_button
    );

  edid : entity work.i2c_rom_slave
    generic map (
      MAX_COLUMNS => MAX_COLUMNS
    )
    port map (
      clk       => clk_100,
      reset     => reset,
      scl       => in_scl,
      sda       => in_sda,
      sda_low   => sda_low,
      read_byte => edid_byte
    );

  in_sda <= '0' when sda_low = '1' else
            'Z';

  control : process (clk_100) is
  begin

    if rising_edge(clk_100) then
      if clear_command = '1' or clear_button = '1' then
        clear_toggle <= not clear_toggle;
        edid_bytes   <= (others => '0');
      elsif edid_byte = '1' and edid_bytes /= 65535 then
        edid_bytes <= edid_bytes + 1;
      end if;
      if reset = '1' then
        edid_bytes <= (others => '0');
      end if;
    end if;

  end process control;

  -- What the pixel domain says, while it runs.
  status_levels <= errors_now & unsupported & following & link_aligned;

  status_crossing : entity work.synchroniser
    generic map (
      WIDTH => ERRORS + 5
    )
    port map (
      clk         => clk_100,
      level       => status_levels,
      synchronous => status_here
    );

  size_crossing : entity work.bus_crossing
    generic map (
      WIDTH => 2 * COUNT_BITS
    )
    port map (
      source_clk      => clk,
      source          => size_now,
      destination_clk => clk_100,
      destination     => size_here
    );

  report_status : process (clk_100) is

    variable alive : std_logic_vector(ERRORS + 4 downto 0);

  begin

    if rising_edge(clk_100) then
      -- Without clocks the last levels mean nothing, but the errors.
      alive := status_here;
      if run = '0' then
        alive(4 downto 0) := "00000";
      end if;
      status_values <= std_logic_vector(edid_bytes) & number(alive(ERRORS + 4 downto 5)) &
                       number(size_here(2 * COUNT_BITS - 1 downto COUNT_BITS)) &
                       number(size_here(COUNT_BITS - 1 downto 0)) & number(alive(4 downto 4)) &
                       number(alive(3 downto 3)) & number(alive(2 downto 0)) & number("0" & run) &
                       number("0" & present) & number(std_logic_vector(rate));

      led(0)          <= present;
      led(1)          <= alive(3);
      led(4 downto 2) <= alive(2 downto 0);
      led(5)          <= '0';
      if alive(ERRORS + 4 downto 5) /= "00000" then
        led(5) <= '1';
      end if;
      led(7 downto 6) <= slice(1 downto 0);
    end if;

  end process report_status;

  --------------------------------------------------------------------------------------------------
  -- Clocks and resets of the video path.

  receive_clocks : entity work.serial_clocks
    port map (
      clk_in      => source_clk,
      pll_reset   => pll_reset(0),
      drp_clk     => clk_100,
      drp_enable  => drp_enable(0),
      drp_write   => drp_write(0),
      drp_address => drp_address(0),
      drp_in      => drp_in(0),
      drp_out     => drp_out(0),
      drp_ready   => drp_ready(0),
      clk         => clk,
      clk_x2      => clk_x2,
      io_clk      => io_clk,
      io_strobe   => io_strobe,
      locked      => pll_locked(0)
    );

  transmit_clocks : entity work.serial_clocks
    port map (
      clk_in      => clk,
      pll_reset   => pll_reset(1),
      drp_clk     => clk_100,
      drp_enable  => drp_enable(1),
      drp_write   => drp_write(1),
      drp_address => drp_address(1),
      drp_in      => drp_in(1),
      drp_out     => drp_out(1),
      drp_ready   => drp_ready(1),
      clk         => tx_clk,
      clk_x2      => tx_clk_x2,
      io_clk      => tx_io_clk,
      io_strobe   => tx_io_strobe,
      locked      => pll_locked(1)
    );

  stop <= not run;

  reset_of_pixels : entity work.reset_bridge
    port map (
      clk     => clk,
      request => stop,
      reset   => pixel_reset
    );

  reset_of_halves : entity work.reset_bridge
    port map (
      clk     => clk_x2,
      request => stop,
      reset   => half_reset
    );

  reset_of_tx : entity work.reset_bridge
    port map (
      clk     => tx_clk,
      request => stop,
      reset   => tx_reset
    );

  reset_of_tx_halves : entity work.reset_bridge
    port map (
      clk     => tx_clk_x2,
      request => stop,
      reset   => tx_half_reset
    );

  --------------------------------------------------------------------------------------------------
  -- Receiver.

  channel : for c in 0 to CHANNELS - 1 generate

    input : entity work.tmds_input
      port map (
        data_p           => in_data_p(c),
        data_n           => in_data_n(c),
        io_clk           => io_clk,
        io_strobe        => io_strobe,
        clk_x2           => clk_x2,
        reset            => half_reset,
        calibrate_master => calibrate_master(c),
        calibrate_slave  => calibrate_slave(c),
        delay_reset      => delay_reset(c),
        step             => step(c),
        step_up          => step_up(c),
        busy             => busy(c),
        valid            => valid(c),
        increase         => increase(c),
        half             => in_halves(5 * c + 4 downto 5 * c)
      );

    phase : entity work.phase_detector_control
      port map (
        clk              => clk_x2,
        reset            => half_reset,
        busy             => busy(c),
        valid            => valid(c),
        increase         => increase(c),
        calibrate_master => calibrate_master(c),
        calibrate_slave  => calibrate_slave(c),
        delay_reset      => delay_reset(c),
        step             => step(c),
        step_up          => step_up(c),
        tracking         => open
      );

  end generate channel;

  receiver : entity work.tmds_receiver
    generic map (
      ALIGN_TIMEOUT => ALIGN_TIMEOUT
    )
    port map (
      clk     => clk,
      clk_x2  => clk_x2,
      reset   => pixel_reset,
      halves  => in_halves,
      active  => link_active,
      h_sync  => link_h_sync,
      v_sync  => link_v_sync,
      pixel   => link_pixel,
      aligned => link_aligned,
      locked  => link_locked,
      error   => link_error
    );

  --------------------------------------------------------------------------------------------------
  -- Video.

  settings <= pass_through & sweep & sweep_frames & slice;

  settings_crossing : entity work.bus_crossing
    generic map (
      WIDTH => 18
    )
    port map (
      source_clk      => clk_100,
      source          => settings,
      destination_clk => clk,
      destination     => pixel_settings
    );

  own_level(0) <= use_own;

  own_crossing : entity work.synchroniser
    port map (
      clk         => clk,
      level       => own_level,
      synchronous => pixel_pattern
    );

  clear_crossing : entity work.synchroniser
    port map (
      clk         => clk,
      level       => clear_toggle,
      synchronous => clear_arrived
    );

  pattern_vector <= to_vector(PATTERN_TIMING);
  pattern_reset  <= pixel_reset or not pixel_pattern(0);

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
      if pixel_pattern(0) = '1' then
        video_active <= drawn_active;
        video_h_sync <= drawn_h_sync;
        video_v_sync <= drawn_v_sync;
        video_pixel  <= drawn_pixel;
      else
        video_active <= link_active;
        video_h_sync <= link_h_sync;
        video_v_sync <= link_v_sync;
        video_pixel  <= link_pixel;
      end if;
      if pixel_reset = '1' then
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
      MAX_COLUMNS         => MAX_COLUMNS,
      EXACT               => EXACT,
      FRACTION_BITS       => FRACTION_BITS,
      GUARD_BITS          => GUARD_BITS,
      BROADCAST_TAPS      => BROADCAST_TAPS,
      ENGINE              => ENGINE
    )
    port map (
      clk          => clk,
      reset        => pixel_reset,
      pass_through => pixel_settings(17),
      slice        => pixel_settings(7 downto 0),
      sweep        => pixel_settings(16),
      sweep_frames => pixel_settings(15 downto 8),
      in_active    => video_active,
      in_h_sync    => video_h_sync,
      in_v_sync    => video_v_sync,
      in_pixel     => video_pixel,
      out_active   => shown_active,
      out_h_sync   => shown_h_sync,
      out_v_sync   => shown_v_sync,
      out_pixel    => shown_pixel,
      following    => following,
      unsupported  => unsupported,
      timing       => video_timing,
      errors       => video_errors
    );

  size_now <= video_timing(5 * COUNT_BITS - 1 downto 4 * COUNT_BITS) & video_timing(COUNT_BITS - 1 downto 0);

  collect_errors : process (clk) is
  begin

    if rising_edge(clk) then
      clear_seen <= clear_arrived;
      if clear_seen /= clear_arrived then
        errors_now <= (others => '0');
      elsif pixel_reset = '0' then
        errors_now(3 downto 0) <= errors_now(3 downto 0) or video_errors;
        if following = '1' and link_error = '1' and pixel_pattern(0) = '0' then
          errors_now(WRONG_WORD) <= '1';
        end if;
      end if;
    end if;

  end process collect_errors;

  --------------------------------------------------------------------------------------------------
  -- Transmitter.

  transmitter : entity work.tmds_transmitter
    port map (
      clk       => clk,
      reset     => pixel_reset,
      active    => shown_active,
      h_sync    => shown_h_sync,
      v_sync    => shown_v_sync,
      pixel     => shown_pixel,
      tx_clk    => tx_clk,
      tx_clk_x2 => tx_clk_x2,
      tx_reset  => tx_reset,
      halves    => out_halves
    );

  lane : for c in 0 to CHANNELS - 1 generate

    output : entity work.tmds_output
      port map (
        half      => out_halves(5 * c + 4 downto 5 * c),
        io_clk    => tx_io_clk,
        io_strobe => tx_io_strobe,
        clk_x2    => tx_clk_x2,
        reset     => tx_half_reset,
        data_p    => out_data_p(c),
        data_n    => out_data_n(c)
      );

  end generate lane;

  clock_lane : entity work.tmds_output
    port map (
      half      => out_halves(5 * CHANNELS + 4 downto 5 * CHANNELS),
      io_clk    => tx_io_clk,
      io_strobe => tx_io_strobe,
      clk_x2    => tx_clk_x2,
      reset     => tx_half_reset,
      data_p    => out_clk_p,
      data_n    => out_clk_n
    );

end architecture rtl;
