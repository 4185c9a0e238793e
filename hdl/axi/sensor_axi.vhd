-- SPDX-License-Identifier: Apache-2.0
-- A sensor_raster with registers behind AXI4-Lite for block designs, calibrations included: from a sensor's raw frames
-- to micro images, in front of refocuser_axi or stack_axi.
--
-- Port names are those by which Vivado's block design finds the interfaces s_axi_ctrl, s_axis, m_axis and interrupt.
-- The streams' data have whole bytes: pixels in the low bits, zeros above. Frames are dropped until software has
-- written their size and enabled the core (docs/registers.md).
--
-- Latency: that of sensor_raster. Throughput: that of sensor_raster.
-- Equation: that of sensor_raster.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.register_map_pkg.all;
use work.axi_pkg.all;
use work.token_pkg.marks_t;
use work.resample_pkg.load_t;

entity sensor_axi is
  generic (
    -- As in sensor_raster.
    MOSAIC           : boolean                     := false;
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
    -- Registers: AXI4-Lite, 4 KiB.
    s_axi_ctrl_awaddr  : in    std_logic_vector(11 downto 0);
    s_axi_ctrl_awprot  : in    std_logic_vector(2 downto 0);
    s_axi_ctrl_awvalid : in    std_logic;
    s_axi_ctrl_awready : out   std_logic;
    s_axi_ctrl_wdata   : in    std_logic_vector(31 downto 0);
    s_axi_ctrl_wstrb   : in    std_logic_vector(3 downto 0);
    s_axi_ctrl_wvalid  : in    std_logic;
    s_axi_ctrl_wready  : out   std_logic;
    s_axi_ctrl_bresp   : out   std_logic_vector(1 downto 0);
    s_axi_ctrl_bvalid  : out   std_logic;
    s_axi_ctrl_bready  : in    std_logic;
    s_axi_ctrl_araddr  : in    std_logic_vector(11 downto 0);
    s_axi_ctrl_arprot  : in    std_logic_vector(2 downto 0);
    s_axi_ctrl_arvalid : in    std_logic;
    s_axi_ctrl_arready : out   std_logic;
    s_axi_ctrl_rdata   : out   std_logic_vector(31 downto 0);
    s_axi_ctrl_rresp   : out   std_logic_vector(1 downto 0);
    s_axi_ctrl_rvalid  : out   std_logic;
    s_axi_ctrl_rready  : in    std_logic;
    -- High while an event that is not masked out is pending.
    interrupt : out   std_logic;
    -- AXI4-Stream video: tuser(0) = start of frame, tlast = end of line, channel 0 of the first pixel in the low bits
    -- of tdata.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(stream_bits(choose(MOSAIC, 1, CHANNELS) * PIXEL_BITS) - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    -- AXI4-Stream video out: the raster of micro images, whose size is in the registers.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(stream_bits(CHANNELS * PIXEL_BITS) - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tlast  : out   std_logic
  );
end entity sensor_axi;

architecture rtl of sensor_axi is

  constant IN_BITS  : positive := choose(MOSAIC, 1, CHANNELS) * PIXEL_BITS;
  constant OUT_BITS : positive := CHANNELS * PIXEL_BITS;

  -- The bus, and the settings from software.
  signal bus_request : bus_request_t;
  signal bus_answer  : bus_answer_t;
  signal orders      : orders_t;
  -- Signals that the registers observe: the streams without their data, and the faults.
  signal s_marks     : marks_t;
  signal watched     : watched_t;
  signal load        : load_t;
  signal faults      : std_logic_vector(5 downto 0);
  signal core_tvalid : std_logic;
  signal core_tready : std_logic;
  -- Copies of the output stream, because VHDL-93 cannot read outputs.
  signal out_tvalid     : std_logic;
  signal out_tdata      : std_logic_vector(OUT_BITS - 1 downto 0);
  signal out_tuser      : std_logic_vector(0 downto 0);
  signal out_tlast      : std_logic;
  signal raster_columns : std_logic_vector(15 downto 0);
  signal raster_rows    : std_logic_vector(15 downto 0);

begin

  -- Ports have the names that Vivado looks for; inside, a bus is two records.
  bus_request <=
  (
    awaddr  => s_axi_ctrl_awaddr,
    awprot  => s_axi_ctrl_awprot,
    awvalid => s_axi_ctrl_awvalid,
    wdata   => s_axi_ctrl_wdata,
    wstrb   => s_axi_ctrl_wstrb,
    wvalid  => s_axi_ctrl_wvalid,
    bready  => s_axi_ctrl_bready,
    araddr  => s_axi_ctrl_araddr,
    arprot  => s_axi_ctrl_arprot,
    arvalid => s_axi_ctrl_arvalid,
    rready  => s_axi_ctrl_rready
  );

  -- Block designs do not connect fields of records, so each wire has a port of its own.
  s_axi_ctrl_awready <= bus_answer.awready;
  s_axi_ctrl_wready  <= bus_answer.wready;
  s_axi_ctrl_bresp   <= bus_answer.bresp;
  s_axi_ctrl_bvalid  <= bus_answer.bvalid;
  s_axi_ctrl_arready <= bus_answer.arready;
  s_axi_ctrl_rdata   <= bus_answer.rdata;
  s_axi_ctrl_rresp   <= bus_answer.rresp;
  s_axi_ctrl_rvalid  <= bus_answer.rvalid;

  -- Both streams are counted at the ports. The input passes through the registers, which drop it until the core runs.
  s_marks <= (s_axis_tvalid, s_axis_tuser, s_axis_tlast);
  watched <=
  (
    tvalid => out_tvalid,
    tready => m_axis_tready,
    tuser  => out_tuser,
    tid    => x"00",
    tlast  => out_tlast
  );

  -- The size of the raster depends on the calibration, so software can read it.
  registers : entity work.refocuser_registers
    generic map (
      PARTS     => 2 ** PARTS_RESAMPLER + choose(MOSAIC, 2 ** PARTS_MOSAIC, 0),
      GEOMETRY  => geometry_word(MICRO_IMAGE_SIZE, 0, CHANNELS, PIXEL_BITS, 1),
      LIMITS    => limits_word(MAX_COLUMNS, 1),
      RESAMPLER => resampler_word(HEXAGONAL, MOVES, GAINS, LINES, FRACTION_BITS, WEIGHT_BITS, GUARD_BITS, GAIN_BITS,
                                  SKEWED),
      LENSES    => LENSES
    )
    port map (
      clk                => clk,
      reset              => reset,
      s_axi_ctrl_request => bus_request,
      s_axi_ctrl_answer  => bus_answer,
      interrupt          => interrupt,
      orders             => orders,
      load               => load,
      faults             => faults,
      raster_columns     => raster_columns,
      raster_rows        => raster_rows,
      s_axis_marks       => s_marks,
      s_axis_tready      => s_axis_tready,
      core_tvalid        => core_tvalid,
      core_tready        => core_tready,
      m_axis_watched     => watched
    );

  -- error_clear is always high, so each flag is high for the clock of its fault.
  sensor : entity work.sensor_raster
    generic map (
      MOSAIC           => MOSAIC,
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      HEXAGONAL        => HEXAGONAL,
      SKEWED           => SKEWED,
      MAX_COLUMNS      => MAX_COLUMNS,
      LINES            => LINES,
      LENSES           => LENSES,
      MOVES            => MOVES,
      GAINS            => GAINS,
      CHANNELS         => CHANNELS,
      PIXEL_BITS       => PIXEL_BITS,
      FRACTION_BITS    => FRACTION_BITS,
      WEIGHT_BITS      => WEIGHT_BITS,
      GUARD_BITS       => GUARD_BITS,
      GAIN_BITS        => GAIN_BITS
    )
    port map (
      clk            => clk,
      reset          => orders.restart,
      columns        => orders.columns,
      rows           => orders.rows,
      red_place      => orders.red_place,
      load_write     => load.write,
      load_kind      => load.kind,
      load_address   => load.address,
      load_data      => load.data,
      s_axis_tvalid  => core_tvalid,
      s_axis_tready  => core_tready,
      s_axis_tdata   => s_axis_tdata(IN_BITS - 1 downto 0),
      s_axis_tuser   => s_axis_tuser,
      s_axis_tlast   => s_axis_tlast,
      m_axis_tvalid  => out_tvalid,
      m_axis_tready  => m_axis_tready,
      m_axis_tdata   => out_tdata,
      m_axis_tuser   => out_tuser,
      m_axis_tlast   => out_tlast,
      raster_columns => raster_columns,
      raster_rows    => raster_rows,
      error_flags    => faults,
      error_clear    => '1'
    );

  m_axis_tvalid <= out_tvalid;
  m_axis_tuser  <= out_tuser;
  m_axis_tlast  <= out_tlast;

  -- AXI4-Stream has whole bytes; the fill bits are zero, so that software may use words as they are.
  pad : process (out_tdata) is
  begin

    m_axis_tdata                        <= (others => '0');
    m_axis_tdata(OUT_BITS - 1 downto 0) <= out_tdata;

  end process pad;

end architecture rtl;
