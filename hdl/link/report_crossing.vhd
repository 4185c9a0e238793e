-- SPDX-License-Identifier: Apache-2.0
-- Brings the reports of the video path and of the delay lines out of the pixel clock, and counts hung delay lines.
--
-- Latency: that of bus_crossing. Throughput: the latest report; a change of a toggle counts if it lasts as long.
-- Equation: hung_counts = changes of hung_toggle since clear; all other outputs = inputs at an earlier moment.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.count_pkg.all;
use work.hdmi_pkg.all;
use work.tmds_pkg.all;

entity report_crossing is
  port (
    -- In pixel_clk: reports of the video path; reports of the delay lines (as in hdmi_control).
    pixel_clk : in    std_logic;
    state     : in    video_state_t;
    lanes     : in    lanes_t;
    -- In clk: the reports that came last.
    clk        : in    std_logic;
    state_here : out   video_state_t;
    lanes_here : out   lanes_t;
    -- How often each delay line hung since the counters were cleared.
    clear       : in    std_logic;
    hung_counts : out   std_logic_vector(RARE_BITS * CHANNELS - 1 downto 0)
  );
end entity report_crossing;

architecture rtl of report_crossing is

  -- Places of the fields in the report. The state of the video path is in the low bits, because its length is a
  -- constant of the package.
  constant TAPS_AT     : positive := STATE_BITS;
  constant TRACKING_AT : positive := TAPS_AT + TAP_BITS * CHANNELS;
  constant HUNG_AT     : positive := TRACKING_AT + CHANNELS;
  constant REPORT_BITS : positive := HUNG_AT + CHANNELS;

  signal report_now  : std_logic_vector(REPORT_BITS - 1 downto 0);
  signal report_here : std_logic_vector(REPORT_BITS - 1 downto 0);
  signal hung_here   : std_logic_vector(CHANNELS - 1 downto 0);
  signal hung_now    : std_logic_vector(CHANNELS - 1 downto 0);
  signal hung_before : std_logic_vector(CHANNELS - 1 downto 0) := (others => '0');
  signal hung        : std_logic_vector(hung_counts'range)     := (others => '0');

begin

  -- All fields cross on one bus, so they belong to one moment: a position of a delay line is never half changed.
  report_now <= lanes.hung_toggle & lanes.tracking & lanes.taps & to_vector(state);

  crossing : entity work.bus_crossing
    generic map (
      WIDTH => REPORT_BITS
    )
    port map (
      source_clk      => pixel_clk,
      source          => report_now,
      destination_clk => clk,
      destination     => report_here
    );

  state_here <= to_state(report_here(STATE_BITS - 1 downto 0));
  lanes_here <= (report_here(HUNG_AT - 1 downto TRACKING_AT), report_here(TRACKING_AT - 1 downto TAPS_AT), hung_here);
  hung_here  <= report_here(REPORT_BITS - 1 downto HUNG_AT);

  -- A toggle instead of a pulse: a change of level waits until the crossing has seen it.
  watch : process (clk) is
  begin

    if rising_edge(clk) then
      hung_before <= hung_here;
      hung        <= each_counted(hung, hung_now, clear);
    end if;

  end process watch;

  hung_now    <= hung_here xor hung_before;
  hung_counts <= hung;

  -- Simulation stops if a toggle changes twice before it has arrived, which would look like no change.
  watch_toggles : process (pixel_clk) is

    variable before : std_logic_vector(CHANNELS - 1 downto 0);

  begin

    -- synthesis translate_off
    if rising_edge(pixel_clk) then
      assert ((lanes.hung_toggle xor before) and (hung_here xor before)) = (CHANNELS - 1 downto 0 => '0') or
             is_x(lanes.hung_toggle & before & hung_here)
        report "report_crossing: a delay line hung again before its last toggle had arrived"
        severity failure;
      before := lanes.hung_toggle;
    end if;

  -- synthesis translate_on

  end process watch_toggles;

end architecture rtl;
