-- SPDX-License-Identifier: Apache-2.0
-- Reads bytes from address 0 on from an I2C device, as the only master of its lines.
--
-- Nine clocks and a stop come first; they free a data line that a device still holds from an interrupted read. If a
-- device took the nine ones for a byte and now acknowledges it, the nine clocks come again. A device may stretch the
-- clock for up to STRETCH clocks. If a line stays low, or a byte is not acknowledged, the read ends with a stop and
-- both lines are released.
--
-- Latency: 51 bits of 4 * QUARTER clocks to the first byte.
-- Throughput: a byte in 9 bits; a bit takes 4 * QUARTER clocks and the time that the clock line takes to rise.
-- Equation: the n-th byte = device(n).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
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
  -- A one leaves the bit to the device.
  constant LISTEN : std_logic := '1';

  -- What is on the lines. free, free_stop: nine ones and a stop. write_start to write_address: a start and two bytes.
  -- read_start, read_device: a start and a byte. read_byte: bytes that are read. stop: a stop.
  type step_t is (
    idle, free, free_stop, write_start, write_device, write_address, read_start, read_device, read_byte, stop
  );

  -- Parts of a bit. hold: clock line low, data line as it was. setup: clock line low, next bit on the data line. rise:
  -- clock line released until it is high. high, high_end: before and after the middle, in which the data line is read,
  -- or makes a start or a stop.
  type phase_t is (hold, setup, rise, high, high_end);

  -- Levels of the lines in this clock.
  signal scl_now : std_logic;
  signal sda_now : std_logic;
  -- The step and the part of the bit; clocks of the part; bits of the byte that are over; the byte with its acknowledge
  -- bit; whether all bytes are read.
  signal step   : step_t                       := idle;
  signal phase  : phase_t                      := hold;
  signal clocks : natural range 0 to STRETCH   := 0;
  signal bits   : natural range 0 to 8         := 0;
  signal shift  : std_logic_vector(8 downto 0) := (others => '1');
  signal all_in : std_logic                    := '0';

  -- The bit under way is a start, a stop, the first bit of a byte that is read.
  signal starts : std_logic;
  signal stops  : std_logic;
  signal opens  : std_logic;

  -- Each high for one clock: the read begins; a quarter has passed; a bit begins, is read, is over; the step is over;
  -- the clock line stays low.
  signal begins     : std_logic;
  signal time_up    : std_logic;
  signal bit_begins : std_logic;
  signal bit_read   : std_logic;
  signal bit_ends   : std_logic;
  signal step_ends  : std_logic;
  signal gives_up   : std_logic;
  -- The data line was low at all nine clocks and at the stop: a device holds it permanently.
  signal held : std_logic;

