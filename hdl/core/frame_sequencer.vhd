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
    -- Size of the frame, read with its first pixel and set at the latest a clock before that pixel is on offer. The
    -- size must not change until the frame has left the core.
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
    -- Faults of the stream by the bits of fault_pkg; they stay set until error_clear.
    error_flags : out   std_logic_vector(4 downto 0);
    error_clear : in    std_logic
  );
end entity frame_sequencer;

architecture rtl of frame_sequencer is

  constant LAST_BAND_ROW : natural := PARALLEL_ROWS - 1;
  -- Bits that number the pixels within a token.
  constant PLACE_BITS  : natural  := choose(PIXELS_PER_CLOCK = 1, 0, bits_for(PIXELS_PER_CLOCK - 1));
  constant COLUMN_BITS : positive := bits_for(MAX_COLUMNS - 1);

  -- accept: pixels of the stream; fill: zeros up to the end of a line that was cut short; flush: a flush line.
  type mode_t is (accept, fill, flush);

  -- The kind of token that is sent at this clock.
  type send_t is (nothing, empty, stream_pixel, zero_pixel, flush_pixel);

  -- A line's number within its band.
  subtype band_row_t is natural range 0 to larger(PARALLEL_ROWS - 1, 1);

  -- A frame's size and slice. rows_left: lines behind the current one.
  type frame_t is record
    last_column : unsigned(COLUMN_BITS - 1 downto 0);
    rows_left   : unsigned(15 downto 0);
    slice       : slice_t;
  end record frame_t;

  -- What has to be flushed or waited for. Each count is one less than what is left (counted_down): the decision is the
  -- longest path of the stream and leaves no time for comparisons.
  type waits_t is record
    -- Tokens and bands that push pixels out of the row filters, and lines out of the column filters.
    tokens : integer range -1 to larger(ROW_FLUSH - 1, 0);
    bands  : integer range -1 to larger(COLUMN_FLUSH - 1, 0);
    -- Tokens before the next band, and bands before the next frame may begin.
    steps : integer range -1 to larger(MIN_STEPS - 2, 0);
    frame : integer range -1 to larger(MIN_BANDS - 2, 0);
    -- Bands up to the next multiple of BAND_MODULUS.
    modulus : integer range -1 to larger(BAND_MODULUS - 2, 0);
  end record waits_t;

  -- at_first is '1' after a reset and stands first, because GHDL 2.0 synthesises a constant of 64, 96 ... bits as 0 if
  -- only its last 32 bits have a '1'.
  type state_t is record
    -- Place in the line. at_first: column = 0; at_last: column = frame.last_column.
    at_first : std_logic;
    at_last  : std_logic;
    column   : unsigned(COLUMN_BITS - 1 downto 0);
    mode     : mode_t;
    -- open_frame: a frame is under way; start_lasts: its mark of start lasts.
    open_frame  : std_logic;
    start_lasts : std_logic;
    frame       : frame_t;
    -- Place in the frame. at_last_row: the line is the frame's last one; band_row: line within its band; first_band:
    -- the band is the frame's first one.
    at_last_row : std_logic;
    band_row    : band_row_t;
    first_band  : std_logic;
    waits       : waits_t;
  end record state_t;

  constant AT_RESET : state_t :=
  (
    at_first    => '1',
    at_last     => '0',
    column      => (others => '0'),
    mode        => accept,
    open_frame  => '0',
    start_lasts => '0',
    -- Field by field, because NVC gives vectors of one aggregate of others the length of the first.
    frame       => (last_column => (others => '0'), rows_left => (others => '0'), slice => (others => '0')),
    at_last_row => '0',
    band_row    => 0,
    first_band  => '0',
    waits       => (others => -1)
  );

  -- The decision of a clock, and what it says about the token that is sent.
  type step_t is record
    send : send_t;
    -- take: the pixel on offer is taken; takes_pixel: the pixel is sent too; starts_frame: the pixel sent is its
    -- frame's first one; breaks_frame: the pixel on offer is a start of frame inside a frame.
    take         : std_logic;
    takes_pixel  : std_logic;
    starts_frame : std_logic;
    breaks_frame : std_logic;
    -- sends_pixel: the token has a pixel (of the stream, of a filled-up line, or of a flush line); sends_image: a
    -- pixel of the stream or of a filled-up line.
    sends_pixel : std_logic;
    sends_image : std_logic;
    -- ends_line, ends_band: the token is its line's, its band's last one. completes_band, ends_frame: the line is its
    -- band's, its frame's last one.
    ends_line      : std_logic;
    completes_band : std_logic;
    ends_band      : std_logic;
    ends_frame     : std_logic;
    frame          : frame_t;
  end record step_t;

  function waits_after (
    state : state_t;
    step  : step_t
  ) return waits_t is

    -- begins: the token begins a group of tokens that the band must complete; counts: the band counts for the multiple
    -- of BAND_MODULUS.
    variable begins : boolean;
    variable counts : boolean;
    variable waits  : waits_t;

  begin

    -- The first group of a band has MIN_STEPS tokens, the others PARALLEL_ROWS.
    begins := step.sends_pixel = '1' and step.completes_band = '1' and
              (state.at_first = '1' or (PARALLEL_ROWS > 1 and state.waits.steps < 0));

    -- Flush lines fill a frame up to a multiple and then stop counting: the next frame may come at any time.
    counts := BAND_MODULUS > 1 and step.ends_band = '1' and
              (KEEP_MODULUS or step.sends_image = '1' or state.waits.modulus >= 0);

    -- Every pixel, also a zero one, has to be pushed out of the row filters; only an empty token pushes.
    waits.tokens := counted_down(state.waits.tokens, step.sends_pixel = '1', ROW_FLUSH, step.send = empty);
    -- A flush line counts with its first pixel. Flush lines load nothing: they leave zeros in the column filters,
    -- which need not come out.
    waits.bands := counted_down(state.waits.bands, step.sends_image = '1', COLUMN_FLUSH,
                                step.send = flush_pixel and state.at_first = '1' and state.band_row = 0);
    -- A band that ends within a group waits for its rest.
    waits.steps := counted_down(state.waits.steps, begins, choose(state.at_first = '1', MIN_STEPS, PARALLEL_ROWS) - 1,
                                step.send /= nothing);
    -- This count starts with a frame's first pixel, because the first band may be the frame's only one.
    waits.frame := counted_down(state.waits.frame, step.starts_frame = '1', MIN_BANDS - 1,
                                step.ends_band = '1' and state.first_band = '0');
    -- BAND_MODULUS (it is M) need not be a power of two, so a counter gives the remainder.
    waits.modulus := counted_down(state.waits.modulus, counts and state.waits.modulus < 0, BAND_MODULUS - 1, counts);

    return waits;

  end function waits_after;

  signal state : state_t := AT_RESET;
  signal step  : step_t;

  -- The pixel on offer starts a frame, is in excess of its line, or has a place in no frame. offered: size and slice
  -- of the frame that the pixel may start.
  signal new_start      : std_logic;
  signal excess         : std_logic;
  signal stray          : std_logic;
  signal offered        : frame_t;
  signal size_supported : std_logic := '0';

  -- Parts of `state` for waveforms, because GHDL writes no records into them: the token's place, the frame's slice.
  signal column     : unsigned(COLUMN_BITS - 1 downto 0);
  signal rows_left  : unsigned(15 downto 0);
  signal slice_held : slice_t;

