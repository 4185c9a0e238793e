-- SPDX-License-Identifier: Apache-2.0
-- Moves raw frames from a file through sensor_raster into a file.
--
-- Reads input.bin in the working directory, 32-bit little-endian words, one for each channel of each pixel, raster
-- order; and loads.bin, four words for each word of the load port: kind, address, low 20 bits, high 20 bits. Writes
-- output.bin, and clocks.txt: one "name value" pair a line.
--
-- STALL_PERCENT and SEED as in file_bench.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library std;
use std.textio.all;

library work;
use work.math_pkg.all;
use work.bench_pkg.all;

entity sensor_bench is
  generic (
    -- As in sensor_raster.
    MOSAIC           : boolean                     := false;
    MICRO_IMAGE_SIZE : positive range 1 to 128     := 2;
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
    GAIN_BITS        : positive range 4 to 14      := 12;
    -- Place of red, words for the load port, the frames in the file, the frames that come out.
    RED_PLACE     : natural  := 0;
    LOADS         : natural  := 0;
    COLUMNS       : positive := 2;
    ROWS          : positive := 2;
    FRAMES        : positive := 1;
    OUT_COLUMNS   : positive := 1;
    OUT_ROWS      : positive := 1;
    STALL_PERCENT : natural  := 0;
    SEED          : positive := 1
  );
end entity sensor_bench;

architecture test of sensor_bench is

  constant IN_CHANNELS  : positive := choose(MOSAIC, 1, CHANNELS);
  constant FRAME_PIXELS : positive := COLUMNS * ROWS;
  constant PIXELS       : positive := FRAME_PIXELS * FRAMES;
  constant OUT_FRAME    : positive := OUT_COLUMNS * OUT_ROWS;
  constant OUT_PIXELS   : positive := OUT_FRAME * FRAMES;
  constant CLOCK_PERIOD : time     := 10 ns;
  -- Clocks after the last pixel in which no other may come; clocks without a pixel after which it counts as hung.
  constant SILENCE    : positive := 64;
  constant IDLE_LIMIT : positive := 100000;

  signal clk           : std_logic                                               := '0';
  signal reset         : std_logic                                               := '1';
  signal running       : boolean                                                 := true;
  signal columns_port  : std_logic_vector(15 downto 0);
  signal rows_port     : std_logic_vector(15 downto 0);
  signal red_port      : std_logic_vector(1 downto 0);
  signal load          : bench_load_t                                            := NO_BENCH_LOAD;
  signal s_axis_tvalid : std_logic                                               := '0';
  signal s_axis_tready : std_logic;
  signal s_axis_tdata  : std_logic_vector(IN_CHANNELS * PIXEL_BITS - 1 downto 0) := (others => '0');
  signal s_axis_tuser  : std_logic_vector(0 downto 0)                            := "0";
  signal s_axis_tlast  : std_logic                                               := '0';
  signal m_axis_tvalid : std_logic;
  signal m_axis_tready : std_logic                                               := '0';
  signal m_axis_tdata  : std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
  signal m_axis_tuser  : std_logic_vector(0 downto 0);
  signal m_axis_tlast  : std_logic;
  signal error_flags   : std_logic_vector(5 downto 0);

