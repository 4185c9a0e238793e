-- SPDX-License-Identifier: Apache-2.0
-- Functions that stand in processes, each with the register that it is for.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.arithmetic_pkg.all;
use work.count_pkg.all;
use work.delay_pkg.all;

entity function_ports is
  generic (
    MODULUS : positive := 3;
    LENGTH  : natural  := 2
  );
  port (
    clk     : in    std_logic;
    happen  : in    std_logic_vector(1 downto 0);
    clear   : in    std_logic;
    counts  : out   std_logic_vector(5 downto 0);
    strobe  : in    std_logic;
    restart : in    std_logic;
    place   : out   std_logic_vector(7 downto 0);
    enable  : in    std_logic;
    reset   : in    std_logic;
    tag     : in    std_logic_vector(2 downto 0);
    late    : out   std_logic_vector(2 downto 0);
    value   : in    std_logic_vector(7 downto 0);
    result  : out   std_logic_vector(4 downto 0)
  );
end entity function_ports;

architecture test of function_ports is

  signal counts_now : std_logic_vector(5 downto 0)                         := (others => '0');
  signal tags       : std_logic_vector(delay_bits(3, LENGTH) - 1 downto 0) := (others => '0');
  signal place_now  : natural;
  signal place_held : natural                                              := 0;

begin

  counts    <= counts_now;
  late      <= delayed(tags, tag, LENGTH);
  place_now <= place_in_turn(place_held, restart, MODULUS);
  place     <= std_logic_vector(to_unsigned(place_now, 8));

  follow : process (clk) is
  begin

    if rising_edge(clk) then
      counts_now <= each_counted(counts_now, happen, clear);
      tags       <= moved_on(tags, tag, enable, reset);
      result     <= rounded(value, 2, 5);
      if strobe = '1' then
        place_held <= place_now;
      end if;
    end if;

  end process follow;

end architecture test;
