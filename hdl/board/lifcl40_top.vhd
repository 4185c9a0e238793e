-- SPDX-License-Identifier: Apache-2.0
-- CrossLink-NX evaluation board (LIFCL-40): a camera at its camera connector, refocused parallel video out.
--
-- This file has what belongs to the board and its family: pins (constraints/lifcl40.pdc), clock, D-PHY.
-- camera_refocuser has everything else.
--
-- Without a sensor in sensor_pkg, the frames are a raster of micro images already, in grey, four pixels each clock:
-- from a sensor with micro images of exactly M x M pixels, 360 million pixels a second on four lanes of 900 Mb/s.
--
-- Clocks: byte_clk from the D-PHY, and clk from the device's oscillator, 450 MHz / (CLOCK_DIVIDE + 1) within 7 %. The
-- crossing is in csi_receiver.
--
-- Latency: that of camera_refocuser, and a line. Throughput: one pixel each clock, PIXELS_PER_CLOCK without a sensor.
-- Equation: out frame = refocus(raster(raw frame)).

library ieee;
use ieee.std_logic_1164.all;

library lifcl;
use lifcl.components.all;

library work;
use work.camera_pkg.all;
use work.core_pkg.all;
use work.math_pkg.all;
use work.refocuser_pkg.all;
use work.sensor_pkg.all;

entity lifcl40_top is
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
    PIXELS_PER_CLOCK    : positive range 1 to 8    := 4;
    -- Lines of a frame; with a sensor its raster sets them.
    ROWS : positive range 1 to 65535 := 480;
    -- Divider of the oscillator; 3 gives 112.5 MHz.
    CLOCK_DIVIDE : positive range 1 to 255 := 3;
    -- Clocks in a millisecond, and in a bit of the serial port; 0: computed from the frequency.
    MILLISECOND : natural := 0;
    BIT_TIME    : natural := 0
  );
  port (
    -- Reset button (low while pressed).
    reset_n : in    std_logic;
    -- The camera: pads of the D-PHY, I2C, reset (low).
    cam_clk_p   : inout std_logic;
    cam_clk_n   : inout std_logic;
    cam_data_p  : inout std_logic_vector(3 downto 0);
    cam_data_n  : inout std_logic_vector(3 downto 0);
    cam_scl     : inout std_logic;
    cam_sda     : inout std_logic;
    cam_reset_n : out   std_logic;
    -- Serial port for calibrations.
    uart_rx : in    std_logic;
    uart_tx : out   std_logic;
    -- Switches for the slice.
    slice : in    std_logic_vector(7 downto 0);
    -- Refocused video: its clock, near whose falling edge the other outputs are stable; frame and line valid; pixels
    -- from the low bits on, red first.
    out_clk         : out   std_logic;
    out_frame_valid : out   std_logic;
    out_line_valid  : out   std_logic;
    out_data        : out   std_logic_vector(39 downto 0);
    -- LEDs (low: lit): state of camera_refocuser.
    led_n : out   std_logic_vector(4 downto 0)
  );
end entity lifcl40_top;

architecture rtl of lifcl40_top is

  constant CORE : core_t := core_of
                            (
                              name                => "lifcl40_top",
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
                              pixels_per_clock    => PIXELS_PER_CLOCK,
                              channels            => CAMERA_CHANNELS,
                              pixel_bits          => RAW_BITS
                            );

  constant CLOCK_KHZ : positive := 450000 / (CLOCK_DIVIDE + 1);
  constant WIDTH     : positive := row_bits(CORE);
  constant TOO_WIDE  : boolean  := not takes(WIDTH <= 40, "lifcl40_top: PIXELS_PER_CLOCK needs more than 40 bits");

  signal clk           : std_logic;
  signal reset_request : std_logic;
  signal reset         : std_logic;
  -- The camera: bytes of its lanes; levels of its I2C lines, and lines to pull low.
  signal byte_clk   : std_logic;
  signal lane_valid : std_logic_vector(CAMERA_LANES - 1 downto 0);
  signal lane_sync  : std_logic_vector(CAMERA_LANES - 1 downto 0);
  signal lane_data  : std_logic_vector(8 * CAMERA_LANES - 1 downto 0);
  signal scl        : std_logic;
  signal sda        : std_logic;
  signal scl_low    : std_logic;
  signal sda_low    : std_logic;
  -- Refocused frames as a stream, then as parallel video.
  signal new_tvalid  : std_logic;
  signal new_tready  : std_logic;
  signal new_tdata   : std_logic_vector(WIDTH - 1 downto 0);
  signal new_tuser   : std_logic_vector(0 downto 0);
  signal new_tlast   : std_logic;
  signal frame_valid : std_logic;
  signal line_valid  : std_logic;
  signal data        : std_logic_vector(WIDTH - 1 downto 0);
  signal state       : std_logic_vector(4 downto 0);

  -- A number as text, because a parameter of the oscillator is a text.

  function decimal (
    value : natural
  ) return string is

    constant DIGITS : string(1 to 10) := "0123456789";

  begin

    if value < 10 then
      return DIGITS(value + 1 to value + 1);
    end if;

    return decimal(value / 10) & DIGITS(value mod 10 + 1);

  end function decimal;

