-- SPDX-License-Identifier: Apache-2.0
-- Brings a count into another clock as Gray code.
--
-- Use it for a count that moves by at most one each clock, such as a FIFO's pointer: neighbouring codes differ in
-- one bit, so a code that is sampled while it changes is either the old or the new one. bus_crossing takes any
-- value, but only one in a round trip; synchroniser takes bits that do not belong together.
--
-- The codes must arrive with less than a clock of clk_in between their bits: see docs/clock-crossings.md.
--
-- Latency: 1 clock of clk_in, then 2 to 3 clocks of clk_out. Throughput: one count each clock.
-- Equation: count_out = count_in at an earlier moment. Cost: 3 flip-flops a bit.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.crossing_pkg.all;

entity gray_crossing is
  generic (
    -- Bits of the count.
    WIDTH : positive
  );
  port (
    -- The count and its clock.
    clk_in   : in    std_logic;
    count_in : in    unsigned(WIDTH - 1 downto 0);
    -- The count in the other clock; a chain of XOR gates drives the port.
    clk_out   : in    std_logic;
    count_out : out   unsigned(WIDTH - 1 downto 0)
  );
end entity gray_crossing;

architecture rtl of gray_crossing is

  subtype code_t is std_logic_vector(WIDTH - 1 downto 0);

  function to_gray (
    value : unsigned
  ) return std_logic_vector is
  begin

    return std_logic_vector(value xor shift_right(value, 1));

  end function to_gray;

  function from_gray (
    gray : std_logic_vector
  ) return unsigned is

    variable value : unsigned(gray'range);

  begin

    value(gray'left) := gray(gray'left);

    for i in gray'left - 1 downto 0 loop

      value(i) := value(i + 1) xor gray(i);

    end loop;

    return value;

  end function from_gray;

  -- The timing constraints match these names.
  signal crossing_code   : code_t := (others => '0');
  signal crossing_caught : code_t := (others => '0');
  signal crossing_stable : code_t := (others => '0');

  -- The registers that the other clock samples must stay flip-flops in front of the XOR gates.
  attribute async_reg of crossing_caught, crossing_stable                                  : signal is "TRUE";
  attribute keep of crossing_caught, crossing_stable, crossing_code                        : signal is "TRUE";
  attribute equivalent_register_removal of crossing_caught, crossing_stable, crossing_code : signal is "no";
  attribute preserve of crossing_caught, crossing_stable, crossing_code                    : signal is true;
  attribute dont_merge of crossing_caught, crossing_stable, crossing_code                  : signal is true;
  attribute syn_preserve of crossing_caught, crossing_stable, crossing_code                : signal is 1;
  attribute shreg_extract of crossing_caught, crossing_stable, crossing_code               : signal is "no";
  attribute syn_srlstyle of crossing_caught, crossing_stable, crossing_code                : signal is "registers";

begin

  send : process (clk_in) is
  begin

    -- synthesis translate_off
    assert not (rising_edge(clk_in) and not is_x(to_gray(count_in)) and count_in - from_gray(crossing_code) + 1 > 2)
      report "gray_crossing: the count moved by more than one, its code may arrive as any other"
      severity failure;
    -- synthesis translate_on

    if rising_edge(clk_in) then
      crossing_code <= to_gray(count_in);
    end if;

  end process send;

  -- Both stages stand here instead of in a synchroniser: the constraints limit the paths to these names, but not
  -- the paths to a synchroniser.
  take : process (clk_out) is
  begin

    if rising_edge(clk_out) then
      crossing_caught <= crossing_code;
      crossing_stable <= crossing_caught;
    end if;

  end process take;

  count_out <= from_gray(crossing_stable);

end architecture rtl;
