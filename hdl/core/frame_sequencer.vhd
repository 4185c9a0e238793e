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
-- zeros. The excess of a long line is dropped. A frame that starts early cuts the one before it short at a whole
-- line. Pixels between frames are dropped, and hold back nothing of the frame before.
--
-- Latency: 1 clock. Throughput: one token each clock while credit = '1'.
-- Equation: the n-th pixel token of line l is pixel n of line l of the frame.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.token_pkg.all;

entity frame_sequencer is
  generic (
    -- Longest line in pixels.
    MAX_COLUMNS : positive;
    -- Neighbouring pixels of a line that come together, a power of two; a line's last ones may be fewer. What is
    -- said of a pixel below holds for all of them.
    PIXELS_PER_CLOCK : positive := 1;
    -- Lines that the filters take at once.
    PARALLEL_ROWS : positive;
    -- Width of a pixel, or of those that come together.
    DATA_BITS : positive;
    -- Tokens behind the last pixel that push everything out of the row filters, with parallel rows out of the array.
    ROW_FLUSH : natural;
    -- Bands behind the last line that push everything out of the column filters.
    COLUMN_FLUSH : natural;
    -- The shortest band in tokens, a multiple of PARALLEL_ROWS.
    MIN_STEPS : positive;
    -- Bands from the beginning of a frame to that of the next one: as many at least, and as the frame has,
    -- rounded up to a multiple of BAND_MODULUS. Flush lines make up for what is missing.
    MIN_BANDS    : positive;
    BAND_MODULUS : positive;
    -- Whether flush lines count, too, so that frames always begin a multiple of BAND_MODULUS bands apart.
    KEEP_MODULUS : boolean := false
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Size of the frame, read with its first pixel and kept stable until the frame has left the core.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- Slice of the frame, read in the clock of frame_start.
    slice       : in    slice_t;
    frame_start : out   std_logic;
    -- The stream.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(DATA_BITS - 1 downto 0);
    s_axis_tuser  : in    std_logic;
    s_axis_tlast  : in    std_logic;
    -- The output can take what one more token yields.
    credit : in    std_logic;
    -- The lines before have left, so that a flush line does not pile its lines upon them. With parallel rows it
    -- waits until they have reached the output.
    drained : in    std_logic;
    -- Tokens with their pixel and the place of its line in its band.
    token      : out   token_t;
    token_row  : out   natural range 0 to larger(PARALLEL_ROWS - 1, 1);
    token_data : out   std_logic_vector(DATA_BITS - 1 downto 0);
    -- 0 line ended early, 1 line ended late, 2 frame started early, 3 pixels without a start of frame, 4 frame size
    -- that the core does not support. They stay set until error_clear.
    error_flags : out   std_logic_vector(4 downto 0);
    error_clear : in    std_logic
  );
end entity frame_sequencer;

