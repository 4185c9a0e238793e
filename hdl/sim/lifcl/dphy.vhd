-- SPDX-License-Identifier: Apache-2.0
-- Model of DPHY, the hard D-PHY of CrossLink-NX (ports as Yosys has them), as receiver with its own
-- protocol logic (CIL) and eight bits a lane.
--
-- A pad has four levels: '1' and '0' in low power, 'H' and 'L' in high speed, which a receiver for low power takes for
-- low. The byte clock is an eighth of the bit rate and stands still with the clock lane. A sync is told a clock ahead
-- of the first byte behind it, as in public designs that received a camera (gatecat/litex-nexus-mipi).
--
-- Left out: transmission, escape modes, deskew, calibration, the register port, the PLL, other widths; times but that
-- to settle, which is taken in clocks of URXCKINE. Inputs for these have as their default the level that a receiver
-- gives them, so that its instance names only what it uses.

library ieee;
use ieee.std_logic_1164.all;

entity dphy is
  generic (
    GSR                : string := "ENABLED";
    AUTO_PD_EN         : string := "POWERED_UP";
    CFG_NUM_LANES      : string := "ONE_LANE";
    CM                 : string := "0b00000000";
    CN                 : string := "0b00000";
    CO                 : string := "0b000";
    CONT_CLK_MODE      : string := "DISABLED";
    DESKEW_EN          : string := "DISABLED";
    DSI_CSI            : string := "CSI2_APP";
    EN_CIL             : string := "CIL_ENABLED";
    HSEL               : string := "DISABLED";
    LANE0_SEL          : string := "LANE_0";
    LOCK_BYP           : string := "GATE_TXBYTECLKHS";
    MASTER_SLAVE       : string := "SLAVE";
    PLLCLKBYPASS       : string := "REGISTERED";
    RSEL               : string := "0b00";
    RXCDRP             : string := "0b00";
    RXDATAWIDTHHS      : string := "0b00";
    RXLPRP             : string := "0b000";
    TEST_ENBL          : string := "0b000000";
    TEST_PATTERN       : string := "0b00000000000000000000000000000000";
    TST                : string := "0b1001";
    TXDATAWIDTHHS      : string := "0b00";
    U_PRG_HS_PREPARE   : string := "0b00";
    U_PRG_HS_TRAIL     : string := "0b000000";
    U_PRG_HS_ZERO      : string := "0b000000";
    U_PRG_RXHS_SETTLE  : string := "0b000000";
    UC_PRG_RXHS_SETTLE : string := "0b000000"
  );
  port (
    lmmiclk     : in    std_logic                     := '0';
    lmmireset_n : in    std_logic                     := '1';
    lmmirequest : in    std_logic                     := '0';
    lmmiwrrd_n  : in    std_logic                     := '0';
    lmmioffset  : in    std_logic_vector(4 downto 0)  := (others => '0');
    lmmiwdata   : in    std_logic_vector(3 downto 0)  := (others => '0');
    bitckext    : in    std_logic                     := '1';
    ckn         : inout std_logic;
    ckp         : inout std_logic;
    clkref      : in    std_logic                     := '1';
    dn0         : inout std_logic;
    dn1         : inout std_logic;
    dn2         : inout std_logic;
    dn3         : inout std_logic;
    dp0         : inout std_logic;
    dp1         : inout std_logic;
    dp2         : inout std_logic;
    dp3         : inout std_logic;
    pddphy      : in    std_logic;
    pdpll       : in    std_logic                     := '1';
    scclkin     : in    std_logic                     := '1';
    ued0then    : in    std_logic;
    ufrxmode    : in    std_logic                     := '0';
    utxmdtx     : in    std_logic                     := '0';
    urxacths    : out   std_logic;
    urxckine    : in    std_logic;
    urxdhs      : out   std_logic_vector(15 downto 0);
    urxshs      : out   std_logic_vector(3 downto 0);
    usstt       : out   std_logic;
    utdis       : in    std_logic                     := '0';
    utxcke      : in    std_logic;
    ude0d0tn    : in    std_logic                     := '0';
    ude1d1tn    : in    std_logic                     := '0';
    ude2d2tn    : in    std_logic                     := '0';
    ude3d3tn    : in    std_logic                     := '0';
    ude4cktn    : in    std_logic                     := '0';
    ude5d0rn    : in    std_logic                     := '0';
    ude6d1rn    : in    std_logic                     := '0';
    ude7d2rn    : in    std_logic                     := '0';
    utxdhs      : in    std_logic_vector(31 downto 0) := x"FFFFFFFF";
    utxener     : in    std_logic                     := '0';
    utxrd0en    : in    std_logic                     := '0';
    utrd0sen    : in    std_logic                     := '0';
    utxskd0n    : in    std_logic                     := '0';
    utxtge0     : in    std_logic                     := '0';
    utxtge1     : in    std_logic                     := '0';
    utxtge2     : in    std_logic                     := '0';
    utxtge3     : in    std_logic                     := '0';
    utxulpse    : in    std_logic                     := '0';
    utxupsex    : in    std_logic                     := '0';
    utxvde      : in    std_logic                     := '0';
    utxwvdhs    : in    std_logic_vector(3 downto 0)  := (others => '0');
    u1enthen    : in    std_logic;
    u1frxmd     : in    std_logic                     := '0';
    u1ftxst     : in    std_logic                     := '0';
    u1rxaths    : out   std_logic;
    u1rxdhs     : out   std_logic_vector(15 downto 0);
    u1rxshs     : out   std_logic_vector(3 downto 0);
    u1sstt      : out   std_logic;
    u1tdis      : in    std_logic                     := '0';
    u1treq      : in    std_logic                     := '0';
    u1tde0d3    : in    std_logic                     := '0';
    u1tde1ck    : in    std_logic                     := '0';
    u1tde2d0    : in    std_logic                     := '0';
    u1tde3d1    : in    std_logic                     := '0';
    u1tde4d2    : in    std_logic                     := '0';
    u1tde5d3    : in    std_logic                     := '0';
    u1tde6      : in    std_logic                     := '0';
    u1tde7      : in    std_logic                     := '0';
    u1txdhs     : in    std_logic_vector(31 downto 0) := x"FFFFFFFF";
    u1txlpd     : in    std_logic                     := '0';
    u1txreq     : in    std_logic                     := '0';
    u1txreqh    : in    std_logic                     := '0';
    u1txsk      : in    std_logic                     := '0';
    u1txtge0    : in    std_logic                     := '0';
    u1txtge1    : in    std_logic                     := '0';
    u1txtge2    : in    std_logic                     := '0';
    u1txtge3    : in    std_logic                     := '0';
    u1txupse    : in    std_logic                     := '0';
    u1txupsx    : in    std_logic                     := '0';
    u1txvde     : in    std_logic                     := '0';
    u1txwvhs    : in    std_logic_vector(3 downto 0)  := (others => '0');
    u2end2      : in    std_logic;
    u2frxmd     : in    std_logic                     := '0';
    u2ftxst     : in    std_logic                     := '0';
    u2rxachs    : out   std_logic;
    u2rxdhs     : out   std_logic_vector(15 downto 0);
    u2rxshs     : out   std_logic_vector(3 downto 0);
    u2sstt      : out   std_logic;
    u2tdis      : in    std_logic                     := '0';
    u2treq      : in    std_logic                     := '0';
    u2tde0d0    : in    std_logic                     := '0';
    u2tde1d1    : in    std_logic                     := '0';
    u2tde2d2    : in    std_logic                     := '0';
    u2tde3d3    : in    std_logic                     := '0';
    u2tde4ck    : in    std_logic                     := '0';
    u2tde5d0    : in    std_logic                     := '0';
    u2tde6d1    : in    std_logic                     := '0';
    u2tde7d2    : in    std_logic                     := '0';
    u2txdhs     : in    std_logic_vector(31 downto 0) := x"FFFFFFFF";
    u2tpdte     : in    std_logic                     := '0';
    u2txreq     : in    std_logic                     := '0';
    u2txreqh    : in    std_logic                     := '0';
    u2txskc     : in    std_logic                     := '0';
    u2txtge0    : in    std_logic                     := '0';
    u2txtge1    : in    std_logic                     := '0';
    u2txtge2    : in    std_logic                     := '0';
    u2txtge3    : in    std_logic                     := '0';
    u2txupse    : in    std_logic                     := '0';
    u2txupsx    : in    std_logic                     := '0';
    u2txvde     : in    std_logic                     := '0';
    u2txwvhs    : in    std_logic_vector(3 downto 0)  := (others => '0');
    u3end3      : in    std_logic;
    u3frxmd     : in    std_logic                     := '0';
    u3ftxst     : in    std_logic                     := '0';
    u3rxaths    : out   std_logic;
    u3rxdhs     : out   std_logic_vector(15 downto 0);
    u3rxshs     : out   std_logic_vector(3 downto 0);
    u3sstt      : out   std_logic;
    u3tdisd2    : in    std_logic                     := '0';
    u3treqd2    : in    std_logic                     := '0';
    u3tde0d3    : in    std_logic                     := '0';
    u3tde1d0    : in    std_logic                     := '0';
    u3tde2d1    : in    std_logic                     := '0';
    u3tde3d2    : in    std_logic                     := '0';
    u3tde4d3    : in    std_logic                     := '0';
    u3tde5ck    : in    std_logic                     := '0';
    u3tde6      : in    std_logic                     := '0';
    u3tde7      : in    std_logic                     := '0';
    u3txdhs     : in    std_logic_vector(31 downto 0) := x"FFFFFFFF";
    u3txlpdt    : in    std_logic                     := '0';
    u3txreq     : in    std_logic                     := '0';
    u3txreqh    : in    std_logic                     := '0';
    u3txskc     : in    std_logic                     := '0';
    u3txtge0    : in    std_logic                     := '0';
    u3txtge1    : in    std_logic                     := '0';
    u3txtge2    : in    std_logic                     := '0';
    u3txtge3    : in    std_logic                     := '0';
    u3txulps    : in    std_logic                     := '0';
    u3txupsx    : in    std_logic                     := '0';
    u3txvd3     : in    std_logic                     := '0';
    u3txwvhs    : in    std_logic_vector(3 downto 0)  := (others => '0');
    ucenck      : in    std_logic;
    uctxreqh    : in    std_logic                     := '0';
    uctxupsc    : in    std_logic                     := '0';
    uctxupsx    : in    std_logic                     := '0';
    ltsten      : in    std_logic                     := '0';
    ltstlane    : in    std_logic_vector(1 downto 0)  := (others => '0');
    urwdckhs    : out   std_logic;
    utrnreq     : in    std_logic                     := '0'
  );
