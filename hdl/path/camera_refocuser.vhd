-- SPDX-License-Identifier: Apache-2.0
-- A camera on one chip, without anything specific to a family: lanes of a D-PHY in, refocused frames out.
--
-- The sensor is set up over I2C and its CSI-2 is received. If sensor_pkg has a sensor, mosaic and lenses are resampled
-- to a raster of micro images; otherwise the frames are that raster, in grey. The raster is refocused. camera_pkg
-- describes the camera's lanes and pixels. The calibration of the lenses is built in (sensor_pkg) or comes over the
-- serial port, as on a board with HDMI; without a calibration no frame comes out. The serial port also reports the
-- set-up and all that came over the lanes, shown or not, and sets the sensor up again (camera_report).
--
-- No frame is stored. The camera does not wait; the sink may, as long as the ring of raw lines and the buffers last.
--
-- Latency: that of csi_receiver, sensor_raster and raster_refocuser. Throughput: one raw pixel each clock of clk, or
-- as many as the core takes without a sensor in sensor_pkg.
-- Equation: out frame = refocus(raster(raw frame)).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.camera_pkg.all;
use work.core_pkg.all;
use work.csi_pkg.all;
use work.math_pkg.all;
use work.resample_pkg.all;
use work.sensor_pkg.all;
use work.token_pkg.all;

