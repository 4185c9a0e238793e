-- SPDX-License-Identifier: Apache-2.0
-- Sipeed Tang Nano 20K (GW2AR-18): a stored light field, refocused, HDMI out. The board needs only a monitor.
--
-- The light field is that of stored_pkg, or the test pattern. The core takes only the picture's columns; black columns
-- on both sides extend the lines to 640 pixels.
--
-- Clocks: the pixel clock, made from the oscillator, and five times that for the serialisers; no crossings.
--
-- Latency: that of refocus_video. Throughput: one pixel each clock.
-- Equation: out picture = refocus(light field).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.core_pkg.all;
use work.fault_pkg.all;
use work.hdmi_pkg.all;
use work.picture_pkg.all;
use work.resample_pkg.all;
use work.tmds_pkg.all;
use work.video_pkg.all;

entity tangnano20k_top is
  generic (
    -- Generics of raster_refocuser.
    MICRO_IMAGE_SIZE    : positive range 1 to 128  := 5;
    SHIFTS              : string                   := "-2 0 2";
    INTERPOLATION_ORDER : natural range 0 to 3     := 0;
    HOLD                : boolean                  := false;
    MAX_COLUMNS         : positive range 1 to 8192 := 480;
    EXACT               : boolean                  := true;
    FRACTION_BITS       : natural range 0 to 12    := 4;
    GUARD_BITS          : natural range 0 to 12    := 2;
    BROADCAST_TAPS      : natural                  := 0;
    ENGINE              : string                   := "fir";
    BOX                 : string                   := "";
    -- The picture's part of 640x480 at 60 Hz, with black columns on both sides.
    SIDE_COLUMNS     : positive range 3 to 1024 := 80;
    PATTERN_H_ACTIVE : positive range 3 to 4095 := 480;
    PATTERN_H_FRONT  : positive range 1 to 4095 := 96;
    PATTERN_H_SYNC   : positive range 1 to 4095 := 96;
    PATTERN_H_BACK   : positive range 1 to 4095 := 128;
    PATTERN_V_ACTIVE : positive range 1 to 4095 := 480;
    PATTERN_V_FRONT  : positive range 1 to 4095 := 10;
    PATTERN_V_SYNC   : positive range 1 to 4095 := 2;
    PATTERN_V_BACK   : positive range 1 to 4095 := 33;
    -- Frames for each slice (30 are half a second); clocks for which a key must be steady (10 ms).
    SWEEP_FRAMES  : positive range 1 to 255       := 30;
    BUTTON_STABLE : positive range 1 to 200000000 := 252000
  );
  port (
    -- Oscillator.
    clk_27 : in    std_logic;
    -- Keys, high while pressed: S1 stops or continues the sweep, S2 stops it and steps.
    key_stop : in    std_logic;
    key_step : in    std_logic;
    -- HDMI out.
    out_clk_p  : out   std_logic;
    out_clk_n  : out   std_logic;
    out_data_p : out   std_logic_vector(2 downto 0);
    out_data_n : out   std_logic_vector(2 downto 0);
    -- LEDs (low: lit): 0 a picture is refocused, 1 the focus sweeps, 2 to 4 the slice, 5 an error.
    led_n : out   std_logic_vector(5 downto 0)
  );
end entity tangnano20k_top;

architecture rtl of tangnano20k_top is

  constant CORE : core_t := picture_core_of
                            (
                              name                => "tangnano20k_top",
                              micro_image_size    => MICRO_IMAGE_SIZE,
                              shifts              => SHIFTS,
                              interpolation_order => INTERPOLATION_ORDER,
                              hold                => HOLD,
                              max_columns         => MAX_COLUMNS,
                              exact               => EXACT,
                              fraction_bits       => FRACTION_BITS,
                              guard_bits          => GUARD_BITS,
                              broadcast_taps      => BROADCAST_TAPS,
                              engine              => ENGINE,
                              box                 => BOX
                            );

  constant PATTERN : timing_t := mode_timing
                                 (
                                   "tangnano20k_top",
                                   PATTERN_H_ACTIVE,
                                   PATTERN_H_FRONT,
                                   PATTERN_H_SYNC,
                                   PATTERN_H_BACK,
                                   PATTERN_V_ACTIVE,
                                   PATTERN_V_FRONT,
                                   PATTERN_V_SYNC,
                                   PATTERN_V_BACK,
                                   false,
                                   false
                                 );

  -- Clocks and reset.
  signal clk    : std_logic;
  signal clk_x5 : std_logic;
  signal locked : std_logic;
  signal stop   : std_logic;
  signal reset  : std_logic;

  -- Settings of the keys: the slice, and whether the focus sweeps.
  signal choice : picture_choice_t;
  signal going  : std_logic;

  -- The light field, refocused, with black sides, as words of the lanes.
  signal drawn : video_t;
  signal shown : video_t;
  signal wide  : video_t;
  signal words : std_logic_vector(10 * CHANNELS + 9 downto 0);
  signal out_p : std_logic_vector(CHANNELS downto 0);
  signal out_n : std_logic_vector(CHANNELS downto 0);

  -- States that the LEDs show.
  signal following    : std_logic;
  signal video_errors : std_logic_vector(VIDEO_ERROR_BITS - 1 downto 0);
  signal errors_now   : std_logic_vector(ERRORS - 1 downto 0) := (others => '0');

