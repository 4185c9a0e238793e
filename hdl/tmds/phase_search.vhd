-- SPDX-License-Identifier: Apache-2.0
-- Finds the delay at which the bits of a channel are sampled in their middle, and watches it.
--
-- All delays are tried, STEP_TAPS taps apart. Where one bit ends and the next begins, the bits of a word move by one
-- place; where sampling is uncertain, no run of equal control tokens arrives. The longest interval of delays with runs
-- at one place is therefore one bit (or as much of it as the delay line covers), and its middle is used.
--
-- A control token is recognised without knowing word boundaries: read around a circle its ten bits change eight times,
-- and the two places without a change, which are neighbours or next but one, show where it begins. Data words change
-- less often, and bits of two words do not repeat.
--
-- A new search begins when a run is found at another place later (the delay has slipped, or the lock was lost), when
-- none is found for TIMEOUT clocks (no signal), or after ERROR_LIMIT wrong words (words that no encoder sends): the
-- middle of the bit has then drifted, for example with temperature, although runs of tokens still arrive. If that
-- search does not help, wrong words count again only after ERROR_WINDOW clocks. Between searches the delay does not
-- move. A search that found nothing at its first delay is repeated before it counts, because the signal may have
-- appeared during the search.
--
-- Latency: for each tried delay RUNS runs of tokens, or TIMEOUT clocks without one. Throughput: one word each clock.
-- Equation: taps = middle of the longest interval of delays with one place of the tokens.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity phase_search is
  generic (
    -- Taps of the delay line; taps between two tried ones.
    TAPS_THERE : positive range 2 to 128 := 128;
    STEP_TAPS  : positive range 1 to 16  := 4;
    -- Clocks without a run after which the tap has none; more than a line's active pixels.
    TIMEOUT : positive := 8192;
    -- Wrong words within ERROR_WINDOW clocks that begin a new search, once in that time; the default is 1.3 s at 50
    -- MHz.
    ERROR_LIMIT  : positive                     := 1000;
    ERROR_WINDOW : positive range 2 to 67108864 := 67108864
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Ten bits of the channel; bit 0 came first.
    bits : in    std_logic_vector(9 downto 0);
    -- A recent word of the channel was one that no encoder sends.
    wrong : in    std_logic;
    -- To the delay line: load_n low sets it to its first tap; each clock of move, which has a falling edge of its own,
    -- moves it up by one tap.
    load_n : out   std_logic;
    move   : out   std_logic;
    -- A delay was found, and no fault has been seen since.
    tracking : out   std_logic;
    -- The tap in use.
    taps : out   std_logic_vector(7 downto 0);
    -- Each change: the delay that had been found was given up. No reset changes it.
    hung_toggle : out   std_logic
  );
end entity phase_search;

