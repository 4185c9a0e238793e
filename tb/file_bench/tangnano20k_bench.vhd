-- SPDX-License-Identifier: Apache-2.0
-- The Tang Nano 20K at work: what its pins send, as words in output.bin (tmds_monitor), until WORDS of them came.
-- The key that steps is pressed for a while after STEP_WORDS words; never if 0.

library ieee;
use ieee.std_logic_1164.all;

entity tangnano20k_bench is
  generic (
    WORDS               : positive := 1000;
    STEP_WORDS          : natural  := 0;
    MICRO_IMAGE_SIZE    : positive := 5;
    SHIFTS              : string   := "-2 0 2";
    MAX_COLUMNS         : positive := 480;
    EXACT               : boolean  := true;
    FRACTION_BITS       : natural  := 4;
    GUARD_BITS          : natural  := 2;
    INTERPOLATION_ORDER : natural  := 0;
    HOLD                : boolean  := false;
    BROADCAST_TAPS      : natural  := 0;
    ENGINE              : string   := "fir";
    BOX                 : string   := "";
    SWEEP_FRAMES        : positive := 1;
    SIDE_COLUMNS        : positive := 80;
    PATTERN_H_ACTIVE    : positive := 480;
    PATTERN_H_FRONT     : positive := 96;
    PATTERN_H_SYNC      : positive := 96;
    PATTERN_H_BACK      : positive := 128;
    PATTERN_V_ACTIVE    : positive := 480;
    PATTERN_V_FRONT     : positive := 10;
    PATTERN_V_SYNC      : positive := 2;
    PATTERN_V_BACK      : positive := 33
  );
end entity tangnano20k_bench;

architecture test of tangnano20k_bench is

  -- Half a period of 27 MHz.
  constant HALF_PERIOD : time := 18519 ps;

  signal clk_27     : std_logic := '0';
  signal key_step   : std_logic := '0';
  signal out_clk_p  : std_logic;
  signal out_clk_n  : std_logic;
  signal out_data_p : std_logic_vector(2 downto 0);
  signal out_data_n : std_logic_vector(2 downto 0);
  signal watching   : boolean   := false;
  signal writing    : boolean   := false;
  signal taken      : natural   := 0;
  signal done       : boolean   := false;

begin

  oscillate : process is
  begin

    while not done loop

      clk_27 <= not clk_27;
      wait for HALF_PERIOD;

    end loop;

    wait;

  end process oscillate;

  board : entity work.tangnano20k_top
    generic map (
      MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
      SHIFTS              => SHIFTS,
      INTERPOLATION_ORDER => INTERPOLATION_ORDER,
      HOLD                => HOLD,
      MAX_COLUMNS         => MAX_COLUMNS,
      EXACT               => EXACT,
      FRACTION_BITS       => FRACTION_BITS,
      GUARD_BITS          => GUARD_BITS,
      BROADCAST_TAPS      => BROADCAST_TAPS,
      ENGINE              => ENGINE,
      BOX                 => BOX,
      SIDE_COLUMNS        => SIDE_COLUMNS,
      PATTERN_H_ACTIVE    => PATTERN_H_ACTIVE,
      PATTERN_H_FRONT     => PATTERN_H_FRONT,
      PATTERN_H_SYNC      => PATTERN_H_SYNC,
      PATTERN_H_BACK      => PATTERN_H_BACK,
      PATTERN_V_ACTIVE    => PATTERN_V_ACTIVE,
      PATTERN_V_FRONT     => PATTERN_V_FRONT,
      PATTERN_V_SYNC      => PATTERN_V_SYNC,
      PATTERN_V_BACK      => PATTERN_V_BACK,
      SWEEP_FRAMES        => SWEEP_FRAMES,
      BUTTON_STABLE       => 4
    )
    port map (
      clk_27     => clk_27,
      key_stop   => '0',
      key_step   => key_step,
      out_clk_p  => out_clk_p,
      out_clk_n  => out_clk_n,
      out_data_p => out_data_p,
      out_data_n => out_data_n,
      led_n      => open
    );

  watching <= taken < WORDS;
  done     <= taken = WORDS and not writing;

  -- The key is pressed for forty words.
  key_step <= '1' when STEP_WORDS > 0 and taken >= STEP_WORDS and taken < STEP_WORDS + 40 else
              '0';

  monitor : entity work.tmds_monitor
    generic map (
      -- The pixel clock is fourteen fifteenths of the oscillator's.
      NOMINAL_PERIOD => 2 * HALF_PERIOD * 15 / 14
    )
    port map (
      clk      => out_clk_p,
      data     => out_data_p,
      watching => watching,
      is_open  => writing,
      words    => taken
    );

  pairs : postponed assert out_data_n = not out_data_p and out_clk_n = not out_clk_p
    report "tangnano20k_bench: the pins of a pair are alike, expected complements from the board's buffers"
    severity failure;

end architecture test;
