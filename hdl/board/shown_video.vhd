-- SPDX-License-Identifier: Apache-2.0
-- The picture that a board shows: the refocused video, and over it the text if screen_pkg has one.
--
-- Latency: that of refocus_video, and with a text OVERLAY_LATENCY clocks. Throughput: one pixel each clock.
-- Equation: out picture = refocus(in picture), with the text.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.core_pkg.all;
use work.fault_pkg.all;
use work.hdmi_pkg.all;
use work.picture_pkg.all;
use work.resample_pkg.all;
use work.screen_pkg.all;
use work.video_pkg.all;

entity shown_video is
  generic (
    -- The core of the picture (picture_core_of).
    CORE : core_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- What is shown; place of the text: 0 none, 1 at the top, 2 at the bottom.
    choice     : in    picture_choice_t;
    text_place : in    std_logic_vector(1 downto 0);
    -- Errors whose number the text shows.
    errors : in    std_logic_vector(ERRORS - 1 downto 0);
    -- Load port of the sensor's calibration.
    load : in    load_t;
    -- Video in; video out.
    in_video  : in    video_t;
    out_video : out   video_t;
    -- As in refocus_video.
    following    : out   std_logic;
    unsupported  : out   std_logic;
    varying      : out   std_logic;
    timing       : out   timing_t;
    video_errors : out   std_logic_vector(VIDEO_ERROR_BITS - 1 downto 0)
  );
end entity shown_video;

architecture rtl of shown_video is

  -- The ruler under the text has a field for each slice.
  constant SLICES : positive := CORE.geometry.slices;

  -- Video before the text is laid over it, and what that video shows.
  signal bare       : video_t;
  signal on_show    : on_show_t;
  signal timing_now : timing_t;

begin

  -- For the board, and for the text, which is placed by the number of rows.
  timing <= timing_now;

  video : entity work.refocus_video
    generic map (
      CORE => CORE
    )
    port map (
      clk         => clk,
      reset       => reset,
      choice      => choice,
      load        => load,
      in_video    => in_video,
      out_video   => bare,
      on_show     => on_show,
      following   => following,
      unsupported => unsupported,
      varying     => varying,
      timing      => timing_now,
      errors      => video_errors
    );

  -- A board without a text has no overlay.
  no_text : if not WITH_TEXT generate
    out_video <= bare;
  end generate no_text;

  text : if WITH_TEXT generate

    -- The meaning of an output's number depends on the build; the text names the kind of output.
    constant KINDS : kinds_t := output_kinds(OUTPUTS);

    -- For text_overlay: whether it is shown, whether at the bottom, what is shown, and the lines of the picture.
    signal show   : std_logic;
    signal bottom : std_logic;
    signal kind   : std_logic_vector(1 downto 0);
    signal rows   : std_logic_vector(11 downto 0);

  begin

    -- 1: at the top, 2: at the bottom. 3 does not occur and would act like 2.
    show   <= text_place(0) or text_place(1);
    bottom <= text_place(1);
    kind   <= std_logic_vector(to_unsigned(KINDS(to_integer(unsigned(on_show.place))), 2));
    rows   <= std_logic_vector(timing_now.rows);

    overlay : entity work.text_overlay
      generic map (
        SLICES        => SLICES,
        FONT          => FONT,
        TEXTS         => TEXTS,
        TEXT_COLUMNS  => TEXT_COLUMNS,
        LABELS        => LABELS,
        LABEL_COLUMNS => LABEL_COLUMNS,
        COLOURS       => COLOURS
      )
      port map (
        clk       => clk,
        reset     => reset,
        show      => show,
        bottom    => bottom,
        rows      => rows,
        slice     => on_show.slice,
        kind      => kind,
        raw       => on_show.raw,
        errors    => errors,
        in_video  => bare,
        out_video => out_video
      );

  end generate text;

end architecture rtl;
