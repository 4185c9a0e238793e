-- SPDX-License-Identifier: Apache-2.0
-- An example of the video path: a synthetic light field as video, refocused under the same timing.
--
-- The generics of the refocuser are those that `plenofir plan rgb-480p` finds. A camera or a receiver takes the
-- place of the pattern; `in_video` shows what the refocuser gets.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.core_pkg.all;
use work.picture_pkg.all;
use work.resample_pkg.all;
use work.video_pkg.all;

entity pattern_video is
  port (
    -- Pixel clock.
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Video timing, see mode_timing.
    timing : in    timing_t;
    -- 0: a = 0, 1: a = 4/3.
    slice : in    std_logic_vector(7 downto 0);
    -- Before the refocuser, and behind it.
    in_video  : out   video_t;
    out_video : out   video_t;
    -- What comes out is refocused.
    following : out   std_logic;
    -- As in refocus_video.
    errors : out   std_logic_vector(3 downto 0)
  );
end entity pattern_video;

architecture rtl of pattern_video is

  constant CORE : core_t := picture_core_of
                            (
                              name             => "pattern_video",
                              micro_image_size => 3,
                              shifts           => "0 4",
                              max_columns      => 640,
                              exact            => true,
                              engine           => "moving_sum"
                            );

  -- There is no sensor, and so no calibration to load.
  constant NO_LOAD : load_t := ('0', "00", (others => '0'), (others => '0'));

  signal choice : picture_choice_t;
  signal drawn  : video_t;

begin

  pattern : entity work.light_field_pattern
    generic map (
      MICRO_IMAGE_SIZE => 3,
      LEFT_SHIFT       => 0,
      MIDDLE_SHIFT     => 4,
      RIGHT_SHIFT      => 0,
      MIDDLE_BEGIN     => 9,
      RIGHT_BEGIN      => 18
    )
    port map (
      clk    => clk,
      reset  => reset,
      timing => timing,
      video  => drawn
    );

  choice.pass_through <= '0';
  choice.slice        <= slice;
  choice.sweep        <= '0';
  choice.sweep_frames <= x"00";
  choice.shown        <= "00";

  refocuser : entity work.refocus_video
    generic map (
      CORE => CORE
    )
    port map (
      clk         => clk,
      reset       => reset,
      choice      => choice,
      load        => NO_LOAD,
      in_video    => drawn,
      out_video   => out_video,
      on_show     => open,
      following   => following,
      unsupported => open,
      varying     => open,
      timing      => open,
      errors      => errors
    );

  in_video <= drawn;

end architecture rtl;