architecture rtl of phase_search is

  -- Equal control tokens behind a first one that count as a run; runs that must be seen.
  constant RUN  : positive range 2 to 15 := 4;
  constant RUNS : positive range 1 to 15 := 2;
  -- Clocks until the words belong to a new delay.
  constant SETTLE : positive range 4 to 63 := 16;

  subtype place_t is natural range 0 to 9;

  subtype tap_t is natural range 0 to TAPS_THERE - 1;

  -- load: to the first tap; go: up to the wanted tap; settled: wait until the words belong to this tap; look: for runs;
  -- decide: the last tap has been tried; follow: the search is over.
  type state_t is (load, go, settled, look, decide, follow);

  -- The state, the clocks that it has lasted, and the runs seen at this tap.
  signal state  : state_t                    := load;
  signal clocks : natural range 0 to TIMEOUT := 0;
  signal seen   : natural range 0 to RUNS    := 0;
  -- Where the delay stands, and where it is to go: it moves one tap at a time.
  signal tap      : tap_t     := 0;
  signal wanted   : tap_t     := 0;
  signal at_best  : std_logic := '0';
  signal move_now : std_logic := '0';
  signal tracks   : std_logic := '0';
  signal hung     : std_logic := '0';

  -- from_start: a run was seen at the first tap; once_more: the search before this one found something.
  signal from_start : std_logic := '0';
  signal once_more  : std_logic := '0';

  -- The interval that continues at this tap, and the longest interval so far.
  signal in_run      : std_logic                     := '0';
  signal begun       : tap_t                         := 0;
  signal place       : place_t                       := 0;
  signal best_begun  : tap_t                         := 0;
  signal best_length : natural range 0 to TAPS_THERE := 0;
  signal best_place  : place_t                       := 0;

  -- Detection of runs of tokens.
  signal changes     : std_logic_vector(9 downto 0) := (others => '0');
  signal word        : std_logic_vector(9 downto 0) := (others => '0');
  signal former      : std_logic_vector(9 downto 0) := (others => '0');
  signal token       : std_logic                    := '0';
  signal token_place : place_t                      := 0;
  signal run_place   : place_t                      := 0;
  signal run_length  : natural range 0 to RUN       := 0;
  signal run_now     : std_logic                    := '0';

  -- Wrong words of this window; its clocks; armed: no search was begun for them in it.
  signal errors   : natural range 0 to ERROR_LIMIT      := 0;
  signal watched  : natural range 0 to ERROR_WINDOW - 1 := 0;
  signal armed    : std_logic                           := '1';
  signal too_many : std_logic;

  -- At this tap: no run came; a run continues the interval; it begins another; enough was seen. lost: the delay in use
  -- is lost.
  signal silent    : std_logic;
  signal goes_on   : std_logic;
  signal breaks    : std_logic;
  signal look_ends : std_logic;
  signal lost      : std_logic;

