-- SPDX-License-Identifier: Apache-2.0
-- Puts starts, stops and bytes on two I2C lines, one order after the other, as their only master.
--
-- A bit has four quarters: the clock line is low for two, and high for two. The data line changes in the middle of the
-- low half and is read in the middle of the high half, where it also makes a start or a stop. The high half begins when
-- the clock line is seen to be high: its pull-up takes time, and a device may stretch the clock for up to STRETCH
-- clocks.
--
-- UM10204 asks for quarters of 4.7 us in standard mode (its longest time, the set-up of a repeated start), of 0.65 us
-- in fast mode (half of its low time, and its set-up and hold times). Without an order the clock line stays low behind
-- a start or a byte, and both lines stay high behind a stop. The first order behind a stop or a reset may be a start,
-- or a byte whose bits are ones: nine clocks that free a data line which a device still holds.
--
-- Latency: a start and a stop take 1 bit, a byte 9 bits. Throughput: a bit takes 4 * QUARTER clocks and the time that
-- the clock line takes to rise and to be seen.
-- Equation: the n-th item on the lines = the n-th order.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.i2c_pkg.all;
use work.math_pkg.all;

entity i2c_master is
  generic (
    -- Clocks in a quarter of a bit. Levels that last for less than a fiftieth of a quarter count as spikes.
    QUARTER : positive range 3 to 65535;
    -- Clocks that the clock line may stay low after it was released.
    STRETCH : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The levels of the lines at the pins; and '1' to pull them low (open drain).
    scl     : in    std_logic;
    sda     : in    std_logic;
    scl_low : out   std_logic;
    sda_low : out   std_logic;
    -- An order stays as it is until it is over; the next one may come in the clock behind. What became of it.
    order  : in    i2c_order_t;
    result : out   i2c_result_t
  );
end entity i2c_master;

architecture rtl of i2c_master is

  -- A one leaves the bit to the device.
  constant LISTEN : std_logic := '1';

  -- Quarters of a bit, and the wait between them. hold: clock line low, data line as it was; also the rest behind a
  -- stop, with both lines high. setup: clock line low, next bit on the data line. rise: clock line released until it is
  -- high. high, high_end: before and after the middle.
  type phase_t is (hold, setup, rise, high, high_end);

  signal scl_now : std_logic;
  signal sda_now : std_logic;

  signal scl_pull : std_logic                                   := '0';
  signal sda_pull : std_logic                                   := '0';
  signal phase    : phase_t                                     := hold;
  signal clocks   : natural range 0 to larger(QUARTER, STRETCH) := 0;
  -- Bits of the byte that are over; bits to be sent, followed by those that were on the line.
  signal bits      : natural range 0 to 8         := 0;
  signal shift     : std_logic_vector(8 downto 0) := (others => '1');
  signal disturbed : std_logic                    := '0';

  -- wanted: there is an order; to_send: the bits of a byte, the next one at the left.
  signal wanted  : std_logic;
  signal to_send : std_logic_vector(8 downto 0);
  -- Each high for one clock: a quarter has passed; a bit begins, is read, is over; the order is over; the clock line
  -- stays low.
  signal time_up    : std_logic;
  signal bit_begins : std_logic;
  signal bit_read   : std_logic;
  signal bit_ends   : std_logic;
  signal order_ends : std_logic;
  signal gives_up   : std_logic;

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

  scl_low <= scl_pull;
  sda_low <= sda_pull;

  result.over      <= order_ends;
  result.stuck     <= gives_up;
  result.level     <= sda_now;
  result.bits      <= shift;
  result.disturbed <= disturbed;

  wanted     <= order.start or order.stop or order.send or order.receive;
  time_up    <= to_logic(clocks = QUARTER - 1);
  bit_begins <= to_logic(phase = hold) and time_up and wanted;
  bit_read   <= to_logic(phase = high) and time_up;
  bit_ends   <= to_logic(phase = high_end) and time_up;
  order_ends <= bit_ends and (order.start or order.stop or disturbed or to_logic(bits = 8));
  gives_up   <= to_logic(phase = rise and clocks = STRETCH - 1) and not scl_now;

  -- The byte is taken from the order in its first bit. A byte from the device consists of ones for it to pull low.
  to_send <= shift when bits /= 0 else
             order.value & LISTEN when order.send = '1' else
             x"FF" & not order.more;

  drive_clock : process (clk) is
  begin

    if rising_edge(clk) then
      -- Each phase resets the counter before its range ends.
      clocks <= clocks + 1;

      case phase is

        when hold =>

          if bit_begins = '1' then
            clocks <= 0;
            phase  <= setup;
          elsif scl_pull = '0' then
            -- At rest; the first bit is like all others, so the clock line falls before it.
            clocks   <= 0;
            scl_pull <= wanted;
          elsif time_up = '1' then
            -- The bit begins in the clock in which its order comes.
            clocks <= clocks;
          end if;

        when setup =>

          if time_up = '1' then
            clocks   <= 0;
            phase    <= rise;
            scl_pull <= '0';
          end if;

        when rise =>

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
            clocks   <= 0;
            phase    <= hold;
            scl_pull <= order.more or not order.stop;
          end if;

      end case;

      if reset = '1' then
        scl_pull <= '0';
        phase    <= hold;
      end if;
    end if;

  end process drive_clock;

  drive_data : process (clk) is
  begin

    if rising_edge(clk) then
      if bit_begins = '1' then
        -- The data line is high before a start and low before a stop.
        sda_pull <= not (order.start or (to_send(8) and not order.stop));
      elsif bit_read = '1' and (order.start or order.stop) = '1' then
        -- While the clock line is high, a falling data line is a start and a rising one a stop.
        sda_pull <= order.start;
      elsif gives_up = '1' then
        sda_pull <= '0';
      end if;
      if reset = '1' then
        sda_pull <= '0';
      end if;
    end if;

  end process drive_data;

  -- Bits to be sent leave at one end; bits on the line come in at the other.
  shift_bits : process (clk) is
  begin

    if rising_edge(clk) then
      if bit_begins = '1' then
        disturbed <= '0';
        if (order.send or order.receive) = '1' then
          shift <= to_send;
        end if;
      elsif bit_read = '1' and (order.send or order.receive) = '1' then
        shift     <= shift(7 downto 0) & sda_now;
        disturbed <= order.send and (shift(8) xor sda_now) and not to_logic(bits = 8);
      elsif order_ends = '1' or gives_up = '1' then
        bits <= 0;
      elsif bit_ends = '1' then
        bits <= bits + 1;
      end if;
      if reset = '1' then
        bits <= 0;
      end if;
    end if;

  end process shift_bits;

  -- Simulation stops if an order goes before it is over.
  watch_orders : process (clk) is
  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      assert not (wanted = '0' and phase /= hold and reset = '0')
        report "i2c_master: an order went before it was over"
        severity failure;
    end if;

  -- synthesis translate_on

  end process watch_orders;

end architecture rtl;