end entity dphy;

architecture behaviour of dphy is

  type flags_t is array (0 to 3) of boolean;

  type counts_t is array (0 to 3) of natural;

  type bytes_t is array (0 to 3) of std_logic_vector(7 downto 0);

  constant SYNC_BYTE : std_logic_vector(7 downto 0) := x"B8";

  -- The number that a text such as "0b000111" stands for.

  function number_of (
    text : string
  ) return natural is

    variable value : natural := 0;

  begin

    for i in text'low + 2 to text'high loop

      value := 2 * value;

      if text(i) = '1' then
        value := value + 1;
      end if;

    end loop;

    return value;

  end function number_of;

  constant SETTLE_CLOCKS : natural := number_of(U_PRG_RXHS_SETTLE);

  -- Pads of the lanes; edges of the bits; lanes whose lines have settled, are in LP-11, have had a sync in this burst;
  -- syncs, and the bytes at the outputs.
  signal positive_pads : std_logic_vector(3 downto 0);
  signal negative_pads : std_logic_vector(3 downto 0);
  signal bit_clock     : std_logic                    := '0';
  signal settled       : std_logic_vector(3 downto 0) := "0000";
  signal stopped       : std_logic_vector(3 downto 0) := "0000";
  signal active        : std_logic_vector(3 downto 0) := "0000";
  signal syncs         : std_logic_vector(3 downto 0) := "0000";
  signal bytes_now     : bytes_t                      := (others => x"00");

