-- SPDX-License-Identifier: Apache-2.0
-- Model of IODELAY2 (UG381, XAPP1064) as a delay line of an input with phase detector.
--
-- The delay is a number of taps of SIM_TAPDELAY_VALUE ps. A calibration (CAL) lasts 12 clocks of CLK, in which BUSY is
-- high, and measures how many taps a bit lasts. RST sets the delay to half of that. CE moves it by one tap up (INC) or
-- down, only while BUSY is low and within one bit. The slave's delay is half a bit longer than its counter says, as
-- measured by its last calibration. A calibration within 16 clocks of a step is a failure of the simulation. With
-- faults (model_faults) the line hangs, ignores commands or answers late, as such delay lines were seen to do on
-- boards.
--
-- Left out: all other types and sources of delay, output delay, the spread between taps and between
-- delay lines, the constant part of the delay, wrap-around, DATAOUT2.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.model_faults.all;

entity iodelay2 is
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
end entity iodelay2;

architecture behaviour of iodelay2 is

  constant TAP                : time    := SIM_TAPDELAY_VALUE * 1 ps;
  constant CALIBRATION_CLOCKS : natural := 12;
  constant QUIET              : natural := 16;
  -- Latest late answer, in clocks.
  constant LATEST : natural := 900;
  -- Time without an edge after which CLK counts as stopped.
  constant STANDSTILL : time := 200 ns;

  -- Another number for each delay line of a design.

  function hash (
    name : string
  ) return natural is

    variable value : natural := 1;

  begin

    for i in name'range loop

      value := (value * 31 + character'pos(name(i))) mod 65536;

    end loop;

    return value;

  end function hash;

  signal delay : time := 0 fs;

begin

  assert idelay_type = "DIFF_PHASE_DETECTOR" and data_rate = "SDR" and delay_src = "IDATAIN" and
         (serdes_mode = "MASTER" or serdes_mode = "SLAVE")
    report "IODELAY2: the model knows DIFF_PHASE_DETECTOR, SDR, IDATAIN only"
    severity failure;

  dataout  <= transport idatain after delay;
  dataout2 <= '0';
  dout     <= '0';
  tout     <= '1';

  control : process is

    -- Taps of a bit; half of them for the slave; the counter; state of a calibration; effects of a fault: clocks by
    -- which an answer is late, whether the line hangs, whether a reset frees it.
    variable bit_taps : natural := 0;
    variable half     : natural := 0;
    variable counter  : natural := 0;
    variable clocks   : natural := 0;
    variable started  : time;
    variable stepped  : natural := QUIET;
    variable random   : natural := hash(iodelay2'path_name);
    variable late     : natural := 0;
    variable stuck    : boolean := false;
    variable by_reset : boolean := true;

    -- The next random number below a limit.

    procedure draw (
      limit  : in positive;
      result : out natural
    ) is
    begin

      random := (random * 25173 + 13849 + delay_faults mod 65536) mod 65536;
      result := (random / 16) mod limit;

    end procedure draw;

    variable chance : natural;

  begin

    busy <= '0';
    wait until rising_edge(clk);

    late := 0;

    -- Only a command can go wrong: a line at rest stays unchanged.
    if delay_faults /= 0 and (cal = '1' or ce = '1') then
      draw(12, chance);
      by_reset := delay_faults mod 2 = 0;
      if chance = 0 then
        busy  <= '1';
        stuck := true;
      elsif chance = 1 then
        stuck := true;
      elsif chance = 2 then
        draw(LATEST, late);
      end if;
    end if;

    while stuck loop

      started := now;
      wait until rising_edge(clk) for STANDSTILL;
      stuck   := not (now - started >= STANDSTILL or (rst = '1' and by_reset));

    end loop;

    -- Clocks since the last step, counted up to where a calibration is allowed.
    if stepped /= QUIET then
      stepped := stepped + 1;
    end if;

    if cal = '1' then
      assert stepped = QUIET
        report "IODELAY2: calibrated too soon behind a step"
        severity failure;

      while late > 0 loop

        wait until rising_edge(clk);
        late := late - 1;

      end loop;

      busy <= '1';
      -- Two bits are measured; with a stopped bit clock the result stays.
      wait until rising_edge(ioclk0) for 100 ns;
      started := now;
      wait until rising_edge(ioclk0) for 100 ns;
      -- Twice: the second and third edges are two whole bits apart, whatever the phase.
      wait until rising_edge(ioclk0) for 100 ns;
      if now - started < 100 ns then
        bit_taps := (now - started) / (2 * TAP);
        if bit_taps > 255 then
          bit_taps := 255;
        end if;
        if SERDES_MODE = "SLAVE" then
          half := bit_taps / 2;
        end if;
      end if;
      clocks := 0;

      while clocks < CALIBRATION_CLOCKS loop

        wait until rising_edge(clk);
        clocks := clocks + 1;

      end loop;

    elsif rst = '1' then
      counter := bit_taps / 2;
    elsif ce = '1' then
      stepped := 0;
      if inc = '1' and counter < bit_taps then
        counter := counter + 1;
      elsif inc = '0' and counter > 0 then
        counter := counter - 1;
      end if;
    end if;

    -- The slave's delay is half a bit longer, so that it samples the edges.
    delay <= (counter + half) * TAP;

  end process control;

end architecture behaviour;
