-- SPDX-License-Identifier: Apache-2.0
-- The ULX3S from the wires of a camera to the serial bits of its HDMI output.
--
-- Packets of input.bin (dphy_camera); words of the three channels go to output.bin (tmds_monitor).

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.camera_pkg.all;

entity ulx3s_camera_bench is
  generic (
    MICRO_IMAGE_SIZE    : positive;
    SHIFTS              : string;
    INTERPOLATION_ORDER : natural := 0;
    HOLD                : boolean := false;
    MAX_COLUMNS         : positive;
    EXACT               : boolean := true;
    FRACTION_BITS       : natural := 0;
    GUARD_BITS          : natural := 0;
    BROADCAST_TAPS      : natural := 0;
    ENGINE              : string;
    BOX                 : string  := "";
    PATTERN_H_ACTIVE    : positive;
    PATTERN_H_FRONT     : positive;
    PATTERN_H_SYNC      : positive;
    PATTERN_H_BACK      : positive;
    PATTERN_V_ACTIVE    : positive;
    PATTERN_V_FRONT     : positive;
    PATTERN_V_SYNC      : positive;
    PATTERN_V_BACK      : positive;
    BIT_PS              : positive;
    -- Words of a channel that are written.
    WORDS : positive
  );
end entity ulx3s_camera_bench;

architecture test of ulx3s_camera_bench is

  -- Half a period of 25 MHz.
  constant HALF_PERIOD : time := 20 ns;

  signal watching : boolean   := false;
  signal writing  : boolean   := false;
  signal taken    : natural   := 0;
  signal done     : boolean   := false;
  signal begun    : boolean   := false;
  signal clk_25   : std_logic := '0';
  signal reset_n  : std_logic := '0';
  signal clk_p    : std_logic;
  signal clk_n    : std_logic;
  signal data_p   : std_logic_vector(3 downto 0);
  signal data_n   : std_logic_vector(3 downto 0);
  signal hs_clk   : std_logic;
  signal hs_data  : std_logic_vector(1 downto 0);
  signal lp_data  : std_logic_vector(3 downto 0);
  signal scl      : std_logic;
  signal sda      : std_logic;
  signal out_clk  : std_logic;
  signal out_data : std_logic_vector(2 downto 0);
  signal led      : std_logic_vector(7 downto 0);

begin

  clk_25  <= not clk_25 after HALF_PERIOD when not done else
             '0';
  reset_n <= '1' after 1 us;
  -- By then the calibration is in.
  begun <= true after 300 us;
  scl   <= 'H';
  sda   <= 'H';

  -- As the pins' receivers see the wires: a pair is a bit, and each line of a data lane goes to a
  -- pin for low power.
  hs_clk <= '1' when clk_p = 'H' else
            '0';

  receivers : for i in 0 to 1 generate
    hs_data(i)         <= to_x01(data_p(i));
    lp_data(2 * i + 1) <= '1' when data_p(i) = '1' else
                          '0';
    lp_data(2 * i)     <= '1' when data_n(i) = '1' else
                          '0';
  end generate receivers;

  camera : entity work.dphy_camera
    generic map (
      LANES  => CAMERA_LANES,
      BIT_PS => BIT_PS
    )
    port map (
      start  => begun,
      clk_p  => clk_p,
      clk_n  => clk_n,
      data_p => data_p,
      data_n => data_n,
      sent   => open
    );

  board : entity work.ulx3s_camera_top
    generic map (
      MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
      SHIFTS              => SHIFTS,
      INTERPOLATION_ORDER => INTERPOLATION_ORDER,
      HOLD                => HOLD,
      MAX_COLUMNS         => MAX_COLUMNS,
      EXACT               => EXACT,
      FRACTION_BITS       => FRACTION_BITS,
      GUARD_BITS          => GUARD_BITS,
      BROADCAST_TAPS      => BROADCAST_TAPS,
      ENGINE              => ENGINE,
      BOX                 => BOX,
      PATTERN_H_ACTIVE    => PATTERN_H_ACTIVE,
      PATTERN_H_FRONT     => PATTERN_H_FRONT,
      PATTERN_H_SYNC      => PATTERN_H_SYNC,
      PATTERN_H_BACK      => PATTERN_H_BACK,
      PATTERN_V_ACTIVE    => PATTERN_V_ACTIVE,
      PATTERN_V_FRONT     => PATTERN_V_FRONT,
      PATTERN_V_SYNC      => PATTERN_V_SYNC,
      PATTERN_V_BACK      => PATTERN_V_BACK,
      SWEEP_FRAMES        => 2,
      BUTTON_STABLE       => 4,
      MILLISECOND         => 2000
    )
    port map (
      clk_25         => clk_25,
      reset_n        => reset_n,
      cam_hs_clk     => hs_clk,
      cam_hs_data    => hs_data,
      cam_lp_data    => lp_data,
      cam_scl        => scl,
      cam_sda        => sda,
      cam_enable     => open,
      out_clk        => out_clk,
      out_data       => out_data,
      uart_rx        => '1',
      uart_tx        => open,
      button_stop    => '0',
      button_step    => '0',
      led            => led,
      wifi_gpio0     => '1',
      wifi_gpio0_new => '1'
    );

  watching <= begun and taken < WORDS;

  monitor : entity work.tmds_monitor
    generic map (
      NOMINAL_PERIOD => 2 * HALF_PERIOD
    )
    port map (
      clk      => out_clk,
      data     => out_data,
      watching => watching,
      is_open  => writing,
      words    => taken
    );

  finish : process is
  begin

    wait until taken = WORDS and not writing;

    assert led(4 downto 3) = "00"
      report "the board tells a fault: lanes " & std_logic'image(led(3)) & ", raster or core " & std_logic'image(led(4))
      severity failure;

    done <= true;
    wait;

  end process finish;

end architecture test;
