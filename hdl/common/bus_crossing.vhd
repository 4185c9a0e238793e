-- SPDX-License-Identifier: Apache-2.0
-- Brings a value of many bits from one clock into another, all bits of the same moment.
--
-- The source takes a copy and announces it by a toggling bit. The destination takes the copy and acknowledges it by a
-- toggling bit of its own. Either clock may stop; the value then stays as it is.
--
-- Use it for values of which only the latest counts: settings, counts, reports. crossing_fifo loses no word and
-- takes one each clock; synchroniser is for bits that do not belong together.
--
-- Latency: 3 clocks of source_clk and 3 of destination_clk, at most twice that.
-- Throughput: one value for each round trip; values in between are not seen.
-- Equation: destination(t) = source at an earlier moment. Cost: 2 flip-flops a bit and 6.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.crossing_pkg.all;

entity bus_crossing is
  generic (
    -- Bits of the value.
    WIDTH : positive
  );
  port (
    -- The value and its clock.
    source_clk : in    std_logic;
    source     : in    std_logic_vector(WIDTH - 1 downto 0);
    -- The destination's clock, and the value as that clock last took it.
    destination_clk : in    std_logic;
    destination     : out   std_logic_vector(WIDTH - 1 downto 0)
  );
end entity bus_crossing;

architecture rtl of bus_crossing is

  -- crossing_data: the source's copy, steady until it is acknowledged, so the destination may sample its bits at
  -- any moment. crossing_taken: the value that the destination sampled.
  signal crossing_data  : std_logic_vector(WIDTH - 1 downto 0) := (others => '0');
  signal crossing_taken : std_logic_vector(WIDTH - 1 downto 0) := (others => '0');
  -- Toggles. They differ while a copy waits and agree once it was taken. A toggle cannot be missed, whichever
  -- clock is faster; a pulse could.
  signal request          : std_logic_vector(0 downto 0) := "0";
  signal request_arrived  : std_logic_vector(0 downto 0);
  signal response         : std_logic_vector(0 downto 0) := "0";
  signal response_arrived : std_logic_vector(0 downto 0);

  -- The timing constraints match these names.
  attribute keep of crossing_data, crossing_taken                        : signal is "TRUE";
  attribute equivalent_register_removal of crossing_data, crossing_taken : signal is "no";
  attribute preserve of crossing_data, crossing_taken                    : signal is true;
  attribute dont_merge of crossing_data, crossing_taken                  : signal is true;
  attribute syn_preserve of crossing_data, crossing_taken                : signal is 1;
  attribute shreg_extract of crossing_data, crossing_taken               : signal is "no";
  attribute syn_srlstyle of crossing_data, crossing_taken                : signal is "registers";

begin

  destination <= crossing_taken;

  send : process (source_clk) is
  begin

    if rising_edge(source_clk) then
      if response_arrived = request then
        crossing_data <= source;
        request       <= not request;
      end if;
    end if;

  end process send;

  forward : entity work.synchroniser
    port map (
      clk         => destination_clk,
      level       => request,
      synchronous => request_arrived
    );

  take : process (destination_clk) is
  begin

    if rising_edge(destination_clk) then
      if request_arrived /= response then
        crossing_taken <= crossing_data;
        response       <= request_arrived;
      end if;
    end if;

  end process take;

  backward : entity work.synchroniser
    port map (
      clk         => source_clk,
      level       => response,
      synchronous => response_arrived
    );

end architecture rtl;
