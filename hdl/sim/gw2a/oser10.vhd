-- SPDX-License-Identifier: Apache-2.0
-- Model of OSER10 (Gowin UG289): the word taken with PCLK, a bit each half cycle of FCLK, D0 first.
--
-- FCLK has five times PCLK's frequency and rises with it. A word begins with the first rising edge of FCLK behind the
-- falling one at which PCLK is seen to have risen.
--
-- Left out: delays; how many cycles the real one takes from the word to its first bit.

library ieee;
use ieee.std_logic_1164.all;

entity oser10 is
  port (
    d9    : in    std_ulogic;
    d8    : in    std_ulogic;
    d7    : in    std_ulogic;
    d6    : in    std_ulogic;
    d5    : in    std_ulogic;
    d4    : in    std_ulogic;
    d3    : in    std_ulogic;
    d2    : in    std_ulogic;
    d1    : in    std_ulogic;
    d0    : in    std_ulogic;
    fclk  : in    std_ulogic;
    pclk  : in    std_ulogic;
    reset : in    std_ulogic;
    q     : out   std_ulogic
  );
end entity oser10;

architecture behaviour of oser10 is

  signal taken : std_ulogic_vector(9 downto 0) := (others => '0');
  signal rest  : std_ulogic_vector(9 downto 0) := (others => '0');
  signal seen  : std_ulogic                    := '0';
  signal fresh : std_ulogic                    := '0';

begin

  take : process (pclk) is
  begin

    if rising_edge(pclk) then
      taken <= d9 & d8 & d7 & d6 & d5 & d4 & d3 & d2 & d1 & d0;
    end if;

  end process take;

  send : process (fclk, reset) is
  begin

    if reset = '1' then
      rest  <= (others => '0');
      seen  <= '0';
      fresh <= '0';
      q     <= '0';
    elsif rising_edge(fclk) then
      -- Two bits are sent in each cycle: one with the rising edge, one with the falling edge.
      if fresh = '1' then
        rest <= taken;
        q    <= taken(0);
      else
        rest <= "00" & rest(9 downto 2);
        q    <= rest(2);
      end if;
    elsif falling_edge(fclk) then
      -- PCLK is sampled with falling edges, far away from its own edges.
      q     <= rest(1);
      seen  <= pclk;
      fresh <= pclk and not seen;
    end if;

  end process send;

end architecture behaviour;
