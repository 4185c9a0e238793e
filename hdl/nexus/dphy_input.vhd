-- SPDX-License-Identifier: Apache-2.0
-- Lanes of a camera into a CrossLink-NX: its hard D-PHY as receiver, and the logic that makes csi_receiver's inputs
-- from its outputs.
--
-- The block follows the lines from low power to high speed, waits until they have settled, finds the sync sequence and
-- aligns the bytes. It reports a sync one clock before the first byte behind it. This, and the parameters, are from a
-- public design that received a camera with this block (gatecat/litex-nexus-mipi). The times to settle are those of
-- Lattice's own receiver (115 and 150 ns; the standard has 85 ns + 6 bits to 145 ns + 10 bits for data). The block's
-- pads are fixed. Lattice gives 2.5 Gb/s for a lane (FPGA-DS-02049), but the byte clock, an eighth of that, is the
-- limit: see docs/resampling.md.
--
-- Latency: that of the block, and 2 clocks of byte_clk. Throughput: a byte of each lane each clock of byte_clk.
-- Equation: that of dphy_lane.

library ieee;
use ieee.std_logic_1164.all;

library lifcl;
use lifcl.components.all;

library work;
use work.math_pkg.all;

entity dphy_input is
  generic (
    -- Lanes: 1, 2 or 4.
    LANES : positive range 1 to 4;
    -- Frequency of sync_clk in MHz.
    SYNC_MHZ : positive range 20 to 400;
    -- true: the camera's clock lane goes on between bursts.
    CONTINUOUS : boolean := false
  );
  port (
    -- Pads of the block; data lanes from LANES on are not used.
    clk_p  : inout std_logic;
    clk_n  : inout std_logic;
    data_p : inout std_logic_vector(3 downto 0);
    data_n : inout std_logic_vector(3 downto 0);
    -- Any clock that always runs, to count times; and a reset of the block.
    sync_clk : in    std_logic;
    reset    : in    std_logic;
    -- Bytes of bursts, as csi_receiver takes them.
    byte_clk   : out   std_logic;
    lane_valid : out   std_logic_vector(LANES - 1 downto 0);
    lane_sync  : out   std_logic_vector(LANES - 1 downto 0);
    lane_data  : out   std_logic_vector(8 * LANES - 1 downto 0)
  );
end entity dphy_input;

architecture rtl of dphy_input is

  constant TAKES_LANES : boolean := takes(LANES /= 3, "dphy_input: LANES is 3, expected 1, 2 or 4");

  -- Times from LP-00 in which the lines are ignored, within the standard's limits (see the header).
  constant DATA_SETTLE_NS  : positive := 115;
  constant CLOCK_SETTLE_NS : positive := 150;

  -- The block's ports are as wide as its widest words; here a word is a byte, in the low bits.
  type words_t is array (0 to 3) of std_logic_vector(15 downto 0);

  type marks_t is array (0 to 3) of std_logic_vector(3 downto 0);

  -- Values of the block's parameters as text.

  -- Number of lanes.
  function lanes_text return string is
  begin

    if LANES = 1 then
      return "ONE_LANE";
    elsif LANES = 2 then
      return "TWO_LANES";
    end if;

    return "FOUR_LANES";

  end function lanes_text;

  function clock_text return string is
  begin

    if CONTINUOUS then
      return "ENABLED";
    end if;

    return "DISABLED";

  end function clock_text;

  -- Clocks of sync_clk in a time, rounded to the next clock.
  function settle_clocks (
    megahertz   : positive;
    nanoseconds : positive
  ) return natural is
  begin

    return (megahertz * nanoseconds + 500) / 1000;

  end function settle_clocks;

  -- The block takes numbers as texts of binary digits.
  function six_bits (
    value : natural
  ) return string is

    variable text : string(1 to 8) := "0b000000";
    variable left : natural;

  begin

    left := value;

    for i in 8 downto 3 loop

      if left mod 2 = 1 then
        text(i) := '1';
      end if;

      left := left / 2;

    end loop;

    return text;

  end function six_bits;

  -- Signals of the block: the lanes' words and marks; active: a lane is in high speed; stopped: it is at rest (LP-11);
  -- at_rest: the same in byte_clk.
  signal clk        : std_logic;
  signal enable     : std_logic;
  signal escape_clk : std_logic := '0';
  signal words      : words_t;
  signal marks      : marks_t;
  signal active     : std_logic_vector(3 downto 0);
  signal stopped    : std_logic_vector(3 downto 0);
  signal at_rest    : std_logic_vector(3 downto 0);
  -- begins: a sync was reported, so the first byte comes; burst: bytes come.
  signal begins : std_logic_vector(3 downto 0) := "0000";
  signal burst  : std_logic_vector(3 downto 0) := "0000";

