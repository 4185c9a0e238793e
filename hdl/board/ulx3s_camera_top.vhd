-- SPDX-License-Identifier: Apache-2.0
-- Radiona ULX3S: a camera at the header J1 in place of HDMI in, refocused HDMI out on the board's GPDI.
--
-- This file has what belongs to the board and its family: pins (constraints/ulx3s_camera.lpf), clocks, lanes.
-- camera_refocuser has everything else. The camera's registers (camera_pkg) make its lines and frames last as long as
-- the screen's; camera_timing absorbs the difference between the two clocks. The raster is shown in the middle of the
-- screen. A screen's frame begins when enough raw lines have arrived for each raster line to be ready in time.
--
-- Clocks: byte_clk of the lanes; the pixel clock, made from the oscillator, and five times that for the output lanes.
-- Crossings are in csi_receiver and word_strobe.
--
-- Latency: that of camera_refocuser, and half of the lines that the raster has fewer than the screen. Throughput: one
-- pixel each clock.
-- Equation: out picture = refocus(raster(raw frame)), in the middle of black.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.camera_pkg.all;
use work.core_pkg.all;
use work.hdmi_pkg.all;
use work.math_pkg.all;
use work.picture_pkg.all;
use work.refocuser_pkg.all;
use work.sensor_pkg.all;
use work.tmds_pkg.all;
use work.video_pkg.all;

entity ulx3s_camera_top is
  generic (
    -- Generics of raster_refocuser.
    MICRO_IMAGE_SIZE    : positive range 1 to 128  := 5;
    SHIFTS              : string                   := "-3";
    INTERPOLATION_ORDER : natural range 0 to 3     := 0;
    HOLD                : boolean                  := false;
    MAX_COLUMNS         : positive range 2 to 8192 := 640;
    EXACT               : boolean                  := true;
    FRACTION_BITS       : natural range 0 to 12    := 0;
    GUARD_BITS          : natural range 0 to 12    := 0;
    BROADCAST_TAPS      : natural                  := 0;
    ENGINE              : string                   := "moving_sum";
    BOX                 : string                   := "";
    -- The screen's mode: 640x480 at 25 MHz.
    PATTERN_H_ACTIVE : positive range 3 to 4095 := 640;
    PATTERN_H_FRONT  : positive range 1 to 4095 := 16;
    PATTERN_H_SYNC   : positive range 1 to 4095 := 96;
    PATTERN_H_BACK   : positive range 1 to 4095 := 48;
    PATTERN_V_ACTIVE : positive range 1 to 4095 := 480;
    PATTERN_V_FRONT  : positive range 1 to 4095 := 10;
    PATTERN_V_SYNC   : positive range 1 to 4095 := 2;
    PATTERN_V_BACK   : positive range 1 to 4095 := 33;
    -- Frames for each slice (30 are half a second); clocks for which a key must be steady (10 ms).
    SWEEP_FRAMES  : positive range 1 to 255       := 30;
    BUTTON_STABLE : positive range 1 to 200000000 := 250000;
    -- Clocks in a millisecond, and in a bit of the serial port; 0: computed from the frequency.
    MILLISECOND : natural := 0;
    BIT_TIME    : natural := 0
  );
  port (
    -- Oscillator, and the reset button (low while pressed).
    clk_25  : in    std_logic;
    reset_n : in    std_logic;
    -- The camera: differential pairs by their positive pins; pins for low power (soft_dphy_input); I2C; cam_enable:
    -- switches its supplies on.
    cam_hs_clk  : in    std_logic;
    cam_hs_data : in    std_logic_vector(1 downto 0);
    cam_lp_data : in    std_logic_vector(3 downto 0);
    cam_scl     : inout std_logic;
    cam_sda     : inout std_logic;
    cam_enable  : out   std_logic;
    -- HDMI out on GPDI.
    out_clk  : out   std_logic;
    out_data : out   std_logic_vector(2 downto 0);
    -- Serial port for calibrations.
    uart_rx : in    std_logic;
    uart_tx : out   std_logic;
    -- Buttons: stop or continue the sweep; stop it and step.
    button_stop : in    std_logic;
    button_step : in    std_logic;
    -- LEDs: 0 to 4 state of camera_refocuser, 5 a pixel came too late for the screen, 6 the focus sweeps.
    led : out   std_logic_vector(7 downto 0);
    -- These pins only need their pull-ups: low, they would start the loader of the board's ESP32; see ulx3s_top.
    wifi_gpio0     : in    std_logic;
    wifi_gpio0_new : in    std_logic
  );
end entity ulx3s_camera_top;

