-- SPDX-License-Identifier: Apache-2.0
-- Turns bands of parallel rows back into a raster: row buffers behind the engine.
--
-- Each row has a FIFO. The FIFOs are read line by line, from the first row of a band to the last. A row without an
-- image line puts a single word into its FIFO; that word is skipped at the end of the line before.
--
-- Latency: 2 clocks from a pixel to its offer when its turn has come. Throughput: one pixel each clock, also just
-- after the sink has stalled.
-- Equation: the n-th line out is the n-th image line of the bands, counted row by row.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.token_pkg.all;

entity row_scatter is
  generic (
    -- Rows of a band.
    PARALLEL_ROWS : positive;
    -- Longest line in pixels.
    MAX_COLUMNS : positive;
    -- Width of a pixel.
    DATA_BITS : positive;
    -- Width of a slice.
    SLICE_BITS : natural range 0 to 8;
    -- The most results that may still come after credit falls.
    UNDER_WAY : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The engine's result for each row, and its pixels, row 0 in the low bits.
    results : in    results_t(0 to PARALLEL_ROWS - 1);
    data    : in    std_logic_vector(PARALLEL_ROWS * DATA_BITS - 1 downto 0);
    -- The pixels in raster order; tid: the slice of the frame.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(DATA_BITS - 1 downto 0);
    m_axis_tuser  : out   std_logic;
    m_axis_tid    : out   std_logic_vector(7 downto 0);
    m_axis_tlast  : out   std_logic;
    -- All FIFOs have room for the results of the tokens under way.
    credit : out   std_logic;
    -- All results have gone out except a few pixels.
    drained : out   std_logic
  );
end entity row_scatter;

architecture rtl of row_scatter is

  -- Without parallel rows a line leaves as it comes, and a row without an image line leaves no word. With parallel
  -- rows a line waits for the lines of the rows before it, which may lag by one token each. Behind a last band
  -- that is not full, the next band comes before all lines of the full band before it have left.
  constant LINE_WORDS : natural := choose(PARALLEL_ROWS = 1, 0, 2 * MAX_COLUMNS + PARALLEL_ROWS);
  -- When credit comes back after a stall, new words reach the output UNDER_WAY + 3 clocks later. The words that
  -- are left must last until then: UNDER_WAY + 1 in the memory, two in the FIFO's registers.
  constant CAPACITY     : positive := LINE_WORDS + 2 * (UNDER_WAY + 1);
  constant ADDRESS_BITS : positive := bits_for(CAPACITY - 1);
  constant CREDIT_LEVEL : positive := 2 ** ADDRESS_BITS - UNDER_WAY;

  -- A word of the FIFO, from the low bits: pixel, end of line, start of frame, slice, mark of a row without image line.
  constant LAST_BIT  : natural  := DATA_BITS;
  constant START_BIT : natural  := DATA_BITS + 1;
  constant WIDTH     : positive := DATA_BITS + 2 + SLICE_BITS;

  subtype entry_t is std_logic_vector(WIDTH downto 0);

  type entries_t is array (natural range 0 to PARALLEL_ROWS - 1) of entry_t;

  constant ALL_ROWS : std_logic_vector(PARALLEL_ROWS - 1 downto 0) := (others => '1');

  -- row: the row whose line goes out; entries: the word that each row's FIFO offers.
  signal row      : natural range 0 to PARALLEL_ROWS := 0;
  signal entries  : entries_t;
  signal on_offer : std_logic_vector(PARALLEL_ROWS - 1 downto 0);
  signal take     : std_logic_vector(PARALLEL_ROWS - 1 downto 0);
  -- For each row: has_credit: room for the tokens under way; is_drained: nearly empty. Both are registers because
  -- the sequencer's decision uses them.
  signal has_credit : std_logic_vector(PARALLEL_ROWS - 1 downto 0) := (others => '0');
  signal is_drained : std_logic_vector(PARALLEL_ROWS - 1 downto 0) := (others => '0');
  signal entry      : entry_t;
  signal offered    : std_logic;
  signal taken      : std_logic;
  -- passed: rows that are skipped at this clock; row_then: the row that comes next.
  signal passed   : std_logic_vector(PARALLEL_ROWS - 1 downto 0);
  signal row_then : natural range 0 to PARALLEL_ROWS;

