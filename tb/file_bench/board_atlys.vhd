-- SPDX-License-Identifier: Apache-2.0
-- The Atlys as hdmi_bench sees a board.

library ieee;
use ieee.std_logic_1164.all;

library unisim;
use unisim.model_faults.all;

architecture test of board_under_test is

begin

  delay_faults <= delay_fault_seed;

  top : entity work.atlys_top
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
      ALIGN_TIMEOUT       => ALIGN_TIMEOUT
    )
    port map (
      clk_100        => clk_100,
      reset_n        => reset_n,
      in_clk_p       => in_clk_p,
      in_clk_n       => in_clk_n,
      in_data_p      => in_data_p,
      in_data_n      => in_data_n,
      in_scl         => scl,
      in_sda         => sda,
      out_clk_p      => out_clk_p,
      out_clk_n      => open,
      out_data_p     => out_data_p,
      out_data_n     => open,
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
      button_output  => '0',
      switch_hide    => '0',
      switch_bottom  => '0',
      led            => led
    );

end architecture test;
