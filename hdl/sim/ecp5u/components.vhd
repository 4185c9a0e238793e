-- The ECP5 primitives that boards use, declared as in Lattice's library of this name;
-- built by scripts/build_hdl.py from the entities of the models.
--
-- For simulation without Lattice's tools: a small library `ecp5u` with behavioural models,
-- written from FPGA-TN-02035 and FPGA-TN-02200. Ports and generics have Lattice's names; only those in use
-- are here. Each model says at its head what it leaves out.

library ieee;
use ieee.std_logic_1164.all;

package components is

  component clkdivf is
    generic (
      GSR : string := "DISABLED";
      DIV : string := "2.0"
    );
    port (
      clki    : in    std_ulogic;
      rst     : in    std_ulogic;
      alignwd : in    std_ulogic;
      cdivx   : out   std_ulogic
    );
  end component clkdivf;

  component delayf is
    generic (
      DEL_MODE  : string  := "USER_DEFINED";
      DEL_VALUE : integer := 0
    );
    port (
      a         : in    std_ulogic;
      loadn     : in    std_ulogic;
      move      : in    std_ulogic;
      direction : in    std_ulogic;
      z         : out   std_ulogic;
      cflag     : out   std_ulogic
    );
  end component delayf;

  component delayg is
    generic (
      DEL_MODE  : string  := "USER_DEFINED";
      DEL_VALUE : integer := 0
    );
    port (
      a : in    std_ulogic;
      z : out   std_ulogic
    );
  end component delayg;

  component eclksyncb is
    port (
      eclki : in    std_ulogic;
      stop  : in    std_ulogic;
      eclko : out   std_ulogic
    );
  end component eclksyncb;

  component ehxplll is
    generic (
      CLKI_DIV        : integer := 1;
      CLKFB_DIV       : integer := 1;
      CLKOP_DIV       : integer := 8;
      CLKOS_DIV       : integer := 8;
      CLKOP_CPHASE    : integer := 0;
      CLKOS_CPHASE    : integer := 0;
      CLKOS_ENABLE    : string  := "DISABLED";
      FEEDBK_PATH     : string  := "CLKOP";
      INT_LOCK_STICKY : string  := "ENABLED";
      PLLRST_ENA      : string  := "DISABLED"
    );
    port (
      clki         : in    std_ulogic;
      clkfb        : in    std_ulogic;
      phasesel1    : in    std_ulogic;
      phasesel0    : in    std_ulogic;
      phasedir     : in    std_ulogic;
      phasestep    : in    std_ulogic;
      phaseloadreg : in    std_ulogic;
      stdby        : in    std_ulogic;
      pllwakesync  : in    std_ulogic;
      rst          : in    std_ulogic;
      enclkop      : in    std_ulogic;
      enclkos      : in    std_ulogic;
      enclkos2     : in    std_ulogic;
      enclkos3     : in    std_ulogic;
      clkop        : out   std_ulogic;
      clkos        : out   std_ulogic;
      clkos2       : out   std_ulogic;
      clkos3       : out   std_ulogic;
      lock         : out   std_ulogic;
      intlock      : out   std_ulogic;
      refclk       : out   std_ulogic;
      clkintfb     : out   std_ulogic
    );
  end component ehxplll;

  component iddrx1f is
    generic (
      GSR : string := "ENABLED"
    );
    port (
      d    : in    std_ulogic;
      sclk : in    std_ulogic;
      rst  : in    std_ulogic;
      q0   : out   std_ulogic;
      q1   : out   std_ulogic
    );
  end component iddrx1f;

  component iddrx2f is
    generic (
      GSR : string := "ENABLED"
    );
    port (
      d       : in    std_ulogic;
      sclk    : in    std_ulogic;
      eclk    : in    std_ulogic;
      rst     : in    std_ulogic;
      alignwd : in    std_ulogic;
      q3      : out   std_ulogic;
      q2      : out   std_ulogic;
      q1      : out   std_ulogic;
      q0      : out   std_ulogic
    );
  end component iddrx2f;

  component oddrx1f is
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
  end component oddrx1f;

end package components;
