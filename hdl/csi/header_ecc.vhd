-- SPDX-License-Identifier: Apache-2.0
-- Corrects one wrong bit of a packet header, and detects two.
--
-- The header is a word of a Hamming code of distance 4: 24 data bits, 6 check bits, and two bits that are zero.
--
-- Latency: 2 clocks. Throughput: one header each clock.
-- Equation: data = header(23:0) xor (the bit whose code equals the syndrome); see csi_pkg.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.csi_pkg.all;
use work.math_pkg.all;

entity header_ecc is
  port (
    clk : in    std_logic;
    -- A header, its first byte in the low bits.
    strobe : in    std_logic;
    header : in    std_logic_vector(31 downto 0);
    -- The header's data (identifier, word count), correct unless damaged; corrected: one bit was wrong; damaged: more
    -- were.
    out_strobe : out   std_logic;
    data       : out   std_logic_vector(23 downto 0);
    corrected  : out   std_logic;
    damaged    : out   std_logic
  );
end entity header_ecc;

architecture rtl of header_ecc is

  -- The header in the second clock.
  signal strobe_1 : std_logic                     := '0';
  signal header_1 : std_logic_vector(31 downto 0) := (others => '0');
  signal wrong_1  : std_logic_vector(5 downto 0)  := (others => '0');

begin

  check : process (clk) is

    variable place  : std_logic_vector(23 downto 0);
    variable odd    : std_logic;
    variable single : std_logic;

  begin

    -- First clock: which check bits disagree. Second clock: which bit that means.
    if rising_edge(clk) then
      strobe_1 <= strobe;
      header_1 <= header;
      wrong_1  <= syndrome(header);

      place := wrong_bit(wrong_1);
      -- One wrong data bit explains the syndrome.
      odd := to_logic(place /= (23 downto 0 => '0'));

      -- One wrong check bit, whose syndrome is that single bit, explains it too; the data are then right.
      for i in 0 to 5 loop

        single := wrong_1(i);

        for j in 0 to 5 loop

          if j /= i then
            single := single and not wrong_1(j);
          end if;

        end loop;

        odd := odd or single;

      end loop;

      out_strobe <= strobe_1;
      data       <= header_1(23 downto 0) xor place;
      corrected  <= '0';
      damaged    <= '0';
      -- The two bits without a check must be zero. One of them set is one wrong bit, both are two.
      if wrong_1 = "000000" then
        corrected <= header_1(30) xor header_1(31);
        damaged   <= header_1(30) and header_1(31);
      elsif header_1(31 downto 30) = "00" and odd = '1' then
        corrected <= '1';
      else
        -- Two wrong bits. Three look like one to any code of distance 4, and are "corrected".
        damaged <= '1';
      end if;
    end if;

  end process check;

end architecture rtl;
