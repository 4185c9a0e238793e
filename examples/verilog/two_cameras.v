// SPDX-License-Identifier: Apache-2.0
// An example design in Verilog with a refocuser for each of two cameras, chosen by parameters of sizes.
//
// plenofir_refocuser.v is written by `plenofir verilog scene.toml wide.toml`. Both refocusers sweep: each frame comes in
// the next slice. Streams are AXI4-Stream video: tuser = start of frame, tlast = end of line.

`default_nettype none

module two_cameras (
    input  wire        clk,
    // Synchronous, active high.
    input  wire        reset,
    // RGB, 21 x 15 pixels, red in the low bits.
    input  wire        rgb_in_tvalid,
    output wire        rgb_in_tready,
    input  wire [23:0] rgb_in_tdata,
    input  wire        rgb_in_tuser,
    input  wire        rgb_in_tlast,
    output wire        rgb_out_tvalid,
    input  wire        rgb_out_tready,
    output wire [23:0] rgb_out_tdata,
    output wire        rgb_out_tuser,
    // The slice that the frame was refocused to.
    output wire [7:0]  rgb_out_tid,
    output wire        rgb_out_tlast,
    // Set by broken frames until reset.
    output wire [4:0]  rgb_flags,
    // Grey, 37 x 11 pixels of 10 bits, two at each clock: the left one in the low bits.
    input  wire        grey_in_tvalid,
    output wire        grey_in_tready,
    input  wire [19:0] grey_in_tdata,
    input  wire        grey_in_tuser,
    input  wire        grey_in_tlast,
    output wire        grey_out_tvalid,
    input  wire        grey_out_tready,
    output wire [19:0] grey_out_tdata,
    output wire        grey_out_tuser,
    output wire [7:0]  grey_out_tid,
    output wire        grey_out_tlast,
    output wire [4:0]  grey_flags
);

  plenofir_refocuser #(
      .COLUMNS         (21),
      .ROWS            (15),
      .MICRO_IMAGE_SIZE(3),
      .SLICES          (3),
      .PIXELS_PER_CLOCK(1),
      .CHANNELS        (3),
      .PIXEL_BITS      (8)
  ) rgb (
      .clk          (clk),
      .reset        (reset),
      .slice        (8'd0),
      .sweep        (1'b1),
      .sweep_frames (8'd1),
      .s_axis_tvalid(rgb_in_tvalid),
      .s_axis_tready(rgb_in_tready),
      .s_axis_tdata (rgb_in_tdata),
      .s_axis_tuser (rgb_in_tuser),
      .s_axis_tlast (rgb_in_tlast),
      .m_axis_tvalid(rgb_out_tvalid),
      .m_axis_tready(rgb_out_tready),
      .m_axis_tdata (rgb_out_tdata),
      .m_axis_tuser (rgb_out_tuser),
      .m_axis_tid   (rgb_out_tid),
      .m_axis_tlast (rgb_out_tlast),
      .error_flags  (rgb_flags),
      .error_clear  (1'b0)
  );

  plenofir_refocuser #(
      .COLUMNS         (37),
      .ROWS            (11),
      .MICRO_IMAGE_SIZE(4),
      .SLICES          (2),
      .PIXELS_PER_CLOCK(2),
      .CHANNELS        (1),
      .PIXEL_BITS      (10)
  ) grey (
      .clk          (clk),
      .reset        (reset),
      .slice        (8'd0),
      .sweep        (1'b1),
      .sweep_frames (8'd1),
      .s_axis_tvalid(grey_in_tvalid),
      .s_axis_tready(grey_in_tready),
      .s_axis_tdata (grey_in_tdata),
      .s_axis_tuser (grey_in_tuser),
      .s_axis_tlast (grey_in_tlast),
      .m_axis_tvalid(grey_out_tvalid),
      .m_axis_tready(grey_out_tready),
      .m_axis_tdata (grey_out_tdata),
      .m_axis_tuser (grey_out_tuser),
      .m_axis_tid   (grey_out_tid),
      .m_axis_tlast (grey_out_tlast),
      .error_flags  (grey_flags),
      .error_clear  (1'b0)
  );

endmodule

`default_nettype wire
