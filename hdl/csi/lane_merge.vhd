-- SPDX-License-Identifier: Apache-2.0
-- Aligns the bytes of a burst that arrive on several lanes, each lane later by its own number of clocks.
--
-- The last bytes of each lane are stored. In the clock in which the last lane has seen its sync, the place of each
-- lane's oldest sync among its bytes shows how early that lane is, for the whole burst. Syncs of bursts that follow at
-- once wait for their turn. A sync without those of the other lanes within MAX_SKEW clocks is dropped and reported.
--
-- Bursts may therefore follow each other at any distance as long as each lane sees each sync in time. A burst with a
-- missing or late sync destroys no other burst if the next burst's syncs come more than MAX_SKEW clocks behind all of
-- its own.
--
-- Latency: 2 clocks from the last lane's byte. Throughput: a byte of each lane each clock.
-- Equation: word(n) = the n-th bytes of all lanes behind their syncs, if the syncs come within MAX_SKEW clocks.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity lane_merge is
  generic (
    LANES : positive range 1 to 4;
    -- Clocks by which a lane may be later than another.
    MAX_SKEW : natural range 0 to 7 := 3
  );
  port (
    clk : in    std_logic;
    -- For each lane: lane_valid: high from the first byte behind a burst's sync sequence to its end; lane_sync: high
    -- with that first byte.
    lane_valid : in    std_logic_vector(LANES - 1 downto 0);
    lane_sync  : in    std_logic_vector(LANES - 1 downto 0);
    -- Bytes of all lanes, lane 0 in the low bits.
    lane_data : in    std_logic_vector(8 * LANES - 1 downto 0);
    -- High for one clock: a burst has ended on the lane without a sync.
    lane_missed : in    std_logic_vector(LANES - 1 downto 0) := (others => '0');
    -- A word of a burst: word_first: the burst's first; word_live: which lanes have a byte in it. A word needs a byte
    -- of lane 0.
    word_first : out   std_logic;
    word_live  : out   std_logic_vector(LANES - 1 downto 0);
    word_data  : out   std_logic_vector(8 * LANES - 1 downto 0);
    -- High for one clock: a burst that not all lanes began within MAX_SKEW clocks. Bursts with less than REST clocks of
    -- rest between them that fail in different lanes may count as one. A burst that no lane began counts when the last
    -- lane has missed it, or when one lane misses the next burst.
    lane_missing : out   std_logic
  );
end entity lane_merge;

architecture rtl of lane_merge is

  -- Bytes that are stored of each lane, lane after lane, the newest first.
  constant DEPTH  : positive := MAX_SKEW + 1;
  constant PLACES : positive := LANES * DEPTH;

  type bytes_t is array (natural range 0 to PLACES - 1) of std_logic_vector(7 downto 0);

  type taps_t is array (natural range 0 to LANES - 1) of natural range 0 to MAX_SKEW;

  constant NO_LANE   : std_logic_vector(LANES - 1 downto 0) := (others => '0');
  constant ALL_LANES : std_logic_vector(LANES - 1 downto 0) := (others => '1');

  -- Clocks without bytes after which a burst is over, including its late lanes.
  constant REST : positive := 15;

  signal valid : std_logic_vector(PLACES - 1 downto 0) := (others => '0');
  signal sync  : std_logic_vector(PLACES - 1 downto 0) := (others => '0');
  signal bytes : bytes_t                               := (others => (others => '0'));
  -- Each lane has a sync among its bytes: all lanes are aligned from this clock on.
  signal starts : std_logic;
  -- The oldest sync of each lane, which is deleted when all are aligned.
  signal oldest : std_logic_vector(PLACES - 1 downto 0);
  -- How early each lane is: now (taps_now), and in this burst (taps); active: lanes that have not ended yet.
  signal taps_now : taps_t;
  signal taps     : taps_t                               := (others => 0);
  signal active   : std_logic_vector(LANES - 1 downto 0) := (others => '0');
  -- dropped: lanes whose sync was dropped in the burst reported last; quiet: clocks without bytes.
  signal dropped : std_logic_vector(LANES - 1 downto 0) := (others => '0');
  signal quiet   : natural range 0 to REST              := 0;
  -- Lanes that have missed a burst of which no byte has come.
  signal missed : std_logic_vector(LANES - 1 downto 0) := (others => '0');

