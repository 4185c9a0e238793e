// SPDX-License-Identifier: Apache-2.0
// The bridge keeps to Wishbone and to AXI4-Lite, as long as the master keeps a request until it is answered or
// given up, and the slave answers what it took.
//
// Each cycle becomes one write or read, with what was on offer when it began, and each offer stays until it is
// taken, even if the master gives up. A cycle is answered once, with the slave's answer, while the master waits
// for it; nothing else is answered. What is on offer begins in the next clock, once nothing is under way.

module wishbone_properties #(
    parameter ADDRESS_BITS = 4
) (
    input clk,
    input reset,
    input cyc,
    input stb,
    input we,
    input [ADDRESS_BITS-3:0] adr,
    input [3:0] sel,
    input [31:0] dat_w,
    input awready,
    input wready,
    input [1:0] bresp,
    input bvalid,
    input arready,
    input [31:0] rdata,
    input [1:0] rresp,
    input rvalid
);
  wire ack, err, awvalid, wvalid, bready, arvalid, rready;
  wire [31:0] dat_r, wdata;
  wire [3:0] wstrb;
  wire [ADDRESS_BITS-1:0] awaddr, araddr;

  wishbone_bridge dut (
      .clk(clk),
      .reset(reset),
      .s_wb_cyc(cyc),
      .s_wb_stb(stb),
      .s_wb_we(we),
      .s_wb_adr(adr),
      .s_wb_sel(sel),
      .s_wb_dat_w(dat_w),
      .s_wb_dat_r(dat_r),
      .s_wb_ack(ack),
      .s_wb_err(err),
      .m_axi_awaddr(awaddr),
      .m_axi_awprot(),
      .m_axi_awvalid(awvalid),
      .m_axi_awready(awready),
      .m_axi_wdata(wdata),
      .m_axi_wstrb(wstrb),
      .m_axi_wvalid(wvalid),
      .m_axi_wready(wready),
      .m_axi_bresp(bresp),
      .m_axi_bvalid(bvalid),
      .m_axi_bready(bready),
      .m_axi_araddr(araddr),
      .m_axi_arprot(),
      .m_axi_arvalid(arvalid),
      .m_axi_arready(arready),
      .m_axi_rdata(rdata),
      .m_axi_rresp(rresp),
      .m_axi_rvalid(rvalid),
      .m_axi_rready(rready)
  );

  wire request = cyc && stb;
  reg begun = 0;
  // The request of the clock before, if it was not answered.
  reg waits = 0, we_was;
  reg [ADDRESS_BITS-3:0] adr_was;
  reg [3:0] sel_was;
  reg [31:0] dat_was;
  // What is under way, what of it was not taken yet, whether its master has waited for it all the time.
  reg under_way = 0, writes, address_due = 0, data_due = 0, read_due = 0, awaited = 0;
  reg [ADDRESS_BITS-3:0] place;
  reg [3:0] bytes;
  reg [31:0] word;
  // The answer of this clock.
  reg ack_due = 0, err_due = 0;
  reg [31:0] answer;

  always @(posedge clk) begin
    begun <= 1;
    waits <= request && !ack && !err;
    we_was <= we;
    adr_was <= adr;
    sel_was <= sel;
    dat_was <= dat_w;

    ack_due <= 0;
    err_due <= 0;
    awaited <= awaited && request;
    if (awready) address_due <= 0;
    if (wready) data_due <= 0;
    if (arready) read_due <= 0;
    if (under_way && (bvalid || rvalid)) begin
      under_way <= 0;
      ack_due <= awaited && request && (writes ? bresp : rresp) == 0;
      err_due <= awaited && request && (writes ? bresp : rresp) != 0;
      answer <= rdata;
    end
    if (!under_way && request && !ack && !err) begin
      under_way <= 1;
      awaited <= 1;
      writes <= we;
      address_due <= we;
      data_due <= we;
      read_due <= !we;
      place <= adr;
      bytes <= sel;
      word <= dat_w;
    end

    if (reset) begin
      waits <= 0;
      under_way <= 0;
      awaited <= 0;
      address_due <= 0;
      data_due <= 0;
      read_due <= 0;
      ack_due <= 0;
      err_due <= 0;
    end
  end

  always @* begin
    // The first clock is one of reset, a master that waits keeps its request, and a slave answers what it took.
    assume (begun || reset);
    assume (!waits || !request || (we == we_was && adr == adr_was && sel == sel_was && dat_w == dat_was));
    assume (!bvalid || (under_way && writes && !address_due && !data_due));
    assume (!rvalid || (under_way && !writes && !read_due));
    if (begun && !reset) begin
      assert (awvalid == address_due);
      assert (wvalid == data_due);
      assert (arvalid == read_due);
      assert (!awvalid || awaddr == {place, 2'b00});
      assert (!arvalid || araddr == {place, 2'b00});
      assert (!wvalid || (wdata == word && wstrb == bytes));
      assert (bready && rready);
      assert (ack == (ack_due && request));
      assert (err == (err_due && request));
      assert (!ack || we || dat_r == answer);
    end
  end
endmodule
