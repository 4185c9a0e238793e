-- SPDX-License-Identifier: Apache-2.0
-- Lanes of a camera into an ECP5, which has no D-PHY: pins with deserialisers, and a dphy_lane for each lane.
--
-- Each line goes to two pins: one of a differential pair (LVDS with a 100 ohm termination) for high speed, and one with
-- 1.2 V levels for low power. The termination is always on, so the two lines of LP-01 differ less than they should, and
-- nothing depends on that state: bursts are recognised by LP-11 followed by LP-00. The clock lane starts before the
-- data lanes and stops after them, so its low-power levels are not used; it may stand still between bursts.
--
-- The clock lane goes to an edge clock (its pins must be able to). Half of that is bits_clk, with four bits of a lane;
-- half of that again, made by a register, is byte_clk. A byte changes half a period before the edge that takes it. Data
-- arrive centred to the clock lane; DELAYG compensates the delay of the clock. For the slowest ECP5 Lattice gives 624
-- Mb/s (GDDRX2, FPGA-DS-02012) at the left and right banks: see docs/resampling.md.
--
-- Latency: 2 to 3 clocks of byte_clk and those of dphy_lane. Throughput: a byte of each lane each clock of byte_clk.
-- Equation: that of dphy_lane.

library ieee;
use ieee.std_logic_1164.all;

library ecp5u;
use ecp5u.components.all;

library work;
use work.math_pkg.all;

entity soft_dphy_input is
  generic (
    -- Lanes: 1, 2 or 4.
    LANES : positive range 1 to 4;
    -- SETTLE of dphy_lane.
    SETTLE : natural range 0 to 255
  );
  port (
    -- Differential pairs of the clock lane and of the data lanes, by their positive pins.
    hs_clk  : in    std_logic;
    hs_data : in    std_logic_vector(LANES - 1 downto 0);
    -- Pins for low power, two for each data lane, the positive line in the higher one.
    lp_data : in    std_logic_vector(2 * LANES - 1 downto 0);
    -- Bytes of bursts, as csi_receiver takes them.
    byte_clk    : out   std_logic;
    lane_valid  : out   std_logic_vector(LANES - 1 downto 0);
    lane_sync   : out   std_logic_vector(LANES - 1 downto 0);
    lane_data   : out   std_logic_vector(8 * LANES - 1 downto 0);
    lane_missed : out   std_logic_vector(LANES - 1 downto 0)
  );
end entity soft_dphy_input;

architecture rtl of soft_dphy_input is

  constant TAKES_LANES : boolean := takes(LANES /= 3, "soft_dphy_input: LANES is 3, expected 1, 2 or 4");

  -- The clock lane as an edge clock; half of it, with four bits each clock; a quarter of it, with eight bits.
  signal edge_clk : std_logic;
  signal bits_clk : std_logic;
  signal half_clk : std_logic := '0';

begin

  byte_clk <= half_clk;

  edge_clock : component eclksyncb
    port map (
      eclki => hs_clk,
      stop  => '0',
      eclko => edge_clk
    );

  bits_clock : component clkdivf
    generic map (
      DIV => "2.0"
    )
    port map (
      clki    => edge_clk,
      rst     => '0',
      alignwd => '0',
      cdivx   => bits_clk
    );

  -- No reset: either phase will do, because bytes are aligned behind it.
  divide : process (bits_clk) is
  begin

    if rising_edge(bits_clk) then
      half_clk <= not half_clk;
    end if;

  end process divide;

  lane : for i in 0 to LANES - 1 generate

    -- Bits of the lane behind its delay; four bits; the four before; a byte of both.
    signal delayed : std_logic;
    signal nibble  : std_logic_vector(3 downto 0);
    signal earlier : std_logic_vector(3 downto 0) := "0000";
    signal held    : std_logic_vector(7 downto 0) := x"00";

  begin

    delay : component delayg
      generic map (
        DEL_MODE => "ECLK_CENTERED"
      )
      port map (
        a => hs_data(i),
        z => delayed
      );

    sample : component iddrx2f
      port map (
        d       => delayed,
        sclk    => bits_clk,
        eclk    => edge_clk,
        rst     => '0',
        alignwd => '0',
        q3      => nibble(3),
        q2      => nibble(2),
        q1      => nibble(1),
        q0      => nibble(0)
      );

    collect : process (bits_clk) is
    begin

      -- The primitive's first bit is the earliest, so the older half is the low one.
      if rising_edge(bits_clk) then
        earlier <= nibble;
        -- half_clk falls with this edge and rises with the next edge of bits_clk, half a period of half_clk later: held
        -- is taken then.
        if half_clk = '1' then
          held <= nibble & earlier;
        end if;
      end if;

    end process collect;

    bursts : entity work.dphy_lane
      generic map (
        SETTLE => SETTLE
      )
      port map (
        clk         => half_clk,
        low_power   => lp_data(2 * i + 1 downto 2 * i),
        bits        => held,
        lane_valid  => lane_valid(i),
        lane_sync   => lane_sync(i),
        lane_data   => lane_data(8 * i + 7 downto 8 * i),
        lane_missed => lane_missed(i)
      );

  end generate lane;

end architecture rtl;
