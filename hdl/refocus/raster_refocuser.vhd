-- Refocuses a raster scan of a light field: one pixel each clock, all channels at once.
--
-- Input FIFO -> frame sequencer -> row stage (switched FIR, depth 1) -> column stage (switched
-- FIR on line buffers) -> scaling -> output FIFO.
--
-- Lines and frames may follow each other without a gap. When nothing follows, the core pushes
-- the rest of the frame out by itself; the input FIFO holds what arrives meanwhile (a line at most).
-- Stalls on either side lose and repeat nothing. The sequencer decides each clock whether
-- the stages get a token, so no enable reaches the filters: the output FIFO has room for all
-- tokens under way.
--
-- Latency: D * (max(columns, 4) + 1) + 14 clocks (13 with stored products) from the first pixel in to
--   the first pixel out when nothing stalls; D = output_delay: lines of the column filter and
--   pixels of the row filter.
-- Throughput: one pixel of all channels each clock.
-- Ports: AXI4-Stream video, tuser(0) = start of frame, tlast = end of line, channel 0 in the low
--   bits of tdata; columns, rows: frame size, read with the first pixel of a frame; error_flags
--   as in frame_sequencer, set until error_clear.
-- Equation: out(k) = round(S2(k) / M**2), S2 the refocusing sums of rows, then columns (EXACT); or
--   with stored products: product = round(x * 2**F / M), intermediate image with G guard
--   bits, rounded and saturated after the rows and after the columns.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.refocus_pkg.all;

entity raster_refocuser is
  generic (
    -- M: pixels a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive range 1 to 128;
    -- a' = a * M: shift in pixels.
    SHIFT : integer range -4096 to 4096;
    -- Whether the picture stays put while focus is stepped.
    CENTRED : boolean := true;
    -- Longest line in pixels; line buffers and input FIFO hold as many.
    MAX_COLUMNS : positive range 1 to 8192 := 2048;
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3 := 1;
    -- Width of a channel; stored products take up to 16 - GUARD_BITS.
    PIXEL_BITS : positive range 1 to 16 := 8;
    -- Exact sums and one division at the end, or stored products.
    EXACT : boolean := true;
    -- Stored products only: fraction bits of the products, at least GUARD_BITS.
    FRACTION_BITS : natural range 0 to 12 := 0;
    -- Stored products only: guard bits of the intermediate image.
    GUARD_BITS : natural range 0 to 12 := 0
  );
  port (
    clk           : in    std_logic;
    reset         : in    std_logic;
    columns       : in    std_logic_vector(15 downto 0);
    rows          : in    std_logic_vector(15 downto 0);
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tlast  : out   std_logic;
    error_flags   : out   std_logic_vector(4 downto 0);
    error_clear   : in    std_logic
  );
end entity raster_refocuser;

