-- SPDX-License-Identifier: Apache-2.0
-- Radiona ULX3S (LFE5U-12F, -25F, -45F, -85F): HDMI in on a GPDI PMOD, refocused HDMI out on the board's GPDI.
--
-- This file has what belongs to the board and its family: pins (constraints/ulx3s.lpf), clocks, lanes. hdmi_control and
-- hdmi_refocuser have everything that is common to all boards.
--
-- Clocks: control_clk, made from the oscillator, runs the control. The pixel clock is the TMDS clock of the input, or
-- for the test pattern one made from the oscillator. A PLL makes it and five times it, at which a lane carries two bits
-- each clock. The transmitter has the same clocks. Crossings are synchroniser, bus_crossing, reset_bridge, and the
-- words of the lanes, which word_strobe keeps away from clock edges.
--
-- Latency: that of hdmi_refocuser. Throughput: one pixel each clock.
-- Equation: out picture = refocus(in picture).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.core_pkg.all;
use work.hdmi_pkg.all;
use work.math_pkg.all;
use work.picture_pkg.all;
use work.tmds_pkg.all;
use work.video_pkg.all;

entity ulx3s_top is
  generic (
    -- Generics of raster_refocuser.
    MICRO_IMAGE_SIZE    : positive range 1 to 128  := 5;
    SHIFTS              : string                   := "-3";
    INTERPOLATION_ORDER : natural range 0 to 3     := 0;
    HOLD                : boolean                  := false;
    MAX_COLUMNS         : positive range 1 to 8192 := 1280;
    EXACT               : boolean                  := false;
    FRACTION_BITS       : natural range 0 to 12    := 4;
    GUARD_BITS          : natural range 0 to 12    := 2;
    BROADCAST_TAPS      : natural                  := 0;
    ENGINE              : string                   := "fir";
    BOX                 : string                   := "";
    -- Test pattern: 640x480 at OWN_DIVIDE = 24.
    PATTERN_H_ACTIVE : positive range 3 to 4095 := 640;
    PATTERN_H_FRONT  : positive range 1 to 4095 := 16;
    PATTERN_H_SYNC   : positive range 1 to 4095 := 96;
    PATTERN_H_BACK   : positive range 1 to 4095 := 48;
    PATTERN_V_ACTIVE : positive range 1 to 4095 := 480;
    PATTERN_V_FRONT  : positive range 1 to 4095 := 10;
    PATTERN_V_SYNC   : positive range 1 to 4095 := 2;
    PATTERN_V_BACK   : positive range 1 to 4095 := 33;
    -- Frequency of the control's clock in MHz.
    CONTROL_MHZ : positive range 5 to 1000 := 50;
    -- Times in 10 ns, except DATA_PATIENCE, which counts METER_WINDOW (625 are 100 ms); a simulation shortens them.
    METER_WINDOW  : positive range 1 to 200000000 := 16000;
    LOCK_TIMEOUT  : positive range 1 to 200000000 := 5000000;
    DATA_PATIENCE : positive                      := 625;
    BUTTON_STABLE : positive range 1 to 200000000 := 1000000;
    BIT_TIME      : positive range 1 to 200000000 := 868;
    DDC_QUARTER   : positive range 1 to 200000000 := 500;
    DDC_PAUSE     : positive range 1 to 200000000 := 200000000;
    -- Frames for each slice of a sweep by the switch; 30 are half a second.
    SWITCH_FRAMES : positive range 1 to 255 := 30;
    -- Words without control tokens after which a channel is lost.
    ALIGN_TIMEOUT : positive := 8192;
    -- Pixel clocks of the build: 80 / CLOCK_RANGE to 160 / CLOCK_RANGE MHz (pixel_clocks); the board's own pixel clock
    -- is 600 MHz / OWN_DIVIDE.
    CLOCK_RANGE : positive range 2 to 4 := 4;
    OWN_DIVIDE  : positive              := 24;
    -- Words without runs of control tokens after which a delay counts as useless (phase_search).
    SEARCH_TIMEOUT : positive := 8192
  );
  port (
    -- Oscillator, and the reset button (low while pressed).
    clk_25  : in    std_logic;
    reset_n : in    std_logic;
    -- HDMI in on the PMOD, with its display data channel; pairs by their positive pins. in_hot_plug: a monitor is
    -- there.
    in_clk      : in    std_logic;
    in_data     : in    std_logic_vector(2 downto 0);
    in_scl      : in    std_logic;
    in_sda      : inout std_logic;
    in_hot_plug : out   std_logic;
    -- HDMI out on GPDI, with its display data channel.
    out_clk  : out   std_logic;
    out_data : out   std_logic_vector(2 downto 0);
    out_scl  : inout std_logic;
    out_sda  : inout std_logic;
    -- Serial port, buttons, switches and LEDs of hdmi_control.
    uart_rx        : in    std_logic;
    uart_tx        : out   std_logic;
    button_up      : in    std_logic;
    button_down    : in    std_logic;
    button_clear   : in    std_logic;
    switch_pattern : in    std_logic;
    switch_pass    : in    std_logic;
    switch_sweep   : in    std_logic;
    led            : out   std_logic_vector(7 downto 0);
    -- These pins only need their pull-ups: low, they would start the loader of the board's ESP32. GPIO0 is at the first
    -- pin up to v3.1.5, at the second from v3.1.6 on, where the first is another pin of the ESP32.
    wifi_gpio0     : in    std_logic;
    wifi_gpio0_new : in    std_logic
  );
