-- SPDX-License-Identifier: Apache-2.0
-- Model of IDDRX1F (FPGA-TN-02035): two bits a clock; both come out with the rising edge behind them.
--
-- Left out: setup and hold times; RST, which no output depends on when it is over.

library ieee;
use ieee.std_logic_1164.all;

entity iddrx1f is
  generic (
    GSR : string := "ENABLED"
  );
  port (
    d    : in    std_ulogic;
    sclk : in    std_ulogic;
    rst  : in    std_ulogic;
    q0   : out   std_ulogic;
    q1   : out   std_ulogic
  );
end entity iddrx1f;

architecture behaviour of iddrx1f is

  -- Each edge takes a bit. The rising edge outputs both bits of the clock before, the rising edge's bit first.
  signal rising_bit  : std_ulogic := '0';
  signal falling_bit : std_ulogic := '0';

begin

  sample : process (sclk) is
  begin

    if rising_edge(sclk) then
      rising_bit <= d;
      q0         <= rising_bit;
      q1         <= falling_bit;
    end if;

    if falling_edge(sclk) then
      falling_bit <= d;
    end if;

  end process sample;

end architecture behaviour;
