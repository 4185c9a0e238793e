// SPDX-License-Identifier: Apache-2.0
// The stream buffer never drops, duplicates or reorders a word, under any stall pattern.
//
// Two words are followed, any two that go in one behind the other (all words between them or none, the
// solver chooses): they come out in this order, each once, and no word comes out that did not go in. An
// offer stays until it is taken, and its word does not change.

module fifo_properties #(
    parameter WIDTH = 2,
    parameter ADDRESS_BITS = 2
) (
    input clk,
    input reset,
    input s_valid,
    input [WIDTH-1:0] s_data,
    input m_ready,
    input follow
);
  localparam COUNT_BITS = ADDRESS_BITS + 2;

  wire s_ready, m_valid;
  wire [WIDTH-1:0] m_data;

  axis_fifo dut (
      .clk(clk),
      .reset(reset),
      .s_axis_tvalid(s_valid),
      .s_axis_tready(s_ready),
      .s_axis_tdata(s_data),
      .m_axis_tvalid(m_valid),
      .m_axis_tready(m_ready),
      .m_axis_tdata(m_data)
  );

  wire in = s_valid && s_ready;
  wire out = m_valid && m_ready;

  // Words inside, and one of them that is followed: its value and the words before it.
  reg [COUNT_BITS-1:0] inside = 0;
  reg followed = 0;
  reg [WIDTH-1:0] value = 0;
  reg [COUNT_BITS-1:0] before = 0;

  reg offered = 0;
  reg [WIDTH-1:0] offer = 0;

  always @(posedge clk) begin
    inside <= inside + in - out;
    if (in && follow && !followed) begin
      followed <= 1;
      value <= s_data;
      before <= inside - out;
    end else if (followed && out) begin
      if (before == 0) followed <= 0;
      else before <= before - 1;
    end
    offered <= m_valid && !m_ready;
    offer <= m_data;
    if (reset) begin
      inside <= 0;
      followed <= 0;
      offered <= 0;
    end
  end

  always @* begin
    if (!reset) begin
      // Nothing comes out of an empty buffer, and it takes as many words as it has room for.
      assert (!m_valid || inside != 0);
      assert (s_ready || inside >= (1 << ADDRESS_BITS));
      assert (inside <= (1 << ADDRESS_BITS) + 2);
      // The followed word comes out when those before it have.
      assert (!(followed && before == 0 && m_valid) || m_data == value);
      assert (!followed || before < inside);
      // Offers are kept.
      assert (!offered || (m_valid && m_data == offer));
    end
  end
endmodule