begin

  column     <= state.column;
  rows_left  <= state.frame.rows_left;
  slice_held <= state.frame.slice;

  -- PIXELS_PER_CLOCK is a power of two, so a shift gives the last token of a line: no division.
  offered.last_column <= resize(shift_right(unsigned(columns) - 1, PLACE_BITS), COLUMN_BITS);
  offered.rows_left   <= unsigned(rows) - 1;
  offered.slice       <= slice;

  new_start <= s_axis_tuser and not state.start_lasts;
  stray     <= '1' when (new_start = '0' and (state.open_frame = '0' or excess = '1')) or
                        (new_start = '1' and state.open_frame = '0' and size_supported = '0') else
               '0';

  -- All that follows the decision uses its few bits alone, and the branches give `take` and the marks of a frame beside
  -- `send`, so that the logic stays shallow. A stray pixel is dropped without delaying a flush.
  decide : process (state, columns, rows, offered, s_axis_tvalid, new_start, stray, credit, drained) is

    -- The next band, and the next frame, may not begin yet.
    variable band_waits  : boolean;
    variable frame_waits : boolean;
    -- The current line, and the first line of the frame on offer, completes a band.
    variable completes       : boolean;
    variable first_completes : boolean;
    variable now             : step_t;

  begin

    band_waits  := state.at_first = '1' and state.waits.steps >= 0;
    frame_waits := state.waits.frame >= 0 or state.waits.modulus >= 0;
    completes   := LAST_BAND_ROW = 0 or state.band_row = LAST_BAND_ROW or state.at_last_row = '1';
    -- A frame of one line is a band by itself, whatever PARALLEL_ROWS is.
    first_completes := LAST_BAND_ROW = 0 or unsigned(rows) = 1;

    now.send         := nothing;
    now.take         := '0';
    now.starts_frame := '0';
    now.breaks_frame := '0';

    if credit = '1' then
      now.take := s_axis_tvalid and stray;

      case state.mode is

        when fill =>

          now.send := zero_pixel;

        when flush =>

          now.send := flush_pixel;

        when accept =>

          if state.open_frame = '0' and state.band_row /= 0 then
            -- Lines that are left of a frame cut short wait until the next band may begin.
            now.send := flush_pixel;
            if band_waits then
              now.send := empty;
            end if;
          elsif s_axis_tvalid = '0' or stray = '1' then
            -- The stream pauses. Within a line nothing need move; between lines and frames the filters are emptied.
            if state.at_first = '1' then
              if state.open_frame = '0' and (state.waits.bands >= 0 or frame_waits) and
                 not band_waits and drained = '1' and (PARALLEL_ROWS = 1 or state.waits.tokens < 0) then
                now.send := flush_pixel;
              elsif state.waits.tokens >= 0 or state.waits.steps >= 0 then
                now.send := empty;
              end if;
            end if;
          elsif state.open_frame = '1' and new_start = '1' then
            -- A start of frame inside a frame waits until the frame cut short has ended.
            now.breaks_frame := '1';
          elsif state.open_frame = '1' then
            now.send := stream_pixel;
            now.take := '1';
            if band_waits and completes then
              now.send := empty;
              now.take := '0';
            end if;
          -- A new frame is on offer. It waits until the frame before has all the bands and tokens that it must have.
          elsif band_waits and (first_completes or frame_waits) then
            now.send := empty;
          elsif frame_waits then
            now.send := flush_pixel;
          else
            now.send         := stream_pixel;
            now.take         := '1';
            now.starts_frame := '1';
          end if;

      end case;

    end if;

    now.takes_pixel := to_logic(now.send = stream_pixel);
    now.sends_image := to_logic(now.send = stream_pixel or now.send = zero_pixel);
    now.sends_pixel := now.sends_image or to_logic(now.send = flush_pixel);
    -- A frame ends with its last line; a frame that was cut short ends with its filled-up line.
    now.frame          := state.frame;
    now.ends_line      := state.at_last;
    now.ends_frame     := state.at_last_row or not state.open_frame;
    now.completes_band := to_logic(completes or now.send = flush_pixel);

    -- The first pixel of a frame takes its size from the ports, the others from the registers.
    if now.starts_frame = '1' then
      now.frame          := offered;
      now.ends_line      := to_logic(unsigned(columns) <= PIXELS_PER_CLOCK);
      now.ends_frame     := to_logic(unsigned(rows) = 1);
      now.completes_band := to_logic(first_completes);
    end if;

    now.ends_band := now.sends_pixel and now.ends_line and now.completes_band;
    step          <= now;

  end process decide;

  s_axis_tready <= step.take;
  frame_start   <= step.starts_frame;

  follow : process (clk) is
  begin

    if rising_edge(clk) then
      -- Compared a clock ahead, because the comparisons would be too long in front of the decision.
      size_supported <= to_logic(unsigned(columns) /= 0 and unsigned(columns) <= MAX_COLUMNS and unsigned(rows) /= 0);
      -- The frame is written in every clock, so it needs no enable.
      state.frame <= step.frame;
      state.waits <= waits_after(state, step);
      if step.takes_pixel = '1' then
        state.start_lasts <= s_axis_tuser and not s_axis_tlast and not step.ends_line;
      end if;
      -- The end of a line comes first, as a line of one pixel ends with the token that begins it.
      if step.sends_pixel = '1' and step.ends_line = '1' then
        state.mode <= accept;
      elsif step.send = flush_pixel then
        state.mode <= flush;
      elsif (step.takes_pixel = '1' and s_axis_tlast = '1') or (step.breaks_frame = '1' and state.at_first = '0') then
        state.mode <= fill;
      end if;
      if step.starts_frame = '1' then
        state.at_last_row <= step.ends_frame;
      end if;
      -- Inner branches clear, and two bits are equations: behind an enable, a branch that clears would become a
      -- synchronous reset at the end of the longest path.
      if step.sends_pixel = '1' then
        if step.ends_line = '1' then
          state.column   <= (others => '0');
          state.at_first <= '1';
          state.at_last  <= to_logic(step.frame.last_column = 0);
          state.band_row <= place_in_turn(state.band_row, step.completes_band, PARALLEL_ROWS);
        else
          state.column   <= state.column + 1;
          state.at_first <= '0';
          state.at_last  <= to_logic(state.column + 1 = step.frame.last_column);
        end if;
      end if;
      state.first_band <= (step.starts_frame or state.first_band) and not step.ends_band;
      state.open_frame <= (step.starts_frame or state.open_frame) and
                          not (step.breaks_frame or (step.sends_image and step.ends_line and step.ends_frame));
      if step.sends_image = '1' and step.ends_line = '1' then
        state.frame.rows_left <= step.frame.rows_left - 1;
        state.at_last_row     <= to_logic(step.frame.rows_left = 1);
      end if;
      if reset = '1' then
        state <= AT_RESET;
      end if;
    end if;

  end process follow;

  faults : entity work.stream_faults
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => s_axis_tvalid,
      new_start     => new_start,
      s_axis_tlast  => s_axis_tlast,
      credit        => credit,
      take          => step.take,
      takes_pixel   => step.takes_pixel,
      starts_frame  => step.starts_frame,
      line_ends     => step.ends_line,
      frame_broken  => step.breaks_frame,
      excess        => excess,
      error_flags   => error_flags,
      error_clear   => error_clear
    );

  give : process (clk) is
  begin

    if rising_edge(clk) then
      -- Only strobe has a reset, because the other fields are valid only while strobe = '1'.
      token.strobe      <= to_logic(step.send /= nothing) and not reset;
      token.pixel       <= step.sends_pixel;
      token.line_first  <= step.sends_pixel and state.at_first;
      token.line_last   <= step.sends_pixel and step.ends_line;
      token.band        <= step.sends_pixel and step.completes_band;
      token.frame_first <= step.sends_pixel and (step.starts_frame or state.first_band);
      token.image       <= step.sends_image;
      token.slice       <= step.frame.slice;
      token_row         <= state.band_row;
      token_data        <= (others => '0');
      if step.takes_pixel = '1' then
        token_data <= s_axis_tdata;
      end if;
    end if;

  end process give;

end architecture rtl;
