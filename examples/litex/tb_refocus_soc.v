// SPDX-License-Identifier: Apache-2.0
// Test bench of refocus_soc: the slice is written to a register, a frame goes through, registers are read.
//
// Compile it with -DCONTROL=... -DSTATUS=... -DFRAMES_OUT=..., the registers' addresses of csr.csv, in bytes; and with
// -DCAMERA if the SoC has a camera, for a scene in RGB: its pins are driven, with a clock of their own.
// It ends with "PASS" or stops at the first fault.

`include "scene_top.vh"
`default_nettype none

module tb_refocus_soc;

  localparam FRAMES = 1;
  localparam M = `SCENE_MICRO_IMAGE_SIZE;
  localparam COLUMNS = `SCENE_COLUMNS;
  localparam ROWS = `SCENE_ROWS;
  localparam CHANNELS = `SCENE_CHANNELS;
  localparam BITS = `SCENE_PIXEL_BITS;
  localparam SLICES = `SCENE_SLICES;
  localparam [16*SLICES-1:0] SHIFTS = `SCENE_SHIFTS;
  // Not the one after reset.
  localparam SLICE = `SCENE_SLICES - 1;

`include "definition.vh"

  reg                      clk = 1'b0;
  reg                      reset = 1'b1;
  reg  [31:0]              address = 0;
  reg  [31:0]              written = 0;
  wire [31:0]              bus_value;
  reg  [31:0]              value = 0;
  reg                      select = 1'b0;
  reg                      write = 1'b0;
  wire                     acknowledge;
  reg                      in_valid = 1'b0;
  wire                     in_ready;
  reg  [CHANNELS*BITS-1:0] in_data = 0;
  reg                      in_first = 1'b0;
  reg                      in_last = 1'b0;
  wire                     out_valid;
  wire [CHANNELS*BITS-1:0] out_data;
  wire                     out_first;
  wire [7:0]               out_slice;
  wire                     out_last;
  integer                  seed = 1;
  integer                  fed;
  integer                  found = 0;

  refocus_soc dut (
      .clk           (clk),
      .reset         (reset),
`ifdef CAMERA
      .camera_pclk   (pixel_clk),
      .camera_href   (href),
      .camera_vsync  (vsync),
      .camera_data   (bytes),
`else
      .s_axis_tvalid (in_valid),
      .s_axis_tready (in_ready),
      .s_axis_tdata  (in_data),
      .s_axis_tuser  (in_first),
      .s_axis_tid    (8'd0),
      .s_axis_tlast  (in_last),
`endif
      .m_axis_tvalid (out_valid),
      .m_axis_tready (1'b1),
      .m_axis_tdata  (out_data),
      .m_axis_tuser  (out_first),
      .m_axis_tid    (out_slice),
      .m_axis_tlast  (out_last),
      .wishbone_adr  (address[31:2]),
      .wishbone_dat_w(written),
      .wishbone_dat_r(bus_value),
      .wishbone_sel  (4'hf),
      .wishbone_cyc  (select),
      .wishbone_stb  (select),
      .wishbone_ack  (acknowledge),
      .wishbone_we   (write),
      .wishbone_cti  (3'd0),
      .wishbone_bte  (2'd0),
      .wishbone_err  ()
  );

  always #5 clk = !clk;

`ifdef CAMERA
  reg         pixel_clk = 1'b0;
  reg         href = 1'b0;
  reg         vsync = 1'b0;
  reg  [7:0]  bytes = 0;
  reg  [15:0] rgb565;

  always #7 pixel_clk = !pixel_clk;

  // A frame of RGB565, the high byte first; values change with the falling edge.
  task send;
    begin
      repeat (4) @(negedge pixel_clk);
      vsync = 1'b1;
      repeat (9) @(negedge pixel_clk);
      vsync = 1'b0;
      repeat (5) @(negedge pixel_clk);
      for (fed = 0; fed < PIXELS; fed = fed + 1) begin
        rgb565 = $random(seed);
        sent[fed] = {rgb565[4:0], rgb565[4:2], rgb565[10:5], rgb565[10:9], rgb565[15:11], rgb565[15:13]};
        href = 1'b1;
        bytes = rgb565[15:8];
        @(negedge pixel_clk) bytes = rgb565[7:0];
        @(negedge pixel_clk);
        if (fed % COLUMNS == COLUMNS - 1) begin
          href = 1'b0;
          repeat (3) @(negedge pixel_clk);
        end
      end
    end
  endtask
`else
  task send;
    begin
      for (fed = 0; fed < PIXELS; fed = fed + 1) begin
        @(negedge clk);
        in_valid = 1'b1;
        in_data = {$random(seed), $random(seed)};
        in_first = fed == 0;
        in_last = fed % COLUMNS == COLUMNS - 1;
        sent[fed] = in_data;
        @(posedge clk);
        while (!in_ready) @(posedge clk);
      end
      @(negedge clk) in_valid = 1'b0;
    end
  endtask
`endif

  task fail;
    input integer place;
    begin
      $display("FAIL: pixel %0d: %h, slice %0d; register %h", place, out_data, out_slice, value);
      $finish(0);
    end
  endtask

  // An access to a register; `value` keeps what was read.
  task access;
    input [31:0] to;
    input [31:0] with;
    input writing;
    begin
      @(negedge clk);
      address = to;
      written = with;
      write = writing;
      select = 1'b1;
      @(posedge clk);
      while (!acknowledge) @(posedge clk);
      value = bus_value;
      #1 select = 1'b0;
    end
  endtask

  always @(posedge clk) begin : sink
    integer channel, want;
    reg [BITS-1:0] got;
    if (out_valid) begin
      if (out_slice !== SLICE || out_first !== (found == 0) || out_last !== (found % COLUMNS == COLUMNS - 1))
        fail(found);
      for (channel = 0; channel < CHANNELS; channel = channel + 1) begin
        got = out_data >> channel * BITS;
        want = refocused(0, found / COLUMNS, found % COLUMNS, channel, SLICE);
        if (got !== want[BITS-1:0]) fail(found);
      end
      found = found + 1;
    end
  end

  initial begin
    repeat (4) @(negedge clk);
    reset = 1'b0;
    access(`CONTROL, SLICE, 1'b1);
    send;
    while (found < PIXELS) @(posedge clk);
    access(`STATUS, 0, 1'b0);
    if (value !== SLICE << 8) fail(found);
    access(`FRAMES_OUT, 0, 1'b0);
    if (value !== FRAMES) fail(found);
    $display("PASS: slice %0d by register, %0d x %0d pixels", SLICE, COLUMNS, ROWS);
    $finish(0);
  end

  initial begin
    #(400 * PIXELS + 100000) $display("FAIL: only %0d pixels came out", found);
    $finish(0);
  end

endmodule

`default_nettype wire
