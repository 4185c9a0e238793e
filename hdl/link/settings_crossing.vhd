-- SPDX-License-Identifier: Apache-2.0
-- Brings the settings of the panel, and the words for a sensor's resampler, into the pixel clock.
--
-- Latency: that of bus_crossing and of synchroniser. Throughput: the latest settings; a word in two round trips.
-- Equation: arrived = settings, with the words of load_crossing.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.hdmi_pkg.all;
use work.resample_pkg.all;
use work.tmds_pkg.all;

entity settings_crossing is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Settings in clk; their fields of words are not used.
    settings : in    video_settings_t;
    -- A word from load_port; port_busy: the word before has not arrived; seen: toggle of the last word that has.
    port_write : in    std_logic;
    port_word  : in    load_word_t;
    port_busy  : out   std_logic;
    seen       : in    std_logic;
    -- Settings in pixel_clk.
    pixel_clk : in    std_logic;
    arrived   : out   video_settings_t
  );
end entity settings_crossing;

architecture rtl of settings_crossing is

  -- Settings of several bits must arrive together, or a slice that was never chosen would be shown for a frame. Those
  -- of one bit have a synchroniser each, which is smaller.
  -- Each field begins behind the field before.
  constant AT_SLICE      : natural  := 0;
  constant AT_FRAMES     : natural  := AT_SLICE + 8;
  constant AT_SWEEP      : natural  := AT_FRAMES + 8;
  constant AT_PASS       : natural  := AT_SWEEP + 1;
  constant AT_SHOWN      : natural  := AT_PASS + 1;
  constant AT_TEXT       : natural  := AT_SHOWN + 2;
  constant AT_POLARITY   : natural  := AT_TEXT + 2;
  constant TOGETHER_BITS : positive := AT_POLARITY + polarity_t'length;

  signal together       : std_logic_vector(TOGETHER_BITS - 1 downto 0);
  signal pixel_together : std_logic_vector(TOGETHER_BITS - 1 downto 0);
  signal singles        : std_logic_vector(1 downto 0);
  signal pixel_singles  : std_logic_vector(1 downto 0);
  signal load_word      : load_word_t;
  signal load_toggle    : std_logic;

begin

  together(AT_FRAMES - 1 downto AT_SLICE)        <= settings.choice.slice;
  together(AT_SWEEP - 1 downto AT_FRAMES)        <= settings.choice.sweep_frames;
  together(AT_SWEEP)                             <= settings.choice.sweep;
  together(AT_PASS)                              <= settings.choice.pass_through;
  together(AT_TEXT - 1 downto AT_SHOWN)          <= settings.choice.shown;
  together(AT_POLARITY - 1 downto AT_TEXT)       <= settings.text_place;
  together(TOGETHER_BITS - 1 downto AT_POLARITY) <= settings.polarity;

  -- All bits of a slice and a sweep arrive in one clock.
  bus_of_settings : entity work.bus_crossing
    generic map (
      WIDTH => TOGETHER_BITS
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

  -- Words for the resampler must all arrive, so each is acknowledged before the next is sent.
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

  arrived.choice.slice        <= pixel_together(AT_FRAMES - 1 downto AT_SLICE);
  arrived.choice.sweep_frames <= pixel_together(AT_SWEEP - 1 downto AT_FRAMES);
  arrived.choice.sweep        <= pixel_together(AT_SWEEP);
  arrived.choice.pass_through <= pixel_together(AT_PASS);
  arrived.choice.shown        <= pixel_together(AT_TEXT - 1 downto AT_SHOWN);
  arrived.text_place          <= pixel_together(AT_POLARITY - 1 downto AT_TEXT);
  arrived.polarity            <= pixel_together(TOGETHER_BITS - 1 downto AT_POLARITY);
  arrived.show_pattern        <= pixel_singles(0);
  arrived.clear_toggle        <= pixel_singles(1);
  arrived.load_word           <= load_word;
  arrived.load_toggle         <= load_toggle;

end architecture rtl;
