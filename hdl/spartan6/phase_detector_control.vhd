-- Keeps the sampling instant of one channel in the middle of its bits.
--
-- The input has two delay lines: behind the master's the bits are sampled, behind the slave's, which
-- is half a bit longer, their edges. The phase detector between them says whether edges come early or late;
-- this control filters that and moves both delays by one tap. First both delay lines are calibrated
-- and reset, then the slave is calibrated again and again, as temperature moves the half bit, and
-- each calibration allows one step (XAPP1064, UG381).
--
-- A delay line that does not answer within TIMEOUT clocks is reset and calibrated anew: nothing waits
-- for ever.
--
-- Latency: FILTER edges from a deviation to a step. Throughput: one step for each INTERVAL clocks.
-- Equation: the delay moves by +1 or -1 when a counter that goes up with each late edge and down with
--   each early one has moved by FILTER.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity phase_detector_control is
  generic (
    -- Edges more in one direction than in the other that make a step.
    FILTER : positive := 16;
    -- Clocks between two calibrations of the slave.
    INTERVAL : positive := 256;
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
    -- To the delay lines: calibrate, reset the delay, step (each for a clock) and its direction.
    calibrate_master : out   std_logic;
    calibrate_slave  : out   std_logic;
    delay_reset      : out   std_logic;
    step             : out   std_logic;
    step_up          : out   std_logic;
    -- Calibrated once since the reset.
    tracking : out   std_logic
  );
end entity phase_detector_control;

architecture rtl of phase_detector_control is

  -- settle: after reset; first, first_done: calibrate both; restart: reset the delays;
  -- track: follow the edges; again, again_done: calibrate the slave.
  type state_t is (settle, first, first_done, restart, track, again, again_done);

  signal state    : state_t                         := settle;
  signal clocks   : natural range 0 to TIMEOUT      := 0;
  signal balance  : integer range -FILTER to FILTER := 0;
  signal may_step : std_logic                       := '0';
  signal busy_now : std_logic                       := '1';

begin

  control : process (clk) is
  begin

    if rising_edge(clk) then
      busy_now         <= busy;
      calibrate_master <= '0';
      calibrate_slave  <= '0';
      delay_reset      <= '0';
      step             <= '0';
      if clocks /= TIMEOUT then
        clocks <= clocks + 1;
      end if;

      case state is

        when settle =>

          if clocks >= 32 and busy_now = '0' then
            state  <= first;
            clocks <= 0;
          end if;

        when first =>

          calibrate_master <= '1';
          calibrate_slave  <= '1';
          if busy_now = '1' then
            state  <= first_done;
            clocks <= 0;
          end if;

        when first_done =>

          if busy_now = '0' then
            delay_reset <= '1';
            state       <= restart;
            clocks      <= 0;
          end if;

        when restart =>

          if clocks >= 8 and busy_now = '0' then
            state    <= track;
            tracking <= '1';
            clocks   <= 0;
          end if;

        when track =>

          if clocks = INTERVAL - 1 then
            state  <= again;
            clocks <= 0;
          end if;
          if may_step = '1' and (balance = FILTER or balance = -FILTER) then
            step     <= '1';
            step_up  <= '0';
            may_step <= '0';
            balance  <= 0;
            if balance > 0 then
              step_up <= '1';
            end if;
          elsif valid = '1' then
            if increase = '1' and balance /= FILTER then
              balance <= balance + 1;
            elsif increase = '0' and balance /= -FILTER then
              balance <= balance - 1;
            end if;
          end if;

        when again =>

          calibrate_slave <= '1';
          if busy_now = '1' then
            calibrate_slave <= '0';
            state           <= again_done;
            clocks          <= 0;
          end if;

        when again_done =>

          if busy_now = '0' then
            state    <= track;
            may_step <= '1';
            balance  <= 0;
            clocks   <= 0;
          end if;

      end case;

      if clocks = TIMEOUT then
        state  <= settle;
        clocks <= 0;
      end if;

      if reset = '1' then
        state    <= settle;
        clocks   <= 0;
        balance  <= 0;
        may_step <= '0';
        tracking <= '0';
      end if;
    end if;

  end process control;

end architecture rtl;
