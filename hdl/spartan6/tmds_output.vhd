-- SPDX-License-Identifier: Apache-2.0
-- Output of one TMDS lane: gearbox, serialiser 5:1 and pins.
--
-- Latency: that of gearbox_10_to_5, and 2 clocks of clk_x2 for the serialiser. Throughput: ten bits each clock of clk.
-- Equation: the bits of word, one each clock of io_clk.

library ieee;
use ieee.std_logic_1164.all;

library unisim;
use unisim.vcomponents.all;

entity tmds_output is
  port (
    -- Ten bits, in clk; bit 0 is sent first.
    word : in    std_logic_vector(9 downto 0);
    -- Clocks from serial_clocks.
    io_clk    : in    std_logic;
    io_strobe : in    std_logic;
    -- Pixel clock; twice that, for the serialiser.
    clk    : in    std_logic;
    clk_x2 : in    std_logic;
    -- Reset in clk_x2.
    reset : in    std_logic;
    -- Pins of the lane.
    data_p : out   std_logic;
    data_n : out   std_logic
  );
end entity tmds_output;

architecture rtl of tmds_output is

  -- The sites of a differential pair: each has a serialiser; the pins are at the master.
  constant MASTER : natural := 0;
  constant SLAVE  : natural := 1;

  subtype sites_t is std_logic_vector(MASTER to SLAVE);

  type bits_t is array (MASTER to SLAVE) of std_logic_vector(4 downto 1);

  function mode (
    site : natural
  ) return string is
  begin

    if site = MASTER then
      return "MASTER";
    end if;

    return "SLAVE";

  end function mode;

  -- Five bits for each clock of clk_x2; the bits of each site; the outputs of the sites.
  signal half : std_logic_vector(4 downto 0);
  signal bits : bits_t;
  signal sent : sites_t;
  -- The cascade: data and tristate go from master to slave and back, and both send a word of five bits together. Inputs
  -- that no other site drives are high.
  signal down_data     : sites_t;
  signal down_tristate : sites_t;
  signal up_data       : sites_t;
  signal up_tristate   : sites_t;
  signal shift_in      : bits_t;

begin

  -- A serialiser has at most eight inputs, so a word of ten bits goes out as two halves of five.
  gearbox : entity work.gearbox_10_to_5
    port map (
      clk    => clk,
      clk_x2 => clk_x2,
      bits   => word,
      half   => half
    );

  -- A cascade sends the slave's four bits first, so the master has the last bit.
  bits(MASTER) <= "000" & half(4);
  bits(SLAVE)  <= half(3 downto 0);

  -- The master has its cascade at shift inputs 3 and 4, the slave at 1 and 2.
  shift_in(MASTER) <= (up_tristate(SLAVE), up_data(SLAVE), '1', '1');
  shift_in(SLAVE)  <= ('1', '1', down_tristate(MASTER), down_data(MASTER));

  -- The slave's output goes out through the master.
  site : for i in MASTER to SLAVE generate

    serialiser : component oserdes2
      generic map (
        DATA_RATE_OQ => "SDR",
        DATA_RATE_OT => "SDR",
        DATA_WIDTH   => 5,
        OUTPUT_MODE  => "DIFFERENTIAL",
        SERDES_MODE  => mode(i)
      )
      port map (
        oq        => sent(i),
        oce       => '1',
        clk0      => io_clk,
        clk1      => '0',
        ioce      => io_strobe,
        rst       => reset,
        clkdiv    => clk_x2,
        d4        => bits(i)(4),
        d3        => bits(i)(3),
        d2        => bits(i)(2),
        d1        => bits(i)(1),
        t1        => '0',
        t2        => '0',
        t3        => '0',
        t4        => '0',
        train     => '0',
        tce       => '1',
        shiftin1  => shift_in(i)(1),
        shiftin2  => shift_in(i)(2),
        shiftin3  => shift_in(i)(3),
        shiftin4  => shift_in(i)(4),
        shiftout1 => down_data(i),
        shiftout2 => down_tristate(i),
        shiftout3 => up_data(i),
        shiftout4 => up_tristate(i)
      );

  end generate site;

  -- TMDS draws its current through the terminators of the sink, so the standard has no other setting.
  pins : component obufds
    generic map (
      IOSTANDARD => "TMDS_33"
    )
    port map (
      i  => sent(MASTER),
      o  => data_p,
      ob => data_n
    );

end architecture rtl;
