-- SPDX-License-Identifier: Apache-2.0
-- The ULX3S as hdmi_bench sees a board: its oscillator, and inputs by their positive pins, an open pair as high.

library ieee;
use ieee.std_logic_1164.all;

library ecp5u;
use ecp5u.model_faults.all;

architecture test of board_under_test is

  signal clk_25 : std_logic := '0';
  signal half   : std_logic := '0';

begin

  delay_faults <= delay_fault_seed;
  slow_lock    <= slow_lock_us;

  -- The bench has a clock of 100 MHz; the board's oscillator is a quarter of it, with edges of its
  -- own.
  oscillate : process (clk_100) is
  begin

    if rising_edge(clk_100) then
      half <= not half;
      if half = '1' then
        clk_25 <= not clk_25;
      end if;
    end if;

  end process oscillate;

  top : entity work.ulx3s_top
    generic map (
      MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
      SHIFTS              => SHIFTS,
      MAX_COLUMNS         => MAX_COLUMNS,
      EXACT               => EXACT,
      FRACTION_BITS       => FRACTION_BITS,
      GUARD_BITS          => GUARD_BITS,
      INTERPOLATION_ORDER => INTERPOLATION_ORDER,
      HOLD                => HOLD,
      BROADCAST_TAPS      => BROADCAST_TAPS,
      ENGINE              => ENGINE,
      BOX                 => BOX,
      PATTERN_H_ACTIVE    => PATTERN_H_ACTIVE,
      PATTERN_H_FRONT     => PATTERN_H_FRONT,
      PATTERN_H_SYNC      => PATTERN_H_SYNC,
      PATTERN_H_BACK      => PATTERN_H_BACK,
      PATTERN_V_ACTIVE    => PATTERN_V_ACTIVE,
      PATTERN_V_FRONT     => PATTERN_V_FRONT,
      PATTERN_V_SYNC      => PATTERN_V_SYNC,
      PATTERN_V_BACK      => PATTERN_V_BACK,
      METER_WINDOW        => METER_WINDOW,
      LOCK_TIMEOUT        => LOCK_TIMEOUT,
      DATA_PATIENCE       => DATA_PATIENCE,
      BUTTON_STABLE       => BUTTON_STABLE,
      BIT_TIME            => BIT_TIME,
      DDC_QUARTER         => DDC_QUARTER,
      DDC_PAUSE           => DDC_PAUSE,
      SWITCH_FRAMES       => SWITCH_FRAMES,
      ALIGN_TIMEOUT       => ALIGN_TIMEOUT,
      CLOCK_RANGE         => CLOCK_RANGE,
      OWN_DIVIDE          => OWN_DIVIDE,
      SEARCH_TIMEOUT      => SEARCH_TIMEOUT
    )
    port map (
      clk_25         => clk_25,
      reset_n        => reset_n,
      in_clk         => in_clk_p,
      in_data        => in_data_p,
      in_scl         => scl,
      in_sda         => sda,
      in_hot_plug    => open,
      out_clk        => out_clk_p,
      out_data       => out_data_p,
      out_scl        => scl,
      out_sda        => sda,
      uart_rx        => uart_rx,
      uart_tx        => uart_tx,
      button_up      => button_up,
      button_down    => button_down,
      button_clear   => button_clear,
      switch_pattern => switch_pattern,
      switch_pass    => switch_pass,
      switch_sweep   => switch_sweep,
      led            => led,
      wifi_gpio0     => '1',
      wifi_gpio0_new => '1'
    );

end architecture test;