architecture rtl of frame_sequencer is

  -- accept: pixels of the stream; fill: zeros up to the end of a broken line; flush: a flush line.
  type state_t is (accept, fill, flush);

  -- What this clock sends to the stages.
  type send_t is (nothing, empty, stream_pixel, zero_pixel, flush_pixel);

  constant LINE_EARLY  : natural := 0;
  constant LINE_LATE   : natural := 1;
  constant FRAME_EARLY : natural := 2;
  constant FRAME_LATE  : natural := 3;
  constant FRAME_SIZE  : natural := 4;

  constant LAST_BAND_ROW : natural := PARALLEL_ROWS - 1;
  -- Of a column, and of MIN_STEPS to compare it with.
  constant COLUMN_BITS : positive := bits_for(larger(MAX_COLUMNS - 1, MIN_STEPS));

  signal state        : state_t   := accept;
  signal send         : send_t;
  signal take         : std_logic;
  signal synchronised : std_logic := '0';
  signal frame_open   : std_logic := '0';
  -- Within the excess of a long line; what is on offer belongs to no frame.
  signal excess : std_logic                          := '0';
  signal stray  : std_logic;
  signal column : unsigned(COLUMN_BITS - 1 downto 0) := (others => '0');
  -- column = 0, column = last_column.
  signal at_first        : std_logic                                  := '1';
  signal at_last         : std_logic                                  := '0';
  signal column_count    : natural range 0 to larger(PARALLEL_ROWS - 1, 1);
  signal column_step     : std_logic;
  signal column_restart  : std_logic;
  signal row             : unsigned(15 downto 0)                      := (others => '0');
  signal last_column     : unsigned(COLUMN_BITS - 1 downto 0)         := (others => '0');
  signal last_row        : unsigned(15 downto 0)                      := (others => '0');
  signal new_last_column : unsigned(COLUMN_BITS - 1 downto 0);
  signal new_last_row    : unsigned(15 downto 0);
  signal size_supported  : std_logic;
  signal starts_frame    : std_logic;
  signal line_ends       : std_logic;
  signal band_row        : natural range 0 to PARALLEL_ROWS           := 0;
  signal completes_band  : std_logic;
  signal completes_first : std_logic;
  signal first_band      : std_logic                                  := '0';
  signal band_wait       : std_logic;
  signal slice_held      : slice_t                                    := (others => '0');
  signal tokens_to_flush : natural range 0 to larger(ROW_FLUSH, 1)    := 0;
  signal bands_to_flush  : natural range 0 to larger(COLUMN_FLUSH, 1) := 0;
  signal steps_missing   : natural range 0 to MIN_STEPS               := 0;
  -- Bands that have to come before the next frame, and those of the frame modulo BAND_MODULUS.
  signal bands_missing : natural range 0 to MIN_BANDS    := 0;
  signal band_phase    : natural range 0 to BAND_MODULUS := 0;
  -- Whether these numbers are above 0, and row = last_row: decisions take no time for comparisons.
  signal tokens_due  : std_logic := '0';
  signal bands_due   : std_logic := '0';
  signal steps_due   : std_logic := '0';
  signal frame_short : std_logic := '0';
  signal frame_odd   : std_logic := '0';
  signal at_last_row : std_logic := '0';
  signal frame_wait  : std_logic;

