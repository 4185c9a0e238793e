-- SPDX-License-Identifier: Apache-2.0
-- From the raw raster of the sensor to the raster of micro images of M x M pixels, without a frame memory.
--
-- Raw lines go into a ring. As soon as the lines that line v of a row of lenses needs have arrived, the resampler walks
-- along the row's lenses and reads four pixels around one position each clock. Positions are sums of registers in fixed
-- point; all pixels of a micro image have the same interpolation weights. Rotation makes a row of lenses drift over the
-- lines: the ring holds rows * tan(angle) + 3 lines, and more where micro images are mirrored at the sensor's borders.
--
-- The output frame has a size of its own: M times the number of lenses. Registers of the grid and tables are written
-- through the load port. The grid takes effect with the first frame after a commit, the tables at once. A load without
-- a commit changes no grid, and a newer calibration replaces one that no frame has used (lens_registers).
--
-- Faults of the stream are repaired as in frame_sequencer. If a frame is cut short, the raster lines whose raw lines
-- have all arrived come out whole. If a raster line needs more raw lines than the ring has, the frame ends there with a
-- flag; the lines before have come out.
--
-- Latency: 27 clocks from the last raw pixel that a line needs to the line's first pixel, hexagonal grids 2 M + 8
-- clocks more, when nothing stalls. State: LINES x MAX_COLUMNS pixels and the tables.
-- Throughput: one raw pixel each clock, and one pixel of the raster each clock. The source is never refused if the sink
-- takes a pixel each clock, a raster line has fewer pixels than a raw line has clocks, M is at most the number of raw
-- lines from a row of lenses to the next, and the ring holds the lines that plenofir.plan.sensor.chip counts.
-- Equation: plenofir.camera.resampling.grid_resampler.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.arithmetic_pkg.all;
use work.math_pkg.all;
use work.resample_pkg.all;
use work.token_pkg.all;

entity resampler is
  generic (
    -- M, pixels of a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- true: rows of lenses are interpolated to a rectangular raster.
    HEXAGONAL : boolean := false;
    -- true: registers hold the steps between the lines and between the pixels of a micro image, so that these may lie
    -- along the axes of a hexagonal grid, 60 degrees apart (focused cameras).
    SKEWED : boolean := false;
    -- Longest raw line in pixels.
    MAX_COLUMNS : positive range 2 to 8192 := 2048;
    -- Raw lines that the ring holds, an even number.
    LINES : positive range 4 to 256 := 8;
    -- LENSES of the table; MOVES: the table moves them from the even grid; GAINS: the table has gains.
    LENSES : positive range 2 to 1048576 := 2;
    MOVES  : boolean                     := false;
    GAINS  : boolean                     := false;
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3 := 1;
    -- Width of a channel.
    PIXEL_BITS : positive range 1 to 16 := 8;
    -- Fraction bits of positions, weights, samples and gains.
    FRACTION_BITS : positive range 8 to 17 := 16;
    WEIGHT_BITS   : positive range 2 to 8  := 8;
    GUARD_BITS    : positive range 1 to 3  := 3;
    GAIN_BITS     : positive range 4 to 14 := 12;
    -- true: the entity in front holds frames back, and taken_early says when it takes one.
    HELD_BACK : boolean := false
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Size of the raw frame, read with its first pixel.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- Load port: the kind of word (resample_pkg: register, lens, profile, commit), its address, its data. A frame has
    -- one calibration, that of its first pixel. If its mark of start lasts several pixels, a calibration committed
    -- between them may already act on the frame.
    load_write   : in    std_logic;
    load_kind    : in    std_logic_vector(1 downto 0);
    load_address : in    std_logic_vector(19 downto 0);
    load_data    : in    std_logic_vector(39 downto 0);
    -- With HELD_BACK: high for one clock when the entity in front takes the first pixel of a frame; the frame has the
    -- calibration of that clock. Without HELD_BACK a frame has the calibration of the clock in which its first pixel is
    -- taken here.
    taken_early : in    std_logic := '0';
    -- Raw frames: AXI4-Stream video, channel 0 in the low bits.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    -- Raster of micro images.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tlast  : out   std_logic;
    -- Size of the raster: of the frame that is processed, between frames of the last one.
    raster_columns : out   std_logic_vector(15 downto 0);
    raster_rows    : out   std_logic_vector(15 downto 0);
    -- Bits 0 to 4: faults of the stream (fault_pkg). Bit 5: the grid needs more lines than the ring has or has no
    -- lens, the frame is a single line or column or has more than 8192 lines, or a commit came before all registers.
    -- Bits stay set until error_clear.
    error_flags : out   std_logic_vector(5 downto 0);
    error_clear : in    std_logic := '0'
  );
