-- SPDX-License-Identifier: Apache-2.0
-- Reads bytes from address 0 on from an I2C device, as the only master of its lines.
--
-- Nine clocks and a stop come first; they free a data line that a device still holds from an interrupted read. If a
-- device took the nine ones for a byte and now acknowledges it, the nine clocks come again. If a line stays low, or a
-- byte is not acknowledged, the read ends with a stop and both lines are released.
--
-- Latency: 51 bits of 4 * QUARTER clocks to the first byte.
-- Throughput: a byte in 9 bits; a bit takes 4 * QUARTER clocks and the time that the clock line takes to rise.
-- Equation: the n-th byte = device(n).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.i2c_pkg.all;
use work.math_pkg.all;

entity i2c_reader is
  generic (
    -- Address of the device.
    DEVICE : std_logic_vector(6 downto 0) := "1010000";
    -- Clocks in a quarter of a bit. 500 gives 50 kHz with clk at 100 MHz, which keeps the times of I2C's standard mode.
    -- Levels that last for less than a fiftieth of a quarter count as spikes.
    QUARTER : positive range 3 to 65535 := 500;
    -- Clocks that the clock line may stay low after it was released.
    STRETCH : positive := 3000000
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The levels of the lines at the pins; and '1' to pull them low (open drain).
    scl     : in    std_logic;
    sda     : in    std_logic;
    scl_low : out   std_logic;
    sda_low : out   std_logic;
    -- High for one clock while idle: begin to read.
    start : in    std_logic;
    -- next_byte: the next byte may be read. more: a further byte is wanted behind it. Both must be constant until it is
    -- read.
    next_byte : in    std_logic;
    more      : in    std_logic;
    -- High for one clock: a byte was read; the byte.
    valid : out   std_logic;
    data  : out   std_logic_vector(7 downto 0);
    -- High for one clock: the read has ended. With it: complete: all bytes came; stuck: a line stayed low.
    done     : out   std_logic;
    complete : out   std_logic;
    stuck    : out   std_logic
  );
end entity i2c_reader;

architecture rtl of i2c_reader is

  constant WRITE_TO  : std_logic_vector(7 downto 0) := DEVICE & '0';
  constant READ_FROM : std_logic_vector(7 downto 0) := DEVICE & '1';
  constant ADDRESS   : std_logic_vector(7 downto 0) := x"00";

  -- The order that is under way. free, free_stop: nine ones and a stop. write_start to write_address: a start and two
  -- bytes. read_start, read_device: a start and a byte. read_byte: bytes that are read. stop: a stop.
  type step_t is (
    idle, free, free_stop, write_start, write_device, write_address, read_start, read_device, read_byte, stop
  );

  signal step   : step_t    := idle;
  signal all_in : std_logic := '0';
  signal order  : i2c_order_t;
  signal result : i2c_result_t;

  -- begins: high for one clock, the read begins. answered: the byte that was sent was on the line, and behind it a zero
  -- as acknowledgement; anything else means another master, a short, or no device. held: the data line was low at all
  -- nine clocks and at the stop, because a device holds it permanently.
  signal begins   : std_logic;
  signal answered : std_logic;
  signal held     : std_logic;

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

  data     <= result.bits(8 downto 1);
  complete <= all_in;
  begins   <= to_logic(step = idle) and start;
  answered <= not (result.disturbed or result.bits(0));
  held     <= to_logic(unsigned(result.bits) = 0) and not result.level;

  order.start <= to_logic(step = write_start or step = read_start);
  order.stop  <= to_logic(step = free_stop or step = stop);
  order.send  <= to_logic(step = write_device or step = write_address or step = read_device);
  -- A byte begins only when the user asks for it; until then the clock line stays low, so that the device waits. Nine
  -- ones are a byte that is not acknowledged: a device that holds the data line shifts out the rest of its byte and
  -- then finds no acknowledgement.
  order.receive <= begins or to_logic(step = free) or (to_logic(step = read_byte) and next_byte);
  order.more    <= (to_logic(step = read_byte) and more) or (to_logic(step = free_stop) and not held);
  order.value   <= WRITE_TO when step = write_device else
                   ADDRESS when step = write_address else
                   READ_FROM;

  follow_steps : process (clk) is
  begin

    if rising_edge(clk) then
      valid <= '0';
      done  <= '0';

      if begins = '1' then
        all_in <= '0';
        stuck  <= '0';
        step   <= free;
      end if;
      if result.stuck = '1' then
        stuck <= '1';
        done  <= '1';
        step  <= idle;
      end if;

      if result.over = '1' then

        case step is

          when free =>

            step <= free_stop;

          when free_stop =>

            step <= write_start;
            -- Held for all ten bits: no clocks will free the line.
            if held = '1' then
              stuck <= '1';
              done  <= '1';
              step  <= idle;
            elsif result.level = '0' then
              -- Held now, but not before: the device acknowledges the ones as if they were a byte. The next nine clocks
              -- find it in another place.
              step <= free;
            end if;

          when write_start =>

            step <= write_device;

          when write_device =>

            step <= write_address;
            if answered = '0' then
              step <= stop;
            end if;

          when write_address =>

            step <= read_start;
            if answered = '0' then
              step <= stop;
            end if;

          when read_start =>

            step <= read_device;

          when read_device =>

            step <= read_byte;
            if answered = '0' then
              step <= stop;
            end if;

          when read_byte =>

            valid <= '1';
            if more = '0' then
              all_in <= '1';
              step   <= stop;
            end if;

          when stop | idle =>

            done <= '1';
            step <= idle;

        end case;

      end if;

      if reset = '1' then
        step  <= idle;
        done  <= '0';
        valid <= '0';
      end if;
    end if;

  end process follow_steps;

  -- Simulation stops at a start while a read is under way, which has no effect.
  watch_starts : process (clk) is
  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      assert not (reset = '0' and start = '1' and step /= idle)
        report "i2c_reader: start came while a read was under way"
        severity failure;
    end if;

  -- synthesis translate_on

  end process watch_starts;

end architecture rtl;
