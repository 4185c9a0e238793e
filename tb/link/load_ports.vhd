-- SPDX-License-Identifier: Apache-2.0
-- The board's serial port with a resampler's load port: receiver, load_port, command_line, transmitter.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.hdmi_pkg.all;

entity load_ports is
  generic (
    DESCRIPTION : string;
    BIT_CLOCKS  : positive
  );
  port (
    clk          : in    std_logic;
    reset        : in    std_logic;
    line_in      : in    std_logic;
    line_out     : out   std_logic;
    value        : out   std_logic_vector(7 downto 0);
    set_slice    : out   std_logic;
    busy         : in    std_logic;
    load_write   : out   std_logic;
    load_kind    : out   std_logic_vector(1 downto 0);
    load_address : out   std_logic_vector(19 downto 0);
    load_data    : out   std_logic_vector(39 downto 0)
  );
end entity load_ports;

architecture test of load_ports is

  signal in_valid     : std_logic;
  signal other_valid  : std_logic;
  signal answer_valid : std_logic;
  signal answer_ready : std_logic;
  signal out_valid    : std_logic;
  signal out_ready    : std_logic;
  signal in_data      : std_logic_vector(7 downto 0);
  signal other_data   : std_logic_vector(7 downto 0);
  signal other_shown  : std_logic_vector(7 downto 0);
  signal answer_data  : std_logic_vector(7 downto 0);
  signal out_data     : std_logic_vector(7 downto 0);
  signal command      : command_t;

begin

  value     <= std_logic_vector(command.value);
  set_slice <= command.set_slice;

  receiver : entity work.uart_receiver
    generic map (
      BIT_CLOCKS => BIT_CLOCKS
    )
    port map (
      clk   => clk,
      reset => reset,
      line  => line_in,
      data  => in_data,
      valid => in_valid
    );

  under_test : entity work.load_port
    generic map (
      DESCRIPTION => DESCRIPTION
    )
    port map (
      clk           => clk,
      reset         => reset,
      in_valid      => in_valid,
      in_data       => in_data,
      other_valid   => other_valid,
      other_data    => other_data,
      s_axis_tvalid => answer_valid,
      s_axis_tready => answer_ready,
      s_axis_tdata  => answer_data,
      m_axis_tvalid => out_valid,
      m_axis_tready => out_ready,
      m_axis_tdata  => out_data,
      busy          => busy,
      load_write    => load_write,
      load_kind     => load_kind,
      load_address  => load_address,
      load_data     => load_data
    );

  -- The end of a line that is not valid: only bytes with TVALID count.
  other_shown <= other_data when other_valid = '1' else
                 x"0D";

  commands : entity work.command_line
    generic map (
      STATUS => "slices=#", FIELDS => 1
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => other_valid,
      s_axis_tdata  => other_shown,
      m_axis_tvalid => answer_valid,
      m_axis_tready => answer_ready,
      m_axis_tdata  => answer_data,
      status_values => x"0003",
      slices        => to_unsigned(3, 9),
      outputs       => "001",
      places        => "001",
      command       => command
    );

  transmitter : entity work.uart_transmitter
    generic map (
      BIT_CLOCKS => BIT_CLOCKS
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => out_valid,
      s_axis_tready => out_ready,
      s_axis_tdata  => out_data,
      line          => line_out
    );

end architecture test;
