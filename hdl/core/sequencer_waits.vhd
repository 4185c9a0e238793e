-- SPDX-License-Identifier: Apache-2.0
-- Tells frame_sequencer how many tokens and bands must still be flushed, and how long a band or a frame has to wait.
--
-- All outputs are registers, because the sequencer's decision is the longest path of the stream and leaves no time for
-- comparisons.
--
-- Latency: 1 clock. Throughput: one token each clock.
-- Equation: a count becomes its start value when loaded, else falls by one with each step while above 0, and is due
-- while above 0; a frame is incomplete until its number of bands is a multiple of BAND_MODULUS.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;

entity sequencer_waits is
  generic (
    -- ROW_FLUSH: empty tokens that push a line out of the row filters; COLUMN_FLUSH: bands that push a frame out
    -- of the column filters.
    ROW_FLUSH    : natural;
    COLUMN_FLUSH : natural;
    -- The shortest band in tokens, a multiple of PARALLEL_ROWS.
    MIN_STEPS : positive;
    -- MIN_BANDS: the shortest frame in bands; BAND_MODULUS: its number of bands is a multiple of this;
    -- KEEP_MODULUS: flush lines that are not needed for the multiple count as well.
    MIN_BANDS    : positive;
    BAND_MODULUS : positive;
    KEEP_MODULUS : boolean
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The token of this clock: any_step: there is one; empty_step: it is empty; sends_pixel: it has a pixel;
    -- sends_image: a pixel of an image line.
    any_step    : in    std_logic;
    empty_step  : in    std_logic;
    sends_pixel : in    std_logic;
    sends_image : in    std_logic;
    -- starts_frame: first pixel of a frame. starts_flush: first pixel of a flush line. band_ends: last token of a band.
    starts_frame : in    std_logic;
    starts_flush : in    std_logic;
    band_ends    : in    std_logic;
    -- first_band: the band is a frame's first one. steps_missing: tokens that the band lacks at its end;
    -- lacks_steps: whether it lacks any.
    first_band    : in    std_logic;
    steps_missing : in    natural range 0 to MIN_STEPS;
    lacks_steps   : in    std_logic;
    -- tokens_due: pixels are in the row filters; bands_due: lines are in the column filters.
    tokens_due : out   std_logic;
    bands_due  : out   std_logic;
    -- steps_due: no band may begin yet; frame_wait: no frame may begin yet.
    steps_due  : out   std_logic;
    frame_wait : out   std_logic
  );
end entity sequencer_waits;

architecture rtl of sequencer_waits is

  constant SOME_TOKENS : std_logic := to_logic(ROW_FLUSH > 0);
  constant SOME_BANDS  : std_logic := to_logic(COLUMN_FLUSH > 0);
  constant MORE_BANDS  : std_logic := to_logic(MIN_BANDS > 1);

  -- The next value of a count of what is left: its start value where it is loaded, one less with a step. A step
  -- comes only while some are left.
  function left_after (
    left  : natural;
    load  : std_logic;
    start : natural;
    step  : std_logic
  ) return natural is
  begin

    if load = '1' then
      return start;
    elsif step = '1' then
      return left - 1;
    end if;

    return left;

  end function left_after;

  -- Whether the next value of the count is above 0. This bit is a register beside the count, so that a decision
  -- needs no comparison. start_some says whether the start value is above 0.
  function some_after (
    left       : natural;
    some       : std_logic;
    load       : std_logic;
    start_some : std_logic;
    step       : std_logic
  ) return std_logic is
  begin

    if load = '1' then
      return start_some;
    elsif step = '1' then
      return to_logic(left > 1);
    end if;

    return some;

  end function some_after;

  -- tokens_left, bands_left: tokens and bands to flush. steps_left, frame_left: tokens before the next band and
  -- bands before the next frame may begin. Behind each its bit "some are left", and the step that takes one off.
  signal tokens_left : natural range 0 to larger(ROW_FLUSH, 1)     := 0;
  signal tokens_some : std_logic                                   := '0';
  signal push        : std_logic;
  signal bands_left  : natural range 0 to larger(COLUMN_FLUSH, 1)  := 0;
  signal bands_some  : std_logic                                   := '0';
  signal flush       : std_logic;
  signal steps_left  : natural range 0 to MIN_STEPS                := 0;
  signal steps_some  : std_logic                                   := '0';
  signal pass        : std_logic;
  signal frame_left  : natural range 0 to larger(MIN_BANDS - 1, 1) := 0;
  -- frame_short: the frame has too few bands so far; frame_odd: its number of bands is no multiple of BAND_MODULUS.
  signal frame_short : std_logic := '0';
  signal append      : std_logic;
  signal frame_odd   : std_logic := '0';
  -- counts_band: a band counts now; band_phase: number of bands modulo BAND_MODULUS.
  signal counts_band : std_logic;
  signal band_phase  : natural range 0 to BAND_MODULUS := 0;

begin

  tokens_due <= tokens_some;
  bands_due  <= bands_some;
  steps_due  <= steps_some;

  push   <= empty_step and tokens_some;
  flush  <= starts_flush and bands_some;
  pass   <= any_step and steps_some;
  append <= band_ends and not first_band and frame_short;

  count_down : process (clk) is
  begin

    if rising_edge(clk) then
      -- Every pixel, also a zero one, has to be pushed out of the row filters; only an empty token pushes.
      tokens_left <= left_after(tokens_left, sends_pixel, ROW_FLUSH, push);
      tokens_some <= some_after(tokens_left, tokens_some, sends_pixel, SOME_TOKENS, push);
      -- Flush lines load nothing: they leave zeros in the column filters, which need not come out.
      bands_left <= left_after(bands_left, sends_image, COLUMN_FLUSH, flush);
      bands_some <= some_after(bands_left, bands_some, sends_image, SOME_BANDS, flush);
      -- This count starts at the end of a band, when the band's length is known: the count is then nearly
      -- always 0, and the next band need not wait for a comparison.
      steps_left <= left_after(steps_left, band_ends, steps_missing, pass);
      steps_some <= some_after(steps_left, steps_some, band_ends, lacks_steps, pass);
      -- This count starts with a frame's first pixel, because the first band may be the frame's only one.
      frame_left  <= left_after(frame_left, starts_frame, MIN_BANDS - 1, append);
      frame_short <= some_after(frame_left, frame_short, starts_frame, MORE_BANDS, append);
      if reset = '1' then
        tokens_left <= 0;
        tokens_some <= '0';
        bands_left  <= 0;
        bands_some  <= '0';
        steps_left  <= 0;
        steps_some  <= '0';
        frame_left  <= 0;
        frame_short <= '0';
      end if;
    end if;

  end process count_down;

  -- Flush lines fill a frame up to a multiple and then stop counting: the next frame may come at any time.
  counts_band <= band_ends when BAND_MODULUS > 1 and (sends_image = '1' or frame_odd = '1' or KEEP_MODULUS) else
                 '0';

  count_modulus : process (clk) is
  begin

    if rising_edge(clk) then
      -- BAND_MODULUS (it is M) need not be a power of two, so a counter gives the remainder.
      if counts_band = '1' then
        if band_phase = BAND_MODULUS - 1 then
          band_phase <= 0;
          frame_odd  <= '0';
        else
          band_phase <= band_phase + 1;
          frame_odd  <= '1';
        end if;
      end if;
      if reset = '1' then
        band_phase <= 0;
        frame_odd  <= '0';
      end if;
    end if;

  end process count_modulus;

  frame_wait <= frame_short or frame_odd;

end architecture rtl;
