-- SPDX-License-Identifier: Apache-2.0
-- row_scatter with ports of plain vectors: simulators show no records to a test in Python.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.token_pkg.all;

entity scatter_ports is
  generic (
    PARALLEL_ROWS : positive := 1;
    MAX_COLUMNS   : positive := 1;
    DATA_BITS     : positive := 8;
    SLICE_BITS    : natural  := 0;
    UNDER_WAY     : positive := 3
  );
  port (
    clk           : in    std_logic;
    reset         : in    std_logic;
    in_valid      : in    std_logic_vector(PARALLEL_ROWS - 1 downto 0);
    in_skip       : in    std_logic_vector(PARALLEL_ROWS - 1 downto 0);
    in_start      : in    std_logic_vector(PARALLEL_ROWS - 1 downto 0);
    in_last       : in    std_logic_vector(PARALLEL_ROWS - 1 downto 0);
    in_slice      : in    std_logic_vector(PARALLEL_ROWS * 8 - 1 downto 0);
    in_data       : in    std_logic_vector(PARALLEL_ROWS * DATA_BITS - 1 downto 0);
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(DATA_BITS - 1 downto 0);
    m_axis_tuser  : out   std_logic;
    m_axis_tid    : out   std_logic_vector(7 downto 0);
    m_axis_tlast  : out   std_logic;
    credit        : out   std_logic;
    drained       : out   std_logic
  );
end entity scatter_ports;

architecture test of scatter_ports is

  signal results : results_t(0 to PARALLEL_ROWS - 1);

begin

  row : for r in 0 to PARALLEL_ROWS - 1 generate
    results(r).valid <= in_valid(r);
    results(r).skip  <= in_skip(r);
    results(r).start <= in_start(r);
    results(r).last  <= in_last(r);
    results(r).slice <= unsigned(in_slice(8 * r + 7 downto 8 * r));
  end generate row;

  dut : entity work.row_scatter
    generic map (
      PARALLEL_ROWS => PARALLEL_ROWS,
      MAX_COLUMNS   => MAX_COLUMNS,
      DATA_BITS     => DATA_BITS,
      SLICE_BITS    => SLICE_BITS,
      UNDER_WAY     => UNDER_WAY
    )
    port map (
      clk           => clk,
      reset         => reset,
      results       => results,
      data          => in_data,
      m_axis_tvalid => m_axis_tvalid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tuser  => m_axis_tuser,
      m_axis_tid    => m_axis_tid,
      m_axis_tlast  => m_axis_tlast,
      credit        => credit,
      drained       => drained
    );

end architecture test;
