-- SPDX-License-Identifier: Apache-2.0
-- What any board shows of its video: the refocused picture, and the text over it where screen_pkg has one.
--
-- Latency: see refocus_video, and that of the text. Throughput: one pixel each clock.
-- Equation: out picture = refocus(in picture), see raster_refocuser.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.hdmi_pkg.all;
use work.picture_pkg.all;
use work.refocus_pkg.all;
use work.refocuser_pkg.all;
use work.resample_pkg.all;
use work.screen_pkg.all;
use work.video_pkg.all;

entity shown_video is
  generic (
    -- How the core computes; its slices and its engine, see raster_refocuser.
    CORE   : core_t;
    SHIFTS : string;
    ENGINE : string
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- What is to be shown, and the place of the text: 0 none, 1 at the top, 2 at the bottom.
    choice     : in    picture_choice_t;
    text_place : in    std_logic_vector(1 downto 0);
    -- Errors that the text tells.
    errors : in    std_logic_vector(ERRORS - 1 downto 0);
    -- The sensor's calibration.
    load : in    load_t;
    -- Video in, and what is shown.
    in_video  : in    video_t;
    out_video : out   video_t;
    -- As refocus_video has them.
    following    : out   std_logic;
    unsupported  : out   std_logic;
    varying      : out   std_logic;
    timing       : out   timing_t;
    video_errors : out   std_logic_vector(3 downto 0)
  );
end entity shown_video;

architecture rtl of shown_video is

  constant REFUSED : boolean := not takes_shifts("shown_video", SHIFTS, CORE.max_columns);

  -- The ruler under the text has a field for each.
  constant SLICES : positive := slice_count(SHIFTS);

  -- Before the text is laid over it, and what the text says of it.
  signal bare       : video_t;
  signal on_show    : on_show_t;
  signal timing_now : timing_t;

begin

  -- Out to the board, and to the text, which is placed by the number of rows.
  timing <= timing_now;

  video : entity work.refocus_video
    generic map (
      MICRO_IMAGE_SIZE    => CORE.micro_image_size,
      SHIFTS              => SHIFTS,
      INTERPOLATION_ORDER => CORE.interpolation_order,
      HOLD                => CORE.hold,
      MAX_COLUMNS         => CORE.max_columns,
      EXACT               => CORE.exact,
      FRACTION_BITS       => CORE.fraction_bits,
      GUARD_BITS          => CORE.guard_bits,
      BROADCAST_TAPS      => CORE.broadcast_taps,
      ENGINE              => ENGINE
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

  -- A board without a screen text pays nothing for it.
  no_text : if not WITH_TEXT generate
    out_video <= bare;
  end generate no_text;

  text : if WITH_TEXT generate

    -- What each output number shows depends on the build; the text names the kind, not the number.
    constant KINDS : kinds_t := output_kinds(OUTPUTS);

    -- For text_overlay: shown at all, at the bottom, what is on show, and the lines of the picture.
    signal show   : std_logic;
    signal bottom : std_logic;
    signal kind   : std_logic_vector(1 downto 0);
    signal rows   : std_logic_vector(11 downto 0);

  begin

    -- 1: at the top, 2: at the bottom. 3 does not come, and would count as at the bottom.
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