begin

  new_last_row   <= unsigned(rows) - 1;
  size_supported <= '1' when unsigned(columns) /= 0 and unsigned(columns) <= MAX_COLUMNS and unsigned(rows) /= 0 else
                    '0';

  one_pixel : if PIXELS_PER_CLOCK = 1 generate
    new_last_column <= resize(unsigned(columns) - 1, COLUMN_BITS);
  end generate one_pixel;

  several_pixels : if PIXELS_PER_CLOCK > 1 generate
    new_last_column <= resize(shift_right(unsigned(columns) - 1, bits_for(PIXELS_PER_CLOCK - 1)), COLUMN_BITS);
  end generate several_pixels;

  -- Whether the line on hand, or the first line of a new frame, completes a band.
  completes_band  <= '1' when LAST_BAND_ROW = 0 or band_row = LAST_BAND_ROW or at_last_row = '1' else
                     '0';
  completes_first <= '1' when LAST_BAND_ROW = 0 or new_last_row = 0 else
                     '0';

  -- No band may begin yet.
  band_wait <= '1' when at_first = '1' and steps_due = '1' else
               '0';

  -- No frame may begin yet.
  frame_wait <= frame_short or frame_odd;

  stray <= '1' when (s_axis_tuser = '0' and (frame_open = '0' or excess = '1')) or
                    (s_axis_tuser = '1' and frame_open = '0' and size_supported = '0') else
           '0';

  -- What to do with this clock; `take` takes the pixel on offer, `send` says what becomes of it. A stray pixel is
  -- dropped, and what has to be flushed is flushed as if there were none.
  decide : process (state, frame_open, at_first, s_axis_tvalid, s_axis_tuser, stray, credit, drained, bands_due,
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
            -- Lines of a frame that was cut short wait for the rest of their band.
            if band_wait = '1' then
              send <= empty;
            else
              send <= flush_pixel;
            end if;
          elsif s_axis_tvalid = '0' or stray = '1' then
            if at_first = '1' then
              if frame_open = '0' and (bands_due = '1' or frame_wait = '1') and band_wait = '0' and drained = '1' and
                 (PARALLEL_ROWS = 1 or tokens_due = '0') then
                send <= flush_pixel;
              elsif tokens_due = '1' or steps_due = '1' then
                send <= empty;
              end if;
            end if;
          elsif frame_open = '1' then
            -- A start of frame inside a frame waits for the end of the broken one.
            if s_axis_tuser = '0' then
              if band_wait = '1' and completes_band = '1' then
                send <= empty;
              else
                take <= '1';
                send <= stream_pixel;
              end if;
            end if;
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

  line_ends <= '1' when (starts_frame = '1' and new_last_column = 0) or
                        (starts_frame = '0' and at_last = '1') else
               '0';

  -- The column modulo PARALLEL_ROWS.
  column_step    <= '0' when send = nothing or send = empty else
                    '1';
  column_restart <= at_first;

  count_columns : entity work.pixel_counter
    generic map (
      MODULUS => PARALLEL_ROWS
    )
    port map (
      clk     => clk,
      strobe  => column_step,
      restart => column_restart,
      count   => column_count
    );

  follow : process (clk) is

    variable image_token : boolean;
    variable frame_ends  : boolean;
    variable band_token  : std_logic;
    variable line_end    : unsigned(COLUMN_BITS - 1 downto 0);
    variable row_end     : unsigned(15 downto 0);
    variable slice_now   : slice_t;
    variable strobe      : std_logic;
    variable line_first  : std_logic;
    variable line_last   : std_logic;
    variable band        : std_logic;
    variable frame_first : std_logic;
    variable pixel       : std_logic;
    variable image       : std_logic;

  begin

    if rising_edge(clk) then
      image_token := send = stream_pixel or send = zero_pixel;

      if error_clear = '1' then
        error_flags <= (others => '0');
      end if;

      -- Position, and what remains to be flushed.
      if starts_frame = '1' then
        last_column   <= new_last_column;
        last_row      <= new_last_row;
        frame_open    <= '1';
        first_band    <= '1';
        synchronised  <= '1';
        bands_missing <= MIN_BANDS - 1;
        frame_short   <= to_logic(MIN_BANDS > 1);
        at_last_row   <= to_logic(new_last_row = 0);
        line_end      := new_last_column;
        row_end       := new_last_row;
        frame_ends    := new_last_row = 0;
        band_token    := completes_first;
        slice_now     := slice;
      else
        line_end   := last_column;
        row_end    := last_row;
        frame_ends := at_last_row = '1';
        band_token := completes_band;
        slice_now  := slice_held;
      end if;
      slice_held <= slice_now;

      if send = flush_pixel then
        band_token := '1';
      end if;

      if send /= nothing and steps_due = '1' then
        steps_missing <= steps_missing - 1;
        steps_due     <= to_logic(steps_missing > 1);
      end if;

      if send = empty then
        if tokens_due = '1' then
          tokens_to_flush <= tokens_to_flush - 1;
          tokens_due      <= to_logic(tokens_to_flush > 1);
        end if;
      elsif send /= nothing then
        tokens_to_flush <= ROW_FLUSH;
        tokens_due      <= to_logic(ROW_FLUSH > 0);
        if image_token then
          bands_to_flush <= COLUMN_FLUSH;
          bands_due      <= to_logic(COLUMN_FLUSH > 0);
        elsif at_first = '1' and band_row = 0 and bands_due = '1' then
          bands_to_flush <= bands_to_flush - 1;
          bands_due      <= to_logic(bands_to_flush > 1);
        end if;

        if line_ends = '1' then
          column   <= (others => '0');
          at_first <= '1';
          state    <= accept;
          if line_end = 0 then
            at_last <= '1';
          else
            at_last <= '0';
          end if;
          if band_token = '1' then
            if BAND_MODULUS > 1 and (image_token or frame_odd = '1' or KEEP_MODULUS) then
              if band_phase = BAND_MODULUS - 1 then
                band_phase <= 0;
                frame_odd  <= '0';
              else
                band_phase <= band_phase + 1;
                frame_odd  <= '1';
              end if;
            end if;
            if starts_frame = '0' and first_band = '0' and frame_short = '1' then
              bands_missing <= bands_missing - 1;
              frame_short   <= to_logic(bands_missing > 1);
            end if;
            band_row   <= 0;
            first_band <= '0';
            if column < MIN_STEPS - 1 then
              steps_missing <= MIN_STEPS - 1 - to_integer(column(bits_for(MIN_STEPS) - 1 downto 0));
              steps_due     <= '1';
            else
              steps_missing <= LAST_BAND_ROW - column_count;
              steps_due     <= to_logic(column_count /= LAST_BAND_ROW);
            end if;
          else
            band_row <= band_row + 1;
          end if;
          if image_token then
            -- The filled-up line of a frame that was cut short is its last one.
            if frame_ends or (frame_open = '0' and starts_frame = '0') then
              frame_open <= '0';
              row        <= (others => '0');
            else
              row         <= row + 1;
              at_last_row <= to_logic(row + 1 = row_end);
            end if;
          end if;
        else
          column   <= column + 1;
          at_first <= '0';
          if column + 1 = line_end then
            at_last <= '1';
          else
            at_last <= '0';
          end if;
          if send = flush_pixel then
            state <= flush;
          end if;
        end if;
      end if;

      -- Faults of the stream.
      if send = stream_pixel then
        excess <= '0';
        if s_axis_tlast = '1' and line_ends = '0' then
          state                   <= fill;
          error_flags(LINE_EARLY) <= '1';
        elsif s_axis_tlast = '0' and line_ends = '1' then
          excess                 <= '1';
          error_flags(LINE_LATE) <= '1';
        end if;
      elsif credit = '1' and s_axis_tvalid = '1' then
        if s_axis_tuser = '1' or s_axis_tlast = '1' then
          excess <= '0';
        end if;
        if state = accept and frame_open = '1' and s_axis_tuser = '1' then
          error_flags(FRAME_EARLY) <= '1';
          frame_open               <= '0';
          if at_first = '1' then
            row <= (others => '0');
          else
            state <= fill;
          end if;
        elsif take = '1' then
          if s_axis_tuser = '1' then
            error_flags(FRAME_SIZE) <= '1';
          elsif synchronised = '1' and excess = '0' then
            error_flags(FRAME_LATE) <= '1';
          end if;
        end if;
      end if;

      -- The token.
      strobe      := '0';
      pixel       := '0';
      line_first  := '0';
      line_last   := '0';
      band        := '0';
      frame_first := '0';
      image       := '0';
      token_row   <= band_row;
      token_data  <= (others => '0');

      if send /= nothing then
        strobe := '1';
      end if;
      if send /= nothing and send /= empty then
        pixel       := '1';
        line_first  := at_first;
        line_last   := line_ends;
        band        := band_token;
        frame_first := starts_frame or first_band;
        if image_token then
          image := '1';
        end if;
      end if;
      if send = stream_pixel then
        token_data <= s_axis_tdata;
      end if;

      if reset = '1' then
        strobe := '0';
      end if;

      token.strobe      <= strobe;
      token.pixel       <= pixel;
      token.line_first  <= line_first;
      token.line_last   <= line_last;
      token.band        <= band;
      token.frame_first <= frame_first;
      token.image       <= image;
      token.slice       <= slice_now;

      if reset = '1' then
        state           <= accept;
        synchronised    <= '0';
        frame_open      <= '0';
        excess          <= '0';
        first_band      <= '0';
        column          <= (others => '0');
        at_first        <= '1';
        at_last         <= '0';
        row             <= (others => '0');
        band_row        <= 0;
        tokens_to_flush <= 0;
        bands_to_flush  <= 0;
        bands_missing   <= 0;
        band_phase      <= 0;
        steps_missing   <= 0;
        tokens_due      <= '0';
        bands_due       <= '0';
        steps_due       <= '0';
        frame_short     <= '0';
        frame_odd       <= '0';
        error_flags     <= (others => '0');
      end if;
    end if;

  end process follow;

end architecture rtl;
