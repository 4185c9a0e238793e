-- SPDX-License-Identifier: Apache-2.0
-- Pins of an ECP5 on the wires of dphy_camera: a pair at equal levels reads as noise would, a pin for low power takes
-- high speed for low.

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
    lane_missed : out   std_logic_vector(LANES - 1 downto 0)
  );
end entity bench_phy;

architecture test of bench_phy is

  signal hs_clk  : std_logic;
  signal hs_data : std_logic_vector(LANES - 1 downto 0);
  signal lp_data : std_logic_vector(2 * LANES - 1 downto 0);

begin

  hs_clk <= '1' when clk_p = 'H' else
            '0';

  receivers : for i in 0 to LANES - 1 generate
    hs_data(i)         <= to_x01(data_p(i));
    lp_data(2 * i + 1) <= '1' when data_p(i) = '1' else
                          '0';
    lp_data(2 * i)     <= '1' when data_n(i) = '1' else
                          '0';
  end generate receivers;

  -- A receiver drives no pin; ports of both families are alike for the bench.
  clk_p  <= 'Z';
  clk_n  <= 'Z';
  data_p <= "ZZZZ";
  data_n <= "ZZZZ";

  phy : entity work.soft_dphy_input
    generic map (
      LANES  => LANES,
      SETTLE => SETTLE
    )
    port map (
      hs_clk      => hs_clk,
      hs_data     => hs_data,
      lp_data     => lp_data,
      byte_clk    => byte_clk,
      lane_valid  => lane_valid,
      lane_sync   => lane_sync,
      lane_data   => lane_data,
      lane_missed => lane_missed
    );

end architecture test;
