-- SPDX-License-Identifier: Apache-2.0
-- Starts the clocks of the video path in the right order, and again after any loss.
--
-- The order, from the measured TMDS clock or (for the test pattern) from the board's own: choose the source; set both
-- PLLs for its range; release the receiver's PLL; when that has locked, the transmitter's PLL; when that has locked,
-- the logic. A source that changes, a clock out of range and a lost lock lead back to the beginning. Each wait ends
-- after TIMEOUT clocks, which is counted. A TMDS clock without data leads back too, so that a PLL or a delay line that
-- started wrongly gets another chance.
--
-- A TMDS clock is accepted when STEADY measurements in a row were in range and each differed from the one before by at
-- most one count, so an open input, which may oscillate, starts nothing. The fastest accepted clock is that of the
-- timing constraints.
--
-- The setting is kept while the clock is in its range: 25 to 50 MHz (low) and 40 MHz and more (high) overlap, so a
-- clock in the overlap does not switch back and forth.
--
-- Latency: STEADY + 1 measurements and the lock times of the PLLs.
-- Equation: run = clock steady and in range, and all PLLs behind it locked.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.hdmi_pkg.all;
use work.math_pkg.all;

entity link_supervisor is
  generic (
    -- Counts of clock_meter for 10 MHz.
    COUNTS_10_MHZ : positive := 100;
    -- Clocks to wait for a lock; clocks for which the PLLs are held in reset before, more than 15.
    TIMEOUT : positive := 1000000;
    HOLD    : positive := 20000;
    -- Measurements without data after which a running link is restarted.
    PATIENCE : positive := 625;
    -- Slowest and fastest TMDS clock in units of 100 kHz.
    SLOWEST : positive := 240;
    FASTEST : positive := 743
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The board's own clock is wanted.
    want_own : in    std_logic;
    -- The TMDS clock as measured by clock_meter.
    rate         : in    unsigned(11 downto 0);
    rate_updated : in    std_logic;
    -- State of the clocks, and orders to them.
    clocks : in    clocks_state_t;
    order  : out   clocks_order_t;
    -- Every channel of the receiver samples well and finds words.
    data : in    std_logic;
    -- High for one clock: the link ran and is stopped again, though the choice of the clock is the same.
    restarted : out   std_logic;
    -- High for one clock: a PLL did not lock in time and was given up.
    lock_failed : out   std_logic;
    -- There is a steady TMDS clock in range.
    present : out   std_logic
  );
end entity link_supervisor;

architecture rtl of link_supervisor is

  -- Measurements of a TMDS clock that must agree.
  constant STEADY : positive range 2 to 15 := 4;

  -- The limits allow for the measuring error of one count, and at the fast end for half a percent of tolerance of the
  -- source.
  constant LOW_SLOWEST  : natural := (COUNTS_10_MHZ * SLOWEST) / 100;
  constant LOW_FASTEST  : natural := (COUNTS_10_MHZ * 50) / 10;
  constant HIGH_SLOWEST : natural := (COUNTS_10_MHZ * 40) / 10;
  constant HIGH_FASTEST : natural := (COUNTS_10_MHZ * FASTEST) / 100 + (COUNTS_10_MHZ * FASTEST) / 20000 + 1;
  -- Above this rate a new clock gets the high setting.
  constant MIDDLE : natural := (COUNTS_10_MHZ * 45) / 10;

  type state_t is (quiet, choose, write_setting, lock_receive, lock_transmit, running);

  signal state : state_t := quiet;
  -- Clocks that a state has lasted, up to TIMEOUT.
  signal waited : natural range 0 to TIMEOUT := 0;
  -- The chosen source and the setting in effect.
  signal own      : std_logic := '0';
  signal high_now : std_logic := '0';
  -- The measurement before; measurements in a row that agree. From the last measurement: in_range: enough agree; fits:
  -- the rate fits the setting in effect; want_high: the setting that a new clock of this rate would get.
  signal last      : unsigned(11 downto 0)     := (others => '0');
  signal agree     : natural range 1 to STEADY := 1;
  signal in_range  : std_logic                 := '0';
  signal fits      : std_logic                 := '0';
  signal want_high : std_logic                 := '0';
  -- The chosen clock runs.
  signal source_ok : std_logic;
  -- Measurements in a row without data.
  signal lacking : natural range 0 to PATIENCE := 0;

  -- PLLs are in reset from configuration on.
  signal receive_reset_now  : std_logic := '1';
  signal transmit_reset_now : std_logic := '1';

