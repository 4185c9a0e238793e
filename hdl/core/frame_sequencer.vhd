-- SPDX-License-Identifier: Apache-2.0
-- Turns an AXI4-Stream of video into the tokens that an engine works on: lines of exactly `columns` pixels, frames that
-- begin with a start of frame, and the empty tokens that drain the filters when no input follows.
--
-- A band is the PARALLEL_ROWS lines that the filters take at once. The last line of a band or of a frame completes it;
-- row_gather stores the lines before. With PARALLEL_ROWS = 1 every line is a band.
--
-- A pixel token carries a pixel of the image. An empty token (strobe without pixel) between two lines pushes the last
-- pixels of a line out of the row filters. A flush line is a line of zeros behind a frame and a band by itself; it
-- pushes the last lines out of the column filters and gives no image line. Lines and frames that follow each other
-- without a gap need neither.
--
-- Faults of the stream raise error flags, and the tokens stay well formed. A line that ends early is filled up with
-- zeros. The excess of a long line is dropped. A frame that starts early ends the one before it at a whole line. Pixels
-- between frames are dropped and do not hold back the frame before. A mark of start that lasts several pixels of a
-- line, as behind a width converter, is one start.
--
-- Latency: 1 clock. Throughput: one token each clock while credit = '1'.
-- Equation: the n-th pixel token of line l is pixel n of line l of the frame.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.count_pkg.all;
use work.math_pkg.all;
use work.token_pkg.all;

entity frame_sequencer is
  generic (
    -- Longest line in pixels.
    MAX_COLUMNS : positive;
    -- Neighbouring pixels of a line in one token, a power of two; a line's last token may have fewer. Below,
    -- "pixel" means all pixels of a token.
    PIXELS_PER_CLOCK : positive := 1;
    -- Lines that the filters take at once.
    PARALLEL_ROWS : positive := 1;
    -- Width of the pixels of a token.
    DATA_BITS : positive;
    -- Empty tokens that push a line out of the row filters; with parallel rows, out of the whole array.
    ROW_FLUSH : natural := 0;
    -- Bands behind the last line that push everything out of the column filters.
    COLUMN_FLUSH : natural := 0;
    -- The shortest band in tokens, a multiple of PARALLEL_ROWS.
    MIN_STEPS : positive := 1;
    -- The least number of bands from the beginning of one frame to that of the next. The frame's own number of
    -- bands is rounded up to a multiple of BAND_MODULUS. Flush lines make up for missing bands.
    MIN_BANDS    : positive := 1;
    BAND_MODULUS : positive := 1;
    -- true: flush lines count too, so that frames always begin a multiple of BAND_MODULUS bands apart.
    KEEP_MODULUS : boolean := false
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Size of the frame, read with its first pixel. The size must not change until the frame has left the core.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- Slice of the frame, read in the clock of frame_start.
    slice       : in    slice_t := (others => '0');
    frame_start : out   std_logic;
    -- The stream of pixels in.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(DATA_BITS - 1 downto 0);
    s_axis_tuser  : in    std_logic;
    s_axis_tlast  : in    std_logic;
    -- The output has room for the results of one more token.
    credit : in    std_logic;
    -- The results of earlier lines have left (with parallel rows: have reached the output), so that a flush line
    -- does not add to them.
    drained : in    std_logic := '1';
    -- Tokens with their pixels, and the number of the token's line within its band.
    token      : out   token_t;
    token_row  : out   natural range 0 to larger(PARALLEL_ROWS - 1, 1);
    token_data : out   std_logic_vector(DATA_BITS - 1 downto 0);
    -- Bits 0 line ended early, 1 line ended late, 2 frame started early, 3 pixels without a start of frame, 4
    -- frame size that the core does not support. Bits stay set until error_clear.
    error_flags : out   std_logic_vector(4 downto 0);
    error_clear : in    std_logic
  );
end entity frame_sequencer;

