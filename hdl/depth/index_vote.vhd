-- SPDX-License-Identifier: Apache-2.0
-- Micro images without texture take the slice of their neighbours.
--
-- A micro image has texture if its sharpest slice is at least CONFIDENCE sharper than its dullest one; it then keeps
-- its slice. A micro image without texture takes the slice that most textured ones have in a window of (2 VOTE_RADIUS +
-- 1) x (2 VOTE_RADIUS + 1) micro images, the first of equal ones. If the window has none with texture, it takes the
-- slice of the micro image above, in a frame's first row that of the one to the left.
--
-- Rows come in scans, one micro image each clock; a memory holds the slices of the window's rows. A scan votes on the
-- row VOTE_RADIUS rows before its own.
--
-- Latency: VOTE_RADIUS rows and vote_latency clocks. Throughput: one micro image each clock; scans begin at least
-- vote_latency clocks after the scan before has ended.
-- Equation: voted = index where most - least >= CONFIDENCE, else argmax over slices of the votes in the window.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.delay_pkg.all;
use work.math_pkg.all;
use work.index_pkg.all;
use work.sharpness_pkg.all;

entity index_vote is
  generic (
    -- Sizes of sharpness_index.
    BUILD : index_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- active: there is a micro image; its number, its sharpest slice, its largest and its least sharpness.
    active : in    std_logic;
    lens   : in    unsigned(bits_for(BUILD.lenses - 1) - 1 downto 0);
    index  : in    unsigned(bits_for(BUILD.slices - 1) - 1 downto 0);
    most   : in    unsigned(BUILD.sharpness_bits - 1 downto 0);
    least  : in    unsigned(BUILD.sharpness_bits - 1 downto 0);
    -- Whether the scan's row belongs to a frame.
    live : in    std_logic;
    -- Which rows of the window belong to the frame of the middle row, the newest in the low bit.
    same : in    std_logic_vector(2 * BUILD.vote_radius downto 0);
    -- Whether the middle row is the first of its frame.
    starts : in    std_logic;
    -- voted_write: there is a micro image of the middle row; its number; its slice; voted_kept: it kept its own slice.
    voted_write : out   std_logic;
    voted_lens  : out   unsigned(bits_for(BUILD.lenses - 1) - 1 downto 0);
    voted_index : out   unsigned(bits_for(BUILD.slices - 1) - 1 downto 0);
    voted_kept  : out   std_logic
  );
end entity index_vote;

architecture rtl of index_vote is

  constant LENS_BITS  : positive := bits_for(BUILD.lenses - 1);
  constant INDEX_BITS : positive := bits_for(BUILD.slices - 1);
  constant WINDOW     : positive := 2 * BUILD.vote_radius + 1;
  constant VOTE_BITS  : positive := bits_for(WINDOW * WINDOW);
  -- An entry of a row: the slice, and whether there is texture.
  constant ENTRY_BITS : positive := INDEX_BITS + 1;
  constant KEPT_BITS  : positive := 2 * BUILD.vote_radius * ENTRY_BITS;
  -- Clocks from an entry of the middle row to the votes on it.
  constant MIDDLE_DELAY : positive := BUILD.vote_radius + BUILD.slices + 1;
  -- Clocks from a micro image to the votes on the middle row's.
  constant FINAL : positive := 3 + MIDDLE_DELAY;

  type entries_t is array (3 to FINAL) of std_logic_vector(ENTRY_BITS - 1 downto 0);

  type lenses_t is array (natural range 0 to FINAL) of unsigned(LENS_BITS - 1 downto 0);

  subtype votes_t is unsigned(VOTE_BITS - 1 downto 0);

  type columns_t is array (natural range 1 to WINDOW) of votes_t;

  type most_t is array (natural range 0 to BUILD.slices - 1) of votes_t;

  type best_t is array (natural range 0 to BUILD.slices - 1) of unsigned(INDEX_BITS - 1 downto 0);

  -- Number of the micro image, and whether there is one, by clocks: index 3 goes with the rows above it, FINAL with its
  -- votes.
  signal lens_at   : lenses_t                                  := (others => (others => '0'));
  signal active_at : std_logic_vector(0 to FINAL)              := (others => '0');
  signal entry_1   : std_logic_vector(ENTRY_BITS - 1 downto 0) := (others => '0');
  signal entry_2   : std_logic_vector(ENTRY_BITS - 1 downto 0) := (others => '0');
  signal entry_3   : std_logic_vector(ENTRY_BITS - 1 downto 0) := (others => '0');
  -- rows: entries of the rows above, the newest in the low bits; moved: with the new entry; middle_at: the entry in the
  -- middle of the window.
  signal rows      : std_logic_vector(KEPT_BITS - 1 downto 0);
  signal moved     : std_logic_vector(KEPT_BITS + ENTRY_BITS - 1 downto 0);
  signal middle_at : entries_t := (others => (others => '0'));
  -- Votes of each slice; the most votes among the slices so far, and the slice that has them.
  signal votes      : most_t;
  signal most_votes : most_t;
  signal best       : best_t;
  -- The slice of the micro image above, for one without votes.
  signal above         : std_logic_vector(INDEX_BITS - 1 downto 0);
  signal result_write  : std_logic                         := '0';
  signal result_lens   : unsigned(LENS_BITS - 1 downto 0)  := (others => '0');
  signal result_index  : unsigned(INDEX_BITS - 1 downto 0) := (others => '0');
  signal result_kept   : std_logic                         := '0';
  signal result_vector : std_logic_vector(INDEX_BITS - 1 downto 0);