begin

  order.use_own        <= own;
  order.high           <= high_now;
  order.receive_reset  <= receive_reset_now;
  order.transmit_reset <= transmit_reset_now;
  present              <= in_range;

  source_ok <= clocks.own_ready when own = '1' else
               in_range and fits;

  judge : process (clk) is
  begin

    if rising_edge(clk) then
      if rate_updated = '1' then
        last      <= rate;
        agree     <= 1;
        in_range  <= '0';
        want_high <= '0';
        fits      <= '0';
        -- The rate is in range, so adding 1 cannot overflow.
        if rate >= LOW_SLOWEST and rate <= HIGH_FASTEST and rate <= last + 1 and last <= rate + 1 then
          if agree >= STEADY - 1 then
            agree    <= STEADY;
            in_range <= '1';
          else
            agree <= agree + 1;
          end if;
        end if;
        if rate > MIDDLE then
          want_high <= '1';
        end if;
        if (high_now = '1' and rate >= HIGH_SLOWEST) or (high_now = '0' and rate <= LOW_FASTEST) then
          fits <= '1';
        end if;
      end if;
      if state = choose then
        -- The setting is about to be chosen for this rate.
        fits <= '1';
      end if;
      if reset = '1' then
        agree    <= 1;
        in_range <= '0';
      end if;
    end if;

  end process judge;

  -- A source that went to sleep may leave its clock on: every PLL locks and no picture comes. A PLL or a delay line
  -- that started wrongly looks the same. A restart every PATIENCE measurements costs nothing in the first case and
  -- cures the second.
  count_lacking : process (clk) is
  begin

    if rising_edge(clk) then
      if state = lock_transmit or (state = running and (data = '1' or own = '1')) then
        lacking <= 0;
      elsif state = running and rate_updated = '1' then
        lacking <= lacking + 1;
      end if;
    end if;

  end process count_lacking;

  -- A lost source, or another choice, ends every state alike, except quiet and choose, where nothing can be lost. In
  -- choose the wait has no limit, because without a source nothing else can be done. In write_setting `configured`
  -- takes up to three clocks to fall behind the order; until then it belongs to the last setting.
  bring_up : process (clk) is

    variable give_up : boolean;

  begin

    if rising_edge(clk) then
      give_up         := waited = TIMEOUT;
      order.configure <= '0';
      restarted       <= '0';
      lock_failed     <= '0';
      if waited /= TIMEOUT then
        waited <= waited + 1;
      end if;

      case state is

        when quiet =>

          -- The resets get HOLD clocks to reach everything that still runs from the old clock. Only then is the source
          -- switched, because a PLL whose input jumps may leave its range.
          order.run          <= '0';
          receive_reset_now  <= '1';
          transmit_reset_now <= '1';
          if waited >= HOLD then
            own    <= want_own;
            state  <= choose;
            waited <= 0;
          end if;

        when choose =>

          waited <= 0;
          if own /= want_own then
            state <= quiet;
          elsif (own = '1' and clocks.own_ready = '1') or (own = '0' and in_range = '1') then
            high_now        <= want_high and not own;
            order.configure <= '1';
            state           <= write_setting;
          end if;

        when write_setting =>

          if clocks.configured = '1' and waited >= 3 then
            receive_reset_now <= '0';
            state             <= lock_receive;
            waited            <= 0;
          end if;

        when lock_receive =>

          if clocks.receive_locked = '1' then
            transmit_reset_now <= '0';
            state              <= lock_transmit;
            waited             <= 0;
          end if;

        when lock_transmit =>

          if clocks.transmit_locked = '1' then
            state <= running;
          end if;

        when running =>

          order.run <= '1';
          waited    <= 0;
          give_up   := clocks.receive_locked = '0' or clocks.transmit_locked = '0' or lacking = PATIENCE;

      end case;

      if state /= quiet and state /= choose and (source_ok = '0' or own /= want_own) then
        give_up := true;
      end if;
      if give_up then
        order.run <= '0';
        state     <= quiet;
        waited    <= 0;
        if state = running and own = want_own then
          restarted <= '1';
        end if;
        if state = lock_receive or state = lock_transmit then
          -- A wait that ends by itself is a PLL that did not lock; a wait that the source ended is not counted.
          lock_failed <= to_logic(waited = TIMEOUT);
        end if;
      end if;

      if reset = '1' then
        state              <= quiet;
        waited             <= 0;
        order.run          <= '0';
        receive_reset_now  <= '1';
        transmit_reset_now <= '1';
      end if;
    end if;

  end process bring_up;

end architecture rtl;