architecture rtl of frame_sequencer is

  -- accept: pixels of the stream; fill: zeros up to the end of a line that was cut short; flush: a flush line.
  type state_t is (accept, fill, flush);

  -- The kind of token that is sent at this clock.
  type send_t is (nothing, empty, stream_pixel, zero_pixel, flush_pixel);

  constant LAST_BAND_ROW : natural := PARALLEL_ROWS - 1;
  -- Bits that number the pixels within a token.
  constant PLACE_BITS : natural := choose(PIXELS_PER_CLOCK = 1, 0, bits_for(PIXELS_PER_CLOCK - 1));
  -- Wide enough for a column index and for MIN_STEPS.
  constant COLUMN_BITS : positive := bits_for(larger(MAX_COLUMNS - 1, MIN_STEPS));

  -- The decision of this clock, and what it says about the token that is sent.
  signal send         : send_t;
  signal take         : std_logic;
  signal starts_frame : std_logic;
  -- sends_pixel: the token has a pixel (of the stream, of a filled-up line, or of a flush line). sends_image: a
  -- pixel of the stream or of a filled-up line. takes_pixel: a pixel of the stream.
  signal sends_pixel  : std_logic;
  signal sends_image  : std_logic;
  signal takes_pixel  : std_logic;
  signal line_ends    : std_logic;
  signal image_ends   : std_logic;
  signal band_ends    : std_logic;
  signal frame_ends   : std_logic;
  signal frame_broken : std_logic;

  signal state : state_t := accept;

  -- A frame is under way; its mark of start lasts. The pixel on offer starts a frame, is in excess, or in no frame.
  signal frame_open  : std_logic := '0';
  signal start_lasts : std_logic := '0';
  signal new_start   : std_logic;
  signal excess      : std_logic;
  signal stray       : std_logic;

  -- Size of the frame: new_ at the ports, line_end and row_end for this clock, last_ as stored. at_last_row: the
  -- line is the frame's last one. slice_now, slice_held: the frame's slice for this clock, and as stored.
  signal size_supported  : std_logic;
  signal new_last_column : unsigned(COLUMN_BITS - 1 downto 0);
  signal new_last_row    : unsigned(15 downto 0);
  signal line_end        : unsigned(COLUMN_BITS - 1 downto 0);
  signal row_end         : unsigned(15 downto 0);
  signal last_column     : unsigned(COLUMN_BITS - 1 downto 0) := (others => '0');
  signal last_row        : unsigned(15 downto 0)              := (others => '0');
  signal at_last_row     : std_logic                          := '0';
  signal slice_now       : slice_t;
  signal slice_held      : slice_t                            := (others => '0');

  -- Place in the frame. at_first: column = 0; at_last: column = last_column; band_row: line within its band.
  signal column       : unsigned(COLUMN_BITS - 1 downto 0)              := (others => '0');
  signal at_first     : std_logic                                       := '1';
  signal at_last      : std_logic                                       := '0';
  signal column_count : natural range 0 to larger(PARALLEL_ROWS - 1, 1);
  signal column_held  : natural range 0 to larger(PARALLEL_ROWS - 1, 1) := 0;
  signal row          : unsigned(15 downto 0)                           := (others => '0');
  signal band_row     : natural range 0 to PARALLEL_ROWS                := 0;
  signal first_band   : std_logic                                       := '0';

  -- The current line, the first line of a new frame, or the token of this clock completes a band.
  signal completes_band  : std_logic;
  signal completes_first : std_logic;
  signal band_token      : std_logic;

  -- Inputs and outputs of sequencer_waits, which explains them.
  signal any_step      : std_logic;
  signal empty_step    : std_logic;
  signal starts_flush  : std_logic;
  signal steps_missing : natural range 0 to MIN_STEPS;
  signal lacks_steps   : std_logic;
  signal tokens_due    : std_logic;
  signal bands_due     : std_logic;
  signal steps_due     : std_logic;
  signal band_wait     : std_logic;
  signal frame_wait    : std_logic;

