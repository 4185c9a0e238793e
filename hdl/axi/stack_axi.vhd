-- SPDX-License-Identifier: Apache-2.0
-- A focal_stack, optionally with a depth_index behind it, with registers behind AXI4-Lite for block designs.
--
-- Port names are those by which Vivado's block design finds the interfaces s_axi_ctrl, s_axis, m_axis and interrupt.
-- The streams' data have whole bytes: pixels in the low bits, zeros above. Frames are dropped until software has
-- written their size and enabled the core (docs/registers.md).
--
-- Latency: that of focal_stack, with DEPTH_INDEX that of depth_index more. Throughput: PIXELS_PER_CLOCK pixels of all
-- channels and slices each clock.
-- Equation: that of focal_stack, with DEPTH_INDEX followed by that of depth_index.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.number_set_pkg.all;
use work.index_pkg.all;
use work.register_map_pkg.all;
use work.axi_pkg.all;
use work.token_pkg.marks_t;

entity stack_axi is
  generic (
    -- As in focal_stack.
    MICRO_IMAGE_SIZE  : positive range 1 to 128;
    SHIFTS            : string;
    CENTRED           : boolean                  := true;
    MAX_COLUMNS       : positive range 1 to 8192 := 2048;
    CHANNELS          : positive range 1 to 3    := 1;
    PIXEL_BITS        : positive range 1 to 16   := 8;
    INPUT_LINES       : positive range 1 to 128  := 1;
    BOX               : string                   := "";
    BORDER_NORMALISED : boolean                  := false;
    PIXELS_PER_CLOCK  : positive range 1 to 32   := 1;
    -- true: a depth_index follows, with PIXELS_PER_CLOCK of at most MICRO_IMAGE_SIZE; then its generics.
    DEPTH_INDEX : boolean                       := false;
    RADIUS      : natural range 0 to 8          := 1;
    CONFIDENCE  : natural range 0 to 1073741823 := 0;
    VOTE_RADIUS : natural range 0 to 4          := 0;
    -- true: SHIFTS names each slice twice, and BOX its box of M samples and behind it a smaller one, for the index.
    SHARP_TOO : boolean := false
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
    s_axis_tdata  : in    std_logic_vector(stream_bits(PIXELS_PER_CLOCK * CHANNELS * PIXEL_BITS) - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    -- AXI4-Stream video out. tdata: the slices of a pixel, the first slice in the low bits; with DEPTH_INDEX the pixel
    -- in focus, above it 8 bits of the index of its slice, from 0. The next pixel's data follow.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(stack_stream_bits(DEPTH_INDEX, SHIFTS, CHANNELS, PIXEL_BITS,
                                                             PIXELS_PER_CLOCK) - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tlast  : out   std_logic
  );
end entity stack_axi;

