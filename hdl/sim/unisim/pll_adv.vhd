-- SPDX-License-Identifier: Apache-2.0
-- Model of PLL_ADV of Spartan-6 (UG382) with its reconfiguration port (XAPP879).
--
-- The VCO runs at CLKIN * CLKFBOUT_MULT, the outputs at VCO / CLKOUT*_DIVIDE, their rising edges with
-- the input's. All divided ratios must be whole numbers of cycles for each input cycle. LOCKED rises
-- LOCK_CYCLES regular input cycles after reset, if the VCO is within its 400 to 1080 MHz (-3); it falls
-- when an input cycle is missing, and the outputs stop. Registers written through the port take
-- effect when RST is released.
--
-- Left out: phases and duty cycles, CLKOUT3 to 5, DIVCLK, filter and lock detector settings, jitter,
-- external feedback, CLKIN2, what LOCKED does between too slow and stopped.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity pll_adv is
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
end entity pll_adv;

architecture behaviour of pll_adv is

  constant LOCK_CYCLES : natural := 32;
  constant VCO_SLOWEST : time    := 2500 ps;
  constant VCO_FASTEST : time    := 925 ps;

  type registers_t is array (0 to 31) of std_logic_vector(15 downto 0);

  -- Places of a counter's low time, high time and "no count": 16 * register + bit (XAPP879).

  type places_t is array (0 to 12) of natural;

  constant FEEDBACK : places_t :=
  (
    16#F9#,
    16#FB#,
    16#FA#,
    16#FD#,
    16#FF#,
    16#FE#,
    16#106#,
    16#107#,
    16#108#,
    16#109#,
    16#10B#,
    16#10A#,
    16#FC#
  );
  constant OUTPUT_0 : places_t :=
  (
    16#D5#,
    16#F2#,
    16#D4#,
    16#D6#,
    16#B9#,
    16#BF#,
    16#113#,
    16#110#,
    16#111#,
    16#10E#,
    16#10C#,
    16#10D#,
    16#F3#
  );
  constant OUTPUT_1 : places_t :=
  (
    16#114#,
    16#6B#,
    16#6A#,
    16#6D#,
    16#6F#,
    16#6E#,
    16#77#,
    16#78#,
    16#79#,
    16#7B#,
    16#7A#,
    16#7C#,
    16#6C#
  );
  constant OUTPUT_2 : places_t :=
  (
    16#87#,
    16#116#,
    16#88#,
    16#89#,
    16#8A#,
    16#8D#,
    16#95#,
    16#94#,
    16#96#,
    16#97#,
    16#99#,
    16#117#,
    16#8B#
  );

  -- Registers are written as a whole, so a counter that reads 0 was never set.
  function divider (
    registers       : registers_t;
    places          : places_t;
    attribute_value : positive
  ) return positive is

    variable low  : natural;
    variable high : natural;

  begin

    low  := 0;
    high := 0;

    for i in 0 to 5 loop

      if registers(places(i) / 16)(places(i) mod 16) = '1' then
        low := low + 2 ** i;
      end if;

      if registers(places(i + 6) / 16)(places(i + 6) mod 16) = '1' then
        high := high + 2 ** i;
      end if;

    end loop;

    -- A counter that was never written has the ratio of the attribute; "no count" is a ratio of 1.
    if low = 0 or high = 0 then
      return attribute_value;
    elsif registers(places(12) / 16)(places(12) mod 16) = '1' then
      return 1;
    end if;

    return low + high;

  end function divider;

  signal registers : registers_t := (others => (others => '0'));
  signal lock_now  : std_ulogic  := '0';

