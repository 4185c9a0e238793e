-- SPDX-License-Identifier: Apache-2.0
-- From the serial line to the picture: the serial port of load_ports, and the video path with a sensor whose
-- calibration comes over the line. While nothing is shown the pixel clock stands but for the words: the host does not
-- wait for a simulation of the video path.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.core_pkg.all;
use work.picture_pkg.all;
use work.resample_pkg.all;
use work.video_pkg.all;

entity load_picture is
  generic (
    DESCRIPTION      : string;
    BIT_CLOCKS       : positive;
    MICRO_IMAGE_SIZE : positive;
    SHIFTS           : string;
    MAX_COLUMNS      : positive
  );
  port (
    clk       : in    std_logic;
    reset     : in    std_logic;
    playing   : in    std_logic;
    line_in   : in    std_logic;
    line_out  : out   std_logic;
    choice    : in    picture_choice_t;
    in_video  : in    video_t;
    out_video : out   video_t;
    on_show   : out   on_show_t;
    following : out   std_logic;
    errors    : out   std_logic_vector(3 downto 0)
  );
end entity load_picture;

architecture test of load_picture is

  constant CORE : core_t := picture_core_of
                            (
                              name             => "load_picture",
                              micro_image_size => MICRO_IMAGE_SIZE,
                              shifts           => SHIFTS,
                              max_columns      => MAX_COLUMNS
                            );

  signal load_write   : std_logic;
  signal load_kind    : std_logic_vector(1 downto 0);
  signal load_address : std_logic_vector(19 downto 0);
  signal load_data    : std_logic_vector(39 downto 0);
  -- The same half a clock later, and the clock of the video path.
  signal word      : load_t    := ('0', "00", (others => '0'), (others => '0'));
  signal runs      : std_logic := '1';
  signal pixel_clk : std_logic;

begin

  -- A clock that is gated between its falling edges has no short pulses.
  pixel_clk <= clk and runs;

  crossing : process (clk) is
  begin

    if falling_edge(clk) then
      runs <= playing or load_write or reset;
      word <= (load_write, load_kind, load_address, load_data);
    end if;

  end process crossing;

  serial : entity work.load_ports
    generic map (
      DESCRIPTION => DESCRIPTION,
      BIT_CLOCKS  => BIT_CLOCKS
    )
    port map (
      clk          => clk,
      reset        => reset,
      line_in      => line_in,
      line_out     => line_out,
      value        => open,
      set_slice    => open,
      busy         => '0',
      load_write   => load_write,
      load_kind    => load_kind,
      load_address => load_address,
      load_data    => load_data
    );

  video : entity work.refocus_video
    generic map (
      CORE => CORE
    )
    port map (
      clk         => pixel_clk,
      reset       => reset,
      choice      => choice,
      load        => word,
      in_video    => in_video,
      out_video   => out_video,
      on_show     => on_show,
      following   => following,
      unsupported => open,
      varying     => open,
      timing      => open,
      errors      => errors
    );

end architecture test;