end entity resampler;

architecture rtl of resampler is

  constant ODD_LINES    : boolean := not takes(LINES mod 2 = 0, "resampler: LINES is odd, expected an even number");
  constant TWO_LAYOUTS  : boolean := not takes(not (HEXAGONAL and SKEWED), "resampler: SKEWED excludes HEXAGONAL");
  constant TWO_CHANNELS : boolean := not takes(CHANNELS /= 2, "resampler: CHANNELS is 2, expected 1 (grey) or 3 (RGB)");

  -- Widths of a pixel, of an interpolated pixel, of a pixel behind its gain, and of the words of both FIFOs with their
  -- marks.
  constant DATA_BITS   : positive := CHANNELS * PIXEL_BITS;
  constant COLUMN_BITS : positive := bits_for(MAX_COLUMNS - 1);
  constant SAMPLE_BITS : positive := PIXEL_BITS + GUARD_BITS;
  constant VALUE_BITS  : positive := SAMPLE_BITS + GAIN_INTEGER_BITS;

  constant BUILD : resample_build_t :=
  (
    MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
    MAX_COLUMNS      => MAX_COLUMNS,
    held_lines       => LINES,
    LENSES           => LENSES,
    MOVES            => MOVES,
    GAINS            => GAINS,
    CHANNELS         => CHANNELS,
    PIXEL_BITS       => PIXEL_BITS,
    DATA_BITS        => DATA_BITS,
    FRACTION_BITS    => FRACTION_BITS,
    WEIGHT_BITS      => WEIGHT_BITS,
    GUARD_BITS       => GUARD_BITS,
    GAIN_BITS        => GAIN_BITS,
    SAMPLE_BITS      => SAMPLE_BITS,
    VALUE_BITS       => VALUE_BITS
  );

  -- The output FIFO has room for all pixels under way, so nothing between the ring and it needs to stop: the walk sends
  -- a pixel only for a credit.
  constant FIFO_BITS : positive := 6;
  constant CREDIT    : positive := 2 ** FIFO_BITS;
  constant IN_BITS   : positive := DATA_BITS + 2;
  constant WORD_BITS : positive := choose(HEXAGONAL, CHANNELS * VALUE_BITS, DATA_BITS) + 2;

  -- From the stream to the ring.
  signal input_word     : std_logic_vector(IN_BITS - 1 downto 0);
  signal input_ready    : std_logic;
  signal frame_accepted : std_logic;
  signal stream_word    : std_logic_vector(IN_BITS - 1 downto 0);
  signal stream_valid   : std_logic;
  signal stream_ready   : std_logic;
  signal may_take       : std_logic;
  signal frame_start    : std_logic;
  signal token          : token_t;
  signal token_data     : std_logic_vector(DATA_BITS - 1 downto 0);
  signal flags          : std_logic_vector(4 downto 0);
  signal fault          : std_logic;
  signal fault_flag     : std_logic := '0';

  signal load       : load_t;
  signal room       : std_logic;
  signal ring_write : ring_write_t;
  signal write_data : std_logic_vector(DATA_BITS - 1 downto 0);
  signal ring       : ring_state_t;
  signal need       : ring_need_t;

  -- The frame that is read, and its registers; the line of the raster on offer.
  signal registers   : registers_t;
  signal frame       : raw_frame_t;
  signal raster_line : raster_line_t;
  signal line_valid  : std_logic;
  signal line_taken  : std_logic;
  signal at_rest     : std_logic;
  signal drained     : std_logic;

  -- Places in the output FIFO that belong to no pixel under way.
  signal credits     : unsigned(FIFO_BITS downto 0) := to_unsigned(CREDIT, FIFO_BITS + 1);
  signal have_credit : std_logic;
  signal step_x      : position_t;
  signal pixel       : walked_t;
  signal black       : unsigned(SAMPLE_BITS - 1 downto 0);
  signal values      : std_logic_vector(CHANNELS * VALUE_BITS - 1 downto 0);

  -- The light at each position; the word for the output FIFO (rounded, unless a hexagonal raster follows); and the word
  -- that comes out.
  signal value_valid : std_logic;
  signal value_first : std_logic;
  signal value_last  : std_logic;
  signal word_valid  : std_logic;
  signal word        : std_logic_vector(WORD_BITS - 1 downto 0);
  signal out_word    : std_logic_vector(WORD_BITS - 1 downto 0);
  signal out_valid   : std_logic;
  signal out_ready   : std_logic;

