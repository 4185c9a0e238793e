-- SPDX-License-Identifier: Apache-2.0
-- Puts refocuser_axi, stack_axi or sensor_axi on a Wishbone bus: each Wishbone cycle becomes an AXI4-Lite access.
--
-- Wishbone B4, standard cycles, words of 32 bits: cyc and stb stay high until ack, or err for SLVERR. A master may
-- abort a cycle before that; the access behind the bridge is then completed without an answer.
--
-- Latency: 2 clocks more than AXI4-Lite takes; with axi_lite_slave behind it 4 clocks from stb to ack. Throughput: a
-- cycle every 5 clocks with axi_lite_slave.
-- Equation: each cycle that is not aborted is answered once, with ack for OKAY and with err for any other answer.

library ieee;
use ieee.std_logic_1164.all;

entity wishbone_bridge is
  generic (
    -- Bits of an address in bytes.
    ADDRESS_BITS : positive range 3 to 32 := 12
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Wishbone. adr counts words; the bits of sel are those of the bytes of dat_w.
    s_wb_cyc   : in    std_logic;
    s_wb_stb   : in    std_logic;
    s_wb_we    : in    std_logic;
    s_wb_adr   : in    std_logic_vector(ADDRESS_BITS - 3 downto 0);
    s_wb_sel   : in    std_logic_vector(3 downto 0);
    s_wb_dat_w : in    std_logic_vector(31 downto 0);
    s_wb_dat_r : out   std_logic_vector(31 downto 0);
    s_wb_ack   : out   std_logic;
    s_wb_err   : out   std_logic;
    -- AXI4-Lite.
    m_axi_awaddr  : out   std_logic_vector(ADDRESS_BITS - 1 downto 0);
    m_axi_awprot  : out   std_logic_vector(2 downto 0);
    m_axi_awvalid : out   std_logic;
    m_axi_awready : in    std_logic;
    m_axi_wdata   : out   std_logic_vector(31 downto 0);
    m_axi_wstrb   : out   std_logic_vector(3 downto 0);
    m_axi_wvalid  : out   std_logic;
    m_axi_wready  : in    std_logic;
    m_axi_bresp   : in    std_logic_vector(1 downto 0);
    m_axi_bvalid  : in    std_logic;
    m_axi_bready  : out   std_logic;
    m_axi_araddr  : out   std_logic_vector(ADDRESS_BITS - 1 downto 0);
    m_axi_arprot  : out   std_logic_vector(2 downto 0);
    m_axi_arvalid : out   std_logic;
    m_axi_arready : in    std_logic;
    m_axi_rdata   : in    std_logic_vector(31 downto 0);
    m_axi_rresp   : in    std_logic_vector(1 downto 0);
    m_axi_rvalid  : in    std_logic;
    m_axi_rready  : out   std_logic
  );
end entity wishbone_bridge;

architecture rtl of wishbone_bridge is

  constant OKAY : std_logic_vector(1 downto 0) := "00";

  signal request : std_logic;
  -- busy: an access is under way; wanted: its master still waits for the answer.
  signal busy    : std_logic := '0';
  signal wanted  : std_logic := '0';
  signal address : std_logic_vector(ADDRESS_BITS - 1 downto 0);

  -- Requests on offer to the slave: address of a write, data of a write, address of a read.
  signal offers_address : std_logic := '0';
  signal offers_data    : std_logic := '0';
  signal offers_read    : std_logic := '0';

  signal ack : std_logic := '0';
  signal err : std_logic := '0';

begin

  -- An answer is withdrawn with its request: a master that aborted must not see it in its next cycle.
  request  <= s_wb_cyc and s_wb_stb;
  s_wb_ack <= ack and request;
  s_wb_err <= err and request;

  m_axi_awaddr  <= address;
  m_axi_awprot  <= "000";
  m_axi_awvalid <= offers_address;
  m_axi_wvalid  <= offers_data;
  -- Answers are taken at once, because only one access is under way.
  m_axi_bready  <= '1';
  m_axi_araddr  <= address;
  m_axi_arprot  <= "000";
  m_axi_arvalid <= offers_read;
  m_axi_rready  <= '1';

  follow : process (clk) is

    variable answered : std_logic;
    variable good     : boolean;

  begin

    if rising_edge(clk) then
      ack <= '0';
      err <= '0';
      -- A request that falls before the answer is aborted, even if another one follows.
      wanted <= wanted and request;

      -- Each offer ends when it is taken; address and data may be taken in different clocks.
      if m_axi_awready = '1' then
        offers_address <= '0';
      end if;
      if m_axi_wready = '1' then
        offers_data <= '0';
      end if;
      if m_axi_arready = '1' then
        offers_read <= '0';
      end if;

      -- No cycle begins in the clock of an answer, because the master still shows the old request then.
      if busy = '0' and request = '1' and ack = '0' and err = '0' then
        busy           <= '1';
        wanted         <= '1';
        offers_address <= s_wb_we;
        offers_data    <= s_wb_we;
        offers_read    <= not s_wb_we;
        address        <= s_wb_adr & "00";
        m_axi_wdata    <= s_wb_dat_w;
        m_axi_wstrb    <= s_wb_sel;
      end if;

      -- Only one access is under way, so any answer belongs to it.
      answered := m_axi_bvalid or m_axi_rvalid;
      good     := m_axi_bresp = OKAY;
      if m_axi_rvalid = '1' then
        good := m_axi_rresp = OKAY;
      end if;
      -- An aborted access ends here too, without an answer.
      if answered = '1' then
        busy       <= '0';
        s_wb_dat_r <= m_axi_rdata;
        if wanted = '1' and request = '1' then
          if good then
            ack <= '1';
          else
            err <= '1';
          end if;
        end if;
      end if;

      if reset = '1' then
        busy           <= '0';
        wanted         <= '0';
        offers_address <= '0';
        offers_data    <= '0';
        offers_read    <= '0';
        ack            <= '0';
        err            <= '0';
      end if;
    end if;

  end process follow;

end architecture rtl;
