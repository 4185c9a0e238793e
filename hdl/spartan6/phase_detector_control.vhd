-- SPDX-License-Identifier: Apache-2.0
-- Keeps the sampling instant of one channel in the middle of its bits.
--
-- The input has two delay lines: behind the master's line the bits are sampled, behind the slave's, which is half a bit
-- longer, their edges. The phase detector between them says whether edges come early or late; this control filters that
-- and moves both delays by one tap. First both delay lines are calibrated, one after the other so that the answer of
-- each is seen, and reset. Then the slave is calibrated again and again, because temperature moves the half bit, and
-- each calibration allows one step (XAPP1064, UG381). A calibration is ordered for one clock, with no delay line busy
-- and no step in the QUIET clocks before.
--
-- A delay line that does not answer within TIMEOUT clocks is reset and calibrated again, so that no wait is endless.
--
-- Latency: FILTER edges from a deviation to a step. Throughput: one step every INTERVAL clocks.
-- Equation: the delay moves by +1 or -1 when a counter, which goes up with each late edge and down with each early one,
-- has moved by FILTER.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity phase_detector_control is
  generic (
    -- Edges by which one direction must lead for a step.
    FILTER : positive := 16;
    -- Clocks between two calibrations of the slave; clocks at their end in which no step is made.
    INTERVAL : positive := 256;
    QUIET    : positive := 16;
    -- Clocks to wait for a delay line.
    TIMEOUT : positive := 1023
  );
  port (
    -- Clock of the deserialiser's words.
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A delay line is being calibrated.
    busy : in    std_logic;
    -- Phase detector: there was an edge, and the delay should grow.
    valid    : in    std_logic;
    increase : in    std_logic;
    -- To the delay lines, each high for one clock: calibrate; reset the delay; step, and its direction.
    calibrate_master : out   std_logic;
    calibrate_slave  : out   std_logic;
    delay_reset      : out   std_logic;
    step             : out   std_logic;
    step_up          : out   std_logic;
    -- Calibrated, and no delay line has hung since.
    tracking : out   std_logic;
    -- Steps up less steps down since the delays were reset, two's complement, at most 127 either way.
    taps : out   std_logic_vector(7 downto 0);
    -- Each change: a delay line did not answer and was reset. No reset changes it.
    hung_toggle : out   std_logic
  );
end entity phase_detector_control;

architecture rtl of phase_detector_control is

  constant FARTHEST : positive := 127;

  -- settle: before the first calibration of each line; begun, calibrating: until BUSY has come and gone; restart: the
  -- delays are reset; track: follow the edges.
  type state_t is (settle, begun, calibrating, restart, track);

  signal state  : state_t                    := settle;
  signal clocks : natural range 0 to TIMEOUT := 0;
  -- Edges that came late less those that came early. The delay moves when one side leads by FILTER, so that noise does
  -- not move it.
  signal balance  : integer range -FILTER to FILTER := 0;
  signal may_step : std_logic                       := '0';
  -- busy_now: BUSY of the delay lines; master_done: the master has been calibrated.
  signal busy_now    : std_logic := '1';
  signal master_done : std_logic := '0';
  signal tracks      : std_logic := '0';
  -- Steps since the delays were reset, for the status line.
  signal position : integer range -FARTHEST to FARTHEST := 0;
  signal hung     : std_logic                           := '0';

  -- follows: edges are counted, far enough before the next calibration; steps: the balance is large enough for a step.
  signal follows : std_logic;
  signal steps   : std_logic;

begin

  tracking    <= tracks;
  taps        <= std_logic_vector(to_signed(position, 8));
  hung_toggle <= hung;

  -- No step is made in the QUIET clocks before a calibration, because a delay line that moves must not be calibrated.
  follows <= to_logic(state = track and clocks < INTERVAL - QUIET);
  steps   <= follows and may_step and to_logic(balance = FILTER or balance = -FILTER);

  control : process (clk) is
  begin

    if rising_edge(clk) then
      busy_now <= busy;
      -- Orders last one clock; the delay lines answer with BUSY.
      calibrate_master <= '0';
      calibrate_slave  <= '0';
      delay_reset      <= '0';
      if clocks /= TIMEOUT then
        clocks <= clocks + 1;
      end if;

      case state is

        when settle =>

          -- BUSY comes some clocks behind an order, so some clocks pass before each order.
          if clocks >= 2 * QUIET and busy_now = '0' then
            calibrate_master <= not master_done;
            calibrate_slave  <= master_done;
            state            <= begun;
            clocks           <= 0;
          end if;

        when begun =>

          if busy_now = '1' then
            state  <= calibrating;
            clocks <= 0;
          end if;

        when calibrating =>

          if busy_now = '0' then
            state       <= track;
            clocks      <= 0;
            master_done <= '1';
            -- Master first, then slave: later only the slave's line is calibrated.
            if master_done = '0' then
              state <= settle;
            elsif tracks = '0' then
              -- Only the first time: later calibrations of the slave keep the delays.
              delay_reset <= '1';
              state       <= restart;
            end if;
          end if;

        when restart =>

          if clocks >= QUIET and busy_now = '0' then
            state  <= track;
            tracks <= '1';
            clocks <= 0;
          end if;

        when track =>

          -- Calibrated again and again, because a delay line drifts with temperature and voltage; only the slave,
          -- because the master carries the data.
          if clocks >= INTERVAL and busy_now = '0' then
            calibrate_slave <= '1';
            state           <= begun;
            clocks          <= 0;
          end if;

      end case;

      -- A delay line that hangs stays busy for ever; a reset frees it, and everything starts again.
      if clocks = TIMEOUT then
        delay_reset <= '1';
        hung        <= not hung;
        tracks      <= '0';
        master_done <= '0';
        state       <= settle;
        clocks      <= 0;
      end if;

      if reset = '1' then
        state       <= settle;
        clocks      <= 0;
        delay_reset <= '0';
        tracks      <= '0';
        master_done <= '0';
      end if;
    end if;

  end process control;

  filter_edges : process (clk) is
  begin

    -- Registered, so that an order and its direction leave together.
    if rising_edge(clk) then
      step <= steps;
      if steps = '1' then
        step_up <= to_logic(balance > 0);
        -- One step for each calibration: the next step waits until the half bit has been measured again.
        may_step <= '0';
        -- The position is counted, because the delay line does not report it.
        if balance > 0 and position /= FARTHEST then
          position <= position + 1;
        elsif balance < 0 and position /= -FARTHEST then
          position <= position - 1;
        end if;
      elsif follows = '1' and valid = '1' then
        -- The balance stops at its ends and waits there until a step is allowed.
        if increase = '1' and balance /= FILTER then
          balance <= balance + 1;
        elsif increase = '0' and balance /= -FILTER then
          balance <= balance - 1;
        end if;
      end if;

      -- Edges counted before a calibration say nothing about the delay behind it.
      if state = calibrating then
        balance  <= 0;
        may_step <= tracks;
      end if;
      if state = settle then
        position <= 0;
      end if;
    end if;

  end process filter_edges;

end architecture rtl;