begin

  tracking    <= tracks;
  taps        <= std_logic_vector(to_unsigned(tap, 8));
  hung_toggle <= hung;
  move        <= move_now;

  silent    <= to_logic(clocks = TIMEOUT);
  goes_on   <= to_logic(state = look and in_run = '1' and run_place = place) and run_now and not silent;
  breaks    <= to_logic(state = look and (in_run = '0' or run_place /= place)) and run_now and not silent;
  look_ends <= (to_logic(state = look) and silent) or (goes_on and to_logic(seen = RUNS - 1)) or
               (breaks and to_logic(seen /= 0));
  too_many  <= armed and to_logic(errors = ERROR_LIMIT);
  lost      <= to_logic(state = follow) and (silent or too_many or (run_now and to_logic(run_place /= best_place)));

  -- Runs are detected at all times; the state of the search decides what they mean.
  find_runs : process (clk) is

    variable still : natural range 0 to 10;
    variable lies  : boolean;
    variable found : place_t;

  begin

    if rising_edge(clk) then
      word <= bits;
      -- Whether a bit differs from the one behind it; the last bit is compared with the first, around a circle.
      changes <= bits xor (bits(0) & bits(9 downto 1));

      still := 0;
      lies  := false;
      found := 0;

      for p in 0 to 9 loop

        if changes(p) = '0' then
          still := still + 1;
          -- Whether the place without a change has another one before it, the neighbour or the one before that: a token
          -- has two such places.
          if changes((p + 9) mod 10) = '0' or changes((p + 8) mod 10) = '0' then
            lies  := true;
            found := p;
          end if;
        end if;

      end loop;

      token       <= '0';
      token_place <= found;
      -- The word itself is compared too: control tokens repeat for the length of a blanking, data words do not.
      former <= word;
      if still = 2 and lies then
        token <= '1';
      end if;

      run_now <= '0';
      if token = '0' or former /= word then
        run_length <= 0;
      elsif run_length /= RUN - 1 then
        -- The count starts again behind each run, so a long blanking gives many.
        run_length <= run_length + 1;
      else
        run_length <= 0;
        run_now    <= '1';
        run_place  <= token_place;
      end if;
    end if;

  end process find_runs;

  count_errors : process (clk) is
  begin

    if rising_edge(clk) then
      -- Only words of a delay in use count; during a search words are wrong by nature.
      if wrong = '1' and state = follow and errors /= ERROR_LIMIT then
        errors <= errors + 1;
      end if;
      if too_many = '1' then
        armed <= '0';
      end if;
      -- Windows follow each other without a gap. A new window allows a search again.
      if watched = ERROR_WINDOW - 1 then
        watched <= 0;
        errors  <= 0;
        armed   <= '1';
      else
        watched <= watched + 1;
      end if;
      if reset = '1' then
        watched <= 0;
        errors  <= 0;
        armed   <= '1';
      end if;
    end if;

  end process count_errors;

  search : process (clk) is
  begin

    if rising_edge(clk) then
      load_n <= '1';
      -- Each pulse is one tap: the delay line moves with its falling edge.
      move_now <= '0';
      if silent = '0' then
        clocks <= clocks + 1;
      end if;

      case state is

        when load =>

          -- Held low for SETTLE clocks, after which the delay line is at its first tap in any case.
          load_n <= '0';
          tap    <= 0;
          if clocks >= SETTLE then
            state <= go;
          end if;

        when go =>

          -- High for a clock, low for a clock, so that each tap has an edge of its own.
          if move_now = '1' then
            tap <= tap + 1;
          elsif tap /= wanted then
            move_now <= '1';
          else
            clocks <= 0;
            state  <= settled;
          end if;

        when settled =>

          if clocks >= SETTLE then
            clocks <= 0;
            state  <= look;
            if at_best = '1' then
              tracks <= '1';
              state  <= follow;
            end if;
          end if;

        when look =>

          if run_now = '1' or look_ends = '1' then
            clocks <= 0;
          end if;
          if look_ends = '1' and tap + STEP_TAPS < TAPS_THERE then
            wanted <= tap + STEP_TAPS;
            state  <= go;
          elsif look_ends = '1' then
            state <= decide;
          end if;

        when decide =>

          -- A clock behind the last tap, whose interval may be the longest.
          clocks    <= 0;
          state     <= load;
          wanted    <= 0;
          at_best   <= '0';
          once_more <= '0';
          -- Without a run at the first tap, some delays may have been tried before the signal appeared: the search is
          -- repeated, then it counts.
          if best_length /= 0 and (from_start = '1' or once_more = '1') then
            wanted  <= best_begun + best_length / 2;
            at_best <= '1';
          elsif best_length /= 0 then
            once_more <= '1';
          end if;

        when follow =>

          if run_now = '1' or lost = '1' then
            clocks <= 0;
          end if;
          if lost = '1' then
            hung    <= not hung;
            tracks  <= '0';
            state   <= load;
            wanted  <= 0;
            at_best <= '0';
          end if;

      end case;

      if reset = '1' then
        state     <= load;
        clocks    <= 0;
        wanted    <= 0;
        at_best   <= '0';
        tracks    <= '0';
        once_more <= '0';
      end if;
    end if;

  end process search;

  -- The interval that this tap belongs to, and the longest one so far.
  find_interval : process (clk) is
  begin

    if rising_edge(clk) then
      if state = settled then
        seen <= 0;
      elsif goes_on = '1' or breaks = '1' then
        seen  <= seen + 1;
        place <= run_place;
        if tap = 0 then
          from_start <= '1';
        end if;
      end if;

      -- The place has changed at this tap, or an interval begins.
      if breaks = '1' then
        -- Another bit begins at this tap, or, if both places occurred here, at the next one.
        begun  <= tap;
        in_run <= to_logic(seen = 0);
      elsif goes_on = '1' and seen = RUNS - 1 and tap - begun >= best_length then
        -- The tap is good when enough runs were at the interval's place; only then may it make the interval the
        -- longest.
        best_begun  <= begun;
        best_length <= tap - begun + 1;
        best_place  <= place;
      end if;
      -- A tap without runs ends the interval, because sampling is uncertain there.
      if (state = look and silent = '1') or state = decide or lost = '1' then
        in_run <= '0';
      end if;

      if state = load then
        from_start <= '0';
        -- At the final tap the longest interval stays as the place to follow.
        if at_best = '0' then
          best_length <= 0;
        end if;
      end if;

      if reset = '1' then
        in_run <= '0';
      end if;
    end if;

  end process find_interval;

end architecture rtl;
