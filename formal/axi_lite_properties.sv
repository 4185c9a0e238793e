// SPDX-License-Identifier: Apache-2.0
// The slave keeps to AXI4-Lite, whatever master and registers do, as long as the master keeps offers.
//
// Each request is taken once and answered once, in order, with OKAY or SLVERR; an answer stays as it is until
// it is taken; nothing is answered that was not asked. A write's address and data are taken each by itself, at
// once unless the write before still has its own. A write reaches the registers once, when both are there and no
// answer waits, with the word's address, the data and strobes that were on offer; without any strobe it reaches
// nothing and the answer is OKAY. A read answers with what the registers hold then.

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
  // What was taken and has not reached the registers.
  reg has_address = 0, has_data = 0, has_read = 0;
  reg [ADDRESS_BITS-1:0] address, read_address;
  reg [31:0] data;
  reg [3:0] strobes;
  // What reached them and was not answered; what the answer has to be.
  reg write_due = 0, read_due = 0;
  reg [1:0] write_answer, read_answer;
  reg [31:0] read_word;

  wire writes = has_address && has_data && !write_due;
  wire reads = has_read && !read_due;

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
    if (writes) begin
      has_address <= 0;
      has_data <= 0;
      write_due <= 1;
      write_answer <= write_refused && strobes != 0 ? 2'b10 : 2'b00;
    end
    if (awvalid && awready) begin
      has_address <= 1;
      address <= awaddr;
    end
    if (wvalid && wready) begin
      has_data <= 1;
      data <= wdata;
      strobes <= wstrb;
    end

    if (rvalid && rready) read_due <= 0;
    if (reads) begin
      has_read <= 0;
      read_due <= 1;
      read_answer <= read_refused ? 2'b10 : 2'b00;
      read_word <= read_refused ? 0 : read_data;
    end
    if (arvalid && arready) begin
      has_read <= 1;
      read_address <= araddr;
    end

    if (reset) begin
      aw_waits <= 0;
      w_waits <= 0;
      ar_waits <= 0;
      b_waits <= 0;
      r_waits <= 0;
      has_address <= 0;
      has_data <= 0;
      has_read <= 0;
      write_due <= 0;
      read_due <= 0;
    end
  end

  always @* begin
    // The first clock is one of reset, and a master keeps its offers.
    assume (begun || reset);
    assume (reset || !aw_waits || (awvalid && awaddr == aw_was));
    assume (reset || !w_waits || (wvalid && wdata == w_was && wstrb == strb_was));
    assume (reset || !ar_waits || (arvalid && araddr == ar_was));
    if (begun && !reset) begin
      // What is taken, and when: it goes on.
      assert (awready == !has_address);
      assert (wready == !has_data);
      assert (arready == !has_read);
      // Answers: one for each request, the right one, kept.
      assert (bvalid == write_due);
      assert (rvalid == read_due);
      assert (!bvalid || bresp == write_answer);
      assert (!rvalid || (rresp == read_answer && rdata == read_word));
      assert (!b_waits || (bvalid && bresp == bresp_was));
      assert (!r_waits || (rvalid && rresp == rresp_was && rdata == r_was));
      // What reaches the registers.
      assert (write == (writes && strobes != 0));
      assert (!write || (write_place == address[ADDRESS_BITS-1:2]));
      assert (!write || (write_data == data && write_bytes == strobes));
      assert (!reads || read_place == read_address[ADDRESS_BITS-1:2]);
    end
  end
endmodule
