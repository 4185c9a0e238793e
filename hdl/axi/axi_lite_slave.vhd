-- SPDX-License-Identifier: Apache-2.0
-- AXI4-Lite with words of 32 bits: one write and one read at a time, each for a single clock on the register side.
--
-- Address and data of a write are taken in any order, because some masters offer the second only when the first is
-- taken. Addresses count bytes. Their low two bits are ignored, because the strobes say which bytes are written. A
-- write without any strobe, as a width converter makes of half a 64-bit word, is answered with OKAY and writes nothing.
--
-- Latency: 2 clocks from address and data to the answer. Throughput: a write and a read every 2 clocks.
-- Equation: each accepted request is answered once, in order, with OKAY or SLVERR; an answer stays until it is taken.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity axi_lite_slave is
  generic (
    -- Bits of an address in bytes.
    ADDRESS_BITS : positive range 3 to 32
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- AXI4-Lite. The handshakes have initial values, because some simulated masters read them at once.
    s_axi_awaddr  : in    std_logic_vector(ADDRESS_BITS - 1 downto 0);
    s_axi_awvalid : in    std_logic;
    s_axi_awready : out   std_logic := '0';
    s_axi_wdata   : in    std_logic_vector(31 downto 0);
    s_axi_wstrb   : in    std_logic_vector(3 downto 0);
    s_axi_wvalid  : in    std_logic;
    s_axi_wready  : out   std_logic := '0';
    s_axi_bresp   : out   std_logic_vector(1 downto 0);
    s_axi_bvalid  : out   std_logic := '0';
    s_axi_bready  : in    std_logic;
    s_axi_araddr  : in    std_logic_vector(ADDRESS_BITS - 1 downto 0);
    s_axi_arvalid : in    std_logic;
    s_axi_arready : out   std_logic := '0';
    s_axi_rdata   : out   std_logic_vector(31 downto 0);
    s_axi_rresp   : out   std_logic_vector(1 downto 0);
    s_axi_rvalid  : out   std_logic := '0';
    s_axi_rready  : in    std_logic;
    -- write is high for one clock, with the word's place, the bytes to write (bits of write_bytes that are 1) and the
    -- data. In the same clock write_refused says that there is no such register to write.
    write         : out   std_logic;
    write_place   : out   unsigned(ADDRESS_BITS - 3 downto 0);
    write_bytes   : out   std_logic_vector(3 downto 0);
    write_data    : out   std_logic_vector(31 downto 0);
    write_refused : in    std_logic;
    -- The word at read_place; read_refused: there is no such register to read.
    read_place   : out   unsigned(ADDRESS_BITS - 3 downto 0);
    read_data    : in    std_logic_vector(31 downto 0);
    read_refused : in    std_logic
  );
end entity axi_lite_slave;

architecture rtl of axi_lite_slave is

  constant OKAY   : std_logic_vector(1 downto 0) := "00";
  constant SLVERR : std_logic_vector(1 downto 0) := "10";

  -- has_address, has_data: the parts of a write that have come; takes_write: it is carried out; answers_write: its
  -- answer is on offer.
  signal has_address   : std_logic                           := '0';
  signal has_data      : std_logic                           := '0';
  signal takes_write   : std_logic;
  signal answers_write : std_logic                           := '0';
  signal write_address : unsigned(ADDRESS_BITS - 3 downto 0) := (others => '0');
  signal strobes       : std_logic_vector(3 downto 0)        := (others => '0');
  signal writes_bytes  : std_logic;
  -- has_read: the address of a read has come; takes_read: it is carried out; answers_read: its answer is on offer.
  signal has_read     : std_logic                           := '0';
  signal takes_read   : std_logic;
  signal answers_read : std_logic                           := '0';
  signal read_address : unsigned(ADDRESS_BITS - 3 downto 0) := (others => '0');

begin

  -- Each ready is a register and depends on no valid, so no combinational path leads from input to output.
  s_axi_awready <= not has_address;
  s_axi_wready  <= not has_data;
  s_axi_bvalid  <= answers_write;
  s_axi_arready <= not has_read;
  s_axi_rvalid  <= answers_read;

  writes_bytes <= '0' when strobes = "0000" else
                  '1';
  -- The next write waits until the answer to the write before is taken, because there is one register for answers.
  takes_write <= has_address and has_data and not answers_write;
  write       <= takes_write and writes_bytes;
  write_place <= write_address;
  write_bytes <= strobes;

  takes_read <= has_read and not answers_read;
  read_place <= read_address;

  follow_writes : process (clk) is
  begin

    if rising_edge(clk) then
      -- Each part is taken when its register is free, whether the other part has come or not.
      if has_address = '0' then
        has_address   <= s_axi_awvalid;
        write_address <= unsigned(s_axi_awaddr(ADDRESS_BITS - 1 downto 2));
      end if;
      if has_data = '0' then
        has_data   <= s_axi_wvalid;
        strobes    <= s_axi_wstrb;
        write_data <= s_axi_wdata;
      end if;

      -- Both parts have come: the registers see them in this clock, and are free in the next.
      if takes_write = '1' then
        has_address   <= '0';
        has_data      <= '0';
        answers_write <= '1';
        s_axi_bresp   <= OKAY;
        if write_refused = '1' and writes_bytes = '1' then
          s_axi_bresp <= SLVERR;
        end if;
      elsif s_axi_bready = '1' then
        answers_write <= '0';
      end if;

      if reset = '1' then
        has_address   <= '0';
        has_data      <= '0';
        answers_write <= '0';
      end if;
    end if;

  end process follow_writes;

  follow_reads : process (clk) is
  begin

    if rising_edge(clk) then
      if has_read = '0' then
        has_read     <= s_axi_arvalid;
        read_address <= unsigned(s_axi_araddr(ADDRESS_BITS - 1 downto 2));
      end if;

      if takes_read = '1' then
        has_read     <= '0';
        answers_read <= '1';
        -- The data are read in the clock of the answer, so that software sees all that happened until then.
        s_axi_rdata <= read_data;
        s_axi_rresp <= OKAY;
        if read_refused = '1' then
          -- A refused read returns 0, also for write-only registers.
          s_axi_rdata <= (others => '0');
          s_axi_rresp <= SLVERR;
        end if;
      elsif s_axi_rready = '1' then
        answers_read <= '0';
      end if;

      if reset = '1' then
        has_read     <= '0';
        answers_read <= '0';
      end if;
    end if;

  end process follow_reads;

end architecture rtl;
