-- SPDX-License-Identifier: Apache-2.0
-- Input of one TMDS channel on a 7-series device: pins, delay line with the search of its delay, deserialiser 10:1.
--
-- During a search the output is 0, because words that arrive then would look like a picture.
--
-- Latency: 3 to 4 clocks of clk. Throughput: ten bits each clock of clk.
-- Equation: bits = ten successive bits while tracking, else 0.

library ieee;
use ieee.std_logic_1164.all;

library unisim;
use unisim.vcomponents.all;

entity lane_input is
  generic (
    -- TIMEOUT of phase_search.
    TIMEOUT : positive := 8192
  );
  port (
    -- Pins of the channel.
    data_p : in    std_logic;
    data_n : in    std_logic;
    -- Pixel clock, and five times that with aligned edges.
    clk    : in    std_logic;
    clk_x5 : in    std_logic;
    -- Reset in clk.
    reset : in    std_logic;
    -- Ten bits, in clk; bit 0 came first.
    bits : out   std_logic_vector(9 downto 0);
    -- In clk: a word of the channel was wrong (phase_search).
    wrong : in    std_logic;
    -- Reports of phase_search, in clk.
    tracking    : out   std_logic;
    taps        : out   std_logic_vector(7 downto 0);
    hung_toggle : out   std_logic
  );
end entity lane_input;

architecture rtl of lane_input is

  -- The deserialisers of the pair's two sites: the slave has the first two of the ten bits.
  constant MASTER : natural := 0;
  constant SLAVE  : natural := 1;

  subtype sites_t is std_logic_vector(MASTER to SLAVE);

  type words_t is array (MASTER to SLAVE) of std_logic_vector(8 downto 1);

  function mode (
    site : natural
  ) return string is
  begin

    if site = MASTER then
      return "MASTER";
    end if;

    return "SLAVE";

  end function mode;

  -- Controls of the delay line; the channel in front of it and behind it.
  signal load_n    : std_logic;
  signal load      : std_logic;
  signal move      : std_logic;
  signal from_pins : std_logic;
  signal delayed   : std_logic;
  -- The other edge of clk_x5; the cascade from the master to the slave, whose other ends are low; the words.
  signal clk_x5_n : std_logic;
  signal shifted1 : sites_t;
  signal shifted2 : sites_t;
  signal enters1  : sites_t;
  signal enters2  : sites_t;
  signal words    : words_t;
  -- All ten bits; whether a delay is found.
  signal bits_now : std_logic_vector(9 downto 0) := (others => '0');
  signal found    : std_logic;

begin

  tracking <= found;
  bits     <= bits_now when found = '1' else
              (others => '0');

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

  load <= not load_n;

  -- A tap is 78 ps; the line moves up one tap with each clock of move.
  delay : component idelaye2
    generic map (
      CINVCTRL_SEL          => "FALSE",
      DELAY_SRC             => "IDATAIN",
      HIGH_PERFORMANCE_MODE => "TRUE",
      IDELAY_TYPE           => "VARIABLE",
      IDELAY_VALUE          => 0,
      PIPE_SEL              => "FALSE",
      REFCLK_FREQUENCY      => 200.0,
      SIGNAL_PATTERN        => "DATA"
    )
    port map (
      c          => clk,
      ce         => move,
      inc        => '1',
      ld         => load,
      ldpipeen   => '0',
      regrst     => '0',
      cinvctrl   => '0',
      cntvaluein => "00000",
      datain     => '0',
      idatain    => from_pins,
      dataout    => delayed
    );

  clk_x5_n        <= not clk_x5;
  enters1(MASTER) <= '0';
  enters2(MASTER) <= '0';
  enters1(SLAVE)  <= shifted1(MASTER);
  enters2(SLAVE)  <= shifted2(MASTER);

  -- Word boundaries are found in the fabric (tmds_word_align), so nothing slips here.
  site : for i in MASTER to SLAVE generate

    deserialiser : component iserdese2
      generic map (
        DATA_RATE         => "DDR",
        DATA_WIDTH        => 10,
        DYN_CLKDIV_INV_EN => "FALSE",
        DYN_CLK_INV_EN    => "FALSE",
        INTERFACE_TYPE    => "NETWORKING",
        IOBDELAY          => "IFD",
        NUM_CE            => 1,
        OFB_USED          => "FALSE",
        SERDES_MODE       => mode(i)
      )
      port map (
        d            => '0',
        ddly         => delayed,
        clk          => clk_x5,
        clkb         => clk_x5_n,
        clkdiv       => clk,
        clkdivp      => '0',
        oclk         => '0',
        oclkb        => '0',
        ofb          => '0',
        ce1          => '1',
        ce2          => '1',
        bitslip      => '0',
        dynclkdivsel => '0',
        dynclksel    => '0',
        rst          => reset,
        shiftin1     => enters1(i),
        shiftin2     => enters2(i),
        shiftout1    => shifted1(i),
        shiftout2    => shifted2(i),
        q1           => words(i)(1),
        q2           => words(i)(2),
        q3           => words(i)(3),
        q4           => words(i)(4),
        q5           => words(i)(5),
        q6           => words(i)(6),
        q7           => words(i)(7),
        q8           => words(i)(8)
      );

  end generate site;

  -- Q1 came last, so the order is turned. A register of its own: the deserialisers' outputs are late in their clock.
  take : process (clk) is
  begin

    if rising_edge(clk) then

      for i in 1 to 8 loop

        bits_now(10 - i) <= words(MASTER)(i);

      end loop;

      bits_now(1) <= words(SLAVE)(3);
      bits_now(0) <= words(SLAVE)(4);
    end if;

  end process take;

  search : entity work.phase_search
    generic map (
      TAPS_THERE => 32,
      STEP_TAPS  => 1,
      TIMEOUT    => TIMEOUT
    )
    port map (
      clk         => clk,
      reset       => reset,
      bits        => bits_now,
      wrong       => wrong,
      load_n      => load_n,
      move        => move,
      tracking    => found,
      taps        => taps,
      hung_toggle => hung_toggle
    );

end architecture rtl;