entity camera_refocuser is
  generic (
    -- The core, for lines of the raster if sensor_pkg has a sensor, else for those of the camera.
    CORE : core_t;
    -- Lines of the frames without a sensor in sensor_pkg.
    ROWS : positive range 1 to 65535;
    -- Frequency of clk in kHz, for I2C and the serial port.
    CLOCK_KHZ : positive range 2000 to 500000;
    -- Clocks in a millisecond, and in a bit of the serial port; 0: computed from CLOCK_KHZ. A simulation shortens them.
    MILLISECOND : natural := 0;
    BIT_TIME    : natural := 0
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Outputs of a D-PHY, as csi_receiver takes them.
    byte_clk    : in    std_logic;
    lane_valid  : in    std_logic_vector(CAMERA_LANES - 1 downto 0);
    lane_sync   : in    std_logic_vector(CAMERA_LANES - 1 downto 0);
    lane_data   : in    std_logic_vector(8 * CAMERA_LANES - 1 downto 0);
    lane_missed : in    std_logic_vector(CAMERA_LANES - 1 downto 0) := (others => '0');
    -- I2C to the sensor: levels of the lines, and '1' to pull them low.
    scl     : in    std_logic;
    sda     : in    std_logic;
    scl_low : out   std_logic;
    sda_low : out   std_logic;
    -- Serial port for commands and calibrations (camera_report, load_port).
    uart_rx : in    std_logic;
    uart_tx : out   std_logic;
    -- Slice, as in slice_select.
    slice : in    std_logic_vector(7 downto 0);
    -- Refocused frames as AXI4-Stream video, and their size.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(row_bits(CORE) - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tlast  : out   std_logic;
    frame_columns : out   std_logic_vector(15 downto 0);
    frame_rows    : out   std_logic_vector(15 downto 0);
    -- Lines of the raw frame that have come completely.
    raw_lines : out   std_logic_vector(15 downto 0);
    -- Bits 0 the sensor is set up, 1 the set-up failed, 2 changes with each raw frame. Since the reset or a command
    -- that clears: 3 any fault of the lanes, 4 any fault of the raster or the core.
    state : out   std_logic_vector(4 downto 0)
  );
end entity camera_refocuser;

architecture rtl of camera_refocuser is

  constant ONE_PIXEL : boolean := not takes(CORE.pixels = 1 or not WITH_SENSOR,
                                            "camera_refocuser: PIXELS_PER_CLOCK above 1 needs a camera without a " &
                                            "sensor in sensor_pkg, as a resampler takes one pixel each clock");

  -- The serial port has 115.2 kBd.
  constant MS         : positive := choose(MILLISECOND = 0, CLOCK_KHZ, MILLISECOND);
  constant BIT_CLOCKS : positive := choose(BIT_TIME = 0, CLOCK_KHZ * 10 / 1152, BIT_TIME);
  -- A quarter of a bit of I2C at 50 kHz, but at least the clocks that a level takes to be seen.
  constant QUARTER : positive := larger(MS / 200, 4);
  -- Bits of the receiver's counters; 255 means 255 or more.
  constant COUNT_BITS : positive := 8;

  -- Frames that the receiver delivers.
  constant RAW_COLUMNS : positive := choose(WITH_SENSOR, SENSOR_COLUMNS, CORE.columns);
  constant RAW_ROWS    : positive := choose(WITH_SENSOR, SENSOR_ROWS, ROWS);

  -- The core takes one size, so its size ports are constants and synthesis removes their logic.
  constant COLUMNS_PORT : std_logic_vector(15 downto 0) := std_logic_vector(to_unsigned(RAW_COLUMNS, 16));
  constant ROWS_PORT    : std_logic_vector(15 downto 0) := std_logic_vector(to_unsigned(RAW_ROWS, 16));

  constant NO_FAULTS : std_logic_vector(8 * COUNT_BITS - 1 downto 0) := (others => '0');

  -- Set-up of the sensor: it was begun; it is asked for, ordered, under way, done without fault, failed; why and where.
  signal begun         : std_logic := '0';
  signal wish          : std_logic := '1';
  signal start         : std_logic := '0';
  signal setup_busy    : std_logic;
  signal setup_done    : std_logic;
  signal setup_failed  : std_logic;
  signal setup_state   : std_logic_vector(1 downto 0);
  signal setup_fault   : std_logic_vector(1 downto 0);
  signal setup_entry   : std_logic_vector(11 downto 0);
  signal setup_retried : std_logic_vector(7 downto 0);

  -- Characters of the serial port, in and out; those of lines for the commands, and the answers to them.
  signal rx_valid     : std_logic;
  signal rx_data      : std_logic_vector(7 downto 0);
  signal tx_valid     : std_logic;
  signal tx_ready     : std_logic;
  signal tx_data      : std_logic_vector(7 downto 0);
  signal line_valid   : std_logic;
  signal line_data    : std_logic_vector(7 downto 0);
  signal answer_valid : std_logic;
  signal answer_ready : std_logic;
  signal answer_data  : std_logic_vector(7 downto 0);
  signal asks_clear   : std_logic;
  signal asks_set_up  : std_logic;
  signal clear        : std_logic;

  -- Raw frames; then the frames that the core takes, behind the resampler if there is one.
  signal raw_tvalid : std_logic;
  -- Low while the ring of raw lines is full; the receiver's buffer takes pixels meanwhile.
  signal raw_tready : std_logic;
  signal raw_tdata  : std_logic_vector(CORE.pixels * RAW_BITS - 1 downto 0);
  signal raw_tuser  : std_logic_vector(0 downto 0);
  signal raw_tlast  : std_logic;
  -- Counters of the receiver; then the raster, and its flags and those of the core, each of which is a fault.
  signal lane_faults : std_logic_vector(8 * COUNT_BITS - 1 downto 0);
  signal lane_left   : std_logic_vector(4 * COUNT_BITS - 1 downto 0);
  signal left_out    : identifier_t;
  signal lens_tvalid : std_logic;
  signal lens_tready : std_logic;
  signal lens_tdata  : std_logic_vector(row_bits(CORE) - 1 downto 0);
  signal lens_tuser  : std_logic_vector(0 downto 0);
  signal lens_tlast  : std_logic;
  -- Size of the frames that the core gets.
  signal lens_columns : std_logic_vector(15 downto 0);
  signal lens_rows    : std_logic_vector(15 downto 0);
  signal lens_flags   : std_logic_vector(5 downto 0);
  signal core_flags   : std_logic_vector(4 downto 0);
  -- Frame order and stream marks of the core.
  signal order   : frame_order_t;
  signal s_marks : marks_t;
  signal m_marks : marks_t;
  -- Lines of the raw frame, and raw frames, so far.
  signal lines       : unsigned(15 downto 0) := (others => '0');
  signal frames      : unsigned(15 downto 0) := (others => '0');
  signal line_count  : std_logic_vector(15 downto 0);
  signal frame_count : std_logic_vector(15 downto 0);

begin

  frame_columns <= lens_columns;
  frame_rows    <= lens_rows;
  raw_lines     <= line_count;

  set_up : entity work.sensor_setup
    generic map (
      REGISTERS   => SENSOR_REGISTERS,
      DEVICE      => SENSOR_ADDRESS,
      QUARTER     => QUARTER,
      STRETCH     => 30 * MS,
      MILLISECOND => MS
    )
    port map (
      clk     => clk,
      reset   => reset,
      scl     => scl,
      sda     => sda,
      scl_low => scl_low,
      sda_low => sda_low,
      start   => start,
      busy    => setup_busy,
      done    => setup_done,
      fault   => setup_fault,
      entry   => setup_entry,
      retried => setup_retried
    );

  receiver : entity work.csi_receiver
    generic map (
      LANES            => CAMERA_LANES,
      PIXEL_BITS       => RAW_BITS,
      PIXELS_PER_CLOCK => CORE.pixels,
      BUFFER_BITS      => BUFFER_BITS,
      COUNT_BITS       => COUNT_BITS
    )
    port map (
      byte_clk        => byte_clk,
      lane_valid      => lane_valid,
      lane_sync       => lane_sync,
      lane_data       => lane_data,
      lane_missed     => lane_missed,
      clk             => clk,
      reset           => reset,
      columns         => COLUMNS_PORT,
      rows            => ROWS_PORT,
      m_axis_tvalid   => raw_tvalid,
      m_axis_tready   => raw_tready,
      m_axis_tdata    => raw_tdata,
      m_axis_tuser    => raw_tuser,
      m_axis_tlast    => raw_tlast,
      fault_counts    => lane_faults,
      left_counts     => lane_left,
      left_identifier => left_out,
      fault_clear     => clear
    );

  --------------------------------------------------------------------------------------------------
  -- Serial port.

  take_characters : entity work.uart_receiver
    generic map (
      BIT_CLOCKS => BIT_CLOCKS
    )
    port map (
      clk   => clk,
      reset => reset,
      line  => uart_rx,
      data  => rx_data,
      valid => rx_valid
    );

  give_characters : entity work.uart_transmitter
    generic map (
      BIT_CLOCKS => BIT_CLOCKS
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => tx_valid,
      s_axis_tready => tx_ready,
      s_axis_tdata  => tx_data,
      line          => uart_tx
    );

  report_camera : entity work.camera_report
    generic map (
      COUNT_BITS => COUNT_BITS
    )
    port map (
      clk             => clk,
      reset           => reset,
      s_axis_tvalid   => line_valid,
      s_axis_tdata    => line_data,
      m_axis_tvalid   => answer_valid,
      m_axis_tready   => answer_ready,
      m_axis_tdata    => answer_data,
      setup_state     => setup_state,
      setup_entry     => setup_entry,
      setup_fault     => setup_fault,
      setup_retried   => setup_retried,
      frames          => frame_count,
      lines           => line_count,
      fault_counts    => lane_faults,
      left_counts     => lane_left,
      left_identifier => left_out,
      lens_flags      => lens_flags,
      core_flags      => core_flags,
      clear           => asks_clear,
      set_up          => asks_set_up
    );

  clear        <= reset or asks_clear;
  setup_failed <= begun and not wish and not start and not setup_busy and not setup_done;
  setup_state  <= (setup_busy or setup_failed) & (setup_busy or setup_done);
  line_count   <= std_logic_vector(lines);
  frame_count  <= std_logic_vector(frames);

  -- Without a resampler the raw frame is the raster: it has the camera's size, and there is nothing to load.
  direct : if not WITH_SENSOR generate
    line_valid   <= rx_valid;
    line_data    <= rx_data;
    tx_valid     <= answer_valid;
    answer_ready <= tx_ready;
    tx_data      <= answer_data;
    lens_tvalid  <= raw_tvalid;
    raw_tready   <= lens_tready;
    lens_tdata   <= raw_tdata;
    lens_tuser   <= raw_tuser;
    lens_tlast   <= raw_tlast;
    lens_columns <= COLUMNS_PORT;
    lens_rows    <= ROWS_PORT;
    lens_flags   <= (others => '0');
  end generate direct;

  sensor : if WITH_SENSOR generate

    -- Corner of the mosaic's red filter.
    constant RED : std_logic_vector(1 downto 0) := std_logic_vector(to_unsigned(RED_PLACE, 2));

    -- Words of the calibration: from load_port; as they came across; high for one clock at the raster.
    signal word_busy : std_logic;
    signal written   : std_logic;
    signal word      : load_word_t;
    signal came      : load_word_t;
    signal toggle    : std_logic;
    signal seen      : std_logic := '0';
    signal load      : load_t;

  begin

    -- Each change of the toggle is a word, as on a board with HDMI. A clock later the word counts as seen.
    load <= to_load(seen xor toggle, came);

    follow_words : process (clk) is
    begin

      if rising_edge(clk) then
        seen <= toggle;
      end if;

    end process follow_words;

    calibrations : entity work.load_port
      generic map (
        DESCRIPTION => RESAMPLER
      )
      port map (
        clk           => clk,
        reset         => reset,
        in_valid      => rx_valid,
        in_data       => rx_data,
        other_valid   => line_valid,
        other_data    => line_data,
        s_axis_tvalid => answer_valid,
        s_axis_tready => answer_ready,
        s_axis_tdata  => answer_data,
        m_axis_tvalid => tx_valid,
        m_axis_tready => tx_ready,
        m_axis_tdata  => tx_data,
        busy          => word_busy,
        load_write    => written,
        load_kind     => word(61 downto 60),
        load_address  => word(59 downto 40),
        load_data     => word(39 downto 0)
      );

    -- Both sides have one clock here; load_crossing is used because it begins with the built-in calibration.
    built_in_first : entity work.load_crossing
      port map (
        clk         => clk,
        reset       => reset,
        port_write  => written,
        port_word   => word,
        port_busy   => word_busy,
        seen        => seen,
        pixel_clk   => clk,
        load_word   => came,
        load_toggle => toggle
      );

    raster : entity work.sensor_raster
      generic map (
        MOSAIC           => MOSAIC,
        MICRO_IMAGE_SIZE => CORE.geometry.micro_image_size,
        HEXAGONAL        => HEXAGONAL,
        SKEWED           => SKEWED,
        MAX_COLUMNS      => SENSOR_COLUMNS,
        LINES            => RING_LINES,
        LENSES           => LENSES,
        MOVES            => MOVES,
        GAINS            => GAINS,
        CHANNELS         => CAMERA_CHANNELS,
        PIXEL_BITS       => RAW_BITS
      )
      port map (
        clk            => clk,
        reset          => reset,
        columns        => COLUMNS_PORT,
        rows           => ROWS_PORT,
        red_place      => RED,
        load_write     => load.write,
        load_kind      => load.kind,
        load_address   => load.address,
        load_data      => load.data,
        s_axis_tvalid  => raw_tvalid,
        s_axis_tready  => raw_tready,
        s_axis_tdata   => raw_tdata,
        s_axis_tuser   => raw_tuser,
        s_axis_tlast   => raw_tlast,
        m_axis_tvalid  => lens_tvalid,
        m_axis_tready  => lens_tready,
        m_axis_tdata   => lens_tdata,
        m_axis_tuser   => lens_tuser,
        m_axis_tlast   => lens_tlast,
        raster_columns => lens_columns,
        raster_rows    => lens_rows,
        error_flags    => lens_flags,
        error_clear    => clear
      );

  end generate sensor;

  order   <=
  (
    columns      => lens_columns,
    ROWS         => lens_rows,
    slice        => slice,
    sweep        => '0',
    sweep_frames => x"00"
  );
  s_marks <= (lens_tvalid, lens_tuser, lens_tlast);

  m_axis_tvalid <= m_marks.tvalid;
  m_axis_tuser  <= m_marks.tuser;
  m_axis_tlast  <= m_marks.tlast;

  slice_core : entity work.refocuser
    generic map (
      CORE => CORE
    )
    port map (
      clk           => clk,
      reset         => reset,
      order         => order,
      s_axis_marks  => s_marks,
      s_axis_tready => lens_tready,
      s_axis_tdata  => lens_tdata,
      m_axis_marks  => m_marks,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tid    => open,
      error_flags   => core_flags,
      error_clear   => clear
    );

  -- The camera's lines are counted where the raster takes them.
  follow : process (clk) is
  begin

    if rising_edge(clk) then
      -- The set-up starts behind each reset, and by command.
      start <= '0';
      if asks_set_up = '1' then
        wish <= '1';
      elsif wish = '1' and setup_busy = '0' and start = '0' then
        start <= '1';
        begun <= '1';
        wish  <= '0';
      end if;

      if raw_tvalid = '1' and raw_tready = '1' then
        if raw_tuser(0) = '1' then
          lines  <= (others => '0');
          frames <= frames + 1;
        elsif raw_tlast = '1' then
          lines <= lines + 1;
        end if;
      end if;

      state(0) <= setup_done;
      -- Asked for, no longer under way, and not done: the sensor did not answer, or kept the lines low.
      state(1) <= setup_failed;
      state(2) <= frames(0);
      if lane_faults /= NO_FAULTS then
        state(3) <= '1';
      end if;
      if lens_flags /= "000000" or core_flags /= "00000" then
        state(4) <= '1';
      end if;
      if clear = '1' then
        state(4 downto 3) <= "00";
      end if;

      if reset = '1' then
        begun  <= '0';
        start  <= '0';
        wish   <= '1';
        state  <= (others => '0');
        lines  <= (others => '0');
        frames <= (others => '0');
      end if;
    end if;

  end process follow;

end architecture rtl;
