// SPDX-License-Identifier: Apache-2.0
// Test bench of refocus_button: random frames through every slice, each pixel against the definition.
//
// Both sides stall at random. It ends with "PASS" or stops at the first wrong pixel.

`include "scene_top.vh"
`default_nettype none

module tb_refocus_button;

  localparam WORD = `SCENE_CHANNELS * `SCENE_PIXEL_BITS;

  reg             clk = 1'b0;
  reg             reset = 1'b1;
  // Pressed in the middle of each frame: the next one comes with the next slice.
  wire            button;
  wire            in_valid;
  wire            in_ready;
  wire [WORD-1:0] in_data;
  wire            in_first;
  wire            in_last;
  wire            out_valid;
  wire            out_ready;
  wire [WORD-1:0] out_data;
  wire            out_first;
  wire [7:0]      out_slice;
  wire            out_last;
  wire [4:0]      error_flags;
  wire            done;

  always #5 clk = !clk;

  always @(posedge clk) begin
    reset <= 1'b0;
    if (done) $finish(0);
  end

  initial begin
    if (!`SCENE_EXACT || !`SCENE_CENTRED || `SCENE_INTERPOLATION_ORDER != 0) begin
      $display("FAIL: the bench knows exact sums, centred output and nearest neighbour only");
      $finish(0);
    end
  end

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

  check_frames #(
      .M       (`SCENE_MICRO_IMAGE_SIZE),
      .COLUMNS (`SCENE_COLUMNS),
      .ROWS    (`SCENE_ROWS),
      .CHANNELS(`SCENE_CHANNELS),
      .BITS    (`SCENE_PIXEL_BITS),
      .SLICES  (`SCENE_SLICES),
      .SHIFTS  (`SCENE_SHIFTS)
  ) check (
      .clk        (clk),
      .reset      (reset),
      .in_valid   (in_valid),
      .in_ready   (in_ready),
      .in_data    (in_data),
      .in_first   (in_first),
      .in_last    (in_last),
      .late       (button),
      .out_valid  (out_valid),
      .out_ready  (out_ready),
      .out_data   (out_data),
      .out_first  (out_first),
      .out_slice  (out_slice),
      .out_last   (out_last),
      .error_flags(error_flags),
      .done       (done)
  );

endmodule

`default_nettype wire