begin

  byte_clk <= clk;
  enable   <= not reset;

  -- The block needs a clock for escape sequences though it sends none; half of sync_clk will do.
  divide : process (sync_clk) is
  begin

    if rising_edge(sync_clk) then
      escape_clk <= not escape_clk;
    end if;

  end process divide;

  -- The block as a receiver of CSI-2, with its own handling of low power. Ports that are not named here send, or belong
  -- to the PLL or the register port: their defaults leave them idle.
  block_itself : component dphy
    generic map (
      CFG_NUM_LANES      => lanes_text,
      CONT_CLK_MODE      => clock_text,
      DSI_CSI            => "CSI2_APP",
      EN_CIL             => "CIL_ENABLED",
      MASTER_SLAVE       => "SLAVE",
      PLLCLKBYPASS       => "BYPASSED",
      RXCDRP             => "0b01",
      RXLPRP             => "0b001",
      TST                => "0b0000",
      U_PRG_RXHS_SETTLE  => six_bits(settle_clocks(SYNC_MHZ, DATA_SETTLE_NS)),
      UC_PRG_RXHS_SETTLE => six_bits(settle_clocks(SYNC_MHZ, CLOCK_SETTLE_NS))
    )
    port map (
      ckn      => clk_n,
      ckp      => clk_p,
      dn0      => data_n(0),
      dn1      => data_n(1),
      dn2      => data_n(2),
      dn3      => data_n(3),
      dp0      => data_p(0),
      dp1      => data_p(1),
      dp2      => data_p(2),
      dp3      => data_p(3),
      pddphy   => reset,
      ued0then => enable,
      urxacths => active(0),
      urxckine => sync_clk,
      urxdhs   => words(0),
      urxshs   => marks(0),
      usstt    => stopped(0),
      utxcke   => escape_clk,
      u1enthen => enable,
      u1rxaths => active(1),
      u1rxdhs  => words(1),
      u1rxshs  => marks(1),
      u1sstt   => stopped(1),
      u2end2   => enable,
      u2rxachs => active(2),
      u2rxdhs  => words(2),
      u2rxshs  => marks(2),
      u2sstt   => stopped(2),
      u3end3   => enable,
      u3rxaths => active(3),
      u3rxdhs  => words(3),
      u3rxshs  => marks(3),
      u3sstt   => stopped(3),
      ucenck   => enable,
      urwdckhs => clk
    );

  -- The levels of rest come from no clock. Bytes stop a few clocks later than the lines; these bytes are filler behind
  -- the packet.
  take_rest : entity work.synchroniser
    generic map (
      WIDTH => 4
    )
    port map (
      clk         => clk,
      level       => stopped,
      synchronous => at_rest
    );

  take : process (clk) is
  begin

    if rising_edge(clk) then

      for i in 0 to LANES - 1 loop

        -- Any of the marks is a sync.
        begins(i)     <= to_logic(marks(i) /= "0000");
        lane_valid(i) <= begins(i) or burst(i);
        lane_sync(i)  <= begins(i);

        lane_data(8 * i + 7 downto 8 * i) <= words(i)(7 downto 0);

        -- A burst lasts from the sync to the rest of the lane, because the block does not say for how long bytes come.
        burst(i) <= begins(i) or burst(i);
        -- Either level ends the burst, whichever the block shows first.
        if active(i) = '0' or at_rest(i) = '1' then
          burst(i)      <= '0';
          lane_valid(i) <= '0';
        end if;

      end loop;

    end if;

  end process take;

end architecture rtl;
