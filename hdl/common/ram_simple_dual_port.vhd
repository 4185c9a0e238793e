-- SPDX-License-Identifier: Apache-2.0
-- Simple dual-port RAM: one write port, one read port, one clock.
--
-- This is the only description of block RAM: synthesis infers RAMB16BWER or RAMB8BWER from it.
--
-- Latency: READ_LATENCY clocks from address to data. 1: the RAM's own register; 2: also the output register behind
-- it, which block RAM needs at high clock rates.
-- Throughput: one read and one write each clock. Reading a word in the clock that writes it returns the old word.
-- Equation: read_data(t + READ_LATENCY) = memory(read_address(t)) where read_enable(t).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity ram_simple_dual_port is
  generic (
    -- Bits of a word.
    WIDTH : positive;
    -- Words of the memory; addresses beyond are not used.
    WORDS : positive;
    -- Clocks from address to data.
    READ_LATENCY : positive range 1 to 2 := 2
  );
  port (
    clk : in    std_logic;
    -- Writes a word.
    write_enable  : in    std_logic;
    write_address : in    unsigned(bits_for(WORDS - 1) - 1 downto 0);
    write_data    : in    std_logic_vector(WIDTH - 1 downto 0);
    -- The RAM's own register reads a word.
    read_enable  : in    std_logic := '1';
    read_address : in    unsigned(bits_for(WORDS - 1) - 1 downto 0);
    -- The word read.
    read_data : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity ram_simple_dual_port;

architecture rtl of ram_simple_dual_port is

  -- XST's template for block RAM has a signal (UG687; its other template has a shared variable, which VHDL-2008
  -- forbids). Simulators keep a driver for each bit of a signal, too much for a memory of megabits: simulation
  -- gets a variable.
  function is_simulation return boolean is
  begin

    -- synthesis translate_off
    return true;
    -- synthesis translate_on

    return false;

  end function is_simulation;

  type memory_t is array (natural range 0 to WORDS - 1) of std_logic_vector(WIDTH - 1 downto 0);

  signal read_word : std_logic_vector(WIDTH - 1 downto 0) := (others => '0');

begin

  synthesised : if not is_simulation generate

    signal memory : memory_t := (others => (others => '0'));

  begin

    access_memory : process (clk) is
    begin

      if rising_edge(clk) then
        if read_enable = '1' then
          read_word <= memory(to_integer(read_address));
        end if;
        if write_enable = '1' then
          memory(to_integer(write_address)) <= write_data;
        end if;
      end if;

    end process access_memory;

  end generate synthesised;

  simulated : if is_simulation generate

    access_memory : process (clk) is

      variable memory : memory_t := (others => (others => '0'));

    begin

      if rising_edge(clk) then
        -- Read before write: a variable, too, then gives the old word if both addresses are equal.
        if read_enable = '1' then
          read_word <= memory(to_integer(read_address));
        end if;
        if write_enable = '1' then
          memory(to_integer(write_address)) := write_data;
        end if;
      end if;

    end process access_memory;

  end generate simulated;

  no_output_register : if READ_LATENCY = 1 generate
    read_data <= read_word;
  end generate no_output_register;

  output_register : if READ_LATENCY = 2 generate

    register_word : process (clk) is
    begin

      if rising_edge(clk) then
        read_data <= read_word;
      end if;

    end process register_word;

  end generate output_register;

end architecture rtl;
