-- SPDX-License-Identifier: Apache-2.0
-- Writes a list of registers into a sensor over I2C, as the only master of its lines.
--
-- A register has an address of 16 bits and a value of 8 or 16, as is usual for sensors with CSI-2; each is written by a
-- transfer of its own. Before the first transfer, and after a failed one, nine clocks and a stop free a data line that
-- the sensor still holds. A failed transfer is repeated after RETRY_PAUSE milliseconds, up to RETRIES times, because a
-- sensor that starts does not answer; then the list ends with a fault. The sensor may stretch the clock for up to
-- STRETCH clocks.
--
-- A sensor that is reset by a register may not acknowledge its value any more. A reset has a pause behind it, so in
-- front of a pause a value that is not acknowledged counts as written; the next entry is repeated until the sensor
-- answers.
--
-- Latency: 48 bits of 4 * QUARTER clocks to the first register.
-- Throughput: a register in 38 or 47 bits; a bit takes 4 * QUARTER clocks and the time that the clock line takes to
-- rise and to be seen.
-- Equation: the n-th transfer writes the n-th entry of REGISTERS.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.hex_pkg.all;
use work.i2c_pkg.all;
use work.math_pkg.all;
use work.setup_list_pkg.all;

entity sensor_setup is
  generic (
    -- The list: for each register hexadecimal digits, four of its address and two or four of its value; blanks between
    -- registers, such as "010001 302a0005". Address ffff with two digits is a pause of that many milliseconds.
    REGISTERS : string;
    -- Address of the sensor.
    DEVICE : std_logic_vector(6 downto 0) := "0010000";
    -- Clocks in a quarter of a bit. 500 gives 50 kHz with clk at 100 MHz, which keeps the times of I2C's standard mode.
    -- Levels that last for less than a fiftieth of a quarter count as spikes.
    QUARTER : positive range 3 to 65535 := 500;
    -- Clocks that the clock line may stay low after it was released.
    STRETCH : positive := 3000000;
    -- Clocks in a millisecond.
    MILLISECOND : positive := 100000;
    -- How often a transfer is repeated, and the milliseconds in between.
    RETRIES     : natural range 0 to 15  := 9;
    RETRY_PAUSE : natural range 0 to 255 := 10
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The levels of the lines at the pins; and '1' to pull them low (open drain).
    scl     : in    std_logic;
    sda     : in    std_logic;
    scl_low : out   std_logic;
    sda_low : out   std_logic;
    -- start: begins the list, high for one clock while busy is low.
    start : in    std_logic;
    busy  : out   std_logic;
    -- All registers are written; stays high until the next start.
    done : out   std_logic := '0';
    -- Why the last failed transfer failed, even if a repetition succeeded: "00" none failed, "01" a line stayed low,
    -- "10" the sensor did not acknowledge, "11" the data line had another level than was sent.
    fault : out   std_logic_vector(1 downto 0) := "00";
    -- With done and busy low: the entry, from 0, at which the list ended. retried: transfers that were repeated, up to
    -- 255.
    entry   : out   std_logic_vector(11 downto 0);
    retried : out   std_logic_vector(7 downto 0)
  );
end entity sensor_setup;

architecture rtl of sensor_setup is

  constant COUNT : positive := entry_count(REGISTERS);

  constant LINE_LOW  : std_logic_vector(1 downto 0) := "01";
  constant REFUSED   : std_logic_vector(1 downto 0) := "10";
  constant DISTURBED : std_logic_vector(1 downto 0) := "11";

  constant WHOLE : boolean := takes(is_list(REGISTERS) and COUNT < 4096,
                                    "sensor_setup: REGISTERS is not 1 to 4095 times six or eight digits (0 to f)");

  constant ENTRIES : entries_t(0 to COUNT - 1) := entries_of(REGISTERS, COUNT);

  -- The order that is under way. Nothing is on the lines in idle, fetch, choose_entry, pause, rest (before a
  -- repetition). free, free_stop: nine ones and a stop. open_transfer: a start; send: four or five bytes;
  -- close_transfer: a stop.
  type step_t is (idle, fetch, choose_entry, pause, rest, free, free_stop, open_transfer, send, close_transfer);

  signal step   : step_t := idle;
  signal order  : i2c_order_t;
  signal result : i2c_result_t;
  -- Bytes of the transfer that are over.
  signal bytes : natural range 0 to 4 := 0;
  -- The entry's number and content; how often it was tried; whether the transfer has failed; repetitions in the whole
  -- list.
  signal number  : natural range 0 to 4095 := 0;
  signal now     : entry_t                 := (others => '0');
  signal tries   : natural range 0 to 15   := 0;
  signal wrong   : std_logic               := '0';
  signal repeats : unsigned(7 downto 0)    := (others => '0');
  -- Clocks of the millisecond, and milliseconds that are left of a pause.
  signal ticks        : natural range 0 to MILLISECOND := 0;
  signal milliseconds : unsigned(7 downto 0)           := (others => '0');

  -- refuses: the sensor does not acknowledge the byte that is over; last: no byte follows it.
  signal refuses : std_logic;
  signal last    : std_logic;
  -- ends: a transfer has ended, or the lines are free; fails: it has failed.
  signal ends  : std_logic;
  signal fails : std_logic;
  -- The entry of the list is done.
  signal entry_over : std_logic;

