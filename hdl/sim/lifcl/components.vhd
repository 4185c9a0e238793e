-- The CrossLink-NX primitives that boards use, declared as in Lattice's library of this name;
-- built by scripts/build_hdl.py from the entities of the models.
--
-- For simulation without Lattice's tools: a small library `lifcl` with behavioural models,
-- written from the cells that Yosys declares. Ports and generics have Lattice's names; only those in use
-- are here. Each model says at its head what it leaves out.

library ieee;
use ieee.std_logic_1164.all;

package components is

  component dphy is
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
  end component dphy;

  component oddrx1 is
    generic (
      GSR : string := "ENABLED"
    );
    port (
      sclk : in    std_ulogic;
      rst  : in    std_ulogic;
      d0   : in    std_ulogic;
      d1   : in    std_ulogic;
      q    : out   std_ulogic
    );
  end component oddrx1;

  component osca is
    generic (
      HF_CLK_DIV : string := "1";
      HF_OSC_EN  : string := "ENABLED"
    );
    port (
      hfouten  : in    std_ulogic;
      hfsdscen : in    std_ulogic;
      hfclkout : out   std_ulogic
    );
  end component osca;

end package components;