begin

  assert clk_feedback = "CLKFBOUT" and divclk_divide = 1 and sim_device = "SPARTAN6"
    report "PLL_ADV: the model knows internal feedback of a SPARTAN6, DIVCLK_DIVIDE = 1, only"
    severity failure;

  clkfbdcm   <= '0';
  clkfbout   <= '0';
  clkout3    <= '0';
  clkout4    <= '0';
  clkout5    <= '0';
  clkoutdcm0 <= '0';
  clkoutdcm1 <= '0';
  clkoutdcm2 <= '0';
  clkoutdcm3 <= '0';
  clkoutdcm4 <= '0';
  clkoutdcm5 <= '0';
  locked     <= lock_now;

  reconfigure : process is
  begin

    drdy <= '0';
    wait until rising_edge(dclk) and den = '1';

    -- XAPP879: the PLL must be in reset while its registers change.
    if dwe = '1' then
      assert rst = '1'
        report "PLL_ADV: register written while the PLL runs"
        severity failure;
      registers(to_integer(unsigned(daddr))) <= di;
    end if;

    do <= registers(to_integer(unsigned(daddr)));
    -- DRDY comes some clocks later, for a clock.
    wait until rising_edge(dclk);
    wait until rising_edge(dclk);
    drdy <= '1';
    wait until rising_edge(dclk);

  end process reconfigure;

  multiply : process is

    variable mult     : positive;
    variable divide_0 : positive;
    variable divide_1 : positive;
    variable divide_2 : positive;
    variable period   : time;
    variable last     : time;
    variable cycles   : natural;
    variable half     : time;

    -- Makes the edges of one output for one input cycle.

    procedure run (
      signal clock   : out std_ulogic;
      constant ratio : positive;
      constant cycle : time
    ) is
    begin

      -- Scheduled from each input edge, so that all outputs stay in step with the input and end with it.
      for i in 0 to 2 * ratio - 1 loop

        if i mod 2 = 0 then
          clock <= transport '1' after cycle * i / (2 * ratio);
        else
          clock <= transport '0' after cycle * i / (2 * ratio);
        end if;

      end loop;

    end procedure run;

  begin

    lock_now <= '0';
    clkout0  <= '0';
    clkout1  <= '0';
    clkout2  <= '0';

    if rst /= '0' then
      wait until rst = '0';
    end if;

    -- Written registers take effect when RST is released.
    mult     := divider(registers, FEEDBACK, CLKFBOUT_MULT);
    divide_0 := divider(registers, OUTPUT_0, CLKOUT0_DIVIDE);
    divide_1 := divider(registers, OUTPUT_1, CLKOUT1_DIVIDE);
    divide_2 := divider(registers, OUTPUT_2, CLKOUT2_DIVIDE);
    assert mult mod divide_0 = 0 and mult mod divide_1 = 0 and mult mod divide_2 = 0
      report "PLL_ADV: the model knows whole ratios only"
      severity failure;
    wait until rising_edge(clkin1) or rst = '1';
    last     := now;
    cycles   := 0;

    while rst = '0' loop

      -- A missing cycle is one that is twice too long; before the first cycle a microsecond.
      if cycles = 0 then
        wait until rising_edge(clkin1) or rst = '1' for 1 us;
      else
        wait until rising_edge(clkin1) or rst = '1' for 2 * period;
      end if;

      exit when rst = '1' or not rising_edge(clkin1);

      if cycles > 0 and (now - last > period + period / 8 or now - last < period - period / 8) then
        -- The input has another frequency.
        exit;
      end if;

      period := now - last;
      last   := now;

      -- Out of the oscillator's range no edges go out, and LOCKED never rises.
      if period / mult > VCO_SLOWEST or period / mult < VCO_FASTEST then
        cycles := 1;
      elsif cycles < LOCK_CYCLES then
        cycles := cycles + 1;
      else
        lock_now <= '1';
      end if;

      -- Two equal periods are needed to know the length of the next one.
      if cycles > 2 then
        run(clkout0, mult / divide_0, period);
        run(clkout1, mult / divide_1, period);
        run(clkout2, mult / divide_2, period);
      end if;

    end loop;

  end process multiply;

end architecture behaviour;
