// SPDX-License-Identifier: Apache-2.0
// The resampler reads only raw lines that are complete and that the ring keeps, for every calibration within its
// limits: the registers, the frame's size, its place in the ring and all times are free.
//
// When a line of the raster is offered, all raw lines between its highest and its lowest lens, and those below, mirrored
// at the borders, are complete, lie behind the first that is kept, and span less than the ring. While a line is walked
// along, no more is given up. Proved by induction over one clock; asserts on internal signals are what carries it.

module ring_properties #(
    parameter M = 3,
    parameter LINES = 4,
    parameter FRACTION_BITS = 8
) (
    input clk,
    input reset,
    input load_write,
    input [1:0] load_kind,
    input [19:0] load_address,
    input [39:0] load_data,
    input frame_start,
    input [15:0] columns,
    input [15:0] rows,
    input frame_waits,
    input [15:0] frame_base,
    input signed [15:0] lines_in,
    input line_taken,
    input at_rest,
    input drained,
    // Any lens of the row, by its raw line counted from that of the first lens; the line of its pixel or the one below.
    input signed [15:0] lens,
    input below
);
  localparam BORDERS = 3, REACH = 4, CHECK = 5, OFFER = 7;

  wire [31:0] raster_line_y, y;
  wire [15:0] keep, base, row_index, line_index, gap, stride;
  wire signed [15:0] last_line, top, bottom, oldest, last_kept, needed, kept;
  wire [479:0] registers;
  wire [3:0] state;
  wire line_valid;

  lens_rows dut (
      .clk(clk),
      .reset(reset),
      .load_write(load_write),
      .load_kind(load_kind),
      .load_address(load_address),
      .load_data(load_data),
      .frame_start(frame_start),
      .columns(columns),
      .rows(rows),
      .ring_frame_waits(frame_waits),
      .ring_frame_base(frame_base),
      .ring_lines_in(lines_in),
      .line_taken(line_taken && line_valid),
      .at_rest(at_rest),
      .drained(drained),
      .need_keep(keep),
      .frame_base(base),
      .frame_last_line(last_line),
      .registers(registers),
      .raster_line_y(raster_line_y),
      .line_valid(line_valid),
      .state(state),
      .y(y),
      .row_index(row_index),
      .line_index(line_index),
      .gap(gap),
      .stride(stride),
      .top(top),
      .bottom(bottom),
      .oldest(oldest),
      .last_kept(last_kept),
      .needed(needed),
      .kept(kept)
  );

  // All in more bits than the circuit has, so that nothing overflows here.
  localparam BITS = 19;
  wire signed [31:0] first_whole = $signed(y) >>> FRACTION_BITS;
  wire signed [31:0] line_whole = $signed(raster_line_y) >>> FRACTION_BITS;
  wire signed [15:0] reach_up = registers[143:128];
  wire signed [15:0] reach_down = registers[159:144];
  wire signed [BITS-1:0] first = first_whole[BITS-1:0];
  wire signed [BITS-1:0] line = line_whole[BITS-1:0];
  wire signed [BITS-1:0] up = reach_up;
  wire signed [BITS-1:0] down = reach_down;
  wire signed [BITS-1:0] last = last_line;
  wire signed [BITS-1:0] least = $signed(gap);
  wire signed [BITS-1:0] most = $signed(stride);
  wire signed [BITS-1:0] index = $signed({1'b0, line_index});
  wire last_row = row_index + 16'd1 == registers[463:448];
  wire signed [BITS-1:0] lowest = bottom > -top ? bottom : -top;
  wire signed [BITS-1:0] apart = lens;
  wire signed [BITS-1:0] read_at = below ? line + apart + 1 : line + apart;
  wire signed [BITS-1:0] read = read_at < 0 ? -read_at : read_at > last ? 2 * last - read_at : read_at;

  // A line of the raster is walked along, with what was kept for it.
  reg walking = 0;
  reg [15:0] kept_for_it = 0;
  reg signed [15:0] lines_before = 0;
  always @(posedge clk) begin
    if (line_valid && line_taken) begin
      walking <= 1;
      kept_for_it <= kept;
    end else if (at_rest) walking <= 0;
    if (reset) walking <= 0;
    lines_before <= lines_in;
  end

  always @* begin
    // The limits: what grid_registers and check_fits hold a calibration to.
    assume (last >= 1 && last < 8192);
    assume (up <= 0 && down >= 0);
    assume (least >= 0 && most >= least && most < 8192);
    if (state >= BORDERS && state <= OFFER) begin
      assume (first + up >= 3 - last && first + down + M + 3 <= 2 * last);
      assume (first_whole > -8192 && first_whole < 16384);
    end
    assume (apart >= up && apart <= down);
    // raw_writer: lines of the frame on work become more.
    if (state == OFFER) assume (lines_in >= lines_before);
    // lens_walk: nothing is taken before the line on work ends, and it is at rest behind one.
    assume (!(line_valid && line_taken && reset));

    assert (state <= 8 && line_index < M);
    if (state >= REACH && state <= OFFER) begin
      assert (line_whole == first_whole + $signed({1'b0, line_index}));
      assert (top == line + up && bottom == line + 1 + down);
      assert (oldest == first + up + (index < least ? index : least));
      assert (last_kept == 2 * last - (first + $signed(M) + down + (last_row ? 0 : most)));
    end
    if (state >= CHECK && state <= OFFER) begin
      assert (needed == (lowest < last ? lowest : last));
      assert (kept == (oldest < 0 || last_kept < 0 ? 0 : oldest < last_kept ? oldest : last_kept));
    end
    if (state > CHECK && state <= OFFER) assert (needed - kept < LINES);
    assert (line_valid == (state == OFFER));
    assert (!walking || state >= BORDERS);

    // What is to be shown.
    if (line_valid) begin
      assert (lines_in > needed);
      assert (read >= 0 && read <= last && read < lines_in);
      assert (read >= kept && needed - read < LINES);
    end
    assert (!walking || keep == base + kept_for_it);
  end
endmodule