begin

  oscillator : component osca
    generic map (
      HF_CLK_DIV => decimal(CLOCK_DIVIDE),
      HF_OSC_EN  => "ENABLED"
    )
    port map (
      hfouten  => '1',
      hfsdscen => '0',
      hfclkout => clk
    );

  -- One button resets board and camera, so the registers are written into a sensor that has just started.
  reset_request <= not reset_n;
  cam_reset_n   <= reset_n;

  bridge : entity work.reset_bridge
    port map (
      clk     => clk,
      request => reset_request,
      reset   => reset
    );

  lanes : entity work.dphy_input
    generic map (
      LANES    => CAMERA_LANES,
      SYNC_MHZ => CLOCK_KHZ / 1000
    )
    port map (
      clk_p      => cam_clk_p,
      clk_n      => cam_clk_n,
      data_p     => cam_data_p,
      data_n     => cam_data_n,
      sync_clk   => clk,
      reset      => reset,
      byte_clk   => byte_clk,
      lane_valid => lane_valid,
      lane_sync  => lane_sync,
      lane_data  => lane_data
    );

  -- A line that a pull-up holds has the level H in simulation and counts as high.
  scl     <= to_x01(cam_scl);
  sda     <= to_x01(cam_sda);
  cam_scl <= '0' when scl_low = '1' else
             'Z';
  cam_sda <= '0' when sda_low = '1' else
             'Z';

  camera : entity work.camera_refocuser
    generic map (
      CORE        => CORE,
      ROWS        => ROWS,
      CLOCK_KHZ   => CLOCK_KHZ,
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
      scl           => scl,
      sda           => sda,
      scl_low       => scl_low,
      sda_low       => sda_low,
      uart_rx       => uart_rx,
      uart_tx       => uart_tx,
      slice         => slice,
      m_axis_tvalid => new_tvalid,
      m_axis_tready => new_tready,
      m_axis_tdata  => new_tdata,
      m_axis_tuser  => new_tuser,
      m_axis_tlast  => new_tlast,
      state         => state
    );

  monitor : entity work.stream_to_parallel
    generic map (
      WIDTH       => WIDTH,
      MAX_COLUMNS => larger(CORE.columns / CORE.pixels, 2),
      ROWS        => 65535
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => new_tvalid,
      s_axis_tready => new_tready,
      s_axis_tdata  => new_tdata,
      s_axis_tuser  => new_tuser,
      s_axis_tlast  => new_tlast,
      frame_valid   => frame_valid,
      line_valid    => line_valid,
      data          => data
    );

  -- Registers at the pins, so that all bits leave at the same time after the clock, however the logic is placed.
  send : process (clk) is
  begin

    if rising_edge(clk) then
      out_frame_valid <= frame_valid;
      out_line_valid  <= line_valid;
      -- High pins that a core of fewer pixels or bits does not use stay low.
      out_data                     <= (others => '0');
      out_data(WIDTH - 1 downto 0) <= data;
      led_n                        <= not state;
    end if;

  end process send;

  -- A clock net has no direct way to a pin: the clock leaves through an output register, high in the first half.
  clock_out : component oddrx1
    port map (
      sclk => clk,
      rst  => '0',
      d0   => '1',
      d1   => '0',
      q    => out_clk
    );

end architecture rtl;
