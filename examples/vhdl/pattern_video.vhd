-- SPDX-License-Identifier: Apache-2.0
-- An example of the video path: a synthetic light field as video, refocused under the same timing.
--
-- The generics of the refocuser are those that `plenofir plan rgb-480p` finds. A camera or a receiver takes the
-- place of the pattern; `in_...` shows what the refocuser gets.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.video_pkg.all;

entity pattern_video is
  port (
    -- Pixel clock.
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Video timing, see mode_timing.
    timing : in    std_logic_vector(TIMING_BITS - 1 downto 0);
    -- 0: a = 0, 1: a = 4/3.
    slice : in    std_logic_vector(7 downto 0);
    -- Before the refocuser: red in the low bits of the pixel.
    in_active : out   std_logic;
    in_pixel  : out   std_logic_vector(23 downto 0);
    -- Behind it.
    out_active : out   std_logic;
    out_h_sync : out   std_logic;
    out_v_sync : out   std_logic;
    out_pixel  : out   std_logic_vector(23 downto 0);
    -- What comes out is refocused.
    following : out   std_logic;
    -- As in refocus_video.
    errors : out   std_logic_vector(3 downto 0)
  );
end entity pattern_video;

architecture rtl of pattern_video is

  signal active : std_logic;
  signal h_sync : std_logic;
  signal v_sync : std_logic;
  signal pixel  : std_logic_vector(23 downto 0);

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
      active => active,
      h_sync => h_sync,
      v_sync => v_sync,
      pixel  => pixel
    );

  refocuser : entity work.refocus_video
    generic map (
      MICRO_IMAGE_SIZE => 3,
      SHIFTS           => "0 4",
      MAX_COLUMNS      => 640,
      EXACT            => true,
      ENGINE           => "moving_sum"
    )
    port map (
      clk          => clk,
      reset        => reset,
      pass_through => '0',
      slice        => slice,
      sweep        => '0',
      sweep_frames => x"00",
      shown        => "00",
      load_write   => '0',
      load_kind    => "00",
      load_address => x"00000",
      load_data    => x"0000000000",
      in_active    => active,
      in_h_sync    => h_sync,
      in_v_sync    => v_sync,
      in_pixel     => pixel,
      out_active   => out_active,
      out_h_sync   => out_h_sync,
      out_v_sync   => out_v_sync,
      out_pixel    => out_pixel,
      out_slice    => open,
      out_shown    => open,
      out_raw      => open,
      following    => following,
      unsupported  => open,
      timing       => open,
      errors       => errors
    );

  in_active <= active;
  in_pixel  <= pixel;

end architecture rtl;
