-- SPDX-License-Identifier: Apache-2.0
-- moving_sum_control with ports of plain bits, as simulators show no records to a test in Python.
-- What it says of a step is shown with the step.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.number_set_pkg.all;
use work.refocus_pkg.all;
use work.sum_schedule_pkg.all;
use work.moving_sum_pkg.all;

entity control_ports is
  generic (
    MICRO_IMAGE_SIZE : positive := 3;
    SHIFTS           : string   := "1";
    CENTRED          : boolean  := true;
    FIXED_SLICE      : integer  := -1
  );
  port (
    clk      : in    std_logic;
    reset    : in    std_logic;
    advance  : in    std_logic;
    first    : in    std_logic;
    live     : in    std_logic;
    slice    : in    std_logic_vector(7 downto 0);
    step     : out   std_logic;
    enter    : out   std_logic;
    leave    : out   std_logic;
    fresh    : out   std_logic;
    to_first : out   std_logic;
    to_held  : out   std_logic;
    take     : out   std_logic;
    due      : out   std_logic
  );
end entity control_ports;

architecture test of control_ports is

  constant GEOMETRY : geometry_t := geometry_of("control_ports", MICRO_IMAGE_SIZE, SHIFTS, CENTRED);

  signal choice  : pixel_choice_t;
  signal command : sum_command_t;
  signal ring    : ring_control_t;
  signal step_2  : std_logic := '0';
  signal step_3  : std_logic := '0';

begin

  dut : entity work.moving_sum_control
    generic map (
      GEOMETRY    => GEOMETRY,
      FIXED_SLICE => FIXED_SLICE
    )
    port map (
      clk       => clk,
      reset     => reset,
      advance   => advance,
      first     => first,
      live      => live,
      slice     => unsigned(slice(bits_for(slice_count(SHIFTS) - 1) - 1 downto 0)),
      ring      => ring,
      choice_3  => choice,
      command_3 => command
    );

  delay_step : process (clk) is
  begin

    if rising_edge(clk) then
      step_2 <= ring.step_1;
      step_3 <= step_2;
      if reset = '1' then
        step_2 <= '0';
        step_3 <= '0';
      end if;
    end if;

  end process delay_step;

  step     <= ring.step_1;
  enter    <= choice.enter and step_3;
  leave    <= choice.leave and step_3;
  fresh    <= command.fresh and step_3;
  to_first <= command.to_first and step_3;
  to_held  <= command.to_held and step_3;
  take     <= command.take and step_3;
  due      <= command.due and step_3;

end architecture test;
