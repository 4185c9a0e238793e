-- SPDX-License-Identifier: Apache-2.0
-- picture_core with a generic for each field of its core, to elaborate it alone.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.core_pkg.all;
use work.fault_pkg.all;
use work.picture_pkg.all;
use work.video_pkg.all;

entity picture_ports is
  generic (
    MICRO_IMAGE_SIZE    : positive range 1 to 128;
    SHIFTS              : string;
    INTERPOLATION_ORDER : natural range 0 to 3          := 0;
    HOLD                : boolean                       := false;
    MAX_COLUMNS         : positive range 1 to 8192;
    CHANNELS            : positive range 1 to 3         := 3;
    EXACT               : boolean                       := true;
    FRACTION_BITS       : natural range 0 to 12         := 8;
    GUARD_BITS          : natural range 0 to 12         := 2;
    BROADCAST_TAPS      : natural                       := 0;
    ENGINE              : string                        := "fir";
    OUTPUTS             : string                        := "r";
    RADIUS              : natural range 0 to 8          := 1;
    CONFIDENCE          : natural range 0 to 1073741823 := 0;
    VOTE_RADIUS         : natural range 0 to 4          := 0;
    COLOURS             : string                        := "";
    BOX                 : string                        := "";
    SHARP_TOO           : boolean                       := false
  );
end entity picture_ports;

architecture test of picture_ports is

  constant CORE : core_t := picture_core_of
                            (
                              name                => "picture_ports",
                              micro_image_size    => MICRO_IMAGE_SIZE,
                              shifts              => SHIFTS,
                              interpolation_order => INTERPOLATION_ORDER,
                              hold                => HOLD,
                              max_columns         => MAX_COLUMNS,
                              channels            => CHANNELS,
                              exact               => EXACT,
                              fraction_bits       => FRACTION_BITS,
                              guard_bits          => GUARD_BITS,
                              broadcast_taps      => BROADCAST_TAPS,
                              engine              => ENGINE,
                              outputs             => OUTPUTS,
                              radius              => RADIUS,
                              vote_radius         => VOTE_RADIUS,
                              colours             => COLOURS,
                              box                 => BOX,
                              sharp_too           => SHARP_TOO
                            );

  signal choice      : picture_choice_t;
  signal in_stream   : stream_t;
  signal out_stream  : stream_t;
  signal in_ready    : std_logic;
  signal slice       : std_logic_vector(7 downto 0);
  signal place       : std_logic_vector(1 downto 0);
  signal error_flags : std_logic_vector(STREAM_FAULT_BITS - 1 downto 0);

begin

  picture : entity work.picture_core
    generic map (
      CORE        => CORE,
      OUTPUTS     => OUTPUTS,
      RADIUS      => RADIUS,
      CONFIDENCE  => CONFIDENCE,
      VOTE_RADIUS => VOTE_RADIUS,
      COLOURS     => COLOURS
    )
    port map (
      clk           => '0',
      reset         => '0',
      columns       => x"0000",
      rows          => x"0000",
      picture_rows  => x"0000",
      choice        => choice,
      s_axis        => in_stream,
      s_axis_tready => in_ready,
      m_axis        => out_stream,
      m_axis_tready => '0',
      m_axis_tid    => slice,
      m_axis_tdest  => place,
      error_flags   => error_flags
    );

end architecture test;