begin

  fifo : for r in 0 to PARALLEL_ROWS - 1 generate

    signal write : std_logic;
    signal word  : entry_t;
    signal level : unsigned(ADDRESS_BITS downto 0);

  begin

    -- With one row, a missing line needs no word, because no other row waits for it.
    write <= results(r).valid when PARALLEL_ROWS = 1 else
             results(r).valid or results(r).skip;

    word(WIDTH)     <= results(r).skip;
    word(START_BIT) <= results(r).start;
    word(LAST_BIT)  <= results(r).last;

    word(WIDTH - 1 downto START_BIT + 1) <= std_logic_vector(results(r).slice(SLICE_BITS - 1 downto 0));
    word(DATA_BITS - 1 downto 0)         <= data((r + 1) * DATA_BITS - 1 downto r * DATA_BITS);

    words : entity work.axis_fifo
      generic map (
        WIDTH        => WIDTH + 1,
        ADDRESS_BITS => ADDRESS_BITS,
        MUST_FIT     => true
      )
      port map (
        clk           => clk,
        reset         => reset,
        s_axis_tvalid => write,
        s_axis_tdata  => word,
        m_axis_tvalid => on_offer(r),
        m_axis_tready => take(r),
        m_axis_tdata  => entries(r),
        level         => level
      );

    take(r) <= taken when row = r else
               passed(r);

    watch_level : process (clk) is
    begin

      if rising_edge(clk) then
        -- The comparison is made a clock ahead, so that its register keeps it out of the sequencer's
        -- decision; CREDIT_LEVEL leaves room for the token that is decided meanwhile.
        if level < CREDIT_LEVEL then
          has_credit(r) <= '1';
        else
          has_credit(r) <= '0';
        end if;
        -- The results of a flush line come UNDER_WAY clocks after its decision; as many words can leave until then.
        if level < UNDER_WAY then
          is_drained(r) <= '1';
        else
          is_drained(r) <= '0';
        end if;
        if reset = '1' then
          has_credit(r) <= '0';
        end if;
      end if;

    end process watch_level;

  end generate fifo;

  credit        <= '1' when has_credit = ALL_ROWS else
                   '0';
  drained       <= '1' when is_drained = ALL_ROWS else
                   '0';
  entry         <= entries(row);
  offered       <= on_offer(row);
  taken         <= offered and (m_axis_tready or entry(WIDTH));
  m_axis_tvalid <= offered and not entry(WIDTH);
  m_axis_tdata  <= entry(DATA_BITS - 1 downto 0);
  m_axis_tuser  <= entry(START_BIT);
  m_axis_tlast  <= entry(LAST_BIT);
  m_axis_tid    <= std_logic_vector(resize(unsigned(entry(WIDTH - 1 downto START_BIT + 1)), 8));

  pass_over : process (row, taken, entry, entries, on_offer) is

    variable place : natural range 0 to PARALLEL_ROWS;
    variable going : std_logic;

  begin

    passed <= (others => '0');
    place  := row;
    -- With the last pixel of a line all following rows without a line are skipped in the same clock, so that
    -- skipping takes no time.
    going := taken and (entry(LAST_BIT) or entry(WIDTH));

    for i in 1 to PARALLEL_ROWS loop

      if going = '1' then
        if place = PARALLEL_ROWS - 1 then
          place := 0;
        else
          place := place + 1;
        end if;
        going := '0';
        if i < PARALLEL_ROWS then
          going         := on_offer(place) and entries(place)(WIDTH);
          passed(place) <= going;
        end if;
      end if;

    end loop;

    row_then <= place;

  end process pass_over;

  next_row : process (clk) is
  begin

    if rising_edge(clk) then
      row <= row_then;
      if reset = '1' then
        row <= 0;
      end if;
    end if;

  end process next_row;

end architecture rtl;
