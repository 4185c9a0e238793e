-- SPDX-License-Identifier: Apache-2.0
-- Aligns the bytes of a burst that arrive on several lanes, each lane late by its own number of clocks.
--
-- The last bytes of each lane are stored. At the clock at which the last lane has seen its sync, the place of each
-- lane's sync among its bytes shows by how much it is early; this holds for the burst. Nothing else of a burst is
-- remembered, so the next one begins anew, whatever happened to this one.
--
-- Latency: 2 clocks behind the last lane. Throughput: a byte of each lane each clock.
-- Equation: word(n) = the n-th bytes of all lanes behind their syncs, if these come within MAX_SKEW clocks.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity lane_merge is
  generic (
    LANES : positive range 1 to 4;
    -- Clocks that a lane may be behind another one.
    MAX_SKEW : natural range 0 to 7 := 3
  );
  port (
    clk : in    std_logic;
    -- Of each lane: high from a burst's first byte behind the sync sequence to its end; high with that first byte.
    lane_valid : in    std_logic_vector(LANES - 1 downto 0);
    lane_sync  : in    std_logic_vector(LANES - 1 downto 0);
    -- Bytes of all lanes, lane 0 in the low bits.
    lane_data : in    std_logic_vector(8 * LANES - 1 downto 0);
    -- A word of a burst, the first one; which lanes it has a byte of. Without the first lane's there is no word.
    word_first : out   std_logic;
    word_live  : out   std_logic_vector(LANES - 1 downto 0);
    word_data  : out   std_logic_vector(8 * LANES - 1 downto 0);
    -- A lane saw a sync, and not all others did within MAX_SKEW clocks.
    lane_missing : out   std_logic
  );
end entity lane_merge;

architecture rtl of lane_merge is

  -- Bytes that are kept of each lane, lane after lane, the newest first.
  constant DEPTH  : positive := MAX_SKEW + 1;
  constant PLACES : positive := LANES * DEPTH;

  type bytes_t is array (natural range 0 to PLACES - 1) of std_logic_vector(7 downto 0);

  type taps_t is array (natural range 0 to LANES - 1) of natural range 0 to MAX_SKEW;

  signal valid : std_logic_vector(PLACES - 1 downto 0) := (others => '0');
  signal sync  : std_logic_vector(PLACES - 1 downto 0) := (others => '0');
  signal bytes : bytes_t                               := (others => (others => '0'));
  -- All lanes are in step from this clock on.
  -- A lane has just seen its sync, and all others have it among their bytes: all lanes are in step
  -- from this clock on.
  signal starts : std_logic;
  -- How early each lane is: now, and in this burst.
  signal taps_now : taps_t;
  signal taps     : taps_t    := (others => 0);
  signal active   : std_logic := '0';

begin

  find_syncs : process (sync, taps) is

    variable newest : std_logic;
    variable all_in : std_logic;
    variable found  : std_logic;

  begin

    newest   := '0';
    all_in   := '1';
    taps_now <= taps;

    for i in 0 to LANES - 1 loop

      newest := newest or sync(i * DEPTH);
      found  := '0';

      -- From the oldest to the newest: if two syncs are among a lane's bytes, the newer one begins
      -- this burst.
      for d in DEPTH - 1 downto 0 loop

        if sync(i * DEPTH + d) = '1' then
          found       := '1';
          taps_now(i) <= d;
        end if;

      end loop;

      all_in := all_in and found;

    end loop;

    starts <= newest and all_in;

  end process find_syncs;

  keep_bytes : process (clk) is

    variable place   : natural range 0 to 31;
    variable missing : std_logic;
    variable live    : std_logic;

  begin

    if rising_edge(clk) then
      missing := '0';

      for i in 0 to LANES - 1 loop

        -- The first place of each lane takes the newest byte.
        valid(i * DEPTH) <= lane_valid(i);
        sync(i * DEPTH)  <= lane_valid(i) and lane_sync(i);
        bytes(i * DEPTH) <= lane_data(8 * i + 7 downto 8 * i);

        -- A sync counts for one burst: it is deleted from the places behind as soon as all lanes
        -- are in step.
        for d in 1 to DEPTH - 1 loop

          valid(i * DEPTH + d) <= valid(i * DEPTH + d - 1);
          sync(i * DEPTH + d)  <= sync(i * DEPTH + d - 1) and not starts;
          bytes(i * DEPTH + d) <= bytes(i * DEPTH + d - 1);

        end loop;

        -- A sync that falls out at the end was never met by the others'.
        missing := missing or (sync(i * DEPTH + DEPTH - 1) and not starts);

      end loop;

      lane_missing <= missing;

      -- With the first word the places just found hold already: those in the register are the last
      -- burst's.
      for i in 0 to LANES - 1 loop

        place := i * DEPTH;
        if starts = '1' then
          place   := place + taps_now(i);
          taps(i) <= taps_now(i);
        else
          place := place + taps(i);
        end if;

        -- Bytes of lanes that never were in step do not leave.
        live         := valid(place) and (starts or active);
        word_live(i) <= live;

        word_data(8 * i + 7 downto 8 * i) <= bytes(place);

        -- The burst lasts as long as the first lane's bytes do: every packet begins and ends with
        -- it, as bytes are dealt out from lane 0 on.
        if i = 0 then
          active <= live;
        end if;

      end loop;

      word_first <= starts;
    end if;

  end process keep_bytes;

end architecture rtl;
