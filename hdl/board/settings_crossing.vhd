-- SPDX-License-Identifier: Apache-2.0
-- Brings the settings of the panel, and the words for a sensor's resampler, into the pixel clock.
--
-- Latency: that of bus_crossing and of synchroniser. Throughput: the latest settings; a word in two round trips.
-- Equation: arrived = settings, with the words of load_crossing.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.hdmi_pkg.all;

entity settings_crossing is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- In clk; what it has of words does not count.
    settings : in    video_settings_t;
    -- A word from load_port; busy: the one before has not arrived. seen: toggle of the last that has.
    port_write : in    std_logic;
    port_word  : in    std_logic_vector(61 downto 0);
    port_busy  : out   std_logic;
    seen       : in    std_logic;
    -- In pixel_clk.
    pixel_clk : in    std_logic;
    arrived   : out   video_settings_t
  );
end entity settings_crossing;

architecture rtl of settings_crossing is

  signal together       : std_logic_vector(21 downto 0);
  signal pixel_together : std_logic_vector(21 downto 0);
  signal singles        : std_logic_vector(1 downto 0);
  signal pixel_singles  : std_logic_vector(1 downto 0);
  signal load_word      : std_logic_vector(61 downto 0);
  signal load_toggle    : std_logic;

begin

  together <= settings.text_place & settings.shown & settings.pass_through & settings.sweep & settings.sweep_frames &
              settings.slice;

  bus_of_settings : entity work.bus_crossing
    generic map (
      WIDTH => 22
    )
    port map (
      source_clk      => clk,
      source          => together,
      destination_clk => pixel_clk,
      destination     => pixel_together
    );

  singles <= settings.clear_toggle & settings.show_pattern;

  levels : entity work.synchroniser
    generic map (
      WIDTH => 2
    )
    port map (
      clk         => pixel_clk,
      level       => singles,
      synchronous => pixel_singles
    );

  loads : entity work.load_crossing
    port map (
      clk         => clk,
      reset       => reset,
      port_write  => port_write,
      port_word   => port_word,
      port_busy   => port_busy,
      seen        => seen,
      pixel_clk   => pixel_clk,
      load_word   => load_word,
      load_toggle => load_toggle
    );

  arrived <=
  (
    pass_through => pixel_together(17),
    slice        => pixel_together(7 downto 0),
    sweep        => pixel_together(16),
    sweep_frames => pixel_together(15 downto 8),
    shown        => pixel_together(19 downto 18),
    text_place   => pixel_together(21 downto 20),
    show_pattern => pixel_singles(0),
    clear_toggle => pixel_singles(1),
    load_word    => load_word,
    load_toggle  => load_toggle
  );

end architecture rtl;