begin

  find_syncs : process (sync, taps) is

    variable all_in  : std_logic;
    variable present : std_logic;

  begin

    all_in   := '1';
    taps_now <= taps;
    oldest   <= (others => '0');

    for i in 0 to LANES - 1 loop

      present := '0';

      -- The loop goes from the oldest byte to the newest, so that bursts leave in their order.
      for d in DEPTH - 1 downto 0 loop

        if sync(i * DEPTH + d) = '1' and present = '0' then
          present               := '1';
          taps_now(i)           <= d;
          oldest(i * DEPTH + d) <= '1';
        end if;

      end loop;

      all_in := all_in and present;

    end loop;

    starts <= all_in;

  end process find_syncs;

  keep_bytes : process (clk) is

    variable place : natural range 0 to 31;
    variable live  : std_logic;

  begin

    if rising_edge(clk) then

      for i in 0 to LANES - 1 loop

        -- The first place of each lane takes the newest byte.
        valid(i * DEPTH) <= lane_valid(i);
        sync(i * DEPTH)  <= lane_valid(i) and lane_sync(i);
        bytes(i * DEPTH) <= lane_data(8 * i + 7 downto 8 * i);

        -- A sync counts for one burst: it is deleted as soon as all lanes are aligned.
        for d in 1 to DEPTH - 1 loop

          valid(i * DEPTH + d) <= valid(i * DEPTH + d - 1);
          sync(i * DEPTH + d)  <= sync(i * DEPTH + d - 1) and not (starts and oldest(i * DEPTH + d - 1));
          bytes(i * DEPTH + d) <= bytes(i * DEPTH + d - 1);

        end loop;

      end loop;

      -- The first word uses the new places at once: the register still has those of the last burst.
      for i in 0 to LANES - 1 loop

        place := i * DEPTH;
        if starts = '1' then
          place   := place + taps_now(i);
          taps(i) <= taps_now(i);
        else
          place := place + taps(i);
        end if;

        -- Bytes of lanes that never were aligned do not leave, nor bytes behind a lane's end, because the next burst
        -- may have come there already.
        live         := valid(place) and (starts or active(i));
        word_live(i) <= live;
        active(i)    <= live;

        word_data(8 * i + 7 downto 8 * i) <= bytes(place);

      end loop;

      word_first <= starts;
    end if;

  end process keep_bytes;

  tell_missing : process (clk) is

    variable drops : std_logic_vector(LANES - 1 downto 0);
    variable known : std_logic_vector(LANES - 1 downto 0);
    variable wants : std_logic_vector(LANES - 1 downto 0);
    variable again : std_logic;

  begin

    if rising_edge(clk) then
      -- A sync that falls out at the end has never met the syncs of the other lanes.
      for i in 0 to LANES - 1 loop

        drops(i) := sync(i * DEPTH + DEPTH - 1) and not starts;

      end loop;

      -- A late lane's sync is dropped after those of the others and belongs to the burst that was reported: a lane has
      -- one sync in a burst.
      known := dropped;
      if starts = '1' or quiet = REST or (drops and dropped) /= NO_LANE then
        known := (others => '0');
      end if;
      dropped <= known or drops;

      -- A burst that some lanes began is reported by their syncs. A burst that no lane began is reported by the lanes
      -- at its end, each later by its own skew.
      wants := missed or lane_missed;
      again := to_logic((missed and lane_missed) /= NO_LANE);
      if quiet /= REST or wants = ALL_LANES then
        missed <= (others => '0');
      elsif again = '1' then
        missed <= lane_missed;
      else
        missed <= wants;
      end if;

      lane_missing <= to_logic((known = NO_LANE and drops /= NO_LANE) or
                               (quiet = REST and (again = '1' or wants = ALL_LANES)));

      if valid /= (PLACES - 1 downto 0 => '0') then
        quiet <= 0;
      elsif quiet /= REST then
        quiet <= quiet + 1;
      end if;
    end if;

  end process tell_missing;

  -- Simulation stops if a lane was not low in front of a burst, which would look like a part of the burst before.
  watch_bursts : process (clk) is

    variable before : std_logic_vector(LANES - 1 downto 0) := (others => '0');

  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      assert (lane_sync and (before or not lane_valid)) = NO_LANE or is_x(lane_sync & lane_valid)
        report "lane_merge: a lane has a sync in the midst of a burst or in none"
        severity failure;
      before := lane_valid;
    end if;

  -- synthesis translate_on

  end process watch_bursts;

end architecture rtl;
