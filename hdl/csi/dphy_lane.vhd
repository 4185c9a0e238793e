-- SPDX-License-Identifier: Apache-2.0
-- A data lane of a D-PHY behind a device's deserialiser: finds bursts, and the bytes in them.
--
-- A lane at rest has both lines high (LP-11). It goes to high speed through LP-01 and LP-00; both lines then stay below
-- the threshold of the low-power receivers. When the lines have settled, the bits are searched for the sync sequence
-- 00011101, which marks the boundary of bytes. A burst ends with the next LP-11. LP-10 begins another mode, which is
-- skipped, or a burst whose lines are exchanged, which is reported as missed. A lane's clock may stand still while the
-- lane is at rest.
--
-- Latency: 3 clocks from the bits of a byte; 2 to 3 clocks from a level. Throughput: a byte each clock.
-- Equation: data(n) = bits 8n to 8n + 7 behind the sync sequence, the first bit in bit 0.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;

entity dphy_lane is
  generic (
    -- Clocks from LP-00 in which bits are ignored: the standard has 85 ns + 6 bits to 145 ns + 10 bits.
    SETTLE : natural range 0 to 255 := 10
  );
  port (
    -- The lanes' clock, an eighth of the bit rate.
    clk : in    std_logic;
    -- Levels of the lane's two lines at the low-power receivers, the positive line in bit 1; from no clock.
    low_power : in    std_logic_vector(1 downto 0);
    -- Eight bits of the lane, bit 0 first; bytes may begin anywhere.
    bits : in    std_logic_vector(7 downto 0);
    -- Bytes of bursts, as csi_receiver takes them.
    lane_valid : out   std_logic := '0';
    lane_sync  : out   std_logic := '0';
    lane_data  : out   std_logic_vector(7 downto 0);
    -- High for one clock: a burst has ended without a sync, or its lines are exchanged.
    lane_missed : out   std_logic := '0'
  );
end entity dphy_lane;

architecture rtl of dphy_lane is

  -- Levels of the two lines: LP-11 at rest, LP-00 on the way to high speed, LP-10 on the way to another mode.
  constant STOP   : std_logic_vector(1 downto 0) := "11";
  constant BRIDGE : std_logic_vector(1 downto 0) := "00";
  constant ESCAPE : std_logic_vector(1 downto 0) := "10";
  -- LP-01; a lane whose lines are exchanged shows it as LP-10.
  constant REQUEST : std_logic_vector(1 downto 0) := "01";
  -- The sync sequence, its first bit in bit 0.
  constant SYNC_BYTE : std_logic_vector(7 downto 0) := x"B8";

  -- Stands for "no byte begins here".
  constant NO_PLACE : positive := 8;

  -- The earliest place of the sync in a window, or NO_PLACE.
  function sync_place (
    bits_so_far : std_logic_vector(15 downto 0)
  ) return natural is

    variable place : natural range 0 to NO_PLACE;

  begin

    place := NO_PLACE;

    -- The loop ends with the first place, so the earliest match is kept.
    for i in 7 downto 0 loop

      if bits_so_far(i + 7 downto i) = SYNC_BYTE then
        place := i;
      end if;

    end loop;

    return place;

  end function sync_place;

  -- passed_over: state unknown; rest; settling: lines settle; search: for the sync; burst: bytes come; escaped: LP-10
  -- has come; exchanged: only LP-00 has come behind it.
  type state_t is (passed_over, rest, settling, search, burst, escaped, exchanged);

  -- levels of the lines; wait_on: clocks of settling that are left; window: the last sixteen bits, the newest at the
  -- left; phase: where a byte begins in it in this burst; first: the next byte is the burst's first.
  signal levels  : std_logic_vector(1 downto 0);
  signal state   : state_t                       := passed_over;
  signal wait_on : natural range 0 to 255        := 0;
  signal window  : std_logic_vector(15 downto 0) := (others => '0');
  signal phase   : natural range 0 to 7          := 0;
  signal first   : std_logic                     := '0';

begin

  take_levels : entity work.synchroniser
    generic map (
      WIDTH => 2
    )
    port map (
      clk         => clk,
      level       => low_power,
      synchronous => levels
    );

  follow : process (clk) is

    variable place : natural range 0 to NO_PLACE;

  begin

    if rising_edge(clk) then
      -- The window has two bytes, so that a byte beginning anywhere lies in it.
      window <= bits & window(15 downto 8);
      place  := sync_place(window);

      lane_valid  <= '0';
      lane_sync   <= '0';
      lane_missed <= '0';
      lane_data   <= (others => '0');

      -- A shift by the burst's phase. It also runs outside of bursts, when nobody reads the result, which saves a
      -- condition.
      for i in 0 to 7 loop

        if phase = i then
          lane_data <= window(i + 7 downto i);
        end if;

      end loop;

      case state is

        when passed_over =>

          -- This state holds after power-up and behind LP-10. Only LP-11 leads out of it, so a burst that is under way
          -- when the FPGA starts is not entered in its middle.
          null;

        when rest =>

          -- Loaded while the lane is at rest, so it starts afresh with every burst.
          wait_on <= SETTLE;
          if levels = BRIDGE then
            state <= settling;
          elsif levels = ESCAPE then
            state <= escaped;
          end if;

        when escaped =>

          if levels = BRIDGE then
            state <= exchanged;
          elsif levels = REQUEST then
            state <= passed_over;
          end if;

        when exchanged =>

          -- Every other mode has more such levels; a burst whose lines are exchanged has none.
          if levels /= BRIDGE then
            state <= passed_over;
          end if;

        when settling =>

          -- The lines swing while the driver changes, and bits of that time could look like the sync.
          if wait_on = 0 then
            state <= search;
          else
            wait_on <= wait_on - 1;
          end if;

        when search =>

          -- The sync itself is not passed on; the next byte is the burst's first.
          first <= '1';
          if place /= NO_PLACE then
            phase <= place;
            state <= burst;
          end if;

        when burst =>

          first      <= '0';
          lane_valid <= '1';
          lane_sync  <= first;

      end case;

      -- LP-11 ends every state. The last bytes before it are levels of the line as it rises; the packet's length cuts
      -- them off.
      if levels = STOP then
        state       <= rest;
        lane_valid  <= '0';
        lane_missed <= to_logic(state = search or state = exchanged);
      end if;
    end if;

  end process follow;

end architecture rtl;