architecture rtl of stack_axi is

  -- All slices of a pixel go side by side from the stack to the index, which judges each once.
  constant SLICES     : positive := slice_count(SHIFTS);
  constant JUDGED     : positive := judged_slices("stack_axi", SHIFTS, choose(SHARP_TOO, 2, 1));
  constant REFUSED    : boolean  := not takes(DEPTH_INDEX or not SHARP_TOO, "stack_axi: SHARP_TOO needs DEPTH_INDEX");
  constant P          : positive := PIXELS_PER_CLOCK;
  constant IN_BITS    : positive := P * CHANNELS * PIXEL_BITS;
  constant STACK_BITS : positive := SLICES * IN_BITS;
  constant OUT_BITS   : positive := stack_output_bits(DEPTH_INDEX, SHIFTS, CHANNELS, PIXEL_BITS, P);

  -- The bus, and the settings from software.
  signal bus_request : bus_request_t;
  signal bus_answer  : bus_answer_t;
  signal orders      : orders_t;
  -- Signals that the registers observe: the streams without their data, and the faults.
  signal s_marks     : marks_t;
  signal watched     : watched_t;
  signal faults      : std_logic_vector(5 downto 0);
  signal core_tvalid : std_logic;
  signal core_tready : std_logic;
  -- Copies of the output stream, because VHDL-93 cannot read outputs.
  signal out_tvalid : std_logic;
  signal out_tdata  : std_logic_vector(OUT_BITS - 1 downto 0);
  signal out_tuser  : std_logic_vector(0 downto 0);
  signal out_tlast  : std_logic;
  -- The stream from the stack to the index.
  signal stack_tvalid : std_logic;
  signal stack_tready : std_logic;
  signal stack_tdata  : std_logic_vector(STACK_BITS - 1 downto 0);
  signal stack_tuser  : std_logic_vector(0 downto 0);
  signal stack_tlast  : std_logic;
  signal stack_faults : std_logic_vector(4 downto 0);
  signal index_faults : std_logic_vector(4 downto 0);

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

  -- The read-only registers are computed from the generics, so software finds what was built.
  registers : entity work.refocuser_registers
    generic map (
      PARTS      => 2 ** PARTS_STACK + choose(DEPTH_INDEX, 2 ** PARTS_DEPTH_INDEX, 0),
      GEOMETRY   => geometry_word(MICRO_IMAGE_SIZE, SLICES, CHANNELS, PIXEL_BITS, P),
      LIMITS     => limits_word(MAX_COLUMNS, 1),
      ENGINE     => engine_word(true, true, CENTRED, false, false, 0, 0, 0, BORDER_NORMALISED),
      SHARPNESS  => sharpness_word(RADIUS, VOTE_RADIUS, SHARP_TOO),
      CONFIDENCE => CONFIDENCE,
      SHIFTS     => SHIFTS,
      BOX        => BOX
    )
    port map (
      clk                => clk,
      reset              => reset,
      s_axi_ctrl_request => bus_request,
      s_axi_ctrl_answer  => bus_answer,
      interrupt          => interrupt,
      orders             => orders,
      faults             => faults,
      s_axis_marks       => s_marks,
      s_axis_tready      => s_axis_tready,
      core_tvalid        => core_tvalid,
      core_tready        => core_tready,
      m_axis_watched     => watched
    );

  -- The registers see stack and index as one core: both have the same size and restart together. error_clear is always
  -- high, so each flag is high for the clock of its fault.
  stack : entity work.focal_stack
    generic map (
      MICRO_IMAGE_SIZE  => MICRO_IMAGE_SIZE,
      SHIFTS            => SHIFTS,
      CENTRED           => CENTRED,
      MAX_COLUMNS       => MAX_COLUMNS,
      CHANNELS          => CHANNELS,
      PIXEL_BITS        => PIXEL_BITS,
      INPUT_LINES       => INPUT_LINES,
      BOX               => BOX,
      BORDER_NORMALISED => BORDER_NORMALISED,
      PIXELS_PER_CLOCK  => P
    )
    port map (
      clk           => clk,
      reset         => orders.restart,
      columns       => orders.columns,
      rows          => orders.rows,
      s_axis_tvalid => core_tvalid,
      s_axis_tready => core_tready,
      s_axis_tdata  => s_axis_tdata(IN_BITS - 1 downto 0),
      s_axis_tuser  => s_axis_tuser,
      s_axis_tlast  => s_axis_tlast,
      m_axis_tvalid => stack_tvalid,
      m_axis_tready => stack_tready,
      m_axis_tdata  => stack_tdata,
      m_axis_tuser  => stack_tuser,
      m_axis_tlast  => stack_tlast,
      error_flags   => stack_faults,
      error_clear   => '1'
    );

  -- Without an index the stack's slices are the output.
  no_index : if not DEPTH_INDEX generate
    out_tvalid   <= stack_tvalid;
    stack_tready <= m_axis_tready;
    out_tdata    <= stack_tdata;
    out_tuser    <= stack_tuser;
    out_tlast    <= stack_tlast;
    index_faults <= (others => '0');
  end generate no_index;

  sharpest : if DEPTH_INDEX generate

    find : entity work.depth_index
      generic map (
        MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
        SLICES           => JUDGED,
        RADIUS           => RADIUS,
        CONFIDENCE       => CONFIDENCE,
        VOTE_RADIUS      => VOTE_RADIUS,
        MAX_COLUMNS      => MAX_COLUMNS,
        PIXELS_PER_CLOCK => P,
        CHANNELS         => CHANNELS,
        PIXEL_BITS       => PIXEL_BITS,
        SHARP_TOO        => SHARP_TOO
      )
      port map (
        clk           => clk,
        reset         => orders.restart,
        columns       => orders.columns,
        rows          => orders.rows,
        picture_rows  => orders.rows,
        slice         => x"00",
        sweep         => '0',
        sweep_frames  => x"00",
        s_axis_tvalid => stack_tvalid,
        s_axis_tready => stack_tready,
        s_axis_tdata  => stack_tdata,
        s_axis_tuser  => stack_tuser,
        s_axis_tlast  => stack_tlast,
        m_axis_tvalid => out_tvalid,
        m_axis_tready => m_axis_tready,
        m_axis_tdata  => out_tdata,
        m_axis_tuser  => out_tuser,
        m_axis_tlast  => out_tlast,
        error_flags   => index_faults,
        error_clear   => '1'
      );

  end generate sharpest;

  -- Both see the same frames, so either may report a fault. The highest bit is that of a calibration, which neither
  -- has.
  faults <= '0' & (stack_faults or index_faults);

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