architecture rtl of raster_refocuser is

  constant STORED : boolean  := not EXACT;
  constant DELAY  : natural  := output_delay(MICRO_IMAGE_SIZE, SHIFT, CENTRED);
  constant AREA   : positive := MICRO_IMAGE_SIZE * MICRO_IMAGE_SIZE;

  -- Largest value and width at each point of the data path.
  function choose (
    condition : boolean;
    yes       : natural;
    no        : natural
  ) return natural is
  begin

    if condition then
      return yes;
    end if;

    return no;

  end function choose;

  constant PIXEL_MAX       : positive := 2 ** PIXEL_BITS - 1;
  constant ROW_ROM_MAX     : positive := scaled_quotient(PIXEL_MAX, FRACTION_BITS, MICRO_IMAGE_SIZE);
  constant ROW_PRODUCT_MAX : positive := choose(EXACT, PIXEL_MAX, ROW_ROM_MAX);
  constant ROW_SUM_MAX     : positive := MICRO_IMAGE_SIZE * ROW_PRODUCT_MAX;
  -- The intermediate image: row sums, or pixels with guard bits.
  constant MIDDLE_BITS     : positive := choose(EXACT, bits_for(ROW_SUM_MAX), PIXEL_BITS + GUARD_BITS);
  constant MIDDLE_MAX      : positive := choose(EXACT, ROW_SUM_MAX, 2 ** MIDDLE_BITS - 1);
  constant DROP_BITS       : integer  := FRACTION_BITS - GUARD_BITS;
  constant COL_SCALE_BITS  : natural  := choose(EXACT, 0, DROP_BITS);
  constant COL_ROM_MAX     : positive := scaled_quotient(MIDDLE_MAX, COL_SCALE_BITS, MICRO_IMAGE_SIZE);
  constant COL_PRODUCT_MAX : positive := choose(EXACT, MIDDLE_MAX, COL_ROM_MAX);
  constant COL_SUM_MAX     : positive := MICRO_IMAGE_SIZE * COL_PRODUCT_MAX;

  constant ROW_SUM_BITS : positive := bits_for(ROW_SUM_MAX);
  constant COL_SUM_BITS : positive := bits_for(COL_SUM_MAX);

  -- Clocks of the scaling behind each stage.
  constant MIDDLE_LATENCY : natural := choose(EXACT, 0, 1);
  constant RESULT_LATENCY : natural := choose(EXACT, 3, 1);

  -- The input FIFO takes what arrives during a flush line, and 2 words of its own latency.
  constant INPUT_ADDRESS_BITS : positive := bits_for(MAX_COLUMNS + 1);
  -- The output FIFO takes all tokens under way when it asks for no more.
  constant OUTPUT_ADDRESS_BITS : positive := 5;
  constant TOKENS_UNDER_WAY    : positive := 2 + 2 * STAGE_LATENCY + MIDDLE_LATENCY + RESULT_LATENCY;
  constant ROOM_LEVEL          : natural  := 2 ** OUTPUT_ADDRESS_BITS - TOKENS_UNDER_WAY;

  constant DATA_BITS   : positive := CHANNELS * PIXEL_BITS;
  constant STREAM_BITS : positive := DATA_BITS + 2;

  -- Side information of a token; bit 0 is the one that reset clears.
  constant PIXEL       : natural := 0;
  constant LINE_FIRST  : natural := 1;
  constant LINE_LAST   : natural := 2;
  constant FRAME_FIRST : natural := 3;
  constant IMAGE       : natural := 4;

  subtype token_tag_t is std_logic_vector(IMAGE downto 0);

  -- Side information of a line in the column stage.
  constant LINE_IMAGE       : natural := 0;
  constant LINE_FRAME_FIRST : natural := 1;

  subtype line_tag_t is std_logic_vector(LINE_FRAME_FIRST downto 0);

  -- Side information of a result pixel.
  constant RESULT_VALID : natural := 0;
  constant RESULT_LAST  : natural := 1;
  constant RESULT_START : natural := 2;

  subtype result_tag_t is std_logic_vector(RESULT_START downto 0);

  signal input_word   : std_logic_vector(STREAM_BITS - 1 downto 0);
  signal stream_word  : std_logic_vector(STREAM_BITS - 1 downto 0);
  signal stream_valid : std_logic;
  signal stream_ready : std_logic;
  signal room         : std_logic := '0';

  signal token_strobe : std_logic;
  signal token_tag    : token_tag_t;
  signal token_data   : std_logic_vector(DATA_BITS - 1 downto 0);

  signal row_strobe : std_logic;
  signal row_tag    : token_tag_t;
  signal row_sums   : std_logic_vector(CHANNELS * ROW_SUM_BITS - 1 downto 0);

  signal pixel_tag    : token_tag_t;
  signal middle_tag   : token_tag_t;
  signal middle_image : std_logic_vector(CHANNELS * MIDDLE_BITS - 1 downto 0);
  signal middle_line  : line_tag_t;
  signal middle_last  : std_logic_vector(1 downto 0);

  signal column_strobe : std_logic;
  signal column_line   : line_tag_t;
  signal column_last   : std_logic_vector(1 downto 0);
  signal column_sums   : std_logic_vector(CHANNELS * COL_SUM_BITS - 1 downto 0);

  signal sum_tag      : result_tag_t;
  signal result_tag   : result_tag_t;
  signal result_data  : std_logic_vector(DATA_BITS - 1 downto 0);
  signal result_word  : std_logic_vector(STREAM_BITS - 1 downto 0);
  signal output_word  : std_logic_vector(STREAM_BITS - 1 downto 0);
  signal output_level : unsigned(OUTPUT_ADDRESS_BITS downto 0);

