-- SPDX-License-Identifier: Apache-2.0
-- Everything of a core except its engine: video stream in, tokens to the engine, results from it, video stream out.
--
-- Input FIFO -> frame sequencer -> row gather -> engine -> row scatter. With PARALLEL_ROWS = 1 the gather is a wire and
-- the scatter a FIFO. With more, the gather stores lines until a band is complete, and the scatter puts the rows of the
-- results in order.
--
-- At each clock the sequencer decides whether the engine gets a token. The sequencer hands out only as many tokens
-- as the output FIFO has room for, so the engine never stalls and needs no clock enable. When nothing follows a
-- frame, empty tokens and flush lines push its last lines out.
--
-- The slice is chosen when a frame's first pixel is taken, and waits in a FIFO of its own while the pixel waits in
-- the input FIFO. This FIFO holds at least SLICE_WORDS slices; if more frames begin within the input FIFO, the next
-- one waits at the port. A mark of start that lasts several pixels of a line counts once.
--
-- Latency: STREAM_LATENCY clocks and those of the engine; 1 more with parallel rows, 3 fewer without input FIFO.
-- Throughput: one token each clock.
-- Equation: the n-th result of an image line out is the n-th in; for tokens see frame_sequencer.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.token_pkg.all;

entity stream_shell is
  generic (
    -- Longest line in pixels.
    MAX_COLUMNS : positive;
    -- Neighbouring pixels of a line in one token, a power of two; above 1 only with one row at a time.
    PIXELS_PER_CLOCK : positive := 1;
    -- Lines that the engine takes at once.
    PARALLEL_ROWS : positive := 1;
    -- Width of the pixels in one word of the stream in.
    IN_BITS : positive;
    -- Width of the pixels in one word of the stream out.
    OUT_BITS : positive;
    -- Slices in the set from which each frame has one; 0: frames have no slice.
    SLICES : natural range 0 to 256 := 0;
    -- Pixels that the input FIFO holds at least; 0: no FIFO, and pixels wait in the source.
    INPUT_PIXELS : natural := 0;
    -- Tokens behind a line's last pixel that push everything out of the engine's row filters.
    ROW_DELAY : natural := 0;
    -- Lines behind the last one that push everything out of the engine's column filters.
    COLUMN_DELAY : natural;
    -- Clocks from a token at the engine's input to its result.
    ENGINE_LATENCY : positive;
    -- The shortest band in tokens, a multiple of PARALLEL_ROWS.
    MIN_STEPS : positive;
    -- The shortest frame in bands.
    MIN_BANDS : positive := 1;
    -- Each frame's number of bands is filled up to a multiple of this.
    BAND_MODULUS : positive := 1;
    -- true: flush lines that are not needed for the multiple count as well.
    KEEP_MODULUS : boolean := false
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Size and slice of the next frame; the size is that of all frames inside.
    order : in    frame_order_t;
    -- The stream of pixels in.
    s_axis_marks  : in    marks_t;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(IN_BITS - 1 downto 0);
    -- The stream of pixels out; tid: the slice of the frame that comes out.
    m_axis_marks  : out   marks_t;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(OUT_BITS - 1 downto 0);
    m_axis_tid    : out   std_logic_vector(7 downto 0);
    -- Faults of the stream by the bits of fault_pkg; they stay set until error_clear.
    error_flags : out   std_logic_vector(4 downto 0);
    error_clear : in    std_logic;
    -- To the engine: a token; which of its rows are image lines; their pixels, row 0 in the low bits.
    token      : out   token_t;
    token_rows : out   std_logic_vector(PARALLEL_ROWS - 1 downto 0);
    token_data : out   std_logic_vector(PARALLEL_ROWS * IN_BITS - 1 downto 0);
    -- Which pixels of a token a line's last token has.
    line_end : out   std_logic_vector(PIXELS_PER_CLOCK - 1 downto 0);
    -- From the engine: results of each row, their pixels, row 0 in the low bits.
    results     : in    results_t(0 to PARALLEL_ROWS - 1);
    result_data : in    std_logic_vector(PARALLEL_ROWS * OUT_BITS - 1 downto 0)
  );
end entity stream_shell;

architecture rtl of stream_shell is

  constant SLICE_BITS  : natural  := choose(SLICES = 0, 0, bits_for(larger(SLICES - 1, 0)));
  constant STREAM_BITS : positive := IN_BITS + 2;
  -- Number of frames that may begin within the input FIFO.
  constant SLICE_WORDS : positive := 2;

  -- Clocks from the sequencer's decision to a result: sequencer 2, gather, engine.
  constant TOKENS_UNDER_WAY : positive := 2 + choose(PARALLEL_ROWS > 1, 2, 0) + ENGINE_LATENCY;

  signal input_word   : std_logic_vector(STREAM_BITS - 1 downto 0);
  signal stream_word  : std_logic_vector(STREAM_BITS - 1 downto 0);
  signal stream_valid : std_logic;
  signal stream_ready : std_logic;
  signal fifo_valid   : std_logic;
  signal fifo_ready   : std_logic;
  signal taken        : std_logic;
  signal slice_fits   : std_logic;
  signal frame_start  : std_logic;
  signal frame_slice  : slice_t;
  signal line_token   : token_t;
  signal line_row     : natural range 0 to larger(PARALLEL_ROWS - 1, 1);
  signal line_data    : std_logic_vector(IN_BITS - 1 downto 0);
  signal credit       : std_logic;
  signal drained      : std_logic;

