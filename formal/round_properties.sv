// SPDX-License-Identifier: Apache-2.0
// The division by a constant rounds to the nearest quotient, halves up:
//
//   quotient = floor(value / DIVISOR + 1/2)
//
// for every value up to VALUE_MAX. A result depends on the input of one clock alone, so the clocks that it takes are all
// there is to look at.

module round_properties #(
    parameter DIVISOR = 4,
    parameter VALUE_BITS = 6,
    parameter VALUE_MAX = 63,
    parameter QUOTIENT_BITS = 5
) (
    input clk,
    input [VALUE_BITS-1:0] value
);
  localparam LATENCY = 3;

  reg [VALUE_BITS-1:0] value_at[0:LATENCY];
  reg [2:0] clocks = 0;
  integer i;

  wire [QUOTIENT_BITS-1:0] quotient;

  divide_round dut (
      .clk(clk),
      .value(value),
      .quotient(quotient)
  );

  always @* value_at[0] = value;

  always @(posedge clk) begin
    for (i = 1; i <= LATENCY; i = i + 1) value_at[i] <= value_at[i-1];
    if (clocks != LATENCY) clocks <= clocks + 1;
  end

  wire [VALUE_BITS+1:0] numerator = value_at[LATENCY] + DIVISOR / 2;
  wire [VALUE_BITS+1:0] product = DIVISOR * quotient;

  always @* begin
    assume (value <= VALUE_MAX);
    if (clocks == LATENCY) assert (product <= numerator && numerator < product + DIVISOR);
  end
endmodule
