-- SPDX-License-Identifier: Apache-2.0
-- An example design in VHDL: the core with registers on a Wishbone bus (standard cycles, words of 32 bits).
--
-- wishbone_bridge in front of refocuser_axi; stack_axi and sensor_axi go behind it in the same way. Grey pixels of
-- 8 bits; the generics are those of the core.

library ieee;
use ieee.std_logic_1164.all;

entity refocuser_wishbone is
  generic (
    MICRO_IMAGE_SIZE : positive := 5;
    SHIFTS           : string   := "-5 0 5";
    MAX_COLUMNS      : positive := 1000;
    ENGINE           : string   := "moving_sum"
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- The registers of docs/registers.md: adr counts words.
    s_wb_cyc   : in    std_logic;
    s_wb_stb   : in    std_logic;
    s_wb_we    : in    std_logic;
    s_wb_adr   : in    std_logic_vector(9 downto 0);
    s_wb_sel   : in    std_logic_vector(3 downto 0);
    s_wb_dat_w : in    std_logic_vector(31 downto 0);
    s_wb_dat_r : out   std_logic_vector(31 downto 0);
    s_wb_ack   : out   std_logic;
    s_wb_err   : out   std_logic;
    interrupt  : out   std_logic;
    -- tuser(0) = start of frame, tlast = end of line.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(7 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    -- The same; tid = the slice that the frame was refocused to.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(7 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tid    : out   std_logic_vector(7 downto 0);
    m_axis_tlast  : out   std_logic
  );
end entity refocuser_wishbone;

architecture rtl of refocuser_wishbone is

  signal awaddr  : std_logic_vector(11 downto 0);
  signal awprot  : std_logic_vector(2 downto 0);
  signal awvalid : std_logic;
  signal awready : std_logic;
  signal wdata   : std_logic_vector(31 downto 0);
  signal wstrb   : std_logic_vector(3 downto 0);
  signal wvalid  : std_logic;
  signal wready  : std_logic;
  signal bresp   : std_logic_vector(1 downto 0);
  signal bvalid  : std_logic;
  signal bready  : std_logic;
  signal araddr  : std_logic_vector(11 downto 0);
  signal arprot  : std_logic_vector(2 downto 0);
  signal arvalid : std_logic;
  signal arready : std_logic;
  signal rdata   : std_logic_vector(31 downto 0);
  signal rresp   : std_logic_vector(1 downto 0);
  signal rvalid  : std_logic;
  signal rready  : std_logic;

begin

  bridge : entity work.wishbone_bridge
    port map (
      clk           => clk,
      reset         => reset,
      s_wb_cyc      => s_wb_cyc,
      s_wb_stb      => s_wb_stb,
      s_wb_we       => s_wb_we,
      s_wb_adr      => s_wb_adr,
      s_wb_sel      => s_wb_sel,
      s_wb_dat_w    => s_wb_dat_w,
      s_wb_dat_r    => s_wb_dat_r,
      s_wb_ack      => s_wb_ack,
      s_wb_err      => s_wb_err,
      m_axi_awaddr  => awaddr,
      m_axi_awprot  => awprot,
      m_axi_awvalid => awvalid,
      m_axi_awready => awready,
      m_axi_wdata   => wdata,
      m_axi_wstrb   => wstrb,
      m_axi_wvalid  => wvalid,
      m_axi_wready  => wready,
      m_axi_bresp   => bresp,
      m_axi_bvalid  => bvalid,
      m_axi_bready  => bready,
      m_axi_araddr  => araddr,
      m_axi_arprot  => arprot,
      m_axi_arvalid => arvalid,
      m_axi_arready => arready,
      m_axi_rdata   => rdata,
      m_axi_rresp   => rresp,
      m_axi_rvalid  => rvalid,
      m_axi_rready  => rready
    );

  core : entity work.refocuser_axi
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFTS           => SHIFTS,
      MAX_COLUMNS      => MAX_COLUMNS,
      ENGINE           => ENGINE
    )
    port map (
      clk                => clk,
      reset              => reset,
      s_axi_ctrl_awaddr  => awaddr,
      s_axi_ctrl_awprot  => awprot,
      s_axi_ctrl_awvalid => awvalid,
      s_axi_ctrl_awready => awready,
      s_axi_ctrl_wdata   => wdata,
      s_axi_ctrl_wstrb   => wstrb,
      s_axi_ctrl_wvalid  => wvalid,
      s_axi_ctrl_wready  => wready,
      s_axi_ctrl_bresp   => bresp,
      s_axi_ctrl_bvalid  => bvalid,
      s_axi_ctrl_bready  => bready,
      s_axi_ctrl_araddr  => araddr,
      s_axi_ctrl_arprot  => arprot,
      s_axi_ctrl_arvalid => arvalid,
      s_axi_ctrl_arready => arready,
      s_axi_ctrl_rdata   => rdata,
      s_axi_ctrl_rresp   => rresp,
      s_axi_ctrl_rvalid  => rvalid,
      s_axi_ctrl_rready  => rready,
      interrupt          => interrupt,
      s_axis_tvalid      => s_axis_tvalid,
      s_axis_tready      => s_axis_tready,
      s_axis_tdata       => s_axis_tdata,
      s_axis_tuser       => s_axis_tuser,
      s_axis_tlast       => s_axis_tlast,
      m_axis_tvalid      => m_axis_tvalid,
      m_axis_tready      => m_axis_tready,
      m_axis_tdata       => m_axis_tdata,
      m_axis_tuser       => m_axis_tuser,
      m_axis_tid         => m_axis_tid,
      m_axis_tlast       => m_axis_tlast
    );

end architecture rtl;
