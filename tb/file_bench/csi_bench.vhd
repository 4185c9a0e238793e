-- SPDX-License-Identifier: Apache-2.0
-- A camera's CSI-2 from a file through csi_receiver, sensor_raster and a core into a file.
--
-- Reads in the working directory loads.bin, four words of 32 bits for each word of the load port (kind, address, low
-- 20 bits, high 20 bits), and when these are loaded input.bin: a word for each lane in each clock of the lanes, the
-- byte in the low bits, bit 8 valid, bit 9 sync. Writes output.bin, a word for each channel of each pixel, and
-- clocks.txt, one "name value" pair a line.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library std;
use std.textio.all;

library work;
use work.math_pkg.all;
use work.bench_pkg.all;

entity csi_bench is
  generic (
    -- As in csi_receiver.
    LANES : positive := 1;
    -- Those of sensor_raster that bench_core has, too.
    MOSAIC            : boolean  := false;
    HEXAGONAL         : boolean  := false;
    SKEWED            : boolean  := false;
    RAW_BITS          : positive := 8;
    RAW_COLUMNS       : positive := 2;
    RAW_FRACTION_BITS : positive := 16;
    RAW_GUARD_BITS    : positive := 3;
    LINES             : positive := 8;
    LENSES            : positive := 2;
    MOVES             : boolean  := false;
    GAINS             : boolean  := false;
    WEIGHT_BITS       : positive := 8;
    GAIN_BITS         : positive := 12;
    -- As in bench_core.
    MICRO_IMAGE_SIZE    : positive := 2;
    SHIFTS              : string   := "0";
    CENTRED             : boolean  := true;
    INTERPOLATION_ORDER : natural  := 0;
    HOLD                : boolean  := false;
    PARALLEL_ROWS       : positive := 1;
    MAX_COLUMNS         : positive := 2048;
    CHANNELS            : positive := 1;
    PIXEL_BITS          : positive := 8;
    EXACT               : boolean  := true;
    FRACTION_BITS       : natural  := 0;
    GUARD_BITS          : natural  := 0;
    BROADCAST_TAPS      : natural  := 0;
    ENGINE              : string   := "fir";
    ANY_ROWS            : boolean  := false;
    SHARPENING          : string   := "";
    BOX                 : string   := "";
    BORDER_NORMALISED   : boolean  := false;
    PIXELS_PER_CLOCK    : positive := 1;
    -- Period of the lanes' clock in ps, its clocks in the file; words for the load port; place of red.
    BYTE_PS   : positive := 10000;
    CLOCKS    : positive := 1;
    LOADS     : natural  := 0;
    RED_PLACE : natural  := 0;
    -- Size of the raw frames, of the raster, frames, frames for each slice.
    RAW_ROWS     : positive := 2;
    COLUMNS      : positive := 1;
    ROWS         : positive := 1;
    FRAMES       : positive := 1;
    SWEEP_FRAMES : natural  := 0;
    -- As in file_bench, but for the camera, which does not wait: stalls of the sink.
    STALL_PERCENT : natural  := 0;
    SEED          : positive := 1
  );
end entity csi_bench;

