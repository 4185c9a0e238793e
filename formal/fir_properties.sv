// SPDX-License-Identifier: Apache-2.0
// The row filter with its control equals the gather equation: whatever the pixels, the stalls and the
// length of a line are, and whenever the next line begins.
//
//   out(k) = sum over u = 0..M-1 of x(M * floor((k + OFFSET - u * SHIFT) / M) + u), x = 0 outside its line
//
// Two lines are followed, the second begins at any clock. Side information tells the line of an output.

module fir_properties #(
    parameter M = 3,
    parameter SHIFT_BIASED = 66,
    parameter OFFSET_BIASED = 66,
    parameter DATA_BITS = 1,
    parameter SUM_BITS = 2,
    parameter LENGTH = 8
) (
    input clk,
    input strobe,
    input first,
    input [DATA_BITS-1:0] data
);
  localparam COUNT_BITS = 4;
  localparam integer SHIFT = SHIFT_BIASED - 64;
  localparam integer OFFSET = OFFSET_BIASED - 64;

  reg started = 0;
  reg line = 0;
  reg [LENGTH*DATA_BITS-1:0] pixels0 = 0;
  reg [LENGTH*DATA_BITS-1:0] pixels1 = 0;
  reg [COUNT_BITS-1:0] length0 = 0;
  reg [COUNT_BITS-1:0] length1 = 0;
  reg [COUNT_BITS-1:0] given0 = 0;
  reg [COUNT_BITS-1:0] given1 = 0;

  // The first pixel of all begins a line, and one later pixel may.
  wire begins = !started || (first && !line && length0 != 0);
  wire now = started && begins ? 1'b1 : line;
  // No more pixels than are kept here.
  wire takes = strobe && (now ? length1 : length0) < LENGTH;

  wire out_strobe;
  wire [SUM_BITS-1:0] sum;
  wire pixel;
  wire line_out;

  part dut (
      .clk(clk),
      .reset(1'b0),
      .token_strobe(takes),
      .token_pixel(1'b1),
      .token_line_first(begins),
      .token_line_last(1'b0),
      .token_band(1'b0),
      .token_frame_first(1'b0),
      .token_image(1'b0),
      .token_slice(8'b0),
      .data(data),
      .tag(now),
      .out_token_strobe(out_strobe),
      .out_token_pixel(pixel),
      .out_data(sum),
      .out_tag(line_out)
  );

  function integer floor_divided(input integer value);
    floor_divided = value >= 0 ? value / M : -((-value + M - 1) / M);
  endfunction

  function [SUM_BITS-1:0] gathered(input [LENGTH*DATA_BITS-1:0] pixels, input [COUNT_BITS-1:0] count,
                                   input integer place);
    integer u, k;
    begin
      gathered = 0;
      for (u = 0; u < M; u = u + 1) begin
        k = M * floor_divided(place + OFFSET - u * SHIFT) + u;
        if (k >= 0 && k < LENGTH && k < count)
          gathered = gathered + ((pixels >> (k * DATA_BITS)) & ((1 << DATA_BITS) - 1));
      end
    end
  endfunction

  integer i;

  always @(posedge clk) begin
    if (takes) begin
      started <= 1;
      line <= now;
      if (now) begin
        pixels1 <= pixels1 | (data << (length1 * DATA_BITS));
        length1 <= length1 + 1;
      end else begin
        pixels0 <= pixels0 | (data << (length0 * DATA_BITS));
        length0 <= length0 + 1;
      end
    end
    if (out_strobe && pixel) begin
      if (line_out) given1 <= given1 + 1;
      else given0 <= given0 + 1;
    end
  end

  always @* begin
    if (out_strobe && pixel) begin
      for (i = 0; i < LENGTH; i = i + 1) begin
        if (!line_out && given0 == i) assert (sum == gathered(pixels0, length0, i));
        if (line_out && given1 == i) assert (sum == gathered(pixels1, length1, i));
      end
      // No output without its pixel.
      assert (line_out ? given1 < length1 : given0 < length0);
    end
  end
endmodule
