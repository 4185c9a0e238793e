-- SPDX-License-Identifier: Apache-2.0
-- refocus_video with a generic for each field of its core: simulators take no records from a test in Python.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.core_pkg.all;
use work.fault_pkg.all;
use work.picture_pkg.all;
use work.resample_pkg.all;
use work.video_pkg.all;

entity video_ports is
  generic (
    MICRO_IMAGE_SIZE    : positive range 1 to 128;
    SHIFTS              : string;
    INTERPOLATION_ORDER : natural range 0 to 3  := 0;
    HOLD                : boolean               := false;
    MAX_COLUMNS         : positive range 1 to 8192;
    EXACT               : boolean               := true;
    FRACTION_BITS       : natural range 0 to 12 := 8;
    GUARD_BITS          : natural range 0 to 12 := 2;
    BROADCAST_TAPS      : natural               := 0;
    ENGINE              : string                := "fir";
    BOX                 : string                := ""
  );
  port (
    clk         : in    std_logic;
    reset       : in    std_logic;
    choice      : in    picture_choice_t;
    load        : in    load_t;
    in_video    : in    video_t;
    out_video   : out   video_t;
    on_show     : out   on_show_t;
    following   : out   std_logic;
    unsupported : out   std_logic;
    varying     : out   std_logic;
    timing      : out   timing_t;
    errors      : out   std_logic_vector(VIDEO_ERROR_BITS - 1 downto 0)
  );
end entity video_ports;

architecture test of video_ports is

  constant CORE : core_t := picture_core_of
                            (
                              name                => "video_ports",
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

begin

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
      out_video   => out_video,
      on_show     => on_show,
      following   => following,
      unsupported => unsupported,
      varying     => varying,
      timing      => timing,
      errors      => errors
    );

end architecture test;
