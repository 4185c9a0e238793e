// SPDX-License-Identifier: Apache-2.0
// The slave keeps to AXI4-Lite, whatever master and registers do, as long as the master keeps offers.
//
// Each request is taken once and answered once, in order, with OKAY or SLVERR; an answer stays as it is until
// it is taken; nothing is answered that was not asked. A write reaches the registers once, with the address,
// data and strobes that were on offer, and never between two words; a read answers with what the registers
// held when it was taken. What is on offer is taken after two clocks at most, once no answer waits.

module axi_lite_properties #(
    parameter ADDRESS_BITS = 4
) (
    input clk,
    input reset,
    input [ADDRESS_BITS-1:0] awaddr,
    input awvalid,
    input [31:0] wdata,
    input [3:0] wstrb,
    input wvalid,
    input bready,
    input [ADDRESS_BITS-1:0] araddr,
    input arvalid,
    input rready,
    input write_refused,
    input [31:0] read_data,
    input read_refused
);
  wire awready, wready, bvalid, arready, rvalid, write;
  wire [1:0] bresp, rresp;
  wire [31:0] rdata, write_data;
  wire [ADDRESS_BITS-3:0] write_place, read_place;
  wire [3:0] write_bytes;

  axi_lite_slave dut (
      .clk(clk),
      .reset(reset),
      .s_axi_awaddr(awaddr),
      .s_axi_awvalid(awvalid),
      .s_axi_awready(awready),
      .s_axi_wdata(wdata),
      .s_axi_wstrb(wstrb),
      .s_axi_wvalid(wvalid),
      .s_axi_wready(wready),
      .s_axi_bresp(bresp),
      .s_axi_bvalid(bvalid),
      .s_axi_bready(bready),
      .s_axi_araddr(araddr),
      .s_axi_arvalid(arvalid),
      .s_axi_arready(arready),
      .s_axi_rdata(rdata),
      .s_axi_rresp(rresp),
      .s_axi_rvalid(rvalid),
      .s_axi_rready(rready),
      .write(write),
      .write_place(write_place),
      .write_bytes(write_bytes),
      .write_data(write_data),
      .write_refused(write_refused),
      .read_place(read_place),
      .read_data(read_data),
      .read_refused(read_refused)
  );

  // Offers of the clock before that were not taken.
  reg begun = 0;
  reg aw_waits = 0, w_waits = 0, ar_waits = 0, b_waits = 0, r_waits = 0;
  reg [ADDRESS_BITS-1:0] aw_was, ar_was;
  reg [31:0] w_was, r_was;
  reg [3:0] strb_was;
  reg [1:0] bresp_was, rresp_was;
  // Requests that were taken and not answered; what the answer has to be.
  reg write_due = 0, read_due = 0;
  reg [1:0] write_answer, read_answer;
  reg [31:0] read_word;
  // Clocks that both halves of a write, a read, have been on offer while no answer waits.
  reg [1:0] write_patience = 0, read_patience = 0;

  always @(posedge clk) begin
    begun <= 1;
    aw_waits <= awvalid && !awready;
    w_waits <= wvalid && !wready;
    ar_waits <= arvalid && !arready;
    b_waits <= bvalid && !bready;
    r_waits <= rvalid && !rready;
    aw_was <= awaddr;
    ar_was <= araddr;
    w_was <= wdata;
    strb_was <= wstrb;
    r_was <= rdata;
    bresp_was <= bresp;
    rresp_was <= rresp;

    if (bvalid && bready) write_due <= 0;
    if (awvalid && awready) begin
      write_due <= 1;
      write_answer <= write_refused || awaddr[1:0] != 0 ? 2'b10 : 2'b00;
    end
    if (rvalid && rready) read_due <= 0;
    if (arvalid && arready) begin
      read_due <= 1;
      read_answer <= read_refused || araddr[1:0] != 0 ? 2'b10 : 2'b00;
      read_word <= read_refused || araddr[1:0] != 0 ? 0 : read_data;
    end

    write_patience <= awvalid && wvalid && !awready && !bvalid ? write_patience + 1 : 0;
    read_patience <= arvalid && !arready && !rvalid ? read_patience + 1 : 0;

    if (reset) begin
      aw_waits <= 0;
      w_waits <= 0;
      ar_waits <= 0;
      b_waits <= 0;
      r_waits <= 0;
      write_due <= 0;
      read_due <= 0;
      write_patience <= 0;
      read_patience <= 0;
    end
  end

  always @* begin
    // The first clock is one of reset, and a master keeps its offers.
    assume (begun || reset);
    assume (reset || !aw_waits || (awvalid && awaddr == aw_was));
    assume (reset || !w_waits || (wvalid && wdata == w_was && wstrb == strb_was));
    assume (reset || !ar_waits || (arvalid && araddr == ar_was));
    if (begun && !reset) begin
      // Both halves of a write are taken together, when both are there, and no other write is under way.
      assert (awready == wready);
      assert (!awready || (awvalid && wvalid && !write_due));
      assert (!arready || (arvalid && !read_due));
      // Answers: one for each request, the right one, kept.
      assert (bvalid == write_due);
      assert (rvalid == read_due);
      assert (!bvalid || bresp == write_answer);
      assert (!rvalid || (rresp == read_answer && rdata == read_word));
      assert (!b_waits || (bvalid && bresp == bresp_was));
      assert (!r_waits || (rvalid && rresp == rresp_was && rdata == r_was));
      // What reaches the registers.
      assert (write == (awready && awaddr[1:0] == 0));
      assert (!write || (write_place == awaddr[ADDRESS_BITS-1:2]));
      assert (!write || (write_data == wdata && write_bytes == wstrb));
      assert (!arready || read_place == araddr[ADDRESS_BITS-1:2]);
      // It goes on.
      assert (write_patience < 2);
      assert (read_patience < 2);
    end
  end
endmodule