begin

  --------------------------------------------------------------------------------------------------
  -- Clock 1: whether there is texture.

  judge : process (clk) is
  begin

    if rising_edge(clk) then
      -- A row beyond the frame has no texture, so it has no vote either.
      entry_1 <= std_logic_vector(index) & (live and has_texture(most, least, BUILD.confidence));
    end if;

  end process judge;

  lens_at(0)   <= lens;
  active_at(0) <= active;

  -- The number of the micro image, delayed for all uses a fixed number of clocks later.
  follow : process (clk) is
  begin

    if rising_edge(clk) then
      lens_at(1 to FINAL)   <= lens_at(0 to FINAL - 1);
      active_at(1 to FINAL) <= active_at(0 to FINAL - 1);
      entry_2               <= entry_1;
      entry_3               <= entry_2;
      if reset = '1' then
        active_at(1 to FINAL) <= (others => '0');
      end if;
    end if;

  end process follow;

  --------------------------------------------------------------------------------------------------
  -- Clock 3: the rows of the window.

  rows_before : entity work.ram_simple_dual_port
    generic map (
      WIDTH => KEPT_BITS,
      WORDS => BUILD.lenses
    )
    port map (
      clk           => clk,
      write_enable  => active_at(3),
      write_address => lens_at(3),
      write_data    => moved(KEPT_BITS - 1 downto 0),
      read_address  => lens_at(1),
      read_data     => rows
    );

  -- Rows move up by one, and the new entry comes in at the low end. The votes are for the middle row.
  moved        <= rows & entry_3;
  middle_at(3) <= moved((BUILD.vote_radius + 1) * ENTRY_BITS - 1 downto BUILD.vote_radius * ENTRY_BITS);

  --------------------------------------------------------------------------------------------------
  -- Clock 4: votes of a column. Clock 5: votes of the window, VOTE_RADIUS clocks behind its middle. Afterwards one
  -- slice each clock is compared for the most votes.

  slice : for s in 0 to BUILD.slices - 1 generate

    signal column  : votes_t   := (others => '0');
    signal columns : columns_t := (others => (others => '0'));
    signal total   : votes_t   := (others => '0');

  begin

    count : process (clk) is

      variable added : votes_t;

    begin

      if rising_edge(clk) then
        added := (others => '0');

        for i in 0 to 2 * BUILD.vote_radius loop

          -- Only rows of the same frame, and only those with texture, vote for their own slice.
          if active_at(3) = '1' and same(i) = '1' and moved(i * ENTRY_BITS) = '1' and
             unsigned(moved((i + 1) * ENTRY_BITS - 1 downto i * ENTRY_BITS + 1)) = s then
            added := added + 1;
          end if;

        end loop;

        -- A column's votes are added when it enters the window and taken away when it leaves: two additions, whatever
        -- the window's width.
        column     <= added;
        total      <= total + column - columns(WINDOW);
        columns(1) <= column;

        for i in 2 to WINDOW loop

          columns(i) <= columns(i - 1);

        end loop;

        -- The sums depend on earlier columns, so a reset must clear all of them.
        if reset = '1' then
          column  <= (others => '0');
          columns <= (others => (others => '0'));
          total   <= (others => '0');
        end if;
      end if;

    end process count;

    -- The slices are compared one after the other, so the votes of slice s wait s clocks.
    votes(s) <= total;

    first_slice : if s = 0 generate
      most_votes(0) <= votes(0);
      best(0)       <= (others => '0');
    end generate first_slice;

    next_slice : if s > 0 generate

      signal counted : std_logic_vector(VOTE_BITS - 1 downto 0);
      signal waiting : std_logic_vector(delay_bits(VOTE_BITS, s - 1) - 1 downto 0) := (others => '0');
      signal value   : unsigned(VOTE_BITS - 1 downto 0);

    begin

      counted <= std_logic_vector(votes(s));

      value <= unsigned(delayed(waiting, counted, s - 1));

      compare : process (clk) is
      begin

        if rising_edge(clk) then
          waiting       <= moved_on(waiting, counted);
          most_votes(s) <= most_votes(s - 1);
          best(s)       <= best(s - 1);
          if value > most_votes(s - 1) then
            most_votes(s) <= value;
            best(s)       <= to_unsigned(s, INDEX_BITS);
          end if;
        end if;

      end process compare;

    end generate next_slice;

  end generate slice;

  --------------------------------------------------------------------------------------------------
  -- The slice of the result.

  row_above : entity work.ram_simple_dual_port
    generic map (
      WIDTH => INDEX_BITS,
      WORDS => BUILD.lenses
    )
    port map (
      clk           => clk,
      write_enable  => result_write,
      write_address => result_lens,
      write_data    => result_vector,
      -- 2 clocks ahead for the memory's latency.
      read_address => lens_at(FINAL - 2),
      read_data    => above
    );

  take : process (clk) is
  begin

    if rising_edge(clk) then
      middle_at(4 to FINAL) <= middle_at(3 to FINAL - 1);

      result_write <= active_at(FINAL);
      result_lens  <= lens_at(FINAL);
      result_kept  <= middle_at(FINAL)(0);
      -- A textured micro image keeps its slice; only the others are outvoted.
      if middle_at(FINAL)(0) = '1' then
        result_index <= unsigned(middle_at(FINAL)(INDEX_BITS downto 1));
      elsif most_votes(BUILD.slices - 1) /= 0 then
        result_index <= best(BUILD.slices - 1);
      -- No neighbour has texture: the micro image above was decided before and is the best guess.
      elsif starts = '0' then
        result_index <= unsigned(above);
      elsif lens_at(FINAL) = 0 then
        result_index <= unsigned(middle_at(FINAL)(INDEX_BITS downto 1));
      end if;
    end if;

  end process take;

  result_vector <= std_logic_vector(result_index);
  voted_write   <= result_write;
  voted_lens    <= result_lens;
  voted_index   <= result_index;
  voted_kept    <= result_kept;

  -- Simulation stops if a scan comes too early: the window holds columns of the scan before until vote_latency clocks
  -- behind its end.
  watch_scans : process (clk) is

    constant PAUSE : natural := vote_latency(BUILD.slices, BUILD.vote_radius, BUILD.boxes);
    variable quiet : natural := PAUSE;

  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      if reset = '1' then
        quiet := PAUSE;
      elsif active = '1' then
        assert quiet = 0 or quiet >= PAUSE
          report "index_vote: a scan began less than vote_latency clocks behind the one before"
          severity failure;
        quiet := 0;
      elsif quiet < PAUSE then
        quiet := quiet + 1;
      end if;
    end if;

  -- synthesis translate_on

  end process watch_scans;

end architecture rtl;
