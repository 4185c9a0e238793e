// SPDX-License-Identifier: Apache-2.0
// The division by a weight that changes is exact: whatever value and weight come with each clock,
//
//   quotient = floor(value / weight + 1/2) for weight > 0, and 0 for weight = 0
//
// for every weight of WEIGHT_BITS, and every value up to weight * (2**QUOTIENT_BITS - 1). A result depends on the inputs of
// one clock alone, so the clocks that it takes are all there is to look at.

module divide_properties #(
    parameter WEIGHT_BITS = 4,
    parameter QUOTIENT_BITS = 4
) (
    input clk,
    input [WEIGHT_BITS+QUOTIENT_BITS-1:0] value,
    input [WEIGHT_BITS-1:0] weight
);
  localparam LATENCY = QUOTIENT_BITS + 1;
  localparam BITS = WEIGHT_BITS + QUOTIENT_BITS;

  reg [BITS-1:0] value_at[0:LATENCY];
  reg [WEIGHT_BITS-1:0] weight_at[0:LATENCY];
  reg [7:0] clocks = 0;
  integer i;

  wire [QUOTIENT_BITS-1:0] quotient;

  divide_weighted dut (
      .clk(clk),
      .values(value),
      .weight(weight),
      .quotients(quotient)
  );

  always @* begin
    value_at[0] = value;
    weight_at[0] = weight;
  end

  always @(posedge clk) begin
    for (i = 1; i <= LATENCY; i = i + 1) begin
      value_at[i] <= value_at[i-1];
      weight_at[i] <= weight_at[i-1];
    end
    if (clocks != 8'hff) clocks <= clocks + 1;
  end

  wire [BITS-1:0] v = value_at[LATENCY];
  wire [WEIGHT_BITS-1:0] w = weight_at[LATENCY];
  wire [BITS:0] numerator = v + (w >> 1);
  wire [BITS:0] product = w * quotient;

  always @* begin
    assume (value <= weight * {QUOTIENT_BITS{1'b1}});
    if (clocks >= LATENCY) begin
      if (w == 0) assert (quotient == 0);
      else assert (product <= numerator && numerator < product + w);
    end
  end
endmodule
