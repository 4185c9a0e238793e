-- SPDX-License-Identifier: Apache-2.0
-- The hard D-PHY of CrossLink-NX on the wires of dphy_camera.

library ieee;
use ieee.std_logic_1164.all;

entity bench_phy is
  generic (
    LANES      : positive range 1 to 4;
    CONTINUOUS : boolean;
    SETTLE     : natural
  );
  port (
    clk_p       : inout std_logic;
    clk_n       : inout std_logic;
    data_p      : inout std_logic_vector(3 downto 0);
    data_n      : inout std_logic_vector(3 downto 0);
    sync_clk    : in    std_logic;
    reset       : in    std_logic;
    byte_clk    : out   std_logic;
    lane_valid  : out   std_logic_vector(LANES - 1 downto 0);
    lane_sync   : out   std_logic_vector(LANES - 1 downto 0);
    lane_data   : out   std_logic_vector(8 * LANES - 1 downto 0);
    lane_missed : out   std_logic_vector(LANES - 1 downto 0) := (others => '0')
  );
end entity bench_phy;

architecture test of bench_phy is

begin

  phy : entity work.dphy_input
    generic map (
      LANES      => LANES,
      SYNC_MHZ   => 60,
      CONTINUOUS => CONTINUOUS
    )
    port map (
      clk_p      => clk_p,
      clk_n      => clk_n,
      data_p     => data_p,
      data_n     => data_n,
      sync_clk   => sync_clk,
      reset      => reset,
      byte_clk   => byte_clk,
      lane_valid => lane_valid,
      lane_sync  => lane_sync,
      lane_data  => lane_data
    );

end architecture test;
