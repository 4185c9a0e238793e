-- SPDX-License-Identifier: Apache-2.0
-- Model of MMCME2_ADV (UG472) with internal feedback: CLKOUTn = CLKIN * CLKFBOUT_MULT_F / DIVCLK_DIVIDE / divider n.
--
-- CLKINSEL chooses CLKIN1 (high) or CLKIN2. Rising edges of an output meet the input's where its ratio to the input is
-- a whole number. LOCKED rises LOCK_CYCLES regular input cycles after reset, if the oscillator is within the 600 to
-- 1200 MHz of the slowest grade; it falls when an input cycle is missing or is another one, and the outputs stop.
--
-- Left out: CLKOUT3 to CLKOUT6, the inverted outputs, phases, duty cycles, fractions of dividers, the ports for
-- registers and for phase shifts, power down, jitter, other feedback.

library ieee;
use ieee.std_logic_1164.all;

entity mmcme2_adv is
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
end entity mmcme2_adv;

architecture behaviour of mmcme2_adv is

  constant LOCK_CYCLES : natural := 32;
  constant VCO_SLOWEST : time    := 1667 ps;
  constant VCO_FASTEST : time    := 833 ps;
  constant MULTIPLIER  : natural := integer(CLKFBOUT_MULT_F);

  type dividers_t is array (0 to 2) of positive;

  constant DIVIDERS : dividers_t := (integer(CLKOUT0_DIVIDE_F), CLKOUT1_DIVIDE, CLKOUT2_DIVIDE);

  -- Half periods of the outputs that run on their own between input edges; 0: stopped.

  type halves_t is array (0 to 2) of time;

  signal clkin   : std_ulogic;
  signal halves  : halves_t                  := (others => 0 fs);
  signal free    : std_ulogic_vector(0 to 2) := "000";
  signal aligned : std_ulogic_vector(0 to 2) := "000";
  signal outputs : std_ulogic_vector(0 to 2);

  -- Whether rising edges of an output meet those of the input.

  function meets (
    output : natural
  ) return boolean is
  begin

    return MULTIPLIER mod (DIVCLK_DIVIDE * DIVIDERS(output)) = 0;

  end function meets;

begin

  assert real(MULTIPLIER) = CLKFBOUT_MULT_F and real(DIVIDERS(0)) = CLKOUT0_DIVIDE_F
    report "MMCME2_ADV: the model knows whole dividers only"
    severity failure;

  clkin <= clkin1 when clkinsel = '1' else
           clkin2;

  clkout0      <= outputs(0);
  clkout1      <= outputs(1);
  clkout2      <= outputs(2);
  clkfbout     <= '0';
  clkfboutb    <= '0';
  clkfbstopped <= '0';
  clkinstopped <= '0';
  clkout0b     <= '0';
  clkout1b     <= '0';
  clkout2b     <= '0';
  clkout3      <= '0';
  clkout3b     <= '0';
  clkout4      <= '0';
  clkout5      <= '0';
  clkout6      <= '0';
  drdy         <= '0';
  psdone       <= '0';
  do           <= (others => '0');

  choose_each : for n in 0 to 2 generate

    outputs(n) <= aligned(n) when meets(n) else
                  free(n);

    oscillate : process is
    begin

      if halves(n) = 0 fs then
        wait until halves(n) /= 0 fs;
      end if;

      wait for halves(n);
      free(n) <= not free(n);

      -- The output stops with its input, as far as a simulation can tell, so that it does not keep a simulation alive.
      if clkin'last_event > 1 us then
        wait until clkin'event;
      end if;

    end process oscillate;

  end generate choose_each;

  multiply : process is

    variable period : time;
    variable last   : time;
    variable vco    : time;
    variable cycles : natural;
    variable ratio  : natural;

  begin

    locked  <= '0';
    aligned <= "000";
    halves  <= (others => 0 fs);

    if rst = '1' then
      wait until rst = '0';
    end if;

    wait until rising_edge(clkin) or rst = '1';
    last   := now;
    cycles := 0;

    while rst /= '1' loop

      -- A missing cycle is one that is twice too long; before the first cycle a microsecond.
      if cycles = 0 then
        wait until rising_edge(clkin) or rst = '1' for 1 us;
      else
        wait until rising_edge(clkin) or rst = '1' for 2 * period;
      end if;

      exit when rst = '1' or not rising_edge(clkin);

      if cycles > 0 and (now - last > period + period / 8 or now - last < period - period / 8) then
        -- The input has another frequency.
        exit;
      end if;

      period := now - last;
      last   := now;
      vco    := period * DIVCLK_DIVIDE / MULTIPLIER;

      -- Out of the oscillator's range no edges go out, and LOCKED never rises.
      if vco > VCO_SLOWEST or vco < VCO_FASTEST then
        cycles := 1;
      elsif cycles < LOCK_CYCLES then
        cycles := cycles + 1;
      else
        locked <= '1';
      end if;

      -- Two equal periods are needed to know the length of the next one.
      if cycles > 2 then

        for n in 0 to 2 loop

          if meets(n) then
            ratio := MULTIPLIER / (DIVCLK_DIVIDE * DIVIDERS(n));

            -- Scheduled from each input edge, so that the outputs stay in step with the input and end with it.
            for i in 0 to 2 * ratio - 1 loop

              if i mod 2 = 0 then
                aligned(n) <= transport '1' after period * i / (2 * ratio);
              else
                aligned(n) <= transport '0' after period * i / (2 * ratio);
              end if;

            end loop;

          else
            halves(n) <= vco * DIVIDERS(n) / 2;
          end if;

        end loop;

      end if;

    end loop;

  end process multiply;

end architecture behaviour;
