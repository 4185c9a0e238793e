-- SPDX-License-Identifier: Apache-2.0
-- The status line and the commands of a camera's serial port.
--
-- The status has the result of the sensor's set-up and all that came over the lanes, shown or not, which explains a
-- missing picture. Commands are those of command_line with CAMERA: c clears counters and flags, i sets the sensor up
-- again.
--
-- Latency: up to the end of a line of characters. Throughput: one line of characters at a time.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.hdmi_pkg.all;

entity camera_report is
  generic (
    -- Bits of a counter.
    COUNT_BITS : positive range 1 to 16
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Characters in, always taken; and characters out.
    s_axis_tvalid : in    std_logic;
    s_axis_tdata  : in    std_logic_vector(7 downto 0);
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(7 downto 0);
    -- Set-up of the sensor: 00 not begun, 01 done, 10 failed, 11 under way; and other ports of sensor_setup.
    setup_state   : in    std_logic_vector(1 downto 0);
    setup_entry   : in    std_logic_vector(11 downto 0);
    setup_fault   : in    std_logic_vector(1 downto 0);
    setup_retried : in    std_logic_vector(7 downto 0);
    -- Raw frames, and lines of the frame under way.
    frames : in    std_logic_vector(15 downto 0);
    lines  : in    std_logic_vector(15 downto 0);
    -- Counters and identifier of csi_receiver.
    fault_counts    : in    std_logic_vector(8 * COUNT_BITS - 1 downto 0);
    left_counts     : in    std_logic_vector(4 * COUNT_BITS - 1 downto 0);
    left_identifier : in    std_logic_vector(7 downto 0);
    -- Flags of sensor_raster and of raster_refocuser.
    lens_flags : in    std_logic_vector(5 downto 0);
    core_flags : in    std_logic_vector(4 downto 0);
    -- Commands, each high for one clock: clear counters and flags; set the sensor up again.
    clear  : out   std_logic;
    set_up : out   std_logic
  );
end entity camera_report;

architecture rtl of camera_report is

  constant STATUS : string   := "setup=# entry=# fault=# repeated=# frames=# lines=# corrected=# damaged=# payload=# " &
                                "cut=# lanes=# order=# size=# lost=# other_type=# other_channel=# no_lines=# " &
                                "no_pixels=# left_out=#/# raster=# core=#";
  constant FIELDS : positive := 22;

  signal values  : std_logic_vector(16 * FIELDS - 1 downto 0);
  signal command : command_t;

begin

  clear  <= command.clear_errors;
  set_up <= command.set_up;

  collect : process (setup_state, setup_entry, setup_fault, setup_retried, frames, lines, fault_counts, left_counts,
                     left_identifier, lens_flags, core_flags) is

    variable place : natural range 0 to FIELDS;

    -- Appends the next number to the status.

    procedure put (
      value : std_logic_vector
    ) is
    begin

      values(16 * place + 15 downto 16 * place) <= std_logic_vector(resize(unsigned(value), 16));
      place                                     := place + 1;

    end procedure put;

  begin

    place := 0;
    put(setup_state);
    put(setup_entry);
    put(setup_fault);
    put(setup_retried);
    -- Numbers of the status have a sign, so the highest bit is 0.
    put('0' & frames(14 downto 0));
    put('0' & lines(14 downto 0));

    for i in 0 to 7 loop

      put(fault_counts((i + 1) * COUNT_BITS - 1 downto i * COUNT_BITS));

    end loop;

    for i in 0 to 3 loop

      put(left_counts((i + 1) * COUNT_BITS - 1 downto i * COUNT_BITS));

    end loop;

    put(left_identifier(7 downto 6));
    put(left_identifier(5 downto 0));
    put(lens_flags);
    put(core_flags);

  end process collect;

  commands : entity work.command_line
    generic map (
      STATUS => STATUS,
      FIELDS => FIELDS,
      CAMERA => true
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => s_axis_tvalid,
      s_axis_tdata  => s_axis_tdata,
      m_axis_tvalid => m_axis_tvalid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      status_values => values,
      command       => command
    );

end architecture rtl;
