-- SPDX-License-Identifier: Apache-2.0
-- Records faults and events of a core until they are cleared; interrupt and counters.
--
-- A fault or event in the clock in which its bit is cleared is kept.
--
-- Latency: 1 clock; 2 clocks to the interrupt. Throughput: one event of each kind each clock.
-- Equation: errors = errors and not cleared or new; counts modulo 2**32.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.register_map_pkg.all;

entity event_registers is
  generic (
    -- Kinds of events that are counted.
    COUNTERS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Each high for one clock: events to count; a frame goes in; a frame comes out; faults.
    events     : in    std_logic_vector(0 to COUNTERS - 1);
    frame_in   : in    std_logic;
    frame_out  : in    std_logic;
    new_errors : in    std_logic_vector(6 downto 0);
    -- Bits to clear; mask: bits of `happened` that interrupt.
    clear_errors   : in    std_logic_vector(6 downto 0);
    clear_happened : in    std_logic_vector(2 downto 0);
    mask           : in    std_logic_vector(2 downto 0);
    -- errors: faults so far. happened: frame in, frame out, error. interrupt: one of these is not masked out.
    errors    : out   std_logic_vector(6 downto 0);
    happened  : out   std_logic_vector(2 downto 0);
    interrupt : out   std_logic := '0';
    -- How often each event happened.
    counts : out   words_t(0 to COUNTERS - 1)
  );
end entity event_registers;

architecture rtl of event_registers is

  signal held_errors   : std_logic_vector(6 downto 0) := (others => '0');
  signal held_happened : std_logic_vector(2 downto 0) := (others => '0');
  signal held_counts   : words_t(0 to COUNTERS - 1)   := (others => (others => '0'));

begin

  errors   <= held_errors;
  happened <= held_happened;
  counts   <= held_counts;

  remember : process (clk) is

    variable new_happened : std_logic_vector(2 downto 0);

  begin

    if rising_edge(clk) then
      new_happened                             := (others => '0');
      new_happened(INTERRUPT_STATUS_FRAME_IN)  := frame_in;
      new_happened(INTERRUPT_STATUS_FRAME_OUT) := frame_out;
      if unsigned(new_errors) /= 0 then
        new_happened(INTERRUPT_STATUS_ERROR) := '1';
      end if;

      -- New events are set last, so that none is lost in the clock in which software clears its bit.
      held_errors   <= (held_errors and not clear_errors) or new_errors;
      held_happened <= (held_happened and not clear_happened) or new_happened;

      -- Counters wrap round: software subtracts two readings modulo 2**32, and never clears.
      for i in 0 to COUNTERS - 1 loop

        if events(i) = '1' then
          held_counts(i) <= std_logic_vector(unsigned(held_counts(i)) + 1);
        end if;

      end loop;

      -- The interrupt is a level: it stays until software has cleared all causes or masked them.
      interrupt <= '0';
      if unsigned(held_happened and mask) /= 0 then
        interrupt <= '1';
      end if;

      if reset = '1' then
        held_errors   <= (others => '0');
        held_happened <= (others => '0');
        held_counts   <= (others => (others => '0'));
        interrupt     <= '0';
      end if;
    end if;

  end process remember;

end architecture rtl;