begin

  -- A camera does not wait, so the FIFO takes pixels while the ring is full or a frame has to wait.
  input_word    <= s_axis_tuser & s_axis_tlast & s_axis_tdata;
  s_axis_tready <= input_ready;
  -- The frame has the calibration of this clock, even if its first pixel waits for the frame before.
  frame_accepted <= taken_early when HELD_BACK else
                    s_axis_tvalid and input_ready and s_axis_tuser(0);

  input_fifo : entity work.axis_fifo
    generic map (
      WIDTH        => IN_BITS,
      ADDRESS_BITS => 4
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => s_axis_tvalid,
      s_axis_tready => input_ready,
      s_axis_tdata  => input_word,
      m_axis_tvalid => stream_valid,
      m_axis_tready => stream_ready,
      m_axis_tdata  => stream_word
    );

  -- A further frame waits until the reader has taken the one before.
  may_take <= room and not (stream_valid and stream_word(DATA_BITS + 1) and
                            (ring.frame_waits or (token.strobe and token.line_first and token.frame_first)));

  sequencer : entity work.frame_sequencer
    generic map (
      MAX_COLUMNS => MAX_COLUMNS,
      DATA_BITS   => DATA_BITS
    )
    port map (
      clk           => clk,
      reset         => reset,
      columns       => columns,
      rows          => rows,
      frame_start   => frame_start,
      s_axis_tvalid => stream_valid,
      s_axis_tready => stream_ready,
      s_axis_tdata  => stream_word(DATA_BITS - 1 downto 0),
      s_axis_tuser  => stream_word(DATA_BITS + 1),
      s_axis_tlast  => stream_word(DATA_BITS),
      credit        => may_take,
      token         => token,
      token_data    => token_data,
      error_flags   => flags,
      error_clear   => error_clear
    );

  -- raw_writer numbers the lines and says when the ring has room for another line, which alone can stop the sequencer.
  writer : entity work.raw_writer
    generic map (
      BUILD => BUILD
    )
    port map (
      clk        => clk,
      reset      => reset,
      token      => token,
      token_data => token_data,
      room       => room,
      ring_write => ring_write,
      write_data => write_data,
      ring       => ring,
      need       => need
    );

  -- Users get plain ports; inside, one record goes to all entities that store words.
  load <= (load_write, load_kind, load_address, load_data);

  lines_of_lenses : entity work.lens_rows
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      HEXAGONAL        => HEXAGONAL,
      SKEWED           => SKEWED,
      LINES            => LINES,
      FRACTION_BITS    => FRACTION_BITS
    )
    port map (
      clk            => clk,
      reset          => reset,
      load           => load,
      frame_accepted => frame_accepted,
      frame_start    => frame_start,
      columns        => columns,
      rows           => rows,
      ring           => ring,
      need           => need,
      raster_line    => raster_line,
      line_valid     => line_valid,
      line_taken     => line_taken,
      at_rest        => at_rest,
      drained        => drained,
      registers      => registers,
      frame          => frame,
      raster_columns => raster_columns,
      raster_rows    => raster_rows,
      fault          => fault
    );

  step_x <= signed(registers(REGISTER_PIXEL_X)) when SKEWED else
            shift_left(to_signed(1, position_t'length), FRACTION_BITS);

  -- lens_walk registers the fields of its pixel: only one more register stands in front of the memories.
  walk : entity work.lens_walk
    generic map (
      BUILD => BUILD
    )
    port map (
      clk         => clk,
      reset       => reset,
      lenses      => unsigned(registers(REGISTER_LENSES)(31 downto 16)),
      right_y     => signed(registers(REGISTER_RIGHT_Y)),
      right_x     => signed(registers(REGISTER_RIGHT_X)),
      step_x      => step_x,
      raster_line => raster_line,
      line_valid  => line_valid,
      line_taken  => line_taken,
      at_rest     => at_rest,
      credit      => have_credit,
      pixel       => pixel
    );

  -- A pixel that was sent in the last clock is not counted yet, so one more place must be free.
  have_credit <= '1' when credits > 1 else
                 '0';
  drained     <= '1' when credits = CREDIT and pixel.valid = '0' else
                 '0';

  -- A pixel that leaves returns its place; a pixel sent in the same clock takes it.
  follow : process (clk) is
  begin

    if rising_edge(clk) then
      if pixel.valid = '1' and not (out_valid = '1' and out_ready = '1') then
        credits <= credits - 1;
      elsif pixel.valid = '0' and out_valid = '1' and out_ready = '1' then
        credits <= credits + 1;
      end if;

      -- A fault in the clock of the clearing is kept.
      if error_clear = '1' then
        fault_flag <= '0';
      end if;
      if fault = '1' then
        fault_flag <= '1';
      end if;

      if reset = '1' then
        credits    <= to_unsigned(CREDIT, FIFO_BITS + 1);
        fault_flag <= '0';
      end if;
    end if;

  end process follow;

  error_flags <= fault_flag & flags;

  -- The black level has the fraction bits of a sample.
  black <= unsigned(registers(REGISTER_BLACK)(SAMPLE_BITS - 1 downto 0));

  -- lens_samples cannot stop: the credits guarantee that each of its values has a place.
  samples : entity work.lens_samples
    generic map (
      BUILD => BUILD
    )
    port map (
      clk         => clk,
      reset       => reset,
      load        => load,
      ring_write  => ring_write,
      write_data  => write_data,
      frame       => frame,
      black       => black,
      pixel       => pixel,
      value_valid => value_valid,
      value_first => value_first,
      value_last  => value_last,
      values      => values
    );

  -- The FIFO's ready is not used, because the credits keep it from being full.
  values_out : entity work.axis_fifo
    generic map (
      WIDTH        => WORD_BITS,
      ADDRESS_BITS => FIFO_BITS,
      MUST_FIT     => true
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => word_valid,
      s_axis_tdata  => word,
      m_axis_tvalid => out_valid,
      m_axis_tready => out_ready,
      m_axis_tdata  => out_word
    );

  rectangular : if not HEXAGONAL generate

    -- The marks are delayed by the clock that rounding takes.
    follow_values : process (clk) is
    begin

      if rising_edge(clk) then
        word_valid                               <= value_valid;
        word(WORD_BITS - 1 downto WORD_BITS - 2) <= value_last & value_first;

        for c in 0 to CHANNELS - 1 loop

          word((c + 1) * PIXEL_BITS - 1 downto c * PIXEL_BITS) <= rounded(values((c + 1) * VALUE_BITS - 1 downto
                                                                                 c * VALUE_BITS), GUARD_BITS,
                                                                          PIXEL_BITS);

        end loop;

        if reset = '1' then
          word_valid <= '0';
        end if;
      end if;

    end process follow_values;

    m_axis_tvalid   <= out_valid;
    out_ready       <= m_axis_tready;
    m_axis_tdata    <= out_word(DATA_BITS - 1 downto 0);
    m_axis_tuser(0) <= out_word(DATA_BITS);
    m_axis_tlast    <= out_word(DATA_BITS + 1);

  end generate rectangular;

  hexagonal_grid : if HEXAGONAL generate

    -- hexagonal_rows interpolates between unrounded values.
    word_valid <= value_valid;
    word       <= value_last & value_first & values;

    straighten : entity work.hexagonal_rows
      generic map (
        BUILD => BUILD
      )
      port map (
        clk           => clk,
        reset         => reset,
        registers     => registers,
        in_valid      => out_valid,
        in_ready      => out_ready,
        in_first      => out_word(WORD_BITS - 2),
        in_last       => out_word(WORD_BITS - 1),
        in_data       => out_word(WORD_BITS - 3 downto 0),
        m_axis_tvalid => m_axis_tvalid,
        m_axis_tready => m_axis_tready,
        m_axis_tdata  => m_axis_tdata,
        m_axis_tuser  => m_axis_tuser,
        m_axis_tlast  => m_axis_tlast
      );

  end generate hexagonal_grid;

end architecture rtl;
