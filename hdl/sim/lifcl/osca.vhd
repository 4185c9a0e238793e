-- SPDX-License-Identifier: Apache-2.0
-- Model of OSCA, the oscillator of CrossLink-NX: 450 MHz divided by an integer.
--
-- Left out: the other outputs, the tolerance of 7 %.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.model_control.all;

entity osca is
  generic (
    HF_CLK_DIV : string := "1";
    HF_OSC_EN  : string := "ENABLED"
  );
  port (
    hfouten  : in    std_ulogic;
    hfsdscen : in    std_ulogic;
    hfclkout : out   std_ulogic
  );
end entity osca;

architecture behaviour of osca is

  function number_of (
    text : string
  ) return natural is

    variable value : natural := 0;

  begin

    for i in text'range loop

      value := 10 * value + character'pos(text(i)) - character'pos('0');

    end loop;

    return value;

  end function number_of;

  -- Half of a period of 450 MHz, times the divider.
  constant HALF : time := (number_of(HF_CLK_DIV) + 1) * 1111 ps;

  signal clk : std_ulogic := '0';

begin

  clk      <= not clk after HALF when not stopped else
              '0';
  hfclkout <= clk and hfouten;

end architecture behaviour;