begin

  master : entity work.i2c_master
    generic map (
      QUARTER => QUARTER,
      STRETCH => STRETCH
    )
    port map (
      clk     => clk,
      reset   => reset,
      scl     => scl,
      sda     => sda,
      scl_low => scl_low,
      sda_low => sda_low,
      order   => order,
      result  => result
    );

  busy    <= to_logic(step /= idle);
  entry   <= std_logic_vector(to_unsigned(number, 12));
  retried <= std_logic_vector(repeats);

  order.start   <= to_logic(step = open_transfer);
  order.stop    <= to_logic(step = free_stop or step = close_transfer);
  order.send    <= to_logic(step = send);
  order.receive <= to_logic(step = free);
  order.more    <= '0';

  with bytes select order.value <=
    DEVICE & '0' when 0,
    now(31 downto 24) when 1,
    now(23 downto 16) when 2,
    now(15 downto 8) when 3,
    now(7 downto 0) when others;

  -- A value that may have reset the sensor needs no acknowledgement.
  refuses <= result.bits(0) and to_logic(now(BEFORE_PAUSE) = '0' or bytes < 3);
  last    <= to_logic(bytes = 4 or (bytes = 3 and now(WIDE) = '0'));
  ends    <= result.over and to_logic(step = free_stop or step = close_transfer);
  -- A data line that is low behind a stop is held by the sensor: the transfer has failed even if all bits were right.
  fails <= result.stuck or (ends and (wrong or not result.level));

  follow_bytes : process (clk) is
  begin

    if rising_edge(clk) then
      if step /= send and step /= close_transfer then
        bytes <= 0;
        wrong <= '0';
      elsif step = send and result.over = '1' then
        if last = '0' then
          bytes <= bytes + 1;
        end if;
        if result.disturbed = '1' then
          wrong <= '1';
          fault <= DISTURBED;
        elsif refuses = '1' then
          wrong <= '1';
          fault <= REFUSED;
        end if;
      end if;
      -- A line that stays low causes all other failures, so it is the one reported.
      if result.stuck = '1' or (ends = '1' and result.level = '0') then
        fault <= LINE_LOW;
      end if;
      if start = '1' and step = idle then
        fault <= "00";
      end if;
    end if;

  end process follow_bytes;

  -- Sensors need a pause behind their reset; the pause is an entry of the list like a register.
  count_pauses_and_repeats : process (clk) is
  begin

    if rising_edge(clk) then
      -- A register comes out of the list a clock behind its number; step fetch is that clock. mod keeps the index
      -- within the list even behind its end.
      now <= ENTRIES(number mod COUNT);
      if step = choose_entry then
        milliseconds <= unsigned(now(15 downto 8));
        ticks        <= 0;
      elsif fails = '1' then
        milliseconds <= to_unsigned(RETRY_PAUSE, 8);
        ticks        <= 0;
      elsif ticks = MILLISECOND - 1 then
        -- The counter runs at all times; only a pause, whose entry has set it, reads it.
        ticks        <= 0;
        milliseconds <= milliseconds - 1;
      else
        ticks <= ticks + 1;
      end if;
      if start = '1' and step = idle then
        repeats <= (others => '0');
      elsif fails = '1' and tries /= RETRIES and repeats /= 255 then
        -- Only repetitions are counted, so the last failure is not.
        repeats <= repeats + 1;
      end if;
    end if;

  end process count_pauses_and_repeats;

  -- A pause is over when its milliseconds have passed; an entry of 0 milliseconds is no pause.
  entry_over <= to_logic(milliseconds = 0) when step = pause else
                ends;

  follow_steps : process (clk) is
  begin

    if rising_edge(clk) then

      case step is

        when idle =>

          if start = '1' then
            step   <= free;
            done   <= '0';
            number <= 0;
            tries  <= 0;
          end if;

        when free =>

          -- Nine clocks: a sensor that holds the data line in the middle of a byte shifts the rest of the byte out.
          if result.over = '1' then
            step <= free_stop;
          end if;

        when free_stop =>

          if ends = '1' then
            step <= fetch;
          end if;

        when fetch =>

          step <= choose_entry;

        when choose_entry =>

          if is_pause(now) = '1' then
            step <= pause;
          else
            step <= open_transfer;
          end if;

        when rest =>

          -- The sensor does not answer while it starts or resets itself.
          if milliseconds = 0 then
            step <= free;
          end if;

        when open_transfer =>

          if result.over = '1' then
            step <= send;
          end if;

        when send =>

          if (result.over and (last or result.disturbed or refuses)) = '1' then
            step <= close_transfer;
          end if;

        when pause | close_transfer =>

          if entry_over = '1' then
            tries <= 0;
            step  <= idle;
            if number = COUNT - 1 then
              done <= '1';
            else
              number <= number + 1;
              step   <= fetch;
            end if;
          end if;

      end case;

      -- This overrides the step's decision: the same entry again, behind a rest and freeing clocks, or the end of the
      -- list.
      if fails = '1' then
        done   <= '0';
        number <= number;
        if tries = RETRIES then
          step <= idle;
        else
          tries <= tries + 1;
          step  <= rest;
        end if;
      end if;

      if reset = '1' then
        step <= idle;
        done <= '0';
      end if;
    end if;

  end process follow_steps;

  -- Simulation stops at a start while busy, which has no effect.
  watch_starts : process (clk) is
  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      assert not (reset = '0' and start = '1' and step /= idle)
        report "sensor_setup: start came while busy"
        severity failure;
    end if;

  -- synthesis translate_on

  end process watch_starts;

end architecture rtl;