begin

  clk          <= not clk after CLOCK_PERIOD / 2 when running else
                  '0';
  reset        <= '0' after 4 * CLOCK_PERIOD;
  columns_port <= std_logic_vector(to_unsigned(COLUMNS, 16));
  rows_port    <= std_logic_vector(to_unsigned(ROWS, 16));
  red_port     <= std_logic_vector(to_unsigned(RED_PLACE, 2));

  design : entity work.sensor_raster
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
      clk           => clk,
      reset         => reset,
      columns       => columns_port,
      rows          => rows_port,
      red_place     => red_port,
      load_write    => load.write,
      load_kind     => load.kind,
      load_address  => load.address,
      load_data     => load.data,
      s_axis_tvalid => s_axis_tvalid,
      s_axis_tready => s_axis_tready,
      s_axis_tdata  => s_axis_tdata,
      s_axis_tuser  => s_axis_tuser,
      s_axis_tlast  => s_axis_tlast,
      m_axis_tvalid => m_axis_tvalid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tuser  => m_axis_tuser,
      m_axis_tlast  => m_axis_tlast,
      error_flags   => error_flags
    );

  bench : process (clk) is

    file input_file  : words_t open read_mode is "input.bin";
    file loads_file  : words_t open read_mode is "loads.bin";
    file output_file : words_t open write_mode is "output.bin";
    file clocks_file : text open write_mode is "clocks.txt";

    variable random         : random_t := SEED mod 65536;
    variable stall          : boolean;
    variable loaded         : natural  := 0;
    variable offered        : natural  := 0;
    variable accepted       : natural  := 0;
    variable received       : natural  := 0;
    variable refused        : natural  := 0;
    variable clock          : natural  := 0;
    variable idle           : natural  := 0;
    variable first_in       : natural  := 0;
    variable last_in        : natural  := 0;
    variable first_out      : natural  := 0;
    variable last_out       : natural  := 0;
    variable framing_errors : natural  := 0;

  begin

    if rising_edge(clk) and reset = '0' then
      clock := clock + 1;
      idle  := idle + 1;

      -- First everything is loaded.
      load.write <= '0';
      if loaded < LOADS then
        read_load(loads_file, load);
        loaded := loaded + 1;
        idle   := 0;
      end if;

      -- What is offered and not taken is counted: a camera would lose it.
      if s_axis_tvalid = '1' then
        if s_axis_tready = '1' then
          if accepted = 0 then
            first_in := clock;
          end if;
          accepted      := accepted + 1;
          last_in       := clock;
          idle          := 0;
          s_axis_tvalid <= '0';
        else
          refused := refused + 1;
        end if;
      end if;

      draw(random, stall, stall_share(STALL_PERCENT, clock, false));
      -- Only one pixel is on offer: the next is drawn when it was taken.
      if loaded = LOADS and offered = accepted and offered < PIXELS and not stall then
        read_values(input_file, PIXEL_BITS, s_axis_tdata);
        s_axis_tvalid <= '1';
        s_axis_tlast  <= ends_line(offered, COLUMNS);
        s_axis_tuser  <= starts_frame(offered, FRAME_PIXELS);
        offered       := offered + 1;
      end if;

      if m_axis_tvalid = '1' and m_axis_tready = '1' then
        if received = 0 then
          first_out := clock;
        end if;
        write_values(output_file, PIXEL_BITS, m_axis_tdata);
        if m_axis_tlast /= ends_line(received, OUT_COLUMNS) or m_axis_tuser /= starts_frame(received, OUT_FRAME) then
          framing_errors := framing_errors + 1;
        end if;
        received := received + 1;
        last_out := clock;
        idle     := 0;
      end if;

      -- Drawn anew for the sink, so that both sides stall apart from each other.
      draw(random, stall, stall_share(STALL_PERCENT, clock, true));
      if stall then
        m_axis_tready <= '0';
      else
        m_axis_tready <= '1';
      end if;

      -- Some clocks of silence behind the last pixel show that none comes in excess.
      if (received >= OUT_PIXELS and idle >= SILENCE) or idle >= IDLE_LIMIT then
        write_count(clocks_file, "accepted", accepted);
        write_count(clocks_file, "received", received);
        write_count(clocks_file, "refused", refused);
        write_count(clocks_file, "clocks", last_out - first_in + 1);
        write_count(clocks_file, "latency", first_out - first_in);
        write_count(clocks_file, "input_clocks", last_in - first_in + 1);
        write_count(clocks_file, "framing_errors", framing_errors);
        write_count(clocks_file, "error_flags", to_integer(unsigned(error_flags)));
        running <= false;
      end if;
    end if;

  end process bench;

end architecture test;
