-- SPDX-License-Identifier: Apache-2.0
-- Attributes for registers between two clocks, one set for each tool. Tools ignore the attributes of other vendors.
--
-- Both stages of a synchroniser must stay flip-flops beside each other; a register that another clock samples must stay
-- one flip-flop, whose name the constraints find (docs/clock-crossings.md).

library ieee;
use ieee.std_logic_1164.all;

package crossing_pkg is

  -- Vivado, and ISE's simulation models: this register may go metastable. Place it close to the register behind it
  -- and do not optimise it.
  attribute async_reg : string;

  -- Keep the register: do not remove it, merge it with an equal one, or move it. In this order for ISE and Vivado
  -- (keep), ISE, Quartus (preserve, dont_merge), and Synplify, Radiant and Gowin.
  attribute keep : string;

  attribute equivalent_register_removal : string;

  attribute preserve : boolean;

  attribute dont_merge : boolean;

  attribute syn_preserve : integer;

  -- Keep registers in a row as flip-flops, not as a shift register in a LUT. In this order for ISE and Vivado, and
  -- for Synplify, Radiant and Gowin.
  attribute shreg_extract : string;

  attribute syn_srlstyle : string;

end package crossing_pkg;