begin

  assert EXACT or GUARD_BITS <= FRACTION_BITS
    report "raster_refocuser: GUARD_BITS exceeds FRACTION_BITS"
    severity failure;

  assert EXACT or PIXEL_BITS + GUARD_BITS <= 16
    report "raster_refocuser: PIXEL_BITS + GUARD_BITS exceeds the 16 address bits of a stored product"
    severity failure;

  -- Stream to tokens.
  input_word <= s_axis_tuser & s_axis_tlast & s_axis_tdata;

  input_fifo : entity work.axis_fifo
    generic map (
      WIDTH        => STREAM_BITS,
      ADDRESS_BITS => INPUT_ADDRESS_BITS
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => s_axis_tvalid,
      s_axis_tready => s_axis_tready,
      s_axis_tdata  => input_word,
      m_axis_tvalid => stream_valid,
      m_axis_tready => stream_ready,
      m_axis_tdata  => stream_word,
      level         => open
    );

  sequencer : entity work.frame_sequencer
    generic map (
      MAX_COLUMNS  => MAX_COLUMNS,
      DATA_BITS    => DATA_BITS,
      FILTER_DELAY => DELAY
    )
    port map (
      clk               => clk,
      reset             => reset,
      columns           => columns,
      rows              => rows,
      s_axis_tvalid     => stream_valid,
      s_axis_tready     => stream_ready,
      s_axis_tdata      => stream_word(DATA_BITS - 1 downto 0),
      s_axis_tuser      => stream_word(DATA_BITS + 1),
      s_axis_tlast      => stream_word(DATA_BITS),
      room              => room,
      token_strobe      => token_strobe,
      token_pixel       => token_tag(PIXEL),
      token_line_first  => token_tag(LINE_FIRST),
      token_line_last   => token_tag(LINE_LAST),
      token_frame_first => token_tag(FRAME_FIRST),
      token_image       => token_tag(IMAGE),
      token_data        => token_data,
      error_flags       => error_flags,
      error_clear       => error_clear
    );

  -- Rows: every token is a step.
  row_stage : entity work.refocus_stage
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFT            => SHIFT,
      CENTRED          => CENTRED,
      DEPTH            => 1,
      CHANNELS         => CHANNELS,
      DATA_BITS        => PIXEL_BITS,
      STORED           => STORED,
      SCALE_BITS       => FRACTION_BITS,
      PRODUCT_MAX      => ROW_PRODUCT_MAX,
      SUM_MAX          => ROW_SUM_MAX,
      STEP_TAG_BITS    => token_tag_t'length,
      TOKEN_TAG_BITS   => 1
    )
    port map (
      clk           => clk,
      reset         => reset,
      strobe        => token_strobe,
      advance       => '1',
      first         => token_tag(LINE_FIRST),
      data          => token_data,
      step_tag      => token_tag,
      token_tag     => "0",
      out_strobe    => row_strobe,
      out_sums      => row_sums,
      out_step_tag  => row_tag,
      out_token_tag => open
    );

  -- The intermediate image.
  exact_middle : if EXACT generate
    middle_image <= row_sums;
  end generate exact_middle;

  stored_middle : if STORED generate

    channel : for c in 0 to CHANNELS - 1 generate

      round_row : entity work.round_saturate
        generic map (
          VALUE_MAX   => ROW_SUM_MAX,
          DROP_BITS   => DROP_BITS,
          RESULT_BITS => MIDDLE_BITS
        )
        port map (
          clk    => clk,
          value  => row_sums((c + 1) * ROW_SUM_BITS - 1 downto c * ROW_SUM_BITS),
          result => middle_image((c + 1) * MIDDLE_BITS - 1 downto c * MIDDLE_BITS)
        );

    end generate channel;

  end generate stored_middle;

  -- A step of the row stage that yields no pixel has no tag at all.
  pixel_tag <= row_tag when row_strobe = '1' and row_tag(PIXEL) = '1' else
               (others => '0');

  middle_tags : entity work.tag_delay
    generic map (
      WIDTH  => token_tag_t'length,
      LENGTH => MIDDLE_LATENCY
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => pixel_tag,
      delayed => middle_tag
    );

  middle_line(LINE_IMAGE)       <= middle_tag(IMAGE);
  middle_line(LINE_FRAME_FIRST) <= middle_tag(FRAME_FIRST);
  middle_last                   <= middle_tag(LINE_LAST) & middle_tag(LINE_FIRST);

  -- Columns: every line is a step.
  column_stage : entity work.refocus_stage
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFT            => SHIFT,
      CENTRED          => CENTRED,
      DEPTH            => MAX_COLUMNS,
      CHANNELS         => CHANNELS,
      DATA_BITS        => MIDDLE_BITS,
      STORED           => STORED,
      SCALE_BITS       => COL_SCALE_BITS,
      PRODUCT_MAX      => COL_PRODUCT_MAX,
      SUM_MAX          => COL_SUM_MAX,
      STEP_TAG_BITS    => line_tag_t'length,
      TOKEN_TAG_BITS   => 2
    )
    port map (
      clk           => clk,
      reset         => reset,
      strobe        => middle_tag(PIXEL),
      advance       => middle_tag(LINE_FIRST),
      first         => middle_tag(FRAME_FIRST),
      data          => middle_image,
      step_tag      => middle_line,
      token_tag     => middle_last,
      out_strobe    => column_strobe,
      out_sums      => column_sums,
      out_step_tag  => column_line,
      out_token_tag => column_last
    );

  -- Scaling to pixels.
  result_channel : for c in 0 to CHANNELS - 1 generate

    exact_result : if EXACT generate

      divide : entity work.divide_round
        generic map (
          VALUE_MAX     => COL_SUM_MAX,
          DIVISOR       => AREA,
          QUOTIENT_BITS => PIXEL_BITS
        )
        port map (
          clk      => clk,
          value    => column_sums((c + 1) * COL_SUM_BITS - 1 downto c * COL_SUM_BITS),
          quotient => result_data((c + 1) * PIXEL_BITS - 1 downto c * PIXEL_BITS)
        );

    end generate exact_result;

    stored_result : if STORED generate

      round_column : entity work.round_saturate
        generic map (
          VALUE_MAX   => COL_SUM_MAX,
          DROP_BITS   => FRACTION_BITS,
          RESULT_BITS => PIXEL_BITS
        )
        port map (
          clk    => clk,
          value  => column_sums((c + 1) * COL_SUM_BITS - 1 downto c * COL_SUM_BITS),
          result => result_data((c + 1) * PIXEL_BITS - 1 downto c * PIXEL_BITS)
        );

    end generate stored_result;

  end generate result_channel;

  sum_tag(RESULT_VALID) <= column_strobe and column_line(LINE_IMAGE);
  sum_tag(RESULT_LAST)  <= column_last(1);
  sum_tag(RESULT_START) <= column_last(0) and column_line(LINE_FRAME_FIRST);

  result_tags : entity work.tag_delay
    generic map (
      WIDTH  => result_tag_t'length,
      LENGTH => RESULT_LATENCY
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => sum_tag,
      delayed => result_tag
    );

  result_word <= result_tag(RESULT_START) & result_tag(RESULT_LAST) & result_data;

  output_fifo : entity work.axis_fifo
    generic map (
      WIDTH        => STREAM_BITS,
      ADDRESS_BITS => OUTPUT_ADDRESS_BITS
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => result_tag(RESULT_VALID),
      s_axis_tready => open,
      s_axis_tdata  => result_word,
      m_axis_tvalid => m_axis_tvalid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => output_word,
      level         => output_level
    );

  m_axis_tdata    <= output_word(DATA_BITS - 1 downto 0);
  m_axis_tlast    <= output_word(DATA_BITS);
  m_axis_tuser(0) <= output_word(DATA_BITS + 1);

  watch_room : process (clk) is
  begin

    if rising_edge(clk) then
      if output_level < ROOM_LEVEL then
        room <= '1';
      else
        room <= '0';
      end if;
      if reset = '1' then
        room <= '0';
      end if;
    end if;

  end process watch_room;

end architecture rtl;
