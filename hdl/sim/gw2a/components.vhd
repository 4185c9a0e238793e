-- The GW2A primitives that boards use, declared as in Gowin's library of this name;
-- built by scripts/build_hdl.py from the entities of the models.
--
-- For simulation without Gowin's tools: a small library `gw2a` with behavioural models,
-- written from UG286 and UG289. Ports and generics have Gowin's names; only those in use
-- are here. Each model says at its head what it leaves out.

library ieee;
use ieee.std_logic_1164.all;

package components is

  component clkdiv is
    generic (
      DIV_MODE : string := "2"
    );
    port (
      hclkin : in    std_ulogic;
      resetn : in    std_ulogic;
      calib  : in    std_ulogic;
      clkout : out   std_ulogic
    );
  end component clkdiv;

  component oser10 is
    port (
      d9    : in    std_ulogic;
      d8    : in    std_ulogic;
      d7    : in    std_ulogic;
      d6    : in    std_ulogic;
      d5    : in    std_ulogic;
      d4    : in    std_ulogic;
      d3    : in    std_ulogic;
      d2    : in    std_ulogic;
      d1    : in    std_ulogic;
      d0    : in    std_ulogic;
      fclk  : in    std_ulogic;
      pclk  : in    std_ulogic;
      reset : in    std_ulogic;
      q     : out   std_ulogic
    );
  end component oser10;

  component rpll is
    generic (
      FCLKIN    : string  := "100.0";
      IDIV_SEL  : integer := 0;
      FBDIV_SEL : integer := 0;
      ODIV_SEL  : integer := 8;
      DEVICE    : string  := "GW2A-18C"
    );
    port (
      clkin    : in    std_ulogic;
      clkfb    : in    std_ulogic;
      reset    : in    std_ulogic;
      reset_p  : in    std_ulogic;
      fbdsel   : in    std_ulogic_vector(5 downto 0);
      idsel    : in    std_ulogic_vector(5 downto 0);
      odsel    : in    std_ulogic_vector(5 downto 0);
      dutyda   : in    std_ulogic_vector(3 downto 0);
      psda     : in    std_ulogic_vector(3 downto 0);
      fdly     : in    std_ulogic_vector(3 downto 0);
      clkout   : out   std_ulogic;
      clkoutp  : out   std_ulogic;
      clkoutd  : out   std_ulogic;
      clkoutd3 : out   std_ulogic;
      lock     : out   std_ulogic
    );
  end component rpll;

  component tlvds_obuf is
    port (
      i  : in    std_ulogic;
      o  : out   std_ulogic;
      ob : out   std_ulogic
    );
  end component tlvds_obuf;

end package components;
