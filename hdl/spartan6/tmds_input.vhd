-- SPDX-License-Identifier: Apache-2.0
-- Input of one TMDS channel: pins, delay lines and their control, deserialiser 5:1, gearbox.
--
-- A differential pair has two sites: the master samples the bits, the slave their edges.
--
-- Latency: 2 to 3 clocks of clk_x2 for the deserialiser, and those of gearbox_5_to_10. Throughput: ten bits each clock
-- of clk.
-- Equation: bits = ten successive bits of the pins.

library ieee;
use ieee.std_logic_1164.all;

library unisim;
use unisim.vcomponents.all;

entity tmds_input is
  port (
    -- Pins of the channel.
    data_p : in    std_logic;
    data_n : in    std_logic;
    -- Clocks from serial_clocks.
    io_clk    : in    std_logic;
    io_strobe : in    std_logic;
    -- Pixel clock; twice that, for the deserialiser.
    clk    : in    std_logic;
    clk_x2 : in    std_logic;
    -- Reset in clk_x2.
    reset : in    std_logic;
    -- Ten bits, in clk; bit 0 came first.
    bits : out   std_logic_vector(9 downto 0);
    -- Reports of phase_detector_control, in clk_x2.
    tracking    : out   std_logic;
    taps        : out   std_logic_vector(7 downto 0);
    hung_toggle : out   std_logic
  );
end entity tmds_input;

architecture rtl of tmds_input is

  -- The sites of a differential pair: each has a delay line and a deserialiser.
  constant MASTER : natural := 0;
  constant SLAVE  : natural := 1;

  subtype sites_t is std_logic_vector(MASTER to SLAVE);

  type words_t is array (MASTER to SLAVE) of std_logic_vector(4 downto 1);

  function of_site (
    site       : natural;
    for_master : string;
    for_slave  : string
  ) return string is
  begin

    if site = MASTER then
      return for_master;
    end if;

    return for_slave;

  end function of_site;

  -- Signals of the control of the delay lines; valid and increase are used at the master only.
  signal calibrate   : sites_t;
  signal delay_reset : std_logic;
  signal step        : std_logic;
  signal step_up     : std_logic;
  signal busy        : std_logic;
  signal site_busy   : sites_t;
  signal valid       : sites_t;
  signal increase    : sites_t;
  -- The pair as one bit; the bit delayed by both lines: the master samples the bits, the slave their edges.
  signal from_pins : std_logic;
  signal delayed   : sites_t;
  -- The cascade of both deserialisers: the slave has one of the five bits, and the master compares the samples of both.
  signal shifted : sites_t;
  -- Five bits for each clock of clk_x2.
  signal words : words_t;
  signal half  : std_logic_vector(4 downto 0);

begin

  -- The control runs with the deserialisers' words, because the phase detector's results come with them.
  phase : entity work.phase_detector_control
    port map (
      clk              => clk_x2,
      reset            => reset,
      busy             => busy,
      valid            => valid(MASTER),
      increase         => increase(MASTER),
      calibrate_master => calibrate(MASTER),
      calibrate_slave  => calibrate(SLAVE),
      delay_reset      => delay_reset,
      step             => step,
      step_up          => step_up,
      tracking         => tracking,
      taps             => taps,
      hung_toggle      => hung_toggle
    );

  -- A command is done when both lines have done it.
  busy <= site_busy(MASTER) or site_busy(SLAVE);

  -- TMDS is terminated to 3.3 V outside of the FPGA; DIFF_TERM would add the 100 ohm of another standard.
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

  -- The two sites of the pair; the tools place each by its mode.
  site : for i in MASTER to SLAVE generate

    -- Both lines are stepped alike, so that the calibrated difference between them stays.
    delay : component iodelay2
      generic map (
        COUNTER_WRAPAROUND => of_site(i, "STAY_AT_LIMIT", "WRAPAROUND"),
        DATA_RATE          => "SDR",
        DELAY_SRC          => "IDATAIN",
        IDELAY_TYPE        => "DIFF_PHASE_DETECTOR",
        SERDES_MODE        => of_site(i, "MASTER", "SLAVE"),
        SIM_TAPDELAY_VALUE => 50
      )
      port map (
        idatain => from_pins,
        odatain => '0',
        t       => '1',
        ioclk0  => io_clk,
        ioclk1  => '0',
        clk     => clk_x2,
        cal     => calibrate(i),
        ce      => step,
        inc     => step_up,
        rst     => delay_reset,
        busy    => site_busy(i),
        dataout => delayed(i)
      );

    -- RETIMED: the word changes with clkdiv only. Word boundaries are found behind the gearbox, so nothing slips here.
    -- The slave's samples at the edges tell the master whether the delay is too long or too short (valid, incdec).
    deserialiser : component iserdes2
      generic map (
        DATA_RATE      => "SDR",
        DATA_WIDTH     => 5,
        INTERFACE_TYPE => "RETIMED",
        SERDES_MODE    => of_site(i, "MASTER", "SLAVE")
      )
      port map (
        d        => delayed(i),
        ce0      => '1',
        clk0     => io_clk,
        clk1     => '0',
        ioce     => io_strobe,
        rst      => reset,
        clkdiv   => clk_x2,
        shiftin  => shifted(SLAVE - i),
        bitslip  => '0',
        q4       => words(i)(4),
        q3       => words(i)(3),
        q2       => words(i)(2),
        q1       => words(i)(1),
        valid    => valid(i),
        incdec   => increase(i),
        shiftout => shifted(i)
      );

  end generate site;

  -- The slave has the first of the five bits.
  half <= words(MASTER) & words(SLAVE)(4);

  -- Two halves are the ten bits of a TMDS word, at any of its ten phases.
  gearbox : entity work.gearbox_5_to_10
    port map (
      clk    => clk,
      clk_x2 => clk_x2,
      half   => half,
      bits   => bits
    );

end architecture rtl;