begin

  -- The oscillator is the only source: there is no input clock to choose.
  clocks : entity work.display_clocks
    port map (
      clk_27 => clk_27,
      clk    => clk,
      clk_x5 => clk_x5,
      locked => locked
    );

  -- Everything is in reset until the PLL has locked.
  stop <= not locked;

  reset_of_pixels : entity work.reset_bridge
    port map (
      clk     => clk,
      request => stop,
      reset   => reset
    );

  -- Without a serial port and an input, the keys make all settings.
  control : entity work.demo_control
    generic map (
      SLICES        => slices_of(CORE),
      FRAMES        => SWEEP_FRAMES,
      BUTTON_STABLE => BUTTON_STABLE
    )
    port map (
      clk      => clk,
      reset    => reset,
      v_sync   => drawn.v_sync,
      key_stop => key_stop,
      key_step => key_step,
      choice   => choice,
      going    => going
    );

  -- Light field and timing are made here, so there is no source to wait for.
  own : entity work.own_light_field
    generic map (
      GEOMETRY      => CORE.geometry,
      FRAME_COLUMNS => PATTERN_H_ACTIVE,
      FRAME_ROWS    => PATTERN_V_ACTIVE
    )
    port map (
      clk    => clk,
      reset  => reset,
      timing => PATTERN,
      video  => drawn
    );

  -- The text is at the bottom; there is no sensor to calibrate.
  picture : entity work.refocus_video
    generic map (
      CORE => CORE
    )
    port map (
      clk         => clk,
      reset       => reset,
      choice      => choice,
      text_place  => "10",
      text_errors => errors_now,
      load        => NO_LOAD,
      in_video    => drawn,
      out_video   => shown,
      following   => following,
      errors      => video_errors
    );

  -- The core must fit the device's block RAM, so its lines are shorter than any HDMI mode's; black columns fill them.
  sides : entity work.black_sides
    generic map (
      COLUMNS => SIDE_COLUMNS
    )
    port map (
      clk       => clk,
      reset     => reset,
      in_video  => shown,
      out_video => wide
    );

  -- Pixels and words have one clock: no crossing.
  transmitter : entity work.tmds_transmitter
    port map (
      clk      => clk,
      reset    => reset,
      video    => wide,
      tx_clk   => clk,
      tx_reset => reset,
      tx_words => words
    );

  -- The clock is sent as a word of five ones and five zeros by an equal output, so that it leaves in step with the
  -- data.
  lane : for c in 0 to CHANNELS generate

    link_out : entity work.serial_output
      port map (
        clk    => clk,
        clk_x5 => clk_x5,
        reset  => reset,
        word   => words(10 * c + 9 downto 10 * c),
        data_p => out_p(c),
        data_n => out_n(c)
      );

  end generate lane;

  out_data_p <= out_p(CHANNELS - 1 downto 0);
  out_data_n <= out_n(CHANNELS - 1 downto 0);
  out_clk_p  <= out_p(CHANNELS);
  out_clk_n  <= out_n(CHANNELS);

  collect_errors : process (clk) is
  begin

    if rising_edge(clk) then
      -- Errors stay until the reset, so that the LED also shows a short one. The last bit is for words of a receiver,
      -- which does not exist here.
      errors_now(VIDEO_ERROR_BITS - 1 downto 0) <= errors_now(VIDEO_ERROR_BITS - 1 downto 0) or video_errors;
      if reset = '1' then
        errors_now <= (others => '0');
      end if;

      led_n(0)          <= not following;
      led_n(1)          <= not going;
      led_n(4 downto 2) <= not choice.slice(2 downto 0);
      led_n(5)          <= '1';
      if errors_now /= "00000" then
        led_n(5) <= '0';
      end if;
    end if;

  end process collect_errors;

end architecture rtl;
