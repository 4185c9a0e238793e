-- SPDX-License-Identifier: Apache-2.0
-- Tells frame_sequencer what it still has to push out of the filters, and how long a band or a frame has to wait.
--
-- All outputs are registers, because the sequencer's decision is the longest path of the stream and leaves no time for
-- comparisons.
--
-- Latency: 1 clock. Throughput: one token each clock.
-- Equation: see countdown; a frame counts as incomplete until its bands are a multiple of BAND_MODULUS.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;

entity sequencer_waits is
  generic (
    -- Empty tokens that push a line out of the row filters, and bands that push a frame out of the column filters.
    ROW_FLUSH    : natural;
    COLUMN_FLUSH : natural;
    -- The shortest band in tokens, a multiple of PARALLEL_ROWS.
    MIN_STEPS : positive;
    -- The shortest frame in bands, and what its number of bands is a multiple of; with KEEP_MODULUS flush lines that
    -- are not needed for that count as well.
    MIN_BANDS    : positive;
    BAND_MODULUS : positive;
    KEEP_MODULUS : boolean
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- What this clock sends: a token, an empty one, one with a pixel, one of an image line.
    any_step    : in    std_logic;
    empty_step  : in    std_logic;
    sends_pixel : in    std_logic;
    sends_image : in    std_logic;
    -- It is a frame's first pixel, a flush line's first one, the last one of a band.
    starts_frame : in    std_logic;
    starts_flush : in    std_logic;
    band_ends    : in    std_logic;
    -- The band is a frame's first one; the tokens that it lacks at its end, and whether it lacks any.
    first_band    : in    std_logic;
    steps_missing : in    natural range 0 to MIN_STEPS;
    lacks_steps   : in    std_logic;
    -- Pixels are in the row filters, and lines in the column filters.
    tokens_due : out   std_logic;
    bands_due  : out   std_logic;
    -- No band may begin yet, and no frame.
    steps_due  : out   std_logic;
    frame_wait : out   std_logic
  );
end entity sequencer_waits;

architecture rtl of sequencer_waits is

  constant SOME_TOKENS : std_logic := to_logic(ROW_FLUSH > 0);
  constant SOME_BANDS  : std_logic := to_logic(COLUMN_FLUSH > 0);
  constant MORE_BANDS  : std_logic := to_logic(MIN_BANDS > 1);

  -- A band ends that is not the first of its frame; a band counts modulo BAND_MODULUS.
  signal later_band  : std_logic;
  signal counts_band : std_logic;
  -- The frame has too few bands so far, or no multiple of BAND_MODULUS.
  signal frame_short : std_logic;
  signal frame_odd   : std_logic                       := '0';
  signal band_phase  : natural range 0 to BAND_MODULUS := 0;

begin

  -- Any pixel, also a zero one, has to be pushed out of the row filters; only an empty token pushes.
  tokens_to_flush : entity work.countdown
    generic map (
      MOST => ROW_FLUSH
    )
    port map (
      clk   => clk,
      reset => reset,
      load  => sends_pixel,
      start => ROW_FLUSH,
      some  => SOME_TOKENS,
      step  => empty_step,
      due   => tokens_due
    );

  -- Flush lines load nothing: they leave zeros in the column filters, which need not come out.
  bands_to_flush : entity work.countdown
    generic map (
      MOST => COLUMN_FLUSH
    )
    port map (
      clk   => clk,
      reset => reset,
      load  => sends_image,
      start => COLUMN_FLUSH,
      some  => SOME_BANDS,
      step  => starts_flush,
      due   => bands_due
    );

  -- Counted from the end of a band, when its number of tokens is known, instead of from its beginning. The count is
  -- then nearly always zero, and the next band need not wait for a comparison.
  steps_to_wait : entity work.countdown
    generic map (
      MOST => MIN_STEPS
    )
    port map (
      clk   => clk,
      reset => reset,
      load  => band_ends,
      start => steps_missing,
      some  => lacks_steps,
      step  => any_step,
      due   => steps_due
    );

  -- The first band counts with the start of the frame.
  later_band <= band_ends and not first_band;

  -- It begins with the frame's first pixel, as the first band may be the only one.
  bands_to_wait : entity work.countdown
    generic map (
      MOST => MIN_BANDS - 1
    )
    port map (
      clk   => clk,
      reset => reset,
      load  => starts_frame,
      start => MIN_BANDS - 1,
      some  => MORE_BANDS,
      step  => later_band,
      due   => frame_short
    );

  -- Flush lines fill a frame up to a multiple, and count only until it is reached: a frame may come at any time then.
  counts_band <= band_ends when BAND_MODULUS > 1 and (sends_image = '1' or frame_odd = '1' or KEEP_MODULUS) else
                 '0';

  count_modulus : process (clk) is
  begin

    if rising_edge(clk) then
      -- BAND_MODULUS may be no power of two (it is M), so the remainder is counted instead of cut.
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
