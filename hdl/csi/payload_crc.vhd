-- SPDX-License-Identifier: Apache-2.0
-- Checks a packet's payload by its checksum: x^16 + x^12 + x^5 + 1 over all bytes, low bits first, beginning with all
-- ones.
--
-- The checksum goes through like the payload and leaves zero if all is right. Further zeros change nothing, so a last
-- word that is not full needs no special case.
--
-- Latency: 2 clocks. Throughput: LANES bytes each clock.
-- Equation: damaged = checksum of payload and received checksum /= 0.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.csi_pkg.all;
use work.math_pkg.all;

entity payload_crc is
  generic (
    -- Bytes of a word.
    LANES : positive range 1 to 4
  );
  port (
    clk : in    std_logic;
    -- A packet begins with the next word.
    restart : in    std_logic;
    -- Bytes of payload and checksum, zeros behind them; last: the packet's last bytes.
    strobe : in    std_logic;
    last   : in    std_logic;
    data   : in    std_logic_vector(8 * LANES - 1 downto 0);
    -- The packet's payload or checksum is wrong.
    damaged : out   std_logic
  );
end entity payload_crc;

architecture rtl of payload_crc is

  -- The checksum after the words so far; due: the packet ended with the last word.
  signal crc : crc_t     := (others => '0');
  signal due : std_logic := '0';

begin

  follow : process (clk) is

    variable behind : crc_t;

  begin

    if rising_edge(clk) then
      behind := crc;

      -- All bytes of a word in one clock: LANES is constant, so this is a tree of exclusive ors.
      for i in 0 to LANES - 1 loop

        behind := crc_behind(behind, data(8 * i + 7 downto 8 * i));

      end loop;

      if restart = '1' then
        crc <= (others => '1');
      elsif strobe = '1' then
        crc <= behind;
      end if;

      due     <= strobe and last;
      damaged <= due and to_logic(crc /= x"0000");
    end if;

  end process follow;

end architecture rtl;
