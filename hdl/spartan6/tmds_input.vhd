-- SPDX-License-Identifier: Apache-2.0
-- Input of one TMDS channel: pins, delay lines and their control, deserialiser 5:1, gearbox.
--
-- Master and slave of a differential pair: the master samples the bits, the slave their edges.
--
-- Latency: the deserialiser, 2 to 3 clocks of clk_x2, and the gearbox. Throughput: ten bits each clock of clk.
-- Equation: bits = ten bits in a row.

library ieee;
use ieee.std_logic_1164.all;

library unisim;
use unisim.vcomponents.all;

entity tmds_input is
  port (
    -- Pins of the channel.
    data_p : in    std_logic;
    data_n : in    std_logic;
    -- From serial_clocks.
    io_clk    : in    std_logic;
    io_strobe : in    std_logic;
    -- Pixel clock, and twice that, the deserialiser's.
    clk    : in    std_logic;
    clk_x2 : in    std_logic;
    -- Reset in clk_x2.
    reset : in    std_logic;
    -- Ten bits, in clk; bit 0 came first.
    bits : out   std_logic_vector(9 downto 0);
    -- The delay lines, in clk_x2: see phase_detector_control.
    tracking    : out   std_logic;
    taps        : out   std_logic_vector(7 downto 0);
    hung_toggle : out   std_logic
  );
end entity tmds_input;

architecture rtl of tmds_input is

  -- From and to the control of the delay lines.
  signal calibrate_master : std_logic;
  signal calibrate_slave  : std_logic;
  signal delay_reset      : std_logic;
  signal step             : std_logic;
  signal step_up          : std_logic;
  signal busy             : std_logic;
  signal valid            : std_logic;
  signal increase         : std_logic;
  -- The pair as one bit, and delayed by both lines: the master is to see the bits, the slave their edges.
  signal from_pins   : std_logic;
  signal master_data : std_logic;
  signal slave_data  : std_logic;
  -- The cascade of both deserialisers: the slave has one of the five bits, the master compares the samples of both.
  signal to_slave  : std_logic;
  signal to_master : std_logic;
  -- Five bits of each clock of clk_x2.
  signal half        : std_logic_vector(4 downto 0);
  signal master_busy : std_logic;
  signal slave_busy  : std_logic;

begin

  phase : entity work.phase_detector_control
    port map (
      clk              => clk_x2,
      reset            => reset,
      busy             => busy,
      valid            => valid,
      increase         => increase,
      calibrate_master => calibrate_master,
      calibrate_slave  => calibrate_slave,
      delay_reset      => delay_reset,
      step             => step,
      step_up          => step_up,
      tracking         => tracking,
      taps             => taps,
      hung_toggle      => hung_toggle
    );

  -- A command is carried out when both lines have carried it out.
  busy <= master_busy or slave_busy;

  -- TMDS is terminated to 3.3 V outside of the FPGA; DIFF_TERM would put another standard's 100 ohm across the pair.
  pins : component ibufds
    generic map (
      DIFF_TERM  => false,
      IOSTANDARD => "TMDS_33"
    )
    port map (
      i  => data_p,
      ib => data_n,
      o  => from_pins
    );

  -- Both lines are stepped alike, so that what the calibration has set between them stays.
  master_delay : component iodelay2
    generic map (
      COUNTER_WRAPAROUND => "STAY_AT_LIMIT",
      DATA_RATE          => "SDR",
      DELAY_SRC          => "IDATAIN",
      IDELAY_TYPE        => "DIFF_PHASE_DETECTOR",
      SERDES_MODE        => "MASTER",
      SIM_TAPDELAY_VALUE => 50
    )
    port map (
      idatain => from_pins,
      odatain => '0',
      t       => '1',
      ioclk0  => io_clk,
      ioclk1  => '0',
      clk     => clk_x2,
      cal     => calibrate_master,
      ce      => step,
      inc     => step_up,
      rst     => delay_reset,
      busy    => master_busy,
      dataout => master_data
    );

  slave_delay : component iodelay2
    generic map (
      COUNTER_WRAPAROUND => "WRAPAROUND",
      DATA_RATE          => "SDR",
      DELAY_SRC          => "IDATAIN",
      IDELAY_TYPE        => "DIFF_PHASE_DETECTOR",
      SERDES_MODE        => "SLAVE",
      SIM_TAPDELAY_VALUE => 50
    )
    port map (
      idatain => from_pins,
      odatain => '0',
      t       => '1',
      ioclk0  => io_clk,
      ioclk1  => '0',
      clk     => clk_x2,
      cal     => calibrate_slave,
      ce      => step,
      inc     => step_up,
      rst     => delay_reset,
      busy    => slave_busy,
      dataout => slave_data
    );

  -- RETIMED: the word changes with clkdiv alone. Word boundaries are found behind the gearbox, so nothing slips here.
  master_deserialiser : component iserdes2
    generic map (
      DATA_RATE      => "SDR",
      DATA_WIDTH     => 5,
      INTERFACE_TYPE => "RETIMED",
      SERDES_MODE    => "MASTER"
    )
    port map (
      d        => master_data,
      ce0      => '1',
      clk0     => io_clk,
      clk1     => '0',
      ioce     => io_strobe,
      rst      => reset,
      clkdiv   => clk_x2,
      shiftin  => to_master,
      bitslip  => '0',
      q4       => half(4),
      q3       => half(3),
      q2       => half(2),
      q1       => half(1),
      valid    => valid,
      incdec   => increase,
      shiftout => to_slave
    );

  -- Its samples at the edges tell the master whether the delay is too long or too short (valid, incdec).
  slave_deserialiser : component iserdes2
    generic map (
      DATA_RATE      => "SDR",
      DATA_WIDTH     => 5,
      INTERFACE_TYPE => "RETIMED",
      SERDES_MODE    => "SLAVE"
    )
    port map (
      d        => slave_data,
      ce0      => '1',
      clk0     => io_clk,
      clk1     => '0',
      ioce     => io_strobe,
      rst      => reset,
      clkdiv   => clk_x2,
      shiftin  => to_slave,
      bitslip  => '0',
      q4       => half(0),
      shiftout => to_master
    );

  -- Two halves make the ten bits of a TMDS word, at any of its ten phases.
  gearbox : entity work.gearbox_5_to_10
    port map (
      clk    => clk,
      clk_x2 => clk_x2,
      half   => half,
      bits   => bits
    );

end architecture rtl;
