-- SPDX-License-Identifier: Apache-2.0
-- Serial transmitter: 8 data bits, no parity, 1 stop bit.
--
-- Latency: 1 clock to the start bit. Throughput: one byte each 10 * BIT_CLOCKS clocks.
-- Equation: line = start bit (low), data bits 0 to 7, stop bit (high), each BIT_CLOCKS long.

library ieee;
use ieee.std_logic_1164.all;

entity uart_transmitter is
  generic (
    -- Clocks in a bit: 868 for 115200 baud and 100 MHz.
    BIT_CLOCKS : positive range 4 to 65535 := 868
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Bytes to send.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(7 downto 0);
    -- Serial line, idle high.
    line : out   std_logic
  );
end entity uart_transmitter;

architecture rtl of uart_transmitter is

  -- Clocks left of the bit on the line; bits left of the character (0: none is under way); bits still to be sent, the
  -- one on the line at the right.
  signal clocks : natural range 0 to BIT_CLOCKS - 1 := 0;
  signal bits   : natural range 0 to 10             := 0;
  signal shift  : std_logic_vector(8 downto 0)      := (others => '1');
  signal ready  : std_logic;

begin

  -- A byte is taken only when the stop bit of the last byte is over, so there is no buffer.
  ready         <= '1' when bits = 0 else
                   '0';
  s_axis_tready <= ready;
  line          <= shift(0);

  send : process (clk) is
  begin

    if rising_edge(clk) then
      if bits = 0 then
        clocks <= BIT_CLOCKS - 1;
        if s_axis_tvalid = '1' then
          shift <= s_axis_tdata & '0';
          bits  <= 10;
        end if;
      elsif clocks /= 0 then
        clocks <= clocks - 1;
      else
        clocks <= BIT_CLOCKS - 1;
        -- The ones that come in at the left are the stop bit and the idle line behind it.
        shift <= '1' & shift(8 downto 1);
        bits  <= bits - 1;
      end if;
      if reset = '1' then
        bits  <= 0;
        shift <= (others => '1');
      end if;
    end if;

  end process send;

end architecture rtl;