begin

  lines : entity work.i2c_lines
    generic map (
      SPIKE => larger(QUARTER / 50, 1)
    )
    port map (
      clk       => clk,
      scl       => scl,
      sda       => sda,
      scl_level => scl_now,
      sda_level => sda_now
    );

  data     <= shift(8 downto 1);
  complete <= all_in;

  starts <= to_logic(step = write_start or step = read_start);
  stops  <= to_logic(step = free_stop or step = stop);
  opens  <= to_logic(step = read_byte and bits = 0);

  begins  <= to_logic(phase = hold and step = idle) and start;
  time_up <= to_logic(clocks = QUARTER - 1);
  -- A byte begins only when the user asks for it; until then the clock line stays low, so that the device waits.
  bit_begins <= to_logic(phase = hold and step /= idle) and time_up and (next_byte or not opens);
  bit_read   <= to_logic(phase = high) and time_up;
  bit_ends   <= to_logic(phase = high_end) and time_up;
  step_ends  <= bit_ends and (starts or stops or to_logic(bits = 8));
  -- A clock line that does not rise is held: by a device that stretches the clock, or by one that hangs.
  gives_up <= to_logic(phase = rise and clocks = STRETCH - 1) and not scl_now;

  held <= to_logic(step = free_stop and unsigned(shift) = 0) and not sda_now;

  drive_clock : process (clk) is
  begin

    if rising_edge(clk) then
      -- The counter serves the quarters and the limit of stretching.
      if clocks /= STRETCH then
        clocks <= clocks + 1;
      end if;

      case phase is

        when hold =>

          -- At rest both lines are high; the first bit begins like all others, with the clock line low.
          if step = idle then
            clocks <= 0;
            if start = '1' then
              scl_low <= '1';
            end if;
          elsif bit_begins = '1' then
            clocks <= 0;
            phase  <= setup;
          elsif time_up = '1' then
            -- The next byte is not asked for yet: the counter stops, so that the bit begins in the clock in which it
            -- is.
            clocks <= clocks;
          end if;

        when setup =>

          if time_up = '1' then
            scl_low <= '0';
            clocks  <= 0;
            phase   <= rise;
          end if;

        when rise =>

          -- The clock line is read back: its pull-up takes time, and a device may hold it.
          if scl_now = '1' then
            clocks <= 0;
            phase  <= high;
          elsif gives_up = '1' then
            clocks <= 0;
            phase  <= hold;
          end if;

        when high =>

          if time_up = '1' then
            clocks <= 0;
            phase  <= high_end;
          end if;

        when high_end =>

          if time_up = '1' then
            clocks  <= 0;
            phase   <= hold;
            scl_low <= '1';
            -- After the last stop, and if the data line cannot be freed, both lines stay high.
            if step_ends = '1' and (step = idle or step = stop or held = '1') then
              scl_low <= '0';
            end if;
          end if;

      end case;

      if reset = '1' then
        scl_low <= '0';
        phase   <= hold;
      end if;
    end if;

  end process drive_clock;

  drive_data : process (clk) is
  begin

    if rising_edge(clk) then
      if bit_begins = '1' then
        -- The data line is high before a start and low before a stop. The first bit of a byte that is read belongs to
        -- the device, but shift gets its ones only in this clock, so `opens` excepts it.
        sda_low <= (stops or (not starts and not shift(8))) and not opens;
      elsif bit_read = '1' and starts = '1' then
        -- While the clock line is high, a falling data line is a start and a rising one a stop.
        sda_low <= '1';
      elsif gives_up = '1' or (bit_read = '1' and stops = '1') then
        sda_low <= '0';
      end if;
      if reset = '1' then
        sda_low <= '0';
      end if;
    end if;

  end process drive_data;

  -- Bits to be sent leave at one end; bits on the line come in at the other.
  shift_bits : process (clk) is
  begin

    if rising_edge(clk) then
      -- Nine ones: a device that holds the data line shifts out the rest of its byte and then finds no acknowledgement.
      if begins = '1' then
        bits  <= 0;
        shift <= (others => '1');
      elsif bit_begins = '1' and opens = '1' then
        -- The bits of the byte are the device's, so ones; the acknowledge bit is the master's: low if it wants more.
        shift <= x"FF" & not more;
      elsif bit_read = '1' and starts = '0' and stops = '0' then
        shift <= shift(7 downto 0) & sda_now;
      elsif step_ends = '1' then
        bits <= 0;
        if step = free_stop then
          -- Ones for the next nine clocks, in case they have to come again.
          shift <= (others => '1');
        elsif step = write_start then
          shift <= WRITE_TO & LISTEN;
        elsif step = write_device then
          shift <= ADDRESS & LISTEN;
        elsif step = read_start then
          shift <= READ_FROM & LISTEN;
        end if;
      elsif bit_ends = '1' then
        bits <= bits + 1;
      end if;
    end if;

  end process shift_bits;

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
      if gives_up = '1' then
        stuck <= '1';
        done  <= '1';
        step  <= idle;
      end if;

      if step_ends = '1' then
        -- The bits sent must be on the line, and behind them a zero as acknowledgement. Anything else means another
        -- master, a short, or no device.
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
            elsif sda_now = '0' then
              -- Held now, but not before: the device acknowledges the ones as if they were a byte. The next nine clocks
              -- find it in another place.
              step <= free;
            end if;

          when write_start =>

            step <= write_device;

          when write_device =>

            step <= write_address;
            if shift /= WRITE_TO & '0' then
              step <= stop;
            end if;

          when write_address =>

            step <= read_start;
            if shift /= ADDRESS & '0' then
              step <= stop;
            end if;

          when read_start =>

            step <= read_device;

          when read_device =>

            step <= read_byte;
            if shift /= READ_FROM & '0' then
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
      assert not (reset = '0' and start = '1' and not (phase = hold and step = idle))
        report "i2c_reader: start came while a read was under way"
        severity failure;
    end if;

  -- synthesis translate_on

  end process watch_starts;

end architecture rtl;
