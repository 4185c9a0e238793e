-- Control of a board with HDMI input and output: clocks, buttons, serial port, EDID, LEDs.
--
-- Works with the board's oscillator, so it answers whatever comes in. Settings and reports cross to and
-- from the pixel clock here.
--
-- LEDs: 0 TMDS clock in range, 1 following (timing understood, picture refocused), 2 to 4 channels
-- aligned, 5 error since the last clearing, 6 and 7 slice.
--
-- Latency: a setting takes about 10 clocks. Throughput: not applicable.
-- Equation: none; see link_supervisor, board_control and i2c_rom_slave.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.hdmi_pkg.all;
use work.tmds_pkg.all;
use work.video_pkg.all;

entity hdmi_control is
  generic (
    -- Number of slices of the refocuser.
    SLICES : positive range 1 to 256;
    -- Longest line in pixels: longer modes are not offered.
    MAX_COLUMNS : positive;
    -- Times in clocks of 100 MHz, see clock_meter, link_supervisor, debouncer and uart_receiver.
    METER_WINDOW  : positive;
    LOCK_TIMEOUT  : positive;
    BUTTON_STABLE : positive;
    BIT_CLOCKS    : positive;
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
    -- Display data channel; sda_low: pull the data line low (open drain).
    scl     : in    std_logic;
    sda     : in    std_logic;
    sda_low : out   std_logic;
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
    -- To and from the video path, in pixel_clk.
    settings : out   video_settings_t;
    state    : in    video_state_t
  );
end entity hdmi_control;

architecture rtl of hdmi_control is

  constant LINK_STATUS  : string := "clock=# present=# running=# aligned=# following=# unsupported=# ";
  constant VIDEO_STATUS : string := "columns=# rows=# errors=# edid=#";

  constant FIELDS : positive := 10;

  signal rate            : unsigned(11 downto 0)        := (others => '0');
  signal rate_updated    : std_logic;
  signal lock_levels     : std_logic_vector(2 downto 0);
  signal locked_here     : std_logic_vector(2 downto 0);
  signal own_level       : std_logic_vector(0 downto 0);
  signal running         : std_logic;
  signal present         : std_logic;
  signal slice           : std_logic_vector(7 downto 0);
  signal sweep           : std_logic;
  signal sweep_frames    : std_logic_vector(7 downto 0);
  signal pass_through    : std_logic;
  signal pattern         : std_logic;
  signal clear_command   : std_logic;
  signal clear_button    : std_logic;
  signal clear_toggle    : std_logic_vector(0 downto 0) := "0";
  signal edid_byte       : std_logic;
  signal edid_bytes      : unsigned(15 downto 0)        := (others => '0');
  signal status_values   : std_logic_vector(16 * FIELDS - 1 downto 0);
  signal status_levels   : std_logic_vector(ERRORS + 4 downto 0);
  signal status_here     : std_logic_vector(ERRORS + 4 downto 0);
  signal size_now        : std_logic_vector(2 * COUNT_BITS - 1 downto 0);
  signal size_here       : std_logic_vector(2 * COUNT_BITS - 1 downto 0);
  signal rows_here       : std_logic_vector(COUNT_BITS - 1 downto 0);
  signal columns_here    : std_logic_vector(COUNT_BITS - 1 downto 0);
  signal settings_vector : std_logic_vector(17 downto 0);
  signal pixel_settings  : std_logic_vector(17 downto 0);
  signal pixel_pattern   : std_logic_vector(0 downto 0);
  signal pixel_clear     : std_logic_vector(0 downto 0);

  -- A number of the status line.
  function number (
    value : std_logic_vector
  ) return std_logic_vector is
  begin

    return std_logic_vector(resize(unsigned(value), 16));

  end function number;

begin

  --------------------------------------------------------------------------------------------------
  -- Clocks.

  meter : entity work.clock_meter
    generic map (
      WINDOW => METER_WINDOW
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
      TIMEOUT       => LOCK_TIMEOUT
    )
    port map (
      clk             => clk,
      reset           => reset,
      want_own        => pattern,
      own_ready       => locked_here(2),
      rate            => rate,
      rate_updated    => rate_updated,
      use_own         => own_level(0),
      configure       => configure,
      high            => setting_high,
      configured      => configured,
      receive_reset   => receive_reset,
      receive_locked  => locked_here(0),
      transmit_reset  => transmit_reset,
      transmit_locked => locked_here(1),
      run             => running,
      present         => present
    );

  use_own <= own_level(0);
  run     <= running;

  --------------------------------------------------------------------------------------------------
  -- Panel, EDID.

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
      clk            => clk,
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
      clk     => clk,
      contact => button_clear,
      level   => open,
      pressed => clear_button
    );

  edid : entity work.i2c_rom_slave
    generic map (
      MAX_COLUMNS => MAX_COLUMNS
    )
    port map (
      clk       => clk,
      reset     => reset,
      scl       => scl,
      sda       => sda,
      sda_low   => sda_low,
      read_byte => edid_byte
    );

  clear : process (clk) is
  begin

    if rising_edge(clk) then
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

  end process clear;

  --------------------------------------------------------------------------------------------------
  -- To the video path.

  settings_vector <= pass_through & sweep & sweep_frames & slice;

  settings_crossing : entity work.bus_crossing
    generic map (
      WIDTH => 18
    )
    port map (
      source_clk      => clk,
      source          => settings_vector,
      destination_clk => pixel_clk,
      destination     => pixel_settings
    );

  pattern_crossing : entity work.synchroniser
    port map (
      clk         => pixel_clk,
      level       => own_level,
      synchronous => pixel_pattern
    );

  clear_crossing : entity work.synchroniser
    port map (
      clk         => pixel_clk,
      level       => clear_toggle,
      synchronous => pixel_clear
    );

  settings <=
  (
    pass_through => pixel_settings(17),
    slice        => pixel_settings(7 downto 0),
    sweep        => pixel_settings(16),
    sweep_frames => pixel_settings(15 downto 8),
    show_pattern => pixel_pattern(0),
    clear_toggle => pixel_clear(0)
  );

  --------------------------------------------------------------------------------------------------
  -- From the video path.

  status_levels <= state.errors & state.unsupported & state.following & state.aligned;

  status_crossing : entity work.synchroniser
    generic map (
      WIDTH => ERRORS + 5
    )
    port map (
      clk         => clk,
      level       => status_levels,
      synchronous => status_here
    );

  size_now <= std_logic_vector(state.rows) & std_logic_vector(state.columns);

  size_crossing : entity work.bus_crossing
    generic map (
      WIDTH => 2 * COUNT_BITS
    )
    port map (
      source_clk      => pixel_clk,
      source          => size_now,
      destination_clk => clk,
      destination     => size_here
    );

  rows_here    <= size_here(2 * COUNT_BITS - 1 downto COUNT_BITS);
  columns_here <= size_here(COUNT_BITS - 1 downto 0);

  report_status : process (clk) is

    variable alive : std_logic_vector(ERRORS + 4 downto 0);

  begin

    if rising_edge(clk) then
      -- Without a pixel clock the last levels mean nothing, except the errors.
      alive := status_here;
      if running = '0' then
        alive(4 downto 0) := "00000";
      end if;
      status_values <= std_logic_vector(edid_bytes) & number(alive(ERRORS + 4 downto 5)) &
                       number(rows_here) & number(columns_here) & number(alive(4 downto 4)) &
                       number(alive(3 downto 3)) & number(alive(2 downto 0)) & number("0" & running) &
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

end architecture rtl;
