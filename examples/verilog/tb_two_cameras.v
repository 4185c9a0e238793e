// SPDX-License-Identifier: Apache-2.0
// Test bench of two_cameras: random frames through every slice of both, each pixel against the definition.
//
// It prints a line that begins with "PASS" for each camera, or stops at the first wrong pixel.

`default_nettype none

module tb_two_cameras;

  reg         clk = 1'b0;
  reg         reset = 1'b1;
  wire        rgb_in_valid, rgb_in_ready, rgb_in_first, rgb_in_last;
  wire [23:0] rgb_in_data;
  wire        rgb_out_valid, rgb_out_ready, rgb_out_first, rgb_out_last;
  wire [23:0] rgb_out_data;
  wire [7:0]  rgb_out_slice;
  wire [4:0]  rgb_flags;
  wire        rgb_done;
  wire        grey_in_valid, grey_in_ready, grey_in_first, grey_in_last;
  wire [19:0] grey_in_data;
  wire        grey_out_valid, grey_out_ready, grey_out_first, grey_out_last;
  wire [19:0] grey_out_data;
  wire [7:0]  grey_out_slice;
  wire [4:0]  grey_flags;
  wire        grey_done;

  always #5 clk = !clk;

  always @(posedge clk) begin
    reset <= 1'b0;
    if (rgb_done && grey_done) $finish(0);
  end

  two_cameras dut (
      .clk            (clk),
      .reset          (reset),
      .rgb_in_tvalid  (rgb_in_valid),
      .rgb_in_tready  (rgb_in_ready),
      .rgb_in_tdata   (rgb_in_data),
      .rgb_in_tuser   (rgb_in_first),
      .rgb_in_tlast   (rgb_in_last),
      .rgb_out_tvalid (rgb_out_valid),
      .rgb_out_tready (rgb_out_ready),
      .rgb_out_tdata  (rgb_out_data),
      .rgb_out_tuser  (rgb_out_first),
      .rgb_out_tid    (rgb_out_slice),
      .rgb_out_tlast  (rgb_out_last),
      .rgb_flags      (rgb_flags),
      .grey_in_tvalid (grey_in_valid),
      .grey_in_tready (grey_in_ready),
      .grey_in_tdata  (grey_in_data),
      .grey_in_tuser  (grey_in_first),
      .grey_in_tlast  (grey_in_last),
      .grey_out_tvalid(grey_out_valid),
      .grey_out_tready(grey_out_ready),
      .grey_out_tdata (grey_out_data),
      .grey_out_tuser (grey_out_first),
      .grey_out_tid   (grey_out_slice),
      .grey_out_tlast (grey_out_last),
      .grey_flags     (grey_flags)
  );

  // a' = a * M in pixels: a = -2/3, 0, 1/3.
  check_frames #(
      .M       (3),
      .COLUMNS (21),
      .ROWS    (15),
      .CHANNELS(3),
      .SLICES  (3),
      .SHIFTS  (48'h0001_0000_fffe)
  ) rgb (
      .clk        (clk),
      .reset      (reset),
      .in_valid   (rgb_in_valid),
      .in_ready   (rgb_in_ready),
      .in_data    (rgb_in_data),
      .in_first   (rgb_in_first),
      .in_last    (rgb_in_last),
      .late       (),
      .out_valid  (rgb_out_valid),
      .out_ready  (rgb_out_ready),
      .out_data   (rgb_out_data),
      .out_first  (rgb_out_first),
      .out_slice  (rgb_out_slice),
      .out_last   (rgb_out_last),
      .error_flags(rgb_flags),
      .done       (rgb_done)
  );

  // a = -1/4, 1/2.
  check_frames #(
      .M        (4),
      .COLUMNS  (37),
      .ROWS     (11),
      .BITS     (10),
      .PER_CLOCK(2),
      .SLICES   (2),
      .SHIFTS   (32'h0002_ffff)
  ) grey (
      .clk        (clk),
      .reset      (reset),
      .in_valid   (grey_in_valid),
      .in_ready   (grey_in_ready),
      .in_data    (grey_in_data),
      .in_first   (grey_in_first),
      .in_last    (grey_in_last),
      .late       (),
      .out_valid  (grey_out_valid),
      .out_ready  (grey_out_ready),
      .out_data   (grey_out_data),
      .out_first  (grey_out_first),
      .out_slice  (grey_out_slice),
      .out_last   (grey_out_last),
      .error_flags(grey_flags),
      .done       (grey_done)
  );

endmodule

`default_nettype wire
