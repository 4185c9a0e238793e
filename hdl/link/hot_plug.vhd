-- SPDX-License-Identifier: Apache-2.0
-- Announces a monitor to the source a while after reset, as if it had just been plugged in.
--
-- A source that was connected before the board was configured, perhaps with other modes, then reads the EDID again.
--
-- Latency: PAUSE clocks.
-- Equation: present = reset has been over for PAUSE clocks.

library ieee;
use ieee.std_logic_1164.all;

entity hot_plug is
  generic (
    -- Clocks after the reset; the default is 200 ms at 100 MHz. Sources take less than 100 ms for a bad contact (HDMI
    -- 1.4, section 8.5).
    PAUSE : positive := 20000000
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The hot plug pin.
    present : out   std_logic
  );
end entity hot_plug;

architecture rtl of hot_plug is

  signal clocks : natural range 0 to PAUSE := 0;

begin

  count : process (clk) is
  begin

    if rising_edge(clk) then
      present <= '0';
      if clocks = PAUSE then
        present <= '1';
      else
        clocks <= clocks + 1;
      end if;
      if reset = '1' then
        clocks  <= 0;
        present <= '0';
      end if;
    end if;

  end process count;

end architecture rtl;
