-- SPDX-License-Identifier: Apache-2.0
-- Packets over the wires of a camera into csi_receiver by the D-PHY of a family, bench_phy.
--
-- Writes the pixels to output.bin, and what csi_receiver counts to counts.txt.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library std;
use std.textio.all;

entity dphy_bench is
  generic (
    LANES      : positive range 1 to 4;
    BIT_PS     : positive;
    CONTINUOUS : boolean;
    SKEW       : natural;
    SETTLE     : natural;
    EXCHANGED  : boolean := false;
    PIXEL_BITS : positive;
    COLUMNS    : positive;
    ROWS       : positive
  );
end entity dphy_bench;

architecture test of dphy_bench is

  type words_t is file of integer;

  constant COUNT_BITS : positive := 8;

  signal running      : boolean   := true;
  signal begun        : boolean;
  signal sent         : boolean;
  signal clk          : std_logic := '0';
  signal sync_clk     : std_logic := '0';
  signal reset        : std_logic := '1';
  signal clk_p        : std_logic;
  signal clk_n        : std_logic;
  signal data_p       : std_logic_vector(3 downto 0);
  signal data_n       : std_logic_vector(3 downto 0);
  signal pins_p       : std_logic_vector(3 downto 0);
  signal pins_n       : std_logic_vector(3 downto 0);
  signal byte_clk     : std_logic;
  signal lane_valid   : std_logic_vector(LANES - 1 downto 0);
  signal lane_sync    : std_logic_vector(LANES - 1 downto 0);
  signal lane_data    : std_logic_vector(8 * LANES - 1 downto 0);
  signal lane_missed  : std_logic_vector(LANES - 1 downto 0);
  signal columns_port : std_logic_vector(15 downto 0);
  signal rows_port    : std_logic_vector(15 downto 0);
  signal tvalid       : std_logic;
  signal tdata        : std_logic_vector(PIXEL_BITS - 1 downto 0);
  signal tuser        : std_logic_vector(0 downto 0);
  signal tlast        : std_logic;
  signal fault_counts : std_logic_vector(8 * COUNT_BITS - 1 downto 0);
  signal left_counts  : std_logic_vector(4 * COUNT_BITS - 1 downto 0);
  signal counts       : std_logic_vector(12 * COUNT_BITS - 1 downto 0);

begin

  -- The core's clock, the PHY's own and the camera's are not related.
  clk          <= not clk after 2 ns when running else
                  '0';
  sync_clk     <= not sync_clk after 8333 ps when running else
                  '0';
  reset        <= '0' after 100 ns;
  begun        <= reset = '0';
  columns_port <= std_logic_vector(to_unsigned(COLUMNS, 16));
  rows_port    <= std_logic_vector(to_unsigned(ROWS, 16));

  camera : entity work.dphy_camera
    generic map (
      LANES      => LANES,
      BIT_PS     => BIT_PS,
      CONTINUOUS => CONTINUOUS,
      SKEW       => SKEW
    )
    port map (
      start  => begun,
      clk_p  => clk_p,
      clk_n  => clk_n,
      data_p => data_p,
      data_n => data_n,
      sent   => sent
    );

  pins_p <= data_n when EXCHANGED else
            data_p;
  pins_n <= data_p when EXCHANGED else
            data_n;

  phy : entity work.bench_phy
    generic map (
      LANES      => LANES,
      CONTINUOUS => CONTINUOUS,
      SETTLE     => SETTLE
    )
    port map (
      clk_p       => clk_p,
      clk_n       => clk_n,
      data_p      => pins_p,
      data_n      => pins_n,
      sync_clk    => sync_clk,
      reset       => reset,
      byte_clk    => byte_clk,
      lane_valid  => lane_valid,
      lane_sync   => lane_sync,
      lane_data   => lane_data,
      lane_missed => lane_missed
    );

  receiver : entity work.csi_receiver
    generic map (
      LANES      => LANES,
      PIXEL_BITS => PIXEL_BITS,
      COUNT_BITS => COUNT_BITS
    )
    port map (
      byte_clk        => byte_clk,
      lane_valid      => lane_valid,
      lane_sync       => lane_sync,
      lane_data       => lane_data,
      lane_missed     => lane_missed,
      clk             => clk,
      reset           => reset,
      virtual_channel => "00",
      columns         => columns_port,
      rows            => rows_port,
      m_axis_tvalid   => tvalid,
      m_axis_tready   => '1',
      m_axis_tdata    => tdata,
      m_axis_tuser    => tuser,
      m_axis_tlast    => tlast,
      fault_counts    => fault_counts,
      left_counts     => left_counts,
      fault_clear     => '0'
    );

  counts <= left_counts & fault_counts;

  take : process (clk) is

    file output_file : words_t open write_mode is "output.bin";
    file counts_file : text open write_mode is "counts.txt";

    variable text_line : line;
    variable idle      : natural := 0;

  begin

    if rising_edge(clk) then
      idle := idle + 1;
      if tvalid = '1' then
        idle := 0;
        write(output_file, to_integer(unsigned(tdata)));
      end if;
      if not sent then
        idle := 0;
      end if;
      -- Nothing more comes: what the receiver counted is complete. Any fault shows in the counts,
      -- so nothing is judged here.
      if idle = 1000 and running then

        for i in 0 to 11 loop

          write(text_line, to_integer(unsigned(counts((i + 1) * COUNT_BITS - 1 downto i * COUNT_BITS))));
          writeline(counts_file, text_line);

        end loop;

        running <= false;
      end if;
    end if;

  end process take;

end architecture test;
