// SPDX-License-Identifier: Apache-2.0
// The row stage with several pixels a token equals the gather equation: whatever the pixels, the stalls, the length
// of a line and the empty tokens behind it are, and whenever the next line begins.
//
//   out(k) = sum over u = 0..M-1 of x(M * floor((k + OFFSET - u * SHIFT) / M) + u), x = 0 outside its line,
//            of those u for which (k + OFFSET - u * SHIFT) mod M is below the box
//
// Two lines are followed, the second begins at any clock from LEAST tokens on. Side information tells the line of an
// output. So the banks, the exchange, the sum ahead of a line and the prefix network are right together.

module lane_properties #(
    parameter M = 3,
    parameter P = 2,
    parameter BOX = 3,
    parameter SHIFT_BIASED = 66,
    parameter OFFSET_BIASED = 66,
    parameter SUM_BITS = 2,
    parameter LEAST = 2,
    parameter LENGTH = 4
) (
    input clk,
    input strobe,
    input first,
    input empty,
    input [P-1:0] data
);
  localparam COUNT_BITS = 4;
  localparam integer SHIFT = SHIFT_BIASED - 64;
  localparam integer OFFSET = OFFSET_BIASED - 64;

  reg started = 0;
  reg line = 0;
  reg ended = 0;
  // Pixels of a bit each, tokens with and without them, and outputs of both lines.
  reg [LENGTH*P-1:0] pixels0 = 0;
  reg [LENGTH*P-1:0] pixels1 = 0;
  reg [COUNT_BITS-1:0] length0 = 0;
  reg [COUNT_BITS-1:0] length1 = 0;
  reg [COUNT_BITS-1:0] tokens0 = 0;
  reg [COUNT_BITS-1:0] given0 = 0;
  reg [COUNT_BITS-1:0] given1 = 0;

  // The first token of all begins a line, and one later token may.
  wire begins = !started || (first && !line && tokens0 >= LEAST);
  wire now = started && begins ? 1'b1 : line;
  wire [COUNT_BITS-1:0] length = now ? length1 : length0;
  // Behind an empty token a line has no more pixels, and no more pixels come than are kept here.
  wire live = begins || (!ended && !empty && length < LENGTH);
  wire takes = strobe && (live || tokens0 != {COUNT_BITS{1'b1}});

  wire out_strobe;
  wire [P*SUM_BITS-1:0] sums;
  wire pixel;
  wire line_out;

  part dut (
      .clk(clk),
      .reset(1'b0),
      .token_strobe(takes),
      .token_pixel(live),
      .token_line_first(begins),
      .token_line_last(1'b0),
      .token_band(1'b0),
      .token_frame_first(1'b0),
      .token_image(1'b0),
      .token_slice(8'b0),
      .data(data),
      .tag(now),
      .line_end({P{1'b1}}),
      .out_token_strobe(out_strobe),
      .out_token_pixel(pixel),
      .out_data(sums),
      .out_tag(line_out)
  );

  function integer floor_divided(input integer value);
    floor_divided = value >= 0 ? value / M : -((-value + M - 1) / M);
  endfunction

  function [SUM_BITS-1:0] gathered(input [LENGTH*P-1:0] pixels, input [COUNT_BITS-1:0] count, input integer place);
    integer u, k, from;
    begin
      gathered = 0;
      for (u = 0; u < M; u = u + 1) begin
        from = M * floor_divided(place + OFFSET - u * SHIFT);
        k = from + u;
        if (place + OFFSET - u * SHIFT - from < BOX && k >= 0 && k < LENGTH * P && k < count * P) gathered = gathered + ((pixels >> k) & 1);
      end
    end
  endfunction

  integer i, j;

  always @(posedge clk) begin
    if (takes) begin
      started <= 1;
      line <= now;
      ended <= !live;
      if (!now) tokens0 <= tokens0 + 1;
      if (live && now) begin
        pixels1 <= pixels1 | (data << (length1 * P));
        length1 <= length1 + 1;
      end
      if (live && !now) begin
        pixels0 <= pixels0 | (data << (length0 * P));
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
      for (i = 0; i < LENGTH; i = i + 1)
        for (j = 0; j < P; j = j + 1) begin
          if (!line_out && given0 == i)
            assert (sums[j*SUM_BITS+:SUM_BITS] == gathered(pixels0, length0, i * P + j));
          if (line_out && given1 == i)
            assert (sums[j*SUM_BITS+:SUM_BITS] == gathered(pixels1, length1, i * P + j));
        end
      // No output without its pixels.
      assert (line_out ? given1 < length1 : given0 < length0);
    end
  end
endmodule