begin

  input_word <= s_axis_marks.tuser & s_axis_marks.tlast & s_axis_tdata;

  -- A pixel enters the input FIFO (or the sequencer) only if there is also a place for a slice.
  fifo_valid    <= s_axis_marks.tvalid and slice_fits;
  taken         <= fifo_ready and slice_fits;
  s_axis_tready <= taken;

  -- A core behind another core needs no input FIFO: pixels wait in the other core's output FIFO.
  no_fifo : if INPUT_PIXELS = 0 generate
    stream_word  <= input_word;
    stream_valid <= fifo_valid;
    fifo_ready   <= stream_ready;
  end generate no_fifo;

  fifo : if INPUT_PIXELS > 0 generate

    input_fifo : entity work.axis_fifo
      generic map (
        WIDTH        => STREAM_BITS,
        ADDRESS_BITS => bits_for(INPUT_PIXELS)
      )
      port map (
        clk           => clk,
        reset         => reset,
        s_axis_tvalid => fifo_valid,
        s_axis_tready => fifo_ready,
        s_axis_tdata  => input_word,
        m_axis_tvalid => stream_valid,
        m_axis_tready => stream_ready,
        m_axis_tdata  => stream_word
      );

  end generate fifo;

  one_slice : if SLICES < 2 generate
    frame_slice <= (others => '0');
    slice_fits  <= '1';
  end generate one_slice;

  set_of_slices : if SLICES > 1 generate

    -- Pixels that enter the input FIFO (index 0) and leave it (1). moves: a pixel does; starts, ends: its marks;
    -- lasts: the mark of start has been set since the pixel before; firsts: it is a frame's first pixel.
    signal moves  : std_logic_vector(0 to 1);
    signal starts : std_logic_vector(0 to 1);
    signal ends   : std_logic_vector(0 to 1);
    signal lasts  : std_logic_vector(0 to 1) := "00";
    signal firsts : std_logic_vector(0 to 1);
    -- The slice of a frame: slice_in as its first pixel enters, slice_out as that pixel leaves, slice_kept afterwards.
    signal slice_in   : unsigned(larger(SLICE_BITS, 1) - 1 downto 0);
    signal slice_out  : std_logic_vector(slice_in'range);
    signal slice_kept : std_logic_vector(slice_in'range) := (others => '0');

  begin

    moves  <= (s_axis_marks.tvalid and taken) & (stream_valid and stream_ready);
    starts <= s_axis_marks.tuser(0) & stream_word(IN_BITS + 1);
    ends   <= s_axis_marks.tlast & stream_word(IN_BITS);
    firsts <= moves and starts and not lasts;

    follow_starts : process (clk) is
    begin

      if rising_edge(clk) then

        for i in moves'range loop

          if moves(i) = '1' then
            lasts(i) <= starts(i) and not ends(i);
          end if;

        end loop;

        if firsts(1) = '1' then
          slice_kept <= slice_out;
        end if;
        if reset = '1' then
          lasts <= "00";
        end if;
      end if;

    end process follow_starts;

    choose_slice : entity work.slice_select
      generic map (
        SLICES     => SLICES,
        SLICE_BITS => SLICE_BITS
      )
      port map (
        clk          => clk,
        reset        => reset,
        frame_start  => firsts(0),
        slice        => order.slice,
        sweep        => order.sweep,
        sweep_frames => order.sweep_frames,
        selected     => slice_in
      );

    at_once : if INPUT_PIXELS = 0 generate
      slice_out  <= std_logic_vector(slice_in);
      slice_fits <= '1';
    end generate at_once;

    waits : if INPUT_PIXELS > 0 generate

      slices_fifo : entity work.axis_fifo
        generic map (
          WIDTH        => SLICE_BITS,
          ADDRESS_BITS => bits_for(SLICE_WORDS - 1)
        )
        port map (
          clk           => clk,
          reset         => reset,
          s_axis_tvalid => firsts(0),
          s_axis_tready => slice_fits,
          s_axis_tdata  => std_logic_vector(slice_in),
          m_axis_tvalid => open,
          m_axis_tready => firsts(1),
          m_axis_tdata  => slice_out,
          level         => open
        );

    end generate waits;

    -- That a frame's first pixel is on offer is enough here; that it leaves in this clock would be known too late.
    frame_slice <= resize(unsigned(slice_out), slice_t'length) when starts(1) = '1' and lasts(1) = '0' else
                   resize(unsigned(slice_kept), slice_t'length);

  end generate set_of_slices;

  sequencer : entity work.frame_sequencer
    generic map (
      MAX_COLUMNS      => MAX_COLUMNS,
      PIXELS_PER_CLOCK => PIXELS_PER_CLOCK,
      PARALLEL_ROWS    => PARALLEL_ROWS,
      DATA_BITS        => IN_BITS,
      ROW_FLUSH        => ROW_DELAY + PARALLEL_ROWS - 1 + choose(PARALLEL_ROWS > 1, TOKENS_UNDER_WAY, 0),
      COLUMN_FLUSH     => divide_up(COLUMN_DELAY, PARALLEL_ROWS),
      MIN_STEPS        => MIN_STEPS,
      MIN_BANDS        => MIN_BANDS,
      BAND_MODULUS     => BAND_MODULUS,
      KEEP_MODULUS     => KEEP_MODULUS
    )
    port map (
      clk           => clk,
      reset         => reset,
      columns       => order.columns,
      rows          => order.rows,
      slice         => frame_slice,
      frame_start   => frame_start,
      s_axis_tvalid => stream_valid,
      s_axis_tready => stream_ready,
      s_axis_tdata  => stream_word(IN_BITS - 1 downto 0),
      s_axis_tuser  => stream_word(IN_BITS + 1),
      s_axis_tlast  => stream_word(IN_BITS),
      credit        => credit,
      drained       => drained,
      token         => line_token,
      token_row     => line_row,
      token_data    => line_data,
      error_flags   => error_flags,
      error_clear   => error_clear
    );

  one_pixel : if PIXELS_PER_CLOCK = 1 generate
    line_end <= "1";
  end generate one_pixel;

  several_pixels : if PIXELS_PER_CLOCK > 1 generate

    -- Number of the line's last pixel within its token.
    signal place : natural range 0 to larger(PIXELS_PER_CLOCK - 1, 1);

  begin

    -- Computed a clock ahead: the engine reads the value with the last token of a line, many clocks later.
    place <= to_integer(unsigned(order.columns) - 1) mod PIXELS_PER_CLOCK;

    find_end : process (clk) is
    begin

      if rising_edge(clk) then
        -- Taken with the frame's first pixel, when the sequencer reads the size: a size written later
        -- belongs to the next frame.
        if frame_start = '1' then

          for j in 0 to PIXELS_PER_CLOCK - 1 loop

            if j <= place then
              line_end(j) <= '1';
            else
              line_end(j) <= '0';
            end if;

          end loop;

        end if;
      end if;

    end process find_end;

  end generate several_pixels;

  gather : entity work.row_gather
    generic map (
      PARALLEL_ROWS => PARALLEL_ROWS,
      MAX_COLUMNS   => MAX_COLUMNS,
      DATA_BITS     => IN_BITS
    )
    port map (
      clk         => clk,
      reset       => reset,
      token       => line_token,
      token_row   => line_row,
      token_data  => line_data,
      array_token => token,
      array_image => token_rows,
      array_data  => token_data
    );

  scatter : entity work.row_scatter
    generic map (
      PARALLEL_ROWS => PARALLEL_ROWS,
      MAX_COLUMNS   => MAX_COLUMNS,
      DATA_BITS     => OUT_BITS,
      SLICE_BITS    => SLICE_BITS,
      UNDER_WAY     => TOKENS_UNDER_WAY
    )
    port map (
      clk           => clk,
      reset         => reset,
      results       => results,
      data          => result_data,
      m_axis_tvalid => m_axis_marks.tvalid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tuser  => m_axis_marks.tuser(0),
      m_axis_tid    => m_axis_tid,
      m_axis_tlast  => m_axis_marks.tlast,
      credit        => credit,
      drained       => drained
    );

  -- row_scatter's credit relies on ENGINE_LATENCY, so simulation checks it.
  watch_latency : process (clk) is

    -- MOST: clocks in which a result may follow the last token (the gather takes two of its own); idle: clocks
    -- since that token.
    constant MOST : positive := TOKENS_UNDER_WAY - 2;
    variable idle : natural  := MOST;

  begin

    -- synthesis translate_off
    if rising_edge(clk) then

      for r in results'range loop

        assert not (results(r).valid = '1' and idle = MOST)
          report stream_shell'path_name & " a result came later than ENGINE_LATENCY tells"
          severity failure;

      end loop;

      if line_token.strobe = '1' then
        idle := 0;
      elsif idle < MOST then
        idle := idle + 1;
      end if;
    end if;

  -- synthesis translate_on

  end process watch_latency;

end architecture rtl;
