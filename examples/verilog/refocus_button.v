// SPDX-License-Identifier: Apache-2.0
// An example design in Verilog around the core of a scene: a button chooses the slice.
//
// scene_top.v and scene_top.vh are written by `plenofir configure SCENE --verilog`, for a scene of several slices.
// Each press of the button takes the next slice; it takes effect with the next frame. Streams are AXI4-Stream video:
// tuser = start of frame, tlast = end of line, channel 0 (red or grey) in the low bits of tdata.

`include "scene_top.vh"
`default_nettype none

module refocus_button #(
    parameter DATA_BITS = `SCENE_CHANNELS * `SCENE_PIXEL_BITS
) (
    input  wire                 clk,
    // Synchronous, active high.
    input  wire                 reset,
    // Already debounced; may change at any time.
    input  wire                 button,
    input  wire                 s_axis_tvalid,
    output wire                 s_axis_tready,
    input  wire [DATA_BITS-1:0] s_axis_tdata,
    input  wire                 s_axis_tuser,
    input  wire                 s_axis_tlast,
    output wire                 m_axis_tvalid,
    input  wire                 m_axis_tready,
    output wire [DATA_BITS-1:0] m_axis_tdata,
    output wire                 m_axis_tuser,
    // The slice that the frame was refocused to.
    output wire [7:0]           m_axis_tid,
    output wire                 m_axis_tlast,
    // Set by broken frames until reset.
    output wire [4:0]           error_flags
);

  localparam [7:0] LAST_SLICE = `SCENE_SLICES - 1;

  // Two registers against metastability, one to see the edge.
  reg [2:0] pressed = 3'b000;
  reg [7:0] slice = 8'd0;

  always @(posedge clk) begin
    pressed <= {pressed[1:0], button};
    if (reset) slice <= 8'd0;
    else if (pressed[1] && !pressed[2]) slice <= slice == LAST_SLICE ? 8'd0 : slice + 8'd1;
  end

  scene_top core (
      .clk          (clk),
      .reset        (reset),
      .slice        (slice),
      .sweep        (1'b0),
      .sweep_frames (8'd0),
      .s_axis_tvalid(s_axis_tvalid),
      .s_axis_tready(s_axis_tready),
      .s_axis_tdata (s_axis_tdata),
      .s_axis_tuser (s_axis_tuser),
      .s_axis_tlast (s_axis_tlast),
      .m_axis_tvalid(m_axis_tvalid),
      .m_axis_tready(m_axis_tready),
      .m_axis_tdata (m_axis_tdata),
      .m_axis_tuser (m_axis_tuser),
      .m_axis_tid   (m_axis_tid),
      .m_axis_tlast (m_axis_tlast),
      .error_flags  (error_flags),
      .error_clear  (1'b0)
  );

endmodule

`default_nettype wire
