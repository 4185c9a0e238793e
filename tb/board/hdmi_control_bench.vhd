-- SPDX-License-Identifier: Apache-2.0
-- hdmi_control with a port for each field of the records that cocotb is to reach.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.fault_pkg.all;
use work.hdmi_pkg.all;
use work.tmds_pkg.all;
use work.video_pkg.all;

entity hdmi_control_bench is
  generic (
    SLICES        : positive := 3;
    MAX_COLUMNS   : positive := 640;
    METER_WINDOW  : positive := 320;
    LOCK_TIMEOUT  : positive := 2000;
    DATA_PATIENCE : positive := 4;
    BIT_CLOCKS    : positive := 4;
    SWITCH_FRAMES : positive := 30;
    CLOCK_RANGE   : natural  := 0;
    -- Times keep their clocks.
    CONTROL_MHZ : positive := 100
  );
  port (
    clk             : in    std_logic;
    reset           : in    std_logic;
    tmds_clk        : in    std_logic;
    pixel_clk       : in    std_logic;
    receive_locked  : in    std_logic;
    transmit_locked : in    std_logic;
    receive_reset   : out   std_logic;
    transmit_reset  : out   std_logic;
    run             : out   std_logic;
    scl             : in    std_logic;
    sda             : in    std_logic;
    sda_low         : out   std_logic;
    out_scl         : in    std_logic;
    out_scl_low     : out   std_logic;
    uart_rx         : in    std_logic;
    uart_tx         : out   std_logic;
    button_clear    : in    std_logic;
    led             : out   std_logic_vector(7 downto 0);
    tracking        : in    std_logic_vector(CHANNELS - 1 downto 0);
    taps            : in    std_logic_vector(TAP_BITS * CHANNELS - 1 downto 0);
    hung_toggle     : in    std_logic_vector(CHANNELS - 1 downto 0);
    -- Of the settings.
    pass_through : out   std_logic;
    slice        : out   std_logic_vector(7 downto 0);
    sweep        : out   std_logic;
    sweep_frames : out   std_logic_vector(7 downto 0);
    show_pattern : out   std_logic;
    clear_toggle : out   std_logic;
    polarity     : out   polarity_t;
    -- Of the state.
    aligned     : in    std_logic_vector(CHANNELS - 1 downto 0);
    following   : in    std_logic;
    unsupported : in    std_logic;
    varying     : in    std_logic;
    inverted    : in    std_logic_vector(CHANNELS - 1 downto 0);
    error_flags : in    std_logic_vector(ERRORS - 1 downto 0);
    word_errors : in    std_logic_vector(WORD_ERROR_BITS * CHANNELS - 1 downto 0);
    columns     : in    std_logic_vector(COUNT_BITS - 1 downto 0);
    rows        : in    std_logic_vector(COUNT_BITS - 1 downto 0);
    hsync       : in    std_logic;
    vsync       : in    std_logic;
    v_sync_now  : in    std_logic;
    hdmi        : in    std_logic;
    avi         : in    std_logic;
    colour      : in    std_logic_vector(1 downto 0);
    limited     : in    std_logic;
    vic         : in    std_logic_vector(7 downto 0)
  );
end entity hdmi_control_bench;

architecture test of hdmi_control_bench is

  signal clocks   : clocks_state_t;
  signal order    : clocks_order_t;
  signal in_ddc   : ddc_t;
  signal out_ddc  : ddc_t;
  signal panel    : panel_t;
  signal lanes    : lanes_t;
  signal settings : video_settings_t;
  signal state    : video_state_t;

  signal out_ddc_low : ddc_t;

begin

  -- No clock of the board's own; a PLL that needs no setting counts as configured.
  clocks <= ('0', '1', receive_locked, transmit_locked);
  in_ddc <= (scl, sda);

  out_ddc     <= (out_scl, '1');
  out_scl_low <= out_ddc_low.scl;

  panel <= (button_clear => button_clear, others => '0');
  lanes <= (tracking, taps, hung_toggle);

  receive_reset  <= order.receive_reset;
  transmit_reset <= order.transmit_reset;
  run            <= order.run;

  pass_through <= settings.choice.pass_through;
  slice        <= settings.choice.slice;
  sweep        <= settings.choice.sweep;
  sweep_frames <= settings.choice.sweep_frames;
  show_pattern <= settings.show_pattern;
  clear_toggle <= settings.clear_toggle;
  polarity     <= settings.polarity;

  fill : process (aligned, following, unsupported, varying, inverted, error_flags, word_errors, columns, rows, hsync,
                  vsync, v_sync_now, hdmi, avi, colour, limited, vic) is

    variable filled : video_state_t;

  begin

    -- What no port drives is zero.
    filled                  := to_state((others => '0'));
    filled.aligned          := aligned;
    filled.following        := following;
    filled.unsupported      := unsupported;
    filled.varying          := varying;
    filled.inverted         := inverted;
    filled.errors           := error_flags;
    filled.word_errors      := word_errors;
    filled.columns          := unsigned(columns);
    filled.rows             := unsigned(rows);
    filled.h_sync           := hsync;
    filled.v_sync           := vsync;
    filled.v_sync_now       := v_sync_now;
    filled.hdmi             := hdmi;
    filled.info.informed    := avi;
    filled.info.colour      := colour;
    filled.info.limited     := limited;
    filled.info.format_code := vic;
    state                   <= filled;

  end process fill;

  under_test : entity work.hdmi_control
    generic map (
      SLICES        => SLICES,
      MAX_COLUMNS   => MAX_COLUMNS,
      CONTROL_MHZ   => CONTROL_MHZ,
      METER_WINDOW  => METER_WINDOW * 100 / CONTROL_MHZ,
      LOCK_TIMEOUT  => LOCK_TIMEOUT * 100 / CONTROL_MHZ,
      DATA_PATIENCE => DATA_PATIENCE,
      CLOCK_RANGE   => CLOCK_RANGE,
      BUTTON_STABLE => 400 / CONTROL_MHZ,
      BIT_TIME      => BIT_CLOCKS * 100 / CONTROL_MHZ,
      DDC_QUARTER   => 5000 / CONTROL_MHZ,
      DDC_PAUSE     => 2000000 / CONTROL_MHZ,
      SWITCH_FRAMES => SWITCH_FRAMES
    )
    port map (
      clk         => clk,
      reset       => reset,
      tmds_clk    => tmds_clk,
      pixel_clk   => pixel_clk,
      clocks      => clocks,
      order       => order,
      in_ddc      => in_ddc,
      in_sda_low  => sda_low,
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

end architecture test;