end entity ulx3s_top;

architecture rtl of ulx3s_top is

  constant CORE : core_t := picture_core_of
                            (
                              name                => "ulx3s_top",
                              micro_image_size    => MICRO_IMAGE_SIZE,
                              shifts              => SHIFTS,
                              interpolation_order => INTERPOLATION_ORDER,
                              hold                => HOLD,
                              max_columns         => MAX_COLUMNS,
                              exact               => EXACT,
                              fraction_bits       => FRACTION_BITS,
                              guard_bits          => GUARD_BITS,
                              broadcast_taps      => BROADCAST_TAPS,
                              engine              => ENGINE,
                              box                 => BOX
                            );

  constant PATTERN : timing_t := mode_timing
                                 (
                                   "ulx3s_top",
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

  -- Clocks and resets.
  signal control_clk   : std_logic;
  signal own_clk       : std_logic;
  signal own_ready     : std_logic;
  signal clocks        : clocks_state_t;
  signal order         : clocks_order_t;
  signal clk           : std_logic;
  signal clk_x5        : std_logic;
  signal pll_locked    : std_logic;
  signal reset_request : std_logic;
  signal reset         : std_logic;
  signal stop          : std_logic;
  signal pixel_reset   : std_logic;
  signal reset_x5      : std_logic;

  -- Display data channels: levels of the pins, and lines to pull low.
  signal in_ddc      : ddc_t;
  signal in_sda_low  : std_logic;
  signal out_ddc     : ddc_t;
  signal out_ddc_low : ddc_t;

  signal panel    : panel_t;
  signal lanes    : lanes_t;
  signal settings : video_settings_t;
  signal state    : video_state_t;
  signal wrong    : std_logic_vector(CHANNELS - 1 downto 0);

  -- Lanes.
  signal in_strobe  : std_logic;
  signal out_strobe : std_logic;
  signal in_bits    : std_logic_vector(10 * CHANNELS - 1 downto 0);
  signal out_words  : std_logic_vector(10 * CHANNELS + 9 downto 0);
  signal pins       : std_logic_vector(CHANNELS downto 0);

begin

  --------------------------------------------------------------------------------------------------
  -- Entities common to all boards.

  control : entity work.hdmi_control
    generic map (
      SLICES        => slices_of(CORE),
      MAX_COLUMNS   => MAX_COLUMNS,
      CLOCK_RANGE   => CLOCK_RANGE,
      CONTROL_MHZ   => CONTROL_MHZ,
      METER_WINDOW  => METER_WINDOW,
      LOCK_TIMEOUT  => LOCK_TIMEOUT,
      DATA_PATIENCE => DATA_PATIENCE,
      BUTTON_STABLE => BUTTON_STABLE,
      BIT_TIME      => BIT_TIME,
      DDC_QUARTER   => DDC_QUARTER,
      DDC_PAUSE     => DDC_PAUSE,
      SWITCH_FRAMES => SWITCH_FRAMES
    )
    port map (
      clk         => control_clk,
      reset       => reset,
      tmds_clk    => in_clk,
      pixel_clk   => clk,
      clocks      => clocks,
      order       => order,
      in_ddc      => in_ddc,
      in_sda_low  => in_sda_low,
      in_hot_plug => in_hot_plug,
      out_ddc     => out_ddc,
      out_ddc_low => out_ddc_low,
      uart_rx     => uart_rx,
      uart_tx     => uart_tx,
      panel       => panel,
      led         => led,
      lanes       => lanes,
      settings    => settings,
      state       => state
    );

  -- A line that a pull-up holds has the level H in simulation and counts as high.
  in_ddc  <= (to_x01(in_scl), to_x01(in_sda));
  out_ddc <= (to_x01(out_scl), to_x01(out_sda));

  -- The channel is open drain: lines are pulled low or released, never driven high.
  in_sda  <= '0' when in_sda_low = '1' else
             'Z';
  out_scl <= '0' when out_ddc_low.scl = '1' else
             'Z';
  out_sda <= '0' when out_ddc_low.sda = '1' else
             'Z';

  -- The board has no buttons and switches for outputs and text.
  panel <=
  (
    button_up      => button_up,
    button_down    => button_down,
    button_clear   => button_clear,
    switch_pattern => switch_pattern,
    switch_pass    => switch_pass,
    switch_sweep   => switch_sweep,
    button_output  => '0',
    switch_hide    => '0',
    switch_bottom  => '0'
  );

  -- Wrong words go back to the search of the delays: they show that the middle of the bits has drifted.
  path : entity work.hdmi_refocuser
    generic map (
      CORE            => CORE,
      PATTERN_COLUMNS => PATTERN_H_ACTIVE,
      PATTERN_ROWS    => PATTERN_V_ACTIVE,
      ALIGN_TIMEOUT   => ALIGN_TIMEOUT
    )
    port map (
      clk            => clk,
      tx_clk         => clk,
      run            => order.run,
      in_bits        => in_bits,
      out_words      => out_words,
      pattern_timing => PATTERN,
      settings       => settings,
      state          => state,
      wrong          => wrong
    );

  --------------------------------------------------------------------------------------------------
  -- Clocks and resets.

  -- Control and test pattern have clocks even without a source.
  oscillator : entity work.oscillator_clocks
    generic map (
      OSCILLATOR_MHZ => 25,
      CONTROL_MHZ    => CONTROL_MHZ,
      OWN_DIVIDE     => OWN_DIVIDE
    )
    port map (
      oscillator_clk => clk_25,
      control_clk    => control_clk,
      own_clk        => own_clk,
      locked         => own_ready
    );

  -- Before the oscillator's PLL has locked, the control clock cannot be trusted.
  reset_request <= not reset_n or not own_ready;

  -- The EDID keeps working while the button bounces or the lock has a short gap.
  reset_of_control : entity work.reset_filter
    generic map (
      ASSERT_CLOCKS  => CONTROL_MHZ,
      RELEASE_CLOCKS => larger(LOCK_TIMEOUT / 5000 * CONTROL_MHZ, 16)
    )
    port map (
      clk     => control_clk,
      request => reset_request,
      reset   => reset
    );

  pixel_clocks_of_both : entity work.pixel_clocks
    generic map (
      BIT_DIVIDE => CLOCK_RANGE
    )
    port map (
      tmds_clk  => in_clk,
      own_clk   => own_clk,
      use_own   => order.use_own,
      pll_reset => order.receive_reset,
      clk       => clk,
      clk_x5    => clk_x5,
      locked    => pll_locked
    );

  -- One PLL serves both directions, so both have the same lock. Its setting is fixed by the build, so it counts as
  -- configured.
  clocks <= (own_ready, '1', pll_locked, pll_locked);

  stop <= not order.run;

  reset_of_pixels : entity work.reset_bridge
    port map (
      clk     => clk,
      request => stop,
      reset   => pixel_reset
    );

  reset_of_lanes : entity work.reset_bridge
    port map (
      clk     => clk_x5,
      request => stop,
      reset   => reset_x5
    );

  --------------------------------------------------------------------------------------------------
  -- Lanes.

  -- One mark for all input lanes and another for all output lanes, so that the words of all channels change together.
  place : entity work.word_strobe
    port map (
      clk        => clk,
      clk_x5     => clk_x5,
      reset      => reset_x5,
      in_strobe  => in_strobe,
      out_strobe => out_strobe
    );

  -- Each lane follows its own drift.
  channel : for c in 0 to CHANNELS - 1 generate

    link_in : entity work.ddr_input
      generic map (
        TIMEOUT => SEARCH_TIMEOUT
      )
      port map (
        data        => in_data(c),
        clk         => clk,
        clk_x5      => clk_x5,
        strobe      => in_strobe,
        reset       => pixel_reset,
        bits        => in_bits(10 * c + 9 downto 10 * c),
        wrong       => wrong(c),
        tracking    => lanes.tracking(c),
        taps        => lanes.taps(TAP_BITS * c + TAP_BITS - 1 downto TAP_BITS * c),
        hung_toggle => lanes.hung_toggle(c)
      );

  end generate channel;

  -- The clock is sent as a word by an equal output, so that it leaves in step with the data.
  lane : for c in 0 to CHANNELS generate

    link_out : entity work.ddr_output
      port map (
        word   => out_words(10 * c + 9 downto 10 * c),
        clk_x5 => clk_x5,
        strobe => out_strobe,
        data   => pins(c)
      );

  end generate lane;

  out_data <= pins(CHANNELS - 1 downto 0);
  out_clk  <= pins(CHANNELS);

end architecture rtl;
