-- SPDX-License-Identifier: Apache-2.0
-- Digilent Atlys (XC6SLX45): HDMI in on J3, refocused HDMI out on J2.
--
-- This file has what belongs to the board and its family: pins (constraints/atlys.ucf), clocks, serialisers.
-- hdmi_control and hdmi_refocuser have everything that is common to all boards.
--
-- Clocks: clk_100 runs the control. The pixel clock is the TMDS clock of J3, or for the test pattern one made on the
-- board. A PLL makes it and its multiples for the receiver and the video path; a second PLL behind it makes those of
-- the transmitter. The clock domains are control (clk_100), pixels (receiver, video, refocuser), the receiver's half
-- words, the transmitter's words and half words; crossings are synchroniser, bus_crossing, reset_bridge, elastic_buffer
-- and the gearboxes.
--
-- Latency: that of hdmi_refocuser. Throughput: one pixel each clock.
-- Equation: out picture = refocus(in picture).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.core_pkg.all;
use work.hdmi_pkg.all;
use work.picture_pkg.all;
use work.tmds_pkg.all;
use work.video_pkg.all;

entity atlys_top is
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
    -- Test pattern: 640x480p60.
    PATTERN_H_ACTIVE : positive range 3 to 4095 := 640;
    PATTERN_H_FRONT  : positive range 1 to 4095 := 16;
    PATTERN_H_SYNC   : positive range 1 to 4095 := 96;
    PATTERN_H_BACK   : positive range 1 to 4095 := 48;
    PATTERN_V_ACTIVE : positive range 1 to 4095 := 480;
    PATTERN_V_FRONT  : positive range 1 to 4095 := 10;
    PATTERN_V_SYNC   : positive range 1 to 4095 := 2;
    PATTERN_V_BACK   : positive range 1 to 4095 := 33;
    -- Times in 10 ns, except DATA_PATIENCE, which counts METER_WINDOW (625 are 100 ms); a simulation shortens them.
    METER_WINDOW  : positive range 1 to 200000000 := 16000;
    LOCK_TIMEOUT  : positive range 1 to 200000000 := 1000000;
    DATA_PATIENCE : positive                      := 625;
    BUTTON_STABLE : positive range 1 to 200000000 := 1000000;
    BIT_TIME      : positive range 1 to 200000000 := 868;
    DDC_QUARTER   : positive range 1 to 200000000 := 500;
    DDC_PAUSE     : positive range 1 to 200000000 := 200000000;
    -- Frames for each slice of a sweep by the switch; 30 are half a second.
    SWITCH_FRAMES : positive range 1 to 255 := 30;
    -- Words without control tokens after which a channel is lost.
    ALIGN_TIMEOUT : positive := 8192
  );
  port (
    -- Oscillator, and the reset button (low while pressed).
    clk_100 : in    std_logic;
    reset_n : in    std_logic;
    -- HDMI in, J3, with its display data channel.
    in_clk_p  : in    std_logic;
    in_clk_n  : in    std_logic;
    in_data_p : in    std_logic_vector(2 downto 0);
    in_data_n : in    std_logic_vector(2 downto 0);
    in_scl    : in    std_logic;
    in_sda    : inout std_logic;
    -- HDMI out, J2, with its display data channel.
    out_clk_p  : out   std_logic;
    out_clk_n  : out   std_logic;
    out_data_p : out   std_logic_vector(2 downto 0);
    out_data_n : out   std_logic_vector(2 downto 0);
    out_scl    : inout std_logic;
    out_sda    : inout std_logic;
    -- Serial port, buttons, switches and LEDs of hdmi_control.
    uart_rx        : in    std_logic;
    uart_tx        : out   std_logic;
    button_up      : in    std_logic;
    button_down    : in    std_logic;
    button_clear   : in    std_logic;
    switch_pattern : in    std_logic;
    switch_pass    : in    std_logic;
    switch_sweep   : in    std_logic;
    button_output  : in    std_logic;
    switch_hide    : in    std_logic;
    switch_bottom  : in    std_logic;
    led            : out   std_logic_vector(7 downto 0)
  );
