-- SPDX-License-Identifier: Apache-2.0
-- Test bench of self_test: it passes with the signature of the golden model, and fails with another.
--
-- It reports "PASS" and stops its clock, or fails.

library ieee;
use ieee.std_logic_1164.all;

entity tb_self_test is
  generic (
    -- What self_test computes for these sizes.
    EXPECTED_HIGH : natural := 28339;
    EXPECTED_LOW  : natural := 45336
  );
end entity tb_self_test;

architecture bench of tb_self_test is

  constant COLUMNS : positive := 20;
  constant ROWS    : positive := 12;

  signal clk    : std_logic := '0';
  signal reset  : std_logic := '1';
  signal done   : boolean   := false;
  signal tested : std_logic_vector(1 downto 0);
  signal passed : std_logic_vector(1 downto 0);

begin

  clk <= not clk after 20 ns when not done else
         '0';

  reset <= '0' after 90 ns;

  -- The second one expects what is wrong.
  right_and_wrong : for i in 0 to 1 generate

    design : entity work.self_test
      generic map (
        MICRO_IMAGE_SIZE => 3,
        SHIFTS           => "2",
        CHANNELS         => 1,
        COLUMNS          => COLUMNS,
        ROWS             => ROWS,
        EXPECTED_HIGH    => EXPECTED_HIGH,
        EXPECTED_LOW     => (EXPECTED_LOW + i) mod 65536
      )
      port map (
        clk    => clk,
        reset  => reset,
        tested => tested(i),
        passed => passed(i),
        blink  => open
      );

  end generate right_and_wrong;

  check : process is
  begin

    wait until tested = "11" for 1 ms;
    -- A few frames more.
    wait for 4 * COLUMNS * ROWS * 40 ns;
    assert tested = "11" and passed = "01"
      report "FAIL: signatures"
      severity failure;
    report "PASS: the right signature, and no other";
    done <= true;
    wait;

  end process check;

end architecture bench;
