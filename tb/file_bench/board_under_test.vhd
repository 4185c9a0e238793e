-- SPDX-License-Identifier: Apache-2.0
-- A board as hdmi_bench sees it; board_NAME has the architecture that puts the top of the board NAME into it.

library ieee;
use ieee.std_logic_1164.all;

entity board_under_test is
  generic (
    MICRO_IMAGE_SIZE    : positive;
    SHIFTS              : string;
    MAX_COLUMNS         : positive;
    EXACT               : boolean;
    FRACTION_BITS       : natural;
    GUARD_BITS          : natural;
    INTERPOLATION_ORDER : natural;
    HOLD                : boolean;
    BROADCAST_TAPS      : natural;
    ENGINE              : string;
    BOX                 : string;
    PATTERN_H_ACTIVE    : positive;
    PATTERN_H_FRONT     : positive;
    PATTERN_H_SYNC      : positive;
    PATTERN_H_BACK      : positive;
    PATTERN_V_ACTIVE    : positive;
    PATTERN_V_FRONT     : positive;
    PATTERN_V_SYNC      : positive;
    PATTERN_V_BACK      : positive;
    METER_WINDOW        : positive;
    LOCK_TIMEOUT        : positive;
    DATA_PATIENCE       : positive;
    BUTTON_STABLE       : positive;
    BIT_TIME            : positive;
    DDC_QUARTER         : positive;
    DDC_PAUSE           : positive;
    SWITCH_FRAMES       : positive;
    ALIGN_TIMEOUT       : positive;
    CLOCK_RANGE         : natural;
    OWN_DIVIDE          : positive;
    SEARCH_TIMEOUT      : positive
  );
  port (
    -- Faults of the delay lines, see model_faults of the library of its models.
    delay_fault_seed : in    natural;
    -- Microseconds until a PLL locks (ULX3S).
    slow_lock_us   : in    natural;
    clk_100        : in    std_logic;
    reset_n        : in    std_logic;
    in_clk_p       : in    std_logic;
    in_clk_n       : in    std_logic;
    in_data_p      : in    std_logic_vector(2 downto 0);
    in_data_n      : in    std_logic_vector(2 downto 0);
    scl            : inout std_logic;
    sda            : inout std_logic;
    out_clk_p      : out   std_logic;
    out_data_p     : out   std_logic_vector(2 downto 0);
    uart_rx        : in    std_logic;
    uart_tx        : out   std_logic;
    button_up      : in    std_logic;
    button_down    : in    std_logic;
    button_clear   : in    std_logic;
    switch_pattern : in    std_logic;
    switch_pass    : in    std_logic;
    switch_sweep   : in    std_logic;
    led            : out   std_logic_vector(7 downto 0)
  );
end entity board_under_test;
