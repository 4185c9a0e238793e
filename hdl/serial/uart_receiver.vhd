-- SPDX-License-Identifier: Apache-2.0
-- Serial receiver: 8 data bits, no parity, 1 stop bit.
--
-- Latency: up to the middle of the stop bit. Throughput: one byte each 10 * BIT_CLOCKS clocks.
-- Equation: data bit n is the level of the line n + 1.5 bits behind the falling edge.

library ieee;
use ieee.std_logic_1164.all;

entity uart_receiver is
  generic (
    -- Clocks in a bit: 868 for 115200 baud and 100 MHz.
    BIT_CLOCKS : positive range 4 to 65535 := 868
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Serial line, idle high.
    line : in    std_logic;
    -- A byte; valid is high for one clock when it has come in. Bytes without a stop bit are dropped.
    data  : out   std_logic_vector(7 downto 0);
    valid : out   std_logic
  );
end entity uart_receiver;

architecture rtl of uart_receiver is

  signal level   : std_logic_vector(0 downto 0);
  signal arrived : std_logic_vector(0 downto 0);
  -- Clocks until the middle of the next bit; bits of the character so far; whether one is under way; its bits.
  signal clocks : natural range 0 to BIT_CLOCKS - 1 := 0;
  signal bits   : natural range 0 to 9              := 0;
  signal busy   : std_logic                         := '0';
  signal shift  : std_logic_vector(7 downto 0)      := (others => '0');
  -- The line was high since the reset or the last character: a line that is low from the start gives no start bit.
  signal rested : std_logic := '0';

begin

  -- Inverted, because a synchroniser starts with zeros: the line counts as idle before the first clock.
  level(0) <= not line;

  crossing : entity work.synchroniser
    port map (
      clk         => clk,
      level       => level,
      synchronous => arrived
    );

  receive : process (clk) is
  begin

    if rising_edge(clk) then
      valid <= '0';
      if busy = '0' then
        -- Half a bit from the falling edge to the middle of the start bit, then whole bits: each sample lies in the
        -- middle of its bit, and the two clocks may differ by half a bit over the character.
        clocks <= BIT_CLOCKS / 2 - 1;
        bits   <= 0;
        if arrived(0) = '0' then
          rested <= '1';
        elsif rested = '1' then
          busy <= '1';
        end if;
      elsif clocks /= 0 then
        clocks <= clocks - 1;
      else
        clocks <= BIT_CLOCKS - 1;
        if bits = 0 and arrived(0) = '0' then
          -- The line is high again in the middle of the supposed start bit: it was a spike.
          busy <= '0';
        elsif bits = 9 then
          busy   <= '0';
          rested <= '0';
          -- A line that is low here breaks the frame (another baud rate, a break): the byte is dropped, and reception
          -- waits until the line was high.
          data  <= shift;
          valid <= not arrived(0);
        else
          bits <= bits + 1;
          -- The lowest bit comes first, so after eight shifts it is in bit 0.
          shift <= not arrived(0) & shift(7 downto 1);
        end if;
      end if;
      if reset = '1' then
        busy   <= '0';
        rested <= '0';
        valid  <= '0';
      end if;
    end if;

  end process receive;

end architecture rtl;
