-- SPDX-License-Identifier: Apache-2.0
-- Model of IDDRX2F (FPGA-TN-02035): four bits a clock of SCLK, two for each of ECLK; Q0 came first.
--
-- Left out: setup and hold times; RST, which no output depends on when it is over; ALIGNWD.

library ieee;
use ieee.std_logic_1164.all;

entity iddrx2f is
  generic (
    GSR : string := "ENABLED"
  );
  port (
    d       : in    std_ulogic;
    sclk    : in    std_ulogic;
    eclk    : in    std_ulogic;
    rst     : in    std_ulogic;
    alignwd : in    std_ulogic;
    q3      : out   std_ulogic;
    q2      : out   std_ulogic;
    q1      : out   std_ulogic;
    q0      : out   std_ulogic
  );
end entity iddrx2f;

architecture behaviour of iddrx2f is

  signal window : std_logic_vector(3 downto 0) := "0000";

begin

  sample : process (eclk, sclk) is
  begin

    -- Both edges of ECLK take a bit; the newest is on the left.
    if eclk'event then
      window <= d & window(3 downto 1);
    end if;

    if rising_edge(sclk) then
      q0 <= window(0);
      q1 <= window(1);
      q2 <= window(2);
      q3 <= window(3);
    end if;

  end process sample;

end architecture behaviour;