architecture rtl of ulx3s_camera_top is

  constant CORE : core_t := core_of
                            (
                              name                => "ulx3s_camera_top",
                              micro_image_size    => MICRO_IMAGE_SIZE,
                              shifts              => SHIFTS,
                              interpolation_order => INTERPOLATION_ORDER,
                              hold                => HOLD,
                              max_columns         => choose(WITH_SENSOR, RASTER_COLUMNS, MAX_COLUMNS),
                              exact               => EXACT,
                              fraction_bits       => FRACTION_BITS,
                              guard_bits          => GUARD_BITS,
                              broadcast_taps      => BROADCAST_TAPS,
                              engine              => ENGINE,
                              box                 => BOX,
                              channels            => CAMERA_CHANNELS,
                              pixel_bits          => RAW_BITS
                            );

  constant TAKES_TWO : boolean := takes(CAMERA_LANES <= 2, "ulx3s_camera_top: CAMERA_LANES of camera_pkg is above 2");
  constant TAKES_8   : boolean := takes(RAW_BITS = 8, "ulx3s_camera_top: RAW_BITS of camera_pkg is not 8");
  -- NVC checks slices of ports at analysis, before TAKES_TWO refuses the number of lanes.
  constant WIRED : positive := choose(CAMERA_LANES <= 2, CAMERA_LANES, 2);

  constant MODE : timing_t := mode_timing
                              (
                                "ulx3s_camera_top",
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

  -- Clocks: from the oscillator; the pixel clock and five times that; their resets.
  signal own_clk     : std_logic;
  signal own_ready   : std_logic;
  signal clk         : std_logic;
  signal clk_x5      : std_logic;
  signal locked      : std_logic;
  signal own_stopped : std_logic;
  signal stop        : std_logic;
  signal reset       : std_logic;
  signal reset_x5    : std_logic;
  -- The camera: bytes of its lanes; levels of its I2C lines, and lines to pull low.
  signal byte_clk    : std_logic;
  signal lane_valid  : std_logic_vector(CAMERA_LANES - 1 downto 0);
  signal lane_sync   : std_logic_vector(CAMERA_LANES - 1 downto 0);
  signal lane_data   : std_logic_vector(8 * CAMERA_LANES - 1 downto 0);
  signal lane_missed : std_logic_vector(CAMERA_LANES - 1 downto 0);
  signal scl         : std_logic;
  signal sda         : std_logic;
  signal scl_low     : std_logic;
  signal sda_low     : std_logic;
  -- Refocused frames in the pixel clock, their size, and the state of camera_refocuser.
  signal new_tdata     : std_logic_vector(CAMERA_CHANNELS * RAW_BITS - 1 downto 0);
  signal new_pixels    : stream_t;
  signal new_ready     : std_logic;
  signal frame_columns : std_logic_vector(15 downto 0);
  signal frame_rows    : std_logic_vector(15 downto 0);
  signal raw_lines     : std_logic_vector(15 downto 0);
  signal state         : std_logic_vector(4 downto 0);

  -- The raw line at which a screen's frame is due; came, came_late: it has come, now and a clock ago; due: high for one
  -- clock.
  signal due_line  : unsigned(15 downto 0) := (others => '0');
  signal came      : std_logic             := '0';
  signal came_late : std_logic             := '0';
  signal due       : std_logic;

  -- The screen: its timing, its picture, a pixel that came too late; the output lanes.
  signal following  : following_t;
  signal shown      : video_t;
  signal underflow  : std_logic;
  signal late       : std_logic := '0';
  signal choice     : picture_choice_t;
  signal going      : std_logic;
  signal out_strobe : std_logic;
  signal words      : std_logic_vector(10 * CHANNELS + 9 downto 0);
  signal pins       : std_logic_vector(CHANNELS downto 0);

begin

  --------------------------------------------------------------------------------------------------
  -- Clocks and resets.

  oscillator : entity work.oscillator_clocks
    generic map (
      OSCILLATOR_MHZ => 25
    )
    port map (
      oscillator_clk => clk_25,
      own_clk        => own_clk,
      locked         => own_ready
    );

  -- The oscillator's PLL makes the source of the pixel clock; the second PLL, which multiplies it, starts behind the
  -- first.
  own_stopped <= not own_ready;

  pixel_clocks_of_both : entity work.pixel_clocks
    port map (
      own_clk   => own_clk,
      pll_reset => own_stopped,
      clk       => clk,
      clk_x5    => clk_x5,
      locked    => locked
    );

  stop <= not reset_n or not locked;

  reset_of_pixels : entity work.reset_bridge
    port map (
      clk     => clk,
      request => stop,
      reset   => reset
    );

  reset_of_lanes : entity work.reset_bridge
    port map (
      clk     => clk_x5,
      request => stop,
      reset   => reset_x5
    );

  --------------------------------------------------------------------------------------------------
  -- The camera.

  -- The reset button switches the camera's supplies off, which also cures a sensor that hangs.
  cam_enable <= reset_n;

  -- A line that a pull-up holds counts as high.
  scl     <= to_x01(cam_scl);
  sda     <= to_x01(cam_sda);
  cam_scl <= '0' when scl_low = '1' else
             'Z';
  cam_sda <= '0' when sda_low = '1' else
             'Z';

  lanes : entity work.soft_dphy_input
    generic map (
      LANES  => CAMERA_LANES,
      SETTLE => LANE_SETTLE
    )
    port map (
      hs_clk      => cam_hs_clk,
      hs_data     => cam_hs_data(WIRED - 1 downto 0),
      lp_data     => cam_lp_data(2 * WIRED - 1 downto 0),
      byte_clk    => byte_clk,
      lane_valid  => lane_valid,
      lane_sync   => lane_sync,
      lane_data   => lane_data,
      lane_missed => lane_missed
    );

  camera : entity work.camera_refocuser
    generic map (
      CORE        => CORE,
      ROWS        => PATTERN_V_ACTIVE,
      CLOCK_KHZ   => 25000,
      MILLISECOND => MILLISECOND,
      BIT_TIME    => BIT_TIME
    )
    port map (
      clk           => clk,
      reset         => reset,
      byte_clk      => byte_clk,
      lane_valid    => lane_valid,
      lane_sync     => lane_sync,
      lane_data     => lane_data,
      lane_missed   => lane_missed,
      scl           => scl,
      sda           => sda,
      scl_low       => scl_low,
      sda_low       => sda_low,
      uart_rx       => uart_rx,
      uart_tx       => uart_tx,
      slice         => choice.slice,
      m_axis_tvalid => new_pixels.tvalid,
      m_axis_tready => new_ready,
      m_axis_tdata  => new_tdata,
      m_axis_tuser  => new_pixels.tuser,
      m_axis_tlast  => new_pixels.tlast,
      frame_columns => frame_columns,
      frame_rows    => frame_rows,
      raw_lines     => raw_lines,
      state         => state
    );

  -- A screen has three channels; a grey camera gives one, which all three show.
  all_channels : for i in 0 to 2 generate
    new_pixels.tdata(8 * i + 7 downto 8 * i) <= new_tdata(8 * (i mod CAMERA_CHANNELS) + 7 downto
                                                          8 * (i mod CAMERA_CHANNELS));
  end generate all_channels;

  --------------------------------------------------------------------------------------------------
  -- The screen. From the beginning of its frame on, it takes lines as fast as the camera sends them, so only a few
  -- lines are stored.

  due <= came and not came_late;

  find_due : process (clk) is

    variable spare : unsigned(15 downto 0);

  begin

    if rising_edge(clk) then
      -- The raster's last line is ready when the last raw line has come; half of the lines that the raster has fewer
      -- lie above it on the screen. Half of an odd number is rounded up: beginning a line later than needed is safe, a
      -- line earlier may find no pixel.
      spare    := PATTERN_V_ACTIVE - unsigned(frame_rows);
      due_line <= spare - shift_right(spare, 1) + START_LINE;
      came     <= to_logic(unsigned(raw_lines) >= due_line);
      -- Faults stay until the reset, like those of the camera: a pixel that came too late shows for one clock only.
      late      <= late or underflow;
      came_late <= came;
      if reset = '1' then
        came <= '0';
        late <= '0';
      end if;
    end if;

  end process find_due;

  screen : entity work.camera_timing
    port map (
      clk       => clk,
      reset     => reset,
      timing    => MODE,
      due       => due,
      following => following
    );

  picture : entity work.stream_to_video
    generic map (
      WINDOW => true
    )
    port map (
      clk             => clk,
      reset           => reset,
      picture_columns => frame_columns,
      picture_rows    => frame_rows,
      following       => following,
      s_axis          => new_pixels,
      s_axis_tready   => new_ready,
      video           => shown,
      underflow       => underflow
    );

  control : entity work.demo_control
    generic map (
      SLICES        => CORE.geometry.slices,
      FRAMES        => SWEEP_FRAMES,
      BUTTON_STABLE => BUTTON_STABLE
    )
    port map (
      clk      => clk,
      reset    => reset,
      v_sync   => shown.v_sync,
      key_stop => button_stop,
      key_step => button_step,
      choice   => choice,
      going    => going
    );

  led <= '0' & going & late & state;

  transmitter : entity work.tmds_transmitter
    port map (
      clk      => clk,
      reset    => reset,
      video    => shown,
      tx_clk   => clk,
      tx_reset => reset,
      tx_words => words
    );

  --------------------------------------------------------------------------------------------------
  -- Output lanes.

  place : entity work.word_strobe
    port map (
      clk        => clk,
      clk_x5     => clk_x5,
      reset      => reset_x5,
      out_strobe => out_strobe
    );

  -- The clock is sent as a word by an equal output, so that it leaves in step with the data.
  lane : for c in 0 to CHANNELS generate

    link_out : entity work.ddr_output
      port map (
        word   => words(10 * c + 9 downto 10 * c),
        clk_x5 => clk_x5,
        strobe => out_strobe,
        data   => pins(c)
      );

  end generate lane;

  out_data <= pins(CHANNELS - 1 downto 0);
  out_clk  <= pins(CHANNELS);

end architecture rtl;
