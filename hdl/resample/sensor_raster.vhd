-- SPDX-License-Identifier: Apache-2.0
-- From a sensor to the raster of micro images: colour_mosaic, if the sensor has a mosaic, then resampler.
--
-- Latency: that of resampler, with MOSAIC that of colour_mosaic more. Throughput: one raw pixel each clock, one pixel
-- of the raster each clock.
-- Equation: with MOSAIC that of colour_mosaic, followed by that of resampler.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity sensor_raster is
  generic (
    -- true: the sensor has a colour filter mosaic; CHANNELS must be 3.
    MOSAIC : boolean := false;
    -- M, and the generics of the resampler.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    HEXAGONAL        : boolean                     := false;
    SKEWED           : boolean                     := false;
    MAX_COLUMNS      : positive range 2 to 8192    := 2048;
    LINES            : positive range 4 to 256     := 8;
    LENSES           : positive range 2 to 1048576 := 2;
    MOVES            : boolean                     := false;
    GAINS            : boolean                     := false;
    CHANNELS         : positive range 1 to 3       := 1;
    PIXEL_BITS       : positive range 1 to 16      := 8;
    FRACTION_BITS    : positive range 8 to 17      := 16;
    WEIGHT_BITS      : positive range 2 to 8       := 8;
    GUARD_BITS       : positive range 1 to 3       := 3;
    GAIN_BITS        : positive range 4 to 14      := 12
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Size of the raw frame; must be constant until the frame has left.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- Line (bit 1) and column (bit 0) of the mosaic's first red pixel.
    red_place : in    std_logic_vector(1 downto 0);
    -- Load port: the kind of word (resample_pkg: register, lens, profile, commit), its address, its data.
    load_write   : in    std_logic;
    load_kind    : in    std_logic_vector(1 downto 0);
    load_address : in    std_logic_vector(19 downto 0);
    load_data    : in    std_logic_vector(39 downto 0);
    -- Raw frames: AXI4-Stream video, channel 0 in the low bits.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(choose(MOSAIC, 1, CHANNELS) * PIXEL_BITS - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    -- Raster of micro images.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tlast  : out   std_logic;
    -- Size of the raster; between frames that of the last one.
    raster_columns : out   std_logic_vector(15 downto 0);
    raster_rows    : out   std_logic_vector(15 downto 0);
    -- Faults by the bits of resampler, which stay set until error_clear. Bits 0 to 4 include those of the mosaic.
    error_flags : out   std_logic_vector(5 downto 0);
    error_clear : in    std_logic := '0'
  );
end entity sensor_raster;

architecture rtl of sensor_raster is

  -- A mosaic gives three channels, so the resampler needs three.
  constant REFUSED : boolean := not takes(not MOSAIC or CHANNELS = 3, "sensor_raster: MOSAIC requires CHANNELS = 3");

  -- Channels behind the mosaic.
  constant COLOURS : positive := choose(MOSAIC, 3, CHANNELS);

  -- The first pixel of a frame is taken; raw pixels with all their colours; the raster.
  signal taken           : std_logic;
  signal in_tready       : std_logic;
  signal raw_tvalid      : std_logic;
  signal raw_tready      : std_logic;
  signal raw_tdata       : std_logic_vector(COLOURS * PIXEL_BITS - 1 downto 0);
  signal raster          : std_logic_vector(COLOURS * PIXEL_BITS - 1 downto 0);
  signal raw_tuser       : std_logic_vector(0 downto 0);
  signal raw_tlast       : std_logic;
  signal mosaic_flags    : std_logic_vector(4 downto 0);
  signal resampler_flags : std_logic_vector(5 downto 0);

begin

  s_axis_tready <= in_tready;
  -- The mosaic holds a frame back for two lines, but its calibration is that of this clock.
  taken <= s_axis_tvalid and in_tready and s_axis_tuser(0);

  -- A grey or an RGB sensor needs nothing in front of the resampler.
  plain : if not MOSAIC generate
    raw_tvalid   <= s_axis_tvalid;
    in_tready    <= raw_tready;
    raw_tdata    <= s_axis_tdata;
    raw_tuser    <= s_axis_tuser;
    raw_tlast    <= s_axis_tlast;
    mosaic_flags <= (others => '0');
  end generate plain;

  -- Colours are completed on the raw grid: resampling first would mix neighbouring colours.
  filters : if MOSAIC generate

    colours : entity work.colour_mosaic
      generic map (
        MAX_COLUMNS => MAX_COLUMNS,
        PIXEL_BITS  => PIXEL_BITS
      )
      port map (
        clk           => clk,
        reset         => reset,
        columns       => columns,
        rows          => rows,
        red_place     => red_place,
        s_axis_tvalid => s_axis_tvalid,
        s_axis_tready => in_tready,
        s_axis_tdata  => s_axis_tdata,
        s_axis_tuser  => s_axis_tuser,
        s_axis_tlast  => s_axis_tlast,
        m_axis_tvalid => raw_tvalid,
        m_axis_tready => raw_tready,
        m_axis_tdata  => raw_tdata,
        m_axis_tuser  => raw_tuser,
        m_axis_tlast  => raw_tlast,
        error_flags   => mosaic_flags,
        error_clear   => error_clear
      );

  end generate filters;

  -- From here on each pixel has CHANNELS values, whatever the sensor.
  lenses_out : entity work.resampler
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      HEXAGONAL        => HEXAGONAL,
      SKEWED           => SKEWED,
      MAX_COLUMNS      => MAX_COLUMNS,
      LINES            => LINES,
      LENSES           => LENSES,
      MOVES            => MOVES,
      GAINS            => GAINS,
      CHANNELS         => COLOURS,
      PIXEL_BITS       => PIXEL_BITS,
      FRACTION_BITS    => FRACTION_BITS,
      WEIGHT_BITS      => WEIGHT_BITS,
      GUARD_BITS       => GUARD_BITS,
      GAIN_BITS        => GAIN_BITS,
      HELD_BACK        => MOSAIC
    )
    port map (
      clk            => clk,
      reset          => reset,
      columns        => columns,
      rows           => rows,
      load_write     => load_write,
      load_kind      => load_kind,
      load_address   => load_address,
      load_data      => load_data,
      taken_early    => taken,
      s_axis_tvalid  => raw_tvalid,
      s_axis_tready  => raw_tready,
      s_axis_tdata   => raw_tdata,
      s_axis_tuser   => raw_tuser,
      s_axis_tlast   => raw_tlast,
      m_axis_tvalid  => m_axis_tvalid,
      m_axis_tready  => m_axis_tready,
      m_axis_tdata   => raster,
      m_axis_tuser   => m_axis_tuser,
      m_axis_tlast   => m_axis_tlast,
      raster_columns => raster_columns,
      raster_rows    => raster_rows,
      error_flags    => resampler_flags,
      error_clear    => error_clear
    );

  -- COLOURS equals CHANNELS for all generics that are not refused.
  m_axis_tdata <= raster(CHANNELS * PIXEL_BITS - 1 downto 0);

  -- Both entities see the same frames, so a fault has the same bit in both.
  error_flags <= resampler_flags or ('0' & mosaic_flags);

end architecture rtl;