architecture test of csi_bench is

  constant FRAME_PIXELS : positive := COLUMNS * ROWS;
  constant PIXELS       : positive := FRAME_PIXELS * FRAMES;
  constant CLOCK_PERIOD : time     := 10 ns;
  -- Clocks after the last pixel in which no other may come; clocks without a pixel or a byte after which it counts as
  -- hung.
  constant SILENCE    : positive := 64;
  constant IDLE_LIMIT : positive := 100000;
  -- Bits of a count of faults.
  constant COUNT_BITS : positive := 16;

  signal clk           : std_logic                                := '0';
  signal byte_clk      : std_logic                                := '0';
  signal reset         : std_logic                                := '1';
  signal running       : boolean                                  := true;
  signal loaded        : boolean                                  := false;
  signal sent          : boolean                                  := false;
  signal first_byte    : boolean                                  := false;
  signal columns_port  : std_logic_vector(15 downto 0);
  signal rows_port     : std_logic_vector(15 downto 0);
  signal raw_columns_p : std_logic_vector(15 downto 0);
  signal raw_rows_p    : std_logic_vector(15 downto 0);
  signal red_port      : std_logic_vector(1 downto 0);
  signal sweep_port    : std_logic_vector(7 downto 0);
  signal lane_valid    : std_logic_vector(LANES - 1 downto 0)     := (others => '0');
  signal lane_sync     : std_logic_vector(LANES - 1 downto 0)     := (others => '0');
  signal lane_data     : std_logic_vector(8 * LANES - 1 downto 0) := (others => '0');
  signal load          : bench_load_t                             := NO_BENCH_LOAD;
  signal raw_tvalid    : std_logic;
  signal raw_tready    : std_logic;
  signal raw_tdata     : std_logic_vector(RAW_BITS - 1 downto 0);
  signal raw_tuser     : std_logic_vector(0 downto 0);
  signal raw_tlast     : std_logic;
  signal raster_tvalid : std_logic;
  signal raster_tready : std_logic;
  signal raster_tdata  : std_logic_vector(CHANNELS * RAW_BITS - 1 downto 0);
  signal raster_tuser  : std_logic_vector(0 downto 0);
  signal raster_tlast  : std_logic;
  signal s_axis_tdata  : std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
  signal m_axis_tvalid : std_logic;
  signal m_axis_tready : std_logic                                := '1';
  signal m_axis_tdata  : std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
  signal m_axis_tuser  : std_logic_vector(0 downto 0);
  signal m_axis_tid    : std_logic_vector(7 downto 0);
  signal m_axis_tlast  : std_logic;
  signal fault_counts  : std_logic_vector(8 * COUNT_BITS - 1 downto 0);
  signal left_counts   : std_logic_vector(4 * COUNT_BITS - 1 downto 0);
  signal left_out      : std_logic_vector(7 downto 0);
  signal counts        : std_logic_vector(12 * COUNT_BITS - 1 downto 0);
  signal sensor_flags  : std_logic_vector(5 downto 0);
  signal error_flags   : std_logic_vector(4 downto 0);

