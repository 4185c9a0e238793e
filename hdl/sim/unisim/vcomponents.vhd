-- The Spartan-6 and 7-series primitives that boards use, declared as in Xilinx's library of this name;
-- built by scripts/build_hdl.py from the entities of the models.
--
-- For simulation without Xilinx's tools: a small library `unisim` with behavioural models,
-- written from UG381, UG382, UG471, UG472, UG615 and XAPP879. Ports and generics have Xilinx's names; only those in use
-- are here. Each model says at its head what it leaves out.

library ieee;
use ieee.std_logic_1164.all;

package vcomponents is

  component bufg is
    port (
      o : out   std_ulogic;
      i : in    std_ulogic
    );
  end component bufg;

  component bufgmux is
    generic (
      CLK_SEL_TYPE : string := "SYNC"
    );
    port (
      o  : out   std_ulogic;
      i0 : in    std_ulogic;
      i1 : in    std_ulogic;
      s  : in    std_ulogic
    );
  end component bufgmux;

  component bufio2 is
    generic (
      DIVIDE        : integer := 1;
      DIVIDE_BYPASS : boolean := true;
      I_INVERT      : boolean := false;
      USE_DOUBLER   : boolean := false
    );
    port (
      divclk       : out   std_ulogic;
      ioclk        : out   std_ulogic;
      serdesstrobe : out   std_ulogic;
      i            : in    std_ulogic
    );
  end component bufio2;

  component bufpll is
    generic (
      DIVIDE      : integer := 1;
      ENABLE_SYNC : boolean := true
    );
    port (
      ioclk        : out   std_ulogic;
      lock         : out   std_ulogic;
      serdesstrobe : out   std_ulogic;
      gclk         : in    std_ulogic;
      locked       : in    std_ulogic;
      pllin        : in    std_ulogic
    );
  end component bufpll;

  component dcm_clkgen is
    generic (
      CLKFX_DIVIDE   : integer := 1;
      CLKFX_MD_MAX   : real    := 0.0;
      CLKFX_MULTIPLY : integer := 4;
      CLKIN_PERIOD   : real    := 0.0
    );
    port (
      clkfx     : out   std_ulogic;
      clkfx180  : out   std_ulogic;
      clkfxdv   : out   std_ulogic;
      locked    : out   std_ulogic;
      progdone  : out   std_ulogic;
      status    : out   std_logic_vector(2 downto 1);
      clkin     : in    std_ulogic;
      freezedcm : in    std_ulogic;
      progclk   : in    std_ulogic;
      progdata  : in    std_ulogic;
      progen    : in    std_ulogic;
      rst       : in    std_ulogic
    );
  end component dcm_clkgen;

  component ibufds is
    generic (
      DIFF_TERM  : boolean := false;
      IOSTANDARD : string  := "DEFAULT"
    );
    port (
      o  : out   std_ulogic;
      i  : in    std_ulogic;
      ib : in    std_ulogic
    );
  end component ibufds;

  component idelayctrl is
    port (
      rdy    : out   std_ulogic;
      refclk : in    std_ulogic;
      rst    : in    std_ulogic
    );
  end component idelayctrl;

  component idelaye2 is
    generic (
      CINVCTRL_SEL          : string  := "FALSE";
      DELAY_SRC             : string  := "IDATAIN";
      HIGH_PERFORMANCE_MODE : string  := "FALSE";
      IDELAY_TYPE           : string  := "FIXED";
      IDELAY_VALUE          : integer := 0;
      PIPE_SEL              : string  := "FALSE";
      REFCLK_FREQUENCY      : real    := 200.0;
      SIGNAL_PATTERN        : string  := "DATA"
    );
    port (
      cntvalueout : out   std_logic_vector(4 downto 0);
      dataout     : out   std_ulogic;
      c           : in    std_ulogic;
      ce          : in    std_ulogic;
      cinvctrl    : in    std_ulogic;
      cntvaluein  : in    std_logic_vector(4 downto 0);
      datain      : in    std_ulogic;
      idatain     : in    std_ulogic;
      inc         : in    std_ulogic;
      ld          : in    std_ulogic;
      ldpipeen    : in    std_ulogic;
      regrst      : in    std_ulogic
    );
  end component idelaye2;

  component iodelay2 is
    generic (
      COUNTER_WRAPAROUND : string  := "WRAPAROUND";
      DATA_RATE          : string  := "SDR";
      DELAY_SRC          : string  := "IO";
      IDELAY2_VALUE      : integer := 0;
      IDELAY_MODE        : string  := "NORMAL";
      IDELAY_TYPE        : string  := "DEFAULT";
      IDELAY_VALUE       : integer := 0;
      ODELAY_VALUE       : integer := 0;
      SERDES_MODE        : string  := "NONE";
      SIM_TAPDELAY_VALUE : integer := 75
    );
    port (
      busy     : out   std_ulogic;
      dataout  : out   std_ulogic;
      dataout2 : out   std_ulogic;
      dout     : out   std_ulogic;
      tout     : out   std_ulogic;
      cal      : in    std_ulogic;
      ce       : in    std_ulogic;
      clk      : in    std_ulogic;
      idatain  : in    std_ulogic;
      inc      : in    std_ulogic;
      ioclk0   : in    std_ulogic;
      ioclk1   : in    std_ulogic;
      odatain  : in    std_ulogic;
      rst      : in    std_ulogic;
      t        : in    std_ulogic
    );
  end component iodelay2;

  component iserdes2 is
    generic (
      BITSLIP_ENABLE : boolean := false;
      DATA_RATE      : string  := "SDR";
      DATA_WIDTH     : integer := 1;
      INTERFACE_TYPE : string  := "NETWORKING";
      SERDES_MODE    : string  := "NONE"
    );
    port (
      cfb0      : out   std_ulogic;
      cfb1      : out   std_ulogic;
      dfb       : out   std_ulogic;
      fabricout : out   std_ulogic;
      incdec    : out   std_ulogic;
      q1        : out   std_ulogic;
      q2        : out   std_ulogic;
      q3        : out   std_ulogic;
      q4        : out   std_ulogic;
      shiftout  : out   std_ulogic;
      valid     : out   std_ulogic;
      bitslip   : in    std_ulogic;
      ce0       : in    std_ulogic;
      clk0      : in    std_ulogic;
      clk1      : in    std_ulogic;
      clkdiv    : in    std_ulogic;
      d         : in    std_ulogic;
      ioce      : in    std_ulogic;
      rst       : in    std_ulogic;
      shiftin   : in    std_ulogic
    );
  end component iserdes2;

  component iserdese2 is
    generic (
      DATA_RATE         : string  := "DDR";
      DATA_WIDTH        : integer := 4;
      DYN_CLKDIV_INV_EN : string  := "FALSE";
      DYN_CLK_INV_EN    : string  := "FALSE";
      INTERFACE_TYPE    : string  := "MEMORY";
      IOBDELAY          : string  := "NONE";
      NUM_CE            : integer := 2;
      OFB_USED          : string  := "FALSE";
      SERDES_MODE       : string  := "MASTER"
    );
    port (
      o            : out   std_ulogic;
      q1           : out   std_ulogic;
      q2           : out   std_ulogic;
      q3           : out   std_ulogic;
      q4           : out   std_ulogic;
      q5           : out   std_ulogic;
      q6           : out   std_ulogic;
      q7           : out   std_ulogic;
      q8           : out   std_ulogic;
      shiftout1    : out   std_ulogic;
      shiftout2    : out   std_ulogic;
      bitslip      : in    std_ulogic;
      ce1          : in    std_ulogic;
      ce2          : in    std_ulogic;
      clk          : in    std_ulogic;
      clkb         : in    std_ulogic;
      clkdiv       : in    std_ulogic;
      clkdivp      : in    std_ulogic;
      d            : in    std_ulogic;
      ddly         : in    std_ulogic;
      dynclkdivsel : in    std_ulogic;
      dynclksel    : in    std_ulogic;
      oclk         : in    std_ulogic;
      oclkb        : in    std_ulogic;
      ofb          : in    std_ulogic;
      rst          : in    std_ulogic;
      shiftin1     : in    std_ulogic;
      shiftin2     : in    std_ulogic
    );
  end component iserdese2;

  component mmcme2_adv is
    generic (
      BANDWIDTH        : string  := "OPTIMIZED";
      CLKFBOUT_MULT_F  : real    := 5.0;
      CLKIN1_PERIOD    : real    := 0.0;
      CLKIN2_PERIOD    : real    := 0.0;
      CLKOUT0_DIVIDE_F : real    := 1.0;
      CLKOUT1_DIVIDE   : integer := 1;
      CLKOUT2_DIVIDE   : integer := 1;
      COMPENSATION     : string  := "ZHOLD";
      DIVCLK_DIVIDE    : integer := 1
    );
    port (
      clkfbout     : out   std_ulogic;
      clkfboutb    : out   std_ulogic;
      clkfbstopped : out   std_ulogic;
      clkinstopped : out   std_ulogic;
      clkout0      : out   std_ulogic;
      clkout0b     : out   std_ulogic;
      clkout1      : out   std_ulogic;
      clkout1b     : out   std_ulogic;
      clkout2      : out   std_ulogic;
      clkout2b     : out   std_ulogic;
      clkout3      : out   std_ulogic;
      clkout3b     : out   std_ulogic;
      clkout4      : out   std_ulogic;
      clkout5      : out   std_ulogic;
      clkout6      : out   std_ulogic;
      do           : out   std_logic_vector(15 downto 0);
      drdy         : out   std_ulogic;
      locked       : out   std_ulogic;
      psdone       : out   std_ulogic;
      clkfbin      : in    std_ulogic;
      clkin1       : in    std_ulogic;
      clkin2       : in    std_ulogic;
      clkinsel     : in    std_ulogic;
      daddr        : in    std_logic_vector(6 downto 0);
      dclk         : in    std_ulogic;
      den          : in    std_ulogic;
      di           : in    std_logic_vector(15 downto 0);
      dwe          : in    std_ulogic;
      psclk        : in    std_ulogic;
      psen         : in    std_ulogic;
      psincdec     : in    std_ulogic;
      pwrdwn       : in    std_ulogic;
      rst          : in    std_ulogic
    );
  end component mmcme2_adv;

  component obufds is
    generic (
      IOSTANDARD : string := "DEFAULT"
    );
    port (
      o  : out   std_ulogic;
      ob : out   std_ulogic;
      i  : in    std_ulogic
    );
  end component obufds;

  component oserdes2 is
    generic (
      BYPASS_GCLK_FF : boolean := false;
      DATA_RATE_OQ   : string  := "DDR";
      DATA_RATE_OT   : string  := "DDR";
      DATA_WIDTH     : integer := 2;
      OUTPUT_MODE    : string  := "SINGLE_ENDED";
      SERDES_MODE    : string  := "NONE";
      TRAIN_PATTERN  : integer := 0
    );
    port (
      oq        : out   std_ulogic;
      shiftout1 : out   std_ulogic;
      shiftout2 : out   std_ulogic;
      shiftout3 : out   std_ulogic;
      shiftout4 : out   std_ulogic;
      tq        : out   std_ulogic;
      clk0      : in    std_ulogic;
      clk1      : in    std_ulogic;
      clkdiv    : in    std_ulogic;
      d1        : in    std_ulogic;
      d2        : in    std_ulogic;
      d3        : in    std_ulogic;
      d4        : in    std_ulogic;
      ioce      : in    std_ulogic;
      oce       : in    std_ulogic;
      rst       : in    std_ulogic;
      shiftin1  : in    std_ulogic;
      shiftin2  : in    std_ulogic;
      shiftin3  : in    std_ulogic;
      shiftin4  : in    std_ulogic;
      t1        : in    std_ulogic;
      t2        : in    std_ulogic;
      t3        : in    std_ulogic;
      t4        : in    std_ulogic;
      tce       : in    std_ulogic;
      train     : in    std_ulogic
    );
  end component oserdes2;

  component oserdese2 is
    generic (
      DATA_RATE_OQ   : string  := "DDR";
      DATA_RATE_TQ   : string  := "DDR";
      DATA_WIDTH     : integer := 4;
      SERDES_MODE    : string  := "MASTER";
      TBYTE_CTL      : string  := "FALSE";
      TBYTE_SRC      : string  := "FALSE";
      TRISTATE_WIDTH : integer := 4
    );
    port (
      ofb       : out   std_ulogic;
      oq        : out   std_ulogic;
      shiftout1 : out   std_ulogic;
      shiftout2 : out   std_ulogic;
      tbyteout  : out   std_ulogic;
      tfb       : out   std_ulogic;
      tq        : out   std_ulogic;
      clk       : in    std_ulogic;
      clkdiv    : in    std_ulogic;
      d1        : in    std_ulogic;
      d2        : in    std_ulogic;
      d3        : in    std_ulogic;
      d4        : in    std_ulogic;
      d5        : in    std_ulogic;
      d6        : in    std_ulogic;
      d7        : in    std_ulogic;
      d8        : in    std_ulogic;
      oce       : in    std_ulogic;
      rst       : in    std_ulogic;
      shiftin1  : in    std_ulogic;
      shiftin2  : in    std_ulogic;
      t1        : in    std_ulogic;
      t2        : in    std_ulogic;
      t3        : in    std_ulogic;
      t4        : in    std_ulogic;
      tbytein   : in    std_ulogic;
      tce       : in    std_ulogic
    );
  end component oserdese2;

  component pll_adv is
    generic (
      BANDWIDTH          : string  := "OPTIMIZED";
      CLK_FEEDBACK       : string  := "CLKFBOUT";
      CLKFBOUT_MULT      : integer := 1;
      CLKFBOUT_PHASE     : real    := 0.0;
      CLKIN1_PERIOD      : real    := 0.0;
      CLKIN2_PERIOD      : real    := 0.0;
      CLKOUT0_DIVIDE     : integer := 1;
      CLKOUT0_DUTY_CYCLE : real    := 0.5;
      CLKOUT0_PHASE      : real    := 0.0;
      CLKOUT1_DIVIDE     : integer := 1;
      CLKOUT1_DUTY_CYCLE : real    := 0.5;
      CLKOUT1_PHASE      : real    := 0.0;
      CLKOUT2_DIVIDE     : integer := 1;
      CLKOUT2_DUTY_CYCLE : real    := 0.5;
      CLKOUT2_PHASE      : real    := 0.0;
      COMPENSATION       : string  := "SYSTEM_SYNCHRONOUS";
      DIVCLK_DIVIDE      : integer := 1;
      REF_JITTER         : real    := 0.100;
      SIM_DEVICE         : string  := "VIRTEX5"
    );
    port (
      clkfbdcm   : out   std_ulogic;
      clkfbout   : out   std_ulogic;
      clkout0    : out   std_ulogic;
      clkout1    : out   std_ulogic;
      clkout2    : out   std_ulogic;
      clkout3    : out   std_ulogic;
      clkout4    : out   std_ulogic;
      clkout5    : out   std_ulogic;
      clkoutdcm0 : out   std_ulogic;
      clkoutdcm1 : out   std_ulogic;
      clkoutdcm2 : out   std_ulogic;
      clkoutdcm3 : out   std_ulogic;
      clkoutdcm4 : out   std_ulogic;
      clkoutdcm5 : out   std_ulogic;
      do         : out   std_logic_vector(15 downto 0);
      drdy       : out   std_ulogic;
      locked     : out   std_ulogic;
      clkfbin    : in    std_ulogic;
      clkin1     : in    std_ulogic;
      clkin2     : in    std_ulogic;
      clkinsel   : in    std_ulogic;
      daddr      : in    std_logic_vector(4 downto 0);
      dclk       : in    std_ulogic;
      den        : in    std_ulogic;
      di         : in    std_logic_vector(15 downto 0);
      dwe        : in    std_ulogic;
      rel        : in    std_ulogic;
      rst        : in    std_ulogic
    );
  end component pll_adv;

end package vcomponents;