end entity atlys_top;

architecture rtl of atlys_top is

  constant CORE : core_t := picture_core_of
                            (
                              name                => "atlys_top",
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
                                   "atlys_top",
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

  -- Control: its reset, the state of the clocks, and the orders to them.
  signal reset_request : std_logic;
  signal reset         : std_logic;
  signal own_ready     : std_logic;
  signal clocks        : clocks_state_t;
  signal order         : clocks_order_t;
  -- Signals of the PLLs of receiver (0) and transmitter (1).
  signal configured_each : std_logic_vector(1 downto 0);
  signal pll_locked      : std_logic_vector(1 downto 0);

  -- Display data channels: levels of the pins, and lines to pull low.
  signal in_ddc      : ddc_t;
  signal in_sda_low  : std_logic;
  signal out_ddc     : ddc_t;
  signal out_ddc_low : ddc_t;

  -- Signals between this file and the entities common to all boards.
  signal panel    : panel_t;
  signal lanes    : lanes_t;
  signal settings : video_settings_t;
  signal state    : video_state_t;

  -- Clocks and resets. The input clock at the pin and on a global net; the chosen pixel clock and its multiples for
  -- both directions.
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
  signal half_reset      : std_logic;
  signal tx_half_reset   : std_logic;

  -- Serialisers.
  signal in_bits   : std_logic_vector(10 * CHANNELS - 1 downto 0);
  signal out_words : std_logic_vector(10 * CHANNELS + 9 downto 0);
  signal out_p     : std_logic_vector(CHANNELS downto 0);
  signal out_n     : std_logic_vector(CHANNELS downto 0);

  -- The constraints name these nets: without the attribute, synthesis could rename or absorb them.
  attribute keep : string;
  attribute keep of tmds_clk_global : signal is "TRUE";
  attribute keep of clk             : signal is "TRUE";
  attribute keep of clk_x2          : signal is "TRUE";
  attribute keep of tx_clk          : signal is "TRUE";
  attribute keep of tx_clk_x2       : signal is "TRUE";
  attribute keep of own_ready       : signal is "TRUE";
  attribute keep of pll_locked      : signal is "TRUE";

begin

  --------------------------------------------------------------------------------------------------
  -- Entities common to all boards.

  control : entity work.hdmi_control
    generic map (
      SLICES        => slices_of(CORE),
      MAX_COLUMNS   => MAX_COLUMNS,
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
      clk         => clk_100,
      reset       => reset,
      tmds_clk    => tmds_clk_global,
      pixel_clk   => clk,
      clocks      => clocks,
      order       => order,
      in_ddc      => in_ddc,
      in_sda_low  => in_sda_low,
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

  panel <=
  (
    button_up      => button_up,
    button_down    => button_down,
    button_clear   => button_clear,
    switch_pattern => switch_pattern,
    switch_pass    => switch_pass,
    switch_sweep   => switch_sweep,
    button_output  => button_output,
    switch_hide    => switch_hide,
    switch_bottom  => switch_bottom
  );

  -- The phase detectors follow the bits, so wrong words need not steer the delays.
  path : entity work.hdmi_refocuser
    generic map (
      CORE            => CORE,
      PATTERN_COLUMNS => PATTERN_H_ACTIVE,
      PATTERN_ROWS    => PATTERN_V_ACTIVE,
      ALIGN_TIMEOUT   => ALIGN_TIMEOUT
    )
    port map (
      clk            => clk,
      tx_clk         => tx_clk,
      run            => order.run,
      in_bits        => in_bits,
      out_words      => out_words,
      pattern_timing => PATTERN,
      settings       => settings,
      state          => state
    );

  --------------------------------------------------------------------------------------------------
  -- Clocks and resets.

  -- The button is low while pressed; the logic's reset is high.
  reset_request <= not reset_n;

  reset_of_control : entity work.reset_bridge
    port map (
      clk     => clk_100,
      request => reset_request,
      reset   => reset
    );

  -- The clock lane has no data: only its frequency is used.
  clock_pins : entity work.clock_input
    port map (
      clk_p      => in_clk_p,
      clk_n      => in_clk_n,
      clk        => tmds_clk,
      clk_global => tmds_clk_global
    );

  -- The PLL follows whichever clock is chosen, so all behind it is independent of the choice.
  clock_select : entity work.pixel_clock_select
    port map (
      clk_100   => clk_100,
      reset     => reset,
      tmds_clk  => tmds_clk,
      use_own   => order.use_own,
      clk       => source_clk,
      own_ready => own_ready
    );

  -- Both PLLs have one setting, which is written to both at the same time.
  clocks <= (own_ready, configured_each(0) and configured_each(1), pll_locked(0), pll_locked(1));

  -- Both PLLs make the same multiples, because receiver and transmitter have a BUFPLL each in their own banks of pins.
  -- The transmitter's PLL takes the receiver's pixel clock as its source, which removes the jitter of a cable.
  receive_clocks : entity work.serial_clocks
    port map (
      clk_in        => source_clk,
      pll_reset     => order.receive_reset,
      control_clk   => clk_100,
      control_reset => reset,
      configure     => order.configure,
      high          => order.high,
      configured    => configured_each(0),
      clk           => clk,
      clk_x2        => clk_x2,
      io_clk        => io_clk,
      io_strobe     => io_strobe,
      locked        => pll_locked(0)
    );

  transmit_clocks : entity work.serial_clocks
    port map (
      clk_in        => clk,
      pll_reset     => order.transmit_reset,
      control_clk   => clk_100,
      control_reset => reset,
      configure     => order.configure,
      high          => order.high,
      configured    => configured_each(1),
      clk           => tx_clk,
      clk_x2        => tx_clk_x2,
      io_clk        => tx_io_clk,
      io_strobe     => tx_io_strobe,
      locked        => pll_locked(1)
    );

  -- The half words have clocks of their own at twice the pixel clock: each has a reset that ends in step with it.
  stop <= not order.run;

  reset_of_halves : entity work.reset_bridge
    port map (
      clk     => clk_x2,
      request => stop,
      reset   => half_reset
    );

  reset_of_tx_halves : entity work.reset_bridge
    port map (
      clk     => tx_clk_x2,
      request => stop,
      reset   => tx_half_reset
    );

  --------------------------------------------------------------------------------------------------
  -- Serialisers.

  -- Each lane has its own delay, because the wires of a cable differ by more than a bit.
  channel : for c in 0 to CHANNELS - 1 generate

    link_in : entity work.tmds_input
      port map (
        data_p    => in_data_p(c),
        data_n    => in_data_n(c),
        io_clk    => io_clk,
        io_strobe => io_strobe,
        clk       => clk,
        clk_x2    => clk_x2,
        reset     => half_reset,
        bits      => in_bits(10 * c + 9 downto 10 * c),

        tracking    => lanes.tracking(c),
        taps        => lanes.taps(TAP_BITS * c + TAP_BITS - 1 downto TAP_BITS * c),
        hung_toggle => lanes.hung_toggle(c)
      );

  end generate channel;

  -- The clock is sent as a word by an equal serialiser, so that it leaves in step with the data.
  lane : for c in 0 to CHANNELS generate

    link_out : entity work.tmds_output
      port map (
        word      => out_words(10 * c + 9 downto 10 * c),
        io_clk    => tx_io_clk,
        io_strobe => tx_io_strobe,
        clk       => tx_clk,
        clk_x2    => tx_clk_x2,
        reset     => tx_half_reset,
        data_p    => out_p(c),
        data_n    => out_n(c)
      );

  end generate lane;

  out_data_p <= out_p(CHANNELS - 1 downto 0);
  out_data_n <= out_n(CHANNELS - 1 downto 0);
  out_clk_p  <= out_p(CHANNELS);
  out_clk_n  <= out_n(CHANNELS);

end architecture rtl;
