-- SPDX-License-Identifier: Apache-2.0
-- From the serial line to the picture: the serial port of load_ports, and the video path with a sensor whose
-- calibration comes over the line. While nothing is shown the pixel clock stands but for the words: the host does not
-- wait for a simulation of the video path.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.video_pkg.all;

entity load_picture is
  generic (
    DESCRIPTION      : string;
    BIT_CLOCKS       : positive;
    MICRO_IMAGE_SIZE : positive;
    SHIFTS           : string;
    MAX_COLUMNS      : positive;
    RAW_COLUMNS      : positive;
    RAW_ROWS         : positive;
    LINES            : positive
  );
  port (
    clk          : in    std_logic;
    reset        : in    std_logic;
    playing      : in    std_logic;
    line_in      : in    std_logic;
    line_out     : out   std_logic;
    pass_through : in    std_logic;
    slice        : in    std_logic_vector(7 downto 0);
    sweep        : in    std_logic;
    sweep_frames : in    std_logic_vector(7 downto 0);
    shown        : in    std_logic_vector(1 downto 0);
    in_active    : in    std_logic;
    in_h_sync    : in    std_logic;
    in_v_sync    : in    std_logic;
    in_pixel     : in    std_logic_vector(23 downto 0);
    out_active   : out   std_logic;
    out_h_sync   : out   std_logic;
    out_v_sync   : out   std_logic;
    out_pixel    : out   std_logic_vector(23 downto 0);
    out_shown    : out   std_logic_vector(1 downto 0);
    following    : out   std_logic;
    errors       : out   std_logic_vector(3 downto 0)
  );
end entity load_picture;

architecture test of load_picture is

  signal load_write   : std_logic;
  signal load_kind    : std_logic_vector(1 downto 0);
  signal load_address : std_logic_vector(19 downto 0);
  signal load_data    : std_logic_vector(39 downto 0);
  -- The same half a clock later, and the clock of the video path.
  signal word_write   : std_logic := '0';
  signal word_kind    : std_logic_vector(1 downto 0);
  signal word_address : std_logic_vector(19 downto 0);
  signal word_data    : std_logic_vector(39 downto 0);
  signal runs         : std_logic := '1';
  signal pixel_clk    : std_logic;

begin

  pixel_clk <= clk and runs;

  cross : process (clk) is
  begin

    if falling_edge(clk) then
      runs         <= playing or load_write or reset;
      word_write   <= load_write;
      word_kind    <= load_kind;
      word_address <= load_address;
      word_data    <= load_data;
    end if;

  end process cross;

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
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFTS           => SHIFTS,
      MAX_COLUMNS      => MAX_COLUMNS,
      CHANNELS         => 1,
      OUTPUTS          => "rm",
      SENSOR           => true,
      RAW_COLUMNS      => RAW_COLUMNS,
      RAW_ROWS         => RAW_ROWS,
      LINES            => LINES
    )
    port map (
      clk          => pixel_clk,
      reset        => reset,
      pass_through => pass_through,
      slice        => slice,
      sweep        => sweep,
      sweep_frames => sweep_frames,
      shown        => shown,
      load_write   => word_write,
      load_kind    => word_kind,
      load_address => word_address,
      load_data    => word_data,
      in_active    => in_active,
      in_h_sync    => in_h_sync,
      in_v_sync    => in_v_sync,
      in_pixel     => in_pixel,
      out_active   => out_active,
      out_h_sync   => out_h_sync,
      out_v_sync   => out_v_sync,
      out_pixel    => out_pixel,
      out_slice    => open,
      out_shown    => out_shown,
      out_raw      => open,
      following    => following,
      unsupported  => open,
      timing       => open,
      errors       => errors
    );

end architecture test;
