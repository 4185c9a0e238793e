-- SPDX-License-Identifier: Apache-2.0
-- Output of one TMDS lane: gearbox, serialiser 5:1 and pins.
--
-- Latency: the gearbox, and the serialiser's 2 clocks of clk_x2. Throughput: ten bits each clock of clk.
-- Equation: the bits of word, one each clock of io_clk.

library ieee;
use ieee.std_logic_1164.all;

library unisim;
use unisim.vcomponents.all;

entity tmds_output is
  port (
    -- Ten bits, in clk; bit 0 is sent first.
    word : in    std_logic_vector(9 downto 0);
    -- From serial_clocks.
    io_clk    : in    std_logic;
    io_strobe : in    std_logic;
    -- Pixel clock, and twice that, the serialiser's.
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

  -- Five bits of each clock of clk_x2, and the pair as one bit.
  signal half    : std_logic_vector(4 downto 0);
  signal to_pins : std_logic;
  -- The cascade: data and tristate go between master and slave, which send a word of five bits together.
  signal master_data     : std_logic;
  signal master_tristate : std_logic;
  signal slave_data      : std_logic;
  signal slave_tristate  : std_logic;

begin

  -- A serialiser has eight inputs at most, so a word of ten bits goes out as two of five.
  gearbox : entity work.gearbox_10_to_5
    port map (
      clk    => clk,
      clk_x2 => clk_x2,
      bits   => word,
      half   => half
    );

  -- A cascade sends the slave's four bits first: the master has the last one.
  master_serialiser : component oserdes2
    generic map (
      DATA_RATE_OQ => "SDR",
      DATA_RATE_OT => "SDR",
      DATA_WIDTH   => 5,
      OUTPUT_MODE  => "DIFFERENTIAL",
      SERDES_MODE  => "MASTER"
    )
    port map (
      oq        => to_pins,
      oce       => '1',
      clk0      => io_clk,
      clk1      => '0',
      ioce      => io_strobe,
      rst       => reset,
      clkdiv    => clk_x2,
      d4        => '0',
      d3        => '0',
      d2        => '0',
      d1        => half(4),
      t1        => '0',
      t2        => '0',
      t3        => '0',
      t4        => '0',
      train     => '0',
      tce       => '1',
      shiftin1  => '1',
      shiftin2  => '1',
      shiftin3  => slave_data,
      shiftin4  => slave_tristate,
      shiftout1 => master_data,
      shiftout2 => master_tristate
    );

  -- It has no pin of its own: what it sends goes out through the master, in front of its bit.
  slave_serialiser : component oserdes2
    generic map (
      DATA_RATE_OQ => "SDR",
      DATA_RATE_OT => "SDR",
      DATA_WIDTH   => 5,
      OUTPUT_MODE  => "DIFFERENTIAL",
      SERDES_MODE  => "SLAVE"
    )
    port map (
      oce       => '1',
      clk0      => io_clk,
      clk1      => '0',
      ioce      => io_strobe,
      rst       => reset,
      clkdiv    => clk_x2,
      d4        => half(3),
      d3        => half(2),
      d2        => half(1),
      d1        => half(0),
      t1        => '0',
      t2        => '0',
      t3        => '0',
      t4        => '0',
      train     => '0',
      tce       => '1',
      shiftin1  => master_data,
      shiftin2  => master_tristate,
      shiftin3  => '1',
      shiftin4  => '1',
      shiftout3 => slave_data,
      shiftout4 => slave_tristate
    );

  -- TMDS draws its current through the terminators of the sink, so the standard has no other setting.
  pins : component obufds
    generic map (
      IOSTANDARD => "TMDS_33"
    )
    port map (
      i  => to_pins,
      o  => data_p,
      ob => data_n
    );

end architecture rtl;
