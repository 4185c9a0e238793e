// SPDX-License-Identifier: Apache-2.0
// Test bench of refocus_button: random frames through every slice, each pixel against the definition.
//
// Both sides stall at random. It ends with "PASS" or stops at the first wrong pixel.

`include "scene_top.vh"
`default_nettype none

module tb_refocus_button;

  localparam FRAMES = `SCENE_SLICES + 1;

`include "definition.vh"

  reg                     clk = 1'b0;
  reg                     reset = 1'b1;
  reg                     button = 1'b0;
  reg                     in_valid = 1'b0;
  wire                    in_ready;
  reg  [CHANNELS*BITS-1:0] in_data = 0;
  reg                     in_first = 1'b0;
  reg                     in_last = 1'b0;
  wire                    out_valid;
  reg                     out_ready = 1'b0;
  wire [CHANNELS*BITS-1:0] out_data;
  wire                    out_first;
  wire [7:0]              out_slice;
  wire                    out_last;
  wire [4:0]              error_flags;

  refocus_button dut (
      .clk          (clk),
      .reset        (reset),
      .button       (button),
      .s_axis_tvalid(in_valid),
      .s_axis_tready(in_ready),
      .s_axis_tdata (in_data),
      .s_axis_tuser (in_first),
      .s_axis_tlast (in_last),
      .m_axis_tvalid(out_valid),
      .m_axis_tready(out_ready),
      .m_axis_tdata (out_data),
      .m_axis_tuser (out_first),
      .m_axis_tid   (out_slice),
      .m_axis_tlast (out_last),
      .error_flags  (error_flags)
  );

  integer seed = 1;
  integer fed = 0;
  integer found = 0;

  always #5 clk = !clk;

  // The source: a pixel is held until it is taken.
  always @(posedge clk) begin
    reset <= 1'b0;
    if (!reset && (!in_valid || in_ready)) begin
      in_valid <= 1'b0;
      if (fed < FRAMES * PIXELS && $random(seed) % 8 != 0) begin : offer
        reg [CHANNELS*BITS-1:0] word;
        word = {$random(seed), $random(seed)};
        sent[fed] = word;
        in_valid <= 1'b1;
        in_data <= word;
        in_first <= fed % PIXELS == 0;
        in_last <= fed % COLUMNS == COLUMNS - 1;
        fed = fed + 1;
      end
    end
    // Pressed in the middle of each frame: the next one comes with the next slice.
    button <= fed % PIXELS > PIXELS / 2;
  end

  // The sink, with the comparison.
  always @(posedge clk) begin : sink
    integer frame, row, column, channel, want, slice;
    reg [BITS-1:0] got;
    out_ready <= $random(seed) % 8 != 0;
    if (out_valid && out_ready) begin
      frame = found / PIXELS;
      row = found % PIXELS / COLUMNS;
      column = found % COLUMNS;
      slice = frame % SLICES;
      if (out_slice !== slice || out_first !== (found % PIXELS == 0) || out_last !== (column == COLUMNS - 1))
        fail(frame, row, column);
      for (channel = 0; channel < CHANNELS; channel = channel + 1) begin
        got = out_data >> channel * BITS;
        want = refocused(frame, row, column, channel, slice);
        if (got !== want[BITS-1:0]) fail(frame, row, column);
      end
      found = found + 1;
      if (found == FRAMES * PIXELS) begin
        if (error_flags !== 5'd0) fail(frame, row, column);
        $display("PASS: %0d frames of %0d x %0d pixels, %0d slices", FRAMES, COLUMNS, ROWS, SLICES);
        $finish(0);
      end
    end
  end

  task fail;
    input integer frame;
    input integer row;
    input integer column;
    begin
      $display("FAIL: frame %0d, row %0d, column %0d: %h, slice %0d, flags %b", frame, row, column, out_data,
               out_slice, error_flags);
      $finish(0);
    end
  endtask

  initial begin
    #(40 * FRAMES * PIXELS + 100000) $display("FAIL: only %0d pixels came out", found);
    $finish(0);
  end

endmodule

`default_nettype wire
