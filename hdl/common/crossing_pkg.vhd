-- SPDX-License-Identifier: Apache-2.0
-- Attributes of the registers between two clocks, in the words of each tool. Vendors' tools ignore those of the others.
--
-- Both stages of a synchroniser must stay flip-flops beside each other; a register that another clock samples must stay
-- one flip-flop, whose name the constraints find (docs/clock-crossings.md).

library ieee;
use ieee.std_logic_1164.all;

package crossing_pkg is

  -- Vivado, and simulation models of ISE: this register may go metastable. Keep it close to the one behind it, and do
  -- not optimise it.
  attribute async_reg : string;

  -- The register is not removed, merged with an equal one, or moved. ISE and Vivado; ISE; Quartus, twice; Synplify,
  -- Radiant and Gowin.
  attribute keep : string;

  attribute equivalent_register_removal : string;

  attribute preserve : boolean;

  attribute dont_merge : boolean;

  attribute syn_preserve : integer;

  -- Registers in a row do not become the memory of a shift register. ISE and Vivado; Synplify, Radiant and Gowin.
  attribute shreg_extract : string;

  attribute syn_srlstyle : string;

end package crossing_pkg;