begin

  -- Two clocks without a common source: that of the lanes comes from the camera.
  clk           <= not clk after CLOCK_PERIOD / 2 when running else
                   '0';
  byte_clk      <= not byte_clk after BYTE_PS * 1 ps / 2 when running else
                   '0';
  reset         <= '0' after 4 * CLOCK_PERIOD;
  columns_port  <= std_logic_vector(to_unsigned(COLUMNS, 16));
  rows_port     <= std_logic_vector(to_unsigned(ROWS, 16));
  raw_columns_p <= std_logic_vector(to_unsigned(RAW_COLUMNS, 16));
  raw_rows_p    <= std_logic_vector(to_unsigned(RAW_ROWS, 16));
  red_port      <= std_logic_vector(to_unsigned(RED_PLACE, 2));
  sweep_port    <= std_logic_vector(to_unsigned(SWEEP_FRAMES, 8));

  receiver : entity work.csi_receiver
    generic map (
      LANES      => LANES,
      PIXEL_BITS => RAW_BITS,
      COUNT_BITS => COUNT_BITS
    )
    port map (
      byte_clk        => byte_clk,
      lane_valid      => lane_valid,
      lane_sync       => lane_sync,
      lane_data       => lane_data,
      clk             => clk,
      reset           => reset,
      columns         => raw_columns_p,
      rows            => raw_rows_p,
      m_axis_tvalid   => raw_tvalid,
      m_axis_tready   => raw_tready,
      m_axis_tdata    => raw_tdata,
      m_axis_tuser    => raw_tuser,
      m_axis_tlast    => raw_tlast,
      fault_counts    => fault_counts,
      left_counts     => left_counts,
      left_identifier => left_out,
      fault_clear     => '0'
    );

  counts <= left_counts & fault_counts;

  sensor : entity work.sensor_raster
    generic map (
      MOSAIC           => MOSAIC,
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      HEXAGONAL        => HEXAGONAL,
      SKEWED           => SKEWED,
      MAX_COLUMNS      => RAW_COLUMNS,
      LINES            => LINES,
      LENSES           => LENSES,
      MOVES            => MOVES,
      GAINS            => GAINS,
      CHANNELS         => CHANNELS,
      PIXEL_BITS       => RAW_BITS,
      FRACTION_BITS    => RAW_FRACTION_BITS,
      WEIGHT_BITS      => WEIGHT_BITS,
      GUARD_BITS       => RAW_GUARD_BITS,
      GAIN_BITS        => GAIN_BITS
    )
    port map (
      clk           => clk,
      reset         => reset,
      columns       => raw_columns_p,
      rows          => raw_rows_p,
      red_place     => red_port,
      load_write    => load.write,
      load_kind     => load.kind,
      load_address  => load.address,
      load_data     => load.data,
      s_axis_tvalid => raw_tvalid,
      s_axis_tready => raw_tready,
      s_axis_tdata  => raw_tdata,
      s_axis_tuser  => raw_tuser,
      s_axis_tlast  => raw_tlast,
      m_axis_tvalid => raster_tvalid,
      m_axis_tready => raster_tready,
      m_axis_tdata  => raster_tdata,
      m_axis_tuser  => raster_tuser,
      m_axis_tlast  => raster_tlast,
      error_flags   => sensor_flags
    );

  -- Raw values into a core of wider pixels: in the low bits, as they are.
  widen : process (raster_tdata) is

    variable narrow : std_logic_vector(RAW_BITS - 1 downto 0);

  begin

    s_axis_tdata <= (others => '0');

    for c in 0 to CHANNELS - 1 loop

      narrow := raster_tdata((c + 1) * RAW_BITS - 1 downto c * RAW_BITS);

      s_axis_tdata(c * PIXEL_BITS + RAW_BITS - 1 downto c * PIXEL_BITS) <= narrow;

    end loop;

  end process widen;

  design : entity work.bench_core
    generic map (
      MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
      SHIFTS              => SHIFTS,
      CENTRED             => CENTRED,
      INTERPOLATION_ORDER => INTERPOLATION_ORDER,
      HOLD                => HOLD,
      PARALLEL_ROWS       => PARALLEL_ROWS,
      MAX_COLUMNS         => MAX_COLUMNS,
      CHANNELS            => CHANNELS,
      PIXEL_BITS          => PIXEL_BITS,
      EXACT               => EXACT,
      FRACTION_BITS       => FRACTION_BITS,
      GUARD_BITS          => GUARD_BITS,
      BROADCAST_TAPS      => BROADCAST_TAPS,
      ENGINE              => ENGINE,
      ANY_ROWS            => ANY_ROWS,
      SHARPENING          => SHARPENING,
      BOX                 => BOX,
      BORDER_NORMALISED   => BORDER_NORMALISED,
      PIXELS_PER_CLOCK    => PIXELS_PER_CLOCK
    )
    port map (
      clk           => clk,
      reset         => reset,
      columns       => columns_port,
      rows          => rows_port,
      sweep_frames  => sweep_port,
      s_axis_tvalid => raster_tvalid,
      s_axis_tready => raster_tready,
      s_axis_tdata  => s_axis_tdata,
      s_axis_tuser  => raster_tuser,
      s_axis_tlast  => raster_tlast,
      m_axis_tvalid => m_axis_tvalid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tuser  => m_axis_tuser,
      m_axis_tid    => m_axis_tid,
      m_axis_tlast  => m_axis_tlast,
      error_flags   => error_flags
    );

  -- It begins when the calibration is loaded: a frame that came before it would be given up.
  camera : process (byte_clk) is

    file input_file : words_t open read_mode is "input.bin";

    variable word  : integer;
    variable entry : std_logic_vector(9 downto 0);
    variable clock : natural := 0;

  begin

    if rising_edge(byte_clk) and loaded then
      lane_valid <= (others => '0');
      lane_sync  <= (others => '0');
      -- A clock of the lanes each clock of the file, as a camera sends: nobody asks whether it is
      -- taken.
      if clock < CLOCKS then
        first_byte <= true;

        for i in 0 to LANES - 1 loop

          read(input_file, word);
          entry         := std_logic_vector(to_unsigned(word, 10));
          lane_valid(i) <= entry(8);
          lane_sync(i)  <= entry(9);

          lane_data(8 * i + 7 downto 8 * i) <= entry(7 downto 0);

        end loop;

        clock := clock + 1;
      else
        sent <= true;
      end if;
    end if;

  end process camera;

  bench : process (clk) is

    file loads_file  : words_t open read_mode is "loads.bin";
    file output_file : words_t open write_mode is "output.bin";
    file clocks_file : text open write_mode is "clocks.txt";

    variable words          : natural  := 0;
    variable received       : natural  := 0;
    variable accepted       : natural  := 0;
    variable clock          : natural  := 0;
    variable idle           : natural  := 0;
    variable first_in       : natural  := 0;
    variable first_out      : natural  := 0;
    variable last_in        : natural  := 0;
    variable last_out       : natural  := 0;
    variable framing_errors : natural  := 0;
    variable slice          : natural  := 0;
    variable random         : random_t := SEED mod 65536;
    variable stall          : boolean;

  begin

    if rising_edge(clk) and reset = '0' then
      clock := clock + 1;
      idle  := idle + 1;
      -- From the clock of the core in which the first byte has been seen.
      if not first_byte then
        first_in := clock;
      end if;
      -- While the camera sends nothing hangs.
      if not sent then
        idle := 0;
      end if;

      -- A word of the calibration each clock, as the load port takes them.
      load.write <= '0';
      if words < LOADS then
        read_load(loads_file, load);
        words := words + 1;
      else
        loaded <= true;
      end if;

      if raw_tvalid = '1' and raw_tready = '1' then
        accepted := accepted + 1;
        last_in  := clock;
      end if;

      if m_axis_tvalid = '1' and m_axis_tready = '1' then
        if received = 0 then
          first_out := clock;
        end if;
        write_values(output_file, PIXEL_BITS, m_axis_tdata);
        if m_axis_tlast /= ends_line(received, COLUMNS) or m_axis_tuser /= starts_frame(received, FRAME_PIXELS) then
          framing_errors := framing_errors + 1;
        end if;
        slice := to_integer(unsigned(m_axis_tid));
        if received mod FRAME_PIXELS = 0 then
          write_count(clocks_file, "slice", slice);
        end if;
        received := received + 1;
        last_out := clock;
        idle     := 0;
      end if;

      draw(random, stall, stall_share(STALL_PERCENT, clock, true));
      m_axis_tready <= to_logic(not stall);

      -- Some clocks of silence behind the last pixel show that none comes in excess.
      if (received >= PIXELS and idle >= SILENCE) or idle >= IDLE_LIMIT then
        write_count(clocks_file, "accepted", accepted);
        write_count(clocks_file, "received", received);
        write_count(clocks_file, "clocks", last_out - first_in + 1);
        write_count(clocks_file, "latency", first_out - first_in);
        write_count(clocks_file, "input_clocks", last_in - first_in + 1);
        write_count(clocks_file, "framing_errors", framing_errors);
        write_count(clocks_file, "error_flags",
                    to_integer(unsigned(sensor_flags)) + 64 * to_integer(unsigned(error_flags)));

        for i in 0 to 11 loop

          write_count(clocks_file, "count",
                      to_integer(unsigned(counts((i + 1) * COUNT_BITS - 1 downto i * COUNT_BITS))));

        end loop;

        write_count(clocks_file, "left_out", to_integer(unsigned(left_out)));

        running <= false;
      end if;
    end if;

  end process bench;

end architecture test;