begin

  assert CFG_NUM_LANES = "ONE_LANE" or CFG_NUM_LANES = "TWO_LANES" or CFG_NUM_LANES = "FOUR_LANES"
    report "DPHY: the model knows one, two and four lanes"
    severity failure;

  assert EN_CIL = "CIL_ENABLED" and MASTER_SLAVE = "SLAVE" and RXDATAWIDTHHS = "0b00"
    report "DPHY: the model knows a receiver with its own logic and 8 bits a lane only"
    severity failure;

  -- The pads are split over many ports; inside they are two words.
  positive_pads <= dp3 & dp2 & dp1 & dp0;
  negative_pads <= dn3 & dn2 & dn1 & dn0;

  -- A receiver drives no pad.
  ckp <= 'Z';
  ckn <= 'Z';
  dp0 <= 'Z';
  dp1 <= 'Z';
  dp2 <= 'Z';
  dp3 <= 'Z';
  dn0 <= 'Z';
  dn1 <= 'Z';
  dn2 <= 'Z';
  dn3 <= 'Z';

  -- In low power the clock lane has no bits.
  bit_clock <= '1' when ckp = 'H' and ckn = 'L' else
               '0';

  find_stop : for i in 0 to 3 generate
    stopped(i) <= '1' when positive_pads(i) = '1' and negative_pads(i) = '1' else
                  '0';
  end generate find_stop;

  settle : process (urxckine, stopped) is

    variable clocks : counts_t := (others => 0);

  begin

    -- The time to settle counts from the fall of the positive line (LP-01), in clocks of URXCKINE.
    for i in 0 to 3 loop

      if positive_pads(i) = '1' then
        clocks(i)  := 0;
        settled(i) <= '0';
      elsif rising_edge(urxckine) then
        if clocks(i) >= SETTLE_CLOCKS then
          settled(i) <= '1';
        else
          clocks(i) := clocks(i) + 1;
        end if;
      end if;

    end loop;

  end process settle;

  -- Every edge of the clock lane brings a bit of each lane.
  receive : process (bit_clock, stopped) is

    -- Bits within the period of the byte clock. For each lane: its last eight bits, bits since the sync, its last byte,
    -- whether the sync has been found, whether it is new.
    variable bits    : natural                      := 0;
    variable window  : bytes_t                      := (others => x"00");
    variable counts  : counts_t                     := (others => 0);
    variable whole   : bytes_t                      := (others => x"00");
    variable found   : flags_t                      := (others => false);
    variable strobes : std_logic_vector(3 downto 0) := "0000";

  begin

    if bit_clock'event then

      for i in 0 to 3 loop

        window(i) := to_x01(positive_pads(i)) & window(i)(7 downto 1);
        if found(i) then
          counts(i) := counts(i) + 1;
          if counts(i) mod 8 = 0 then
            whole(i) := window(i);
          end if;
        elsif settled(i) = '1' and window(i) = SYNC_BYTE then
          found(i)   := true;
          counts(i)  := 0;
          strobes(i) := '1';
        end if;

      end loop;

      -- All lanes share the byte clock; the bytes of each lane wait for it, wherever the lane's sync was.
      bits := (bits + 1) mod 8;
      if bits = 0 then
        urwdckhs  <= '1';
        bytes_now <= whole;
        syncs     <= strobes;
        -- The sync is reported with this byte clock; the first byte comes with the next.
        active  <= active or strobes;
        strobes := "0000";
      elsif bits = 4 then
        urwdckhs <= '0';
      end if;
    end if;

    -- LP-11 ends the burst of a lane at any time.
    for i in 0 to 3 loop

      if stopped(i) = '1' then
        found(i)   := false;
        strobes(i) := '0';
        syncs(i)   <= '0';
        active(i)  <= '0';
      end if;

    end loop;

  end process receive;

  urxdhs  <= x"00" & bytes_now(0);
  u1rxdhs <= x"00" & bytes_now(1);
  u2rxdhs <= x"00" & bytes_now(2);
  u3rxdhs <= x"00" & bytes_now(3);
  urxshs  <= "000" & syncs(0);
  u1rxshs <= "000" & syncs(1);
  u2rxshs <= "000" & syncs(2);
  u3rxshs <= "000" & syncs(3);

  urxacths <= active(0);
  u1rxaths <= active(1);
  u2rxachs <= active(2);
  u3rxaths <= active(3);
  usstt    <= stopped(0);
  u1sstt   <= stopped(1);
  u2sstt   <= stopped(2);
  u3sstt   <= stopped(3);

end architecture behaviour;