begin

  --------------------------------------------------------------------------------------------------
  -- The pixel on offer, and the reasons to wait.

  -- PIXELS_PER_CLOCK is a power of two, so a shift gives the last token of a line: no division.
  new_last_column <= resize(shift_right(unsigned(columns) - 1, PLACE_BITS), COLUMN_BITS);
  new_last_row    <= unsigned(rows) - 1;
  size_supported  <= '1' when unsigned(columns) /= 0 and unsigned(columns) <= MAX_COLUMNS and unsigned(rows) /= 0 else
                     '0';

  completes_band <= '1' when LAST_BAND_ROW = 0 or band_row = LAST_BAND_ROW or at_last_row = '1' else
                    '0';
  -- A frame of one line is a band by itself, whatever PARALLEL_ROWS is.
  completes_first <= '1' when LAST_BAND_ROW = 0 or new_last_row = 0 else
                     '0';

  -- The next band may not begin yet.
  band_wait <= '1' when at_first = '1' and steps_due = '1' else
               '0';

  new_start <= s_axis_tuser and not start_lasts;
  stray     <= '1' when (new_start = '0' and (frame_open = '0' or excess = '1')) or
                        (new_start = '1' and frame_open = '0' and size_supported = '0') else
               '0';

  -- The decision: `take` takes the pixel on offer, `send` says which token is sent. A stray pixel is dropped without
  -- delaying a flush.
  decide : process (state, frame_open, at_first, s_axis_tvalid, new_start, stray, credit, drained, bands_due,
                    tokens_due, steps_due, band_row, band_wait, frame_wait, completes_band, completes_first) is
  begin

    send         <= nothing;
    take         <= '0';
    starts_frame <= '0';

    if credit = '1' then
      take <= s_axis_tvalid and stray;

      case state is

        when fill =>

          send <= zero_pixel;

        when flush =>

          send <= flush_pixel;

        when accept =>

          if frame_open = '0' and band_row /= 0 then
            -- Lines that are left of a frame cut short wait until the next band may begin.
            if band_wait = '1' then
              send <= empty;
            else
              send <= flush_pixel;
            end if;
          elsif s_axis_tvalid = '0' or stray = '1' then
            -- The stream pauses. Within a line nothing need move; between lines and frames the filters are emptied.
            if at_first = '1' then
              if frame_open = '0' and (bands_due = '1' or frame_wait = '1') and band_wait = '0' and drained = '1' and
                 (PARALLEL_ROWS = 1 or tokens_due = '0') then
                send <= flush_pixel;
              elsif tokens_due = '1' or steps_due = '1' then
                send <= empty;
              end if;
            end if;
          elsif frame_open = '1' then
            -- A start of frame inside a frame waits until the frame cut short has ended.
            if new_start = '0' then
              if band_wait = '1' and completes_band = '1' then
                send <= empty;
              else
                take <= '1';
                send <= stream_pixel;
              end if;
            end if;
          -- A new frame is on offer. It waits until the frame before has all the bands and tokens that it must have.
          elsif band_wait = '1' and (completes_first = '1' or frame_wait = '1') then
            send <= empty;
          elsif frame_wait = '1' then
            send <= flush_pixel;
          else
            take         <= '1';
            send         <= stream_pixel;
            starts_frame <= '1';
          end if;

      end case;

    end if;

  end process decide;

  s_axis_tready <= take;
  frame_start   <= starts_frame;

  --------------------------------------------------------------------------------------------------
  -- What follows from the decision.

  -- The decision has few bits. All that follows uses `send` alone, so that the logic stays shallow.
  any_step    <= '0' when send = nothing else
                 '1';
  empty_step  <= '1' when send = empty else
                 '0';
  takes_pixel <= '1' when send = stream_pixel else
                 '0';
  sends_image <= '1' when send = stream_pixel or send = zero_pixel else
                 '0';
  sends_pixel <= '1' when send = flush_pixel or sends_image = '1' else
                 '0';

  -- The first pixel of a frame takes its size from the ports, the others from the registers.
  line_end  <= new_last_column when starts_frame = '1' else
               last_column;
  row_end   <= new_last_row when starts_frame = '1' else
               last_row;
  slice_now <= slice when starts_frame = '1' else
               slice_held;

  line_ends  <= '1' when (starts_frame = '1' and new_last_column = 0) or
                         (starts_frame = '0' and at_last = '1') else
                '0';
  image_ends <= sends_image and line_ends;

  band_token <= '1' when send = flush_pixel else
                completes_first when starts_frame = '1' else
                completes_band;
  band_ends  <= sends_pixel and line_ends and band_token;

  -- A frame ends with its last line; a frame that was cut short ends with its filled-up line.
  frame_ends <= '1' when (starts_frame = '1' and new_last_row = 0) or
                         (starts_frame = '0' and (at_last_row = '1' or frame_open = '0')) else
                '0';

  -- A start of frame inside a frame. Nothing is sent in this clock: the broken frame ends first.
  frame_broken <= credit and s_axis_tvalid and new_start and frame_open when state = accept else
                  '0';

  --------------------------------------------------------------------------------------------------
  -- Place in the frame.

  follow_line : process (clk) is
  begin

    if rising_edge(clk) then
      -- The register is written in every clock, so it needs no enable; line_end holds the old value except
      -- with starts_frame.
      last_column <= line_end;
      if sends_pixel = '1' then
        column_held <= column_count;
        if line_ends = '1' then
          column   <= (others => '0');
          at_first <= '1';
          at_last  <= to_logic(line_end = 0);
        else
          column   <= column + 1;
          at_first <= '0';
          at_last  <= to_logic(column + 1 = line_end);
        end if;
      end if;
      if reset = '1' then
        column   <= (others => '0');
        at_first <= '1';
        at_last  <= '0';
      end if;
    end if;

  end process follow_line;

  follow_state : process (clk) is
  begin

    if rising_edge(clk) then
      -- The end of a line is handled first, as a line of one pixel ends with the token that begins it.
      if sends_pixel = '1' and line_ends = '1' then
        state <= accept;
      elsif send = flush_pixel then
        state <= flush;
      elsif (takes_pixel = '1' and s_axis_tlast = '1') or (frame_broken = '1' and at_first = '0') then
        state <= fill;
      end if;
      if reset = '1' then
        state <= accept;
      end if;
    end if;

  end process follow_state;

  follow_frame : process (clk) is
  begin

    if rising_edge(clk) then
      last_row   <= row_end;
      slice_held <= slice_now;
      if starts_frame = '1' then
        frame_open  <= '1';
        at_last_row <= to_logic(new_last_row = 0);
      end if;
      if image_ends = '1' then
        if frame_ends = '1' then
          frame_open <= '0';
          row        <= (others => '0');
        else
          row         <= row + 1;
          at_last_row <= to_logic(row + 1 = row_end);
        end if;
      end if;
      -- Tokens of the broken frame are already under way, so its line and its band are filled up before the
      -- new frame begins.
      if frame_broken = '1' then
        frame_open <= '0';
        if at_first = '1' then
          row <= (others => '0');
        end if;
      end if;
      if takes_pixel = '1' then
        start_lasts <= s_axis_tuser and not s_axis_tlast and not line_ends;
      end if;
      if reset = '1' then
        frame_open  <= '0';
        start_lasts <= '0';
        row         <= (others => '0');
      end if;
    end if;

  end process follow_frame;

  follow_band : process (clk) is
  begin

    if rising_edge(clk) then
      if starts_frame = '1' then
        first_band <= '1';
      end if;
      if band_ends = '1' then
        band_row   <= 0;
        first_band <= '0';
      elsif sends_pixel = '1' and line_ends = '1' then
        band_row <= band_row + 1;
      end if;
      if reset = '1' then
        band_row   <= 0;
        first_band <= '0';
      end if;
    end if;

  end process follow_band;

  -- The column modulo PARALLEL_ROWS.
  column_count <= place_in_turn(column_held, at_first, PARALLEL_ROWS);

  --------------------------------------------------------------------------------------------------
  -- What remains to be flushed or waited for.

  -- A flush line counts with its first pixel.
  starts_flush <= '1' when send = flush_pixel and at_first = '1' and band_row = 0 else
                  '0';

  -- Tokens that a short line lacks to MIN_STEPS, or to a multiple of PARALLEL_ROWS.
  steps_missing <= MIN_STEPS - 1 - to_integer(column(bits_for(MIN_STEPS) - 1 downto 0)) when column < MIN_STEPS - 1 else
                   LAST_BAND_ROW - column_count;
  lacks_steps   <= '1' when column < MIN_STEPS - 1 or column_count /= LAST_BAND_ROW else
                   '0';

  waits : entity work.sequencer_waits
    generic map (
      ROW_FLUSH    => ROW_FLUSH,
      COLUMN_FLUSH => COLUMN_FLUSH,
      MIN_STEPS    => MIN_STEPS,
      MIN_BANDS    => MIN_BANDS,
      BAND_MODULUS => BAND_MODULUS,
      KEEP_MODULUS => KEEP_MODULUS
    )
    port map (
      clk           => clk,
      reset         => reset,
      any_step      => any_step,
      empty_step    => empty_step,
      sends_pixel   => sends_pixel,
      sends_image   => sends_image,
      starts_frame  => starts_frame,
      starts_flush  => starts_flush,
      band_ends     => band_ends,
      first_band    => first_band,
      steps_missing => steps_missing,
      lacks_steps   => lacks_steps,
      tokens_due    => tokens_due,
      bands_due     => bands_due,
      steps_due     => steps_due,
      frame_wait    => frame_wait
    );

  faults : entity work.stream_faults
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => s_axis_tvalid,
      new_start     => new_start,
      s_axis_tlast  => s_axis_tlast,
      credit        => credit,
      take          => take,
      takes_pixel   => takes_pixel,
      starts_frame  => starts_frame,
      line_ends     => line_ends,
      frame_broken  => frame_broken,
      excess        => excess,
      error_flags   => error_flags,
      error_clear   => error_clear
    );

  --------------------------------------------------------------------------------------------------
  -- The token.

  give : process (clk) is
  begin

    if rising_edge(clk) then
      -- Only strobe has a reset, because the other fields are valid only while strobe = '1'.
      token.strobe      <= any_step and not reset;
      token.pixel       <= sends_pixel;
      token.line_first  <= sends_pixel and at_first;
      token.line_last   <= sends_pixel and line_ends;
      token.band        <= sends_pixel and band_token;
      token.frame_first <= sends_pixel and (starts_frame or first_band);
      token.image       <= sends_image;
      token.slice       <= slice_now;
      token_row         <= band_row;
      token_data        <= (others => '0');
      if takes_pixel = '1' then
        token_data <= s_axis_tdata;
      end if;
    end if;

  end process give;

end architecture rtl;
