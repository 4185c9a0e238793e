// SPDX-License-Identifier: Apache-2.0
// For test benches: random frames into a refocuser, each pixel that comes out against the definition.
//
// Frame n is expected in slice n modulo SLICES. Both sides stall at random. `done` rises behind the last pixel, with a
// line that begins with "PASS"; the first wrong pixel, or a stream that stands still, ends the simulation with "FAIL".

`default_nettype none

module check_frames #(
    // Pixels a micro image in each dimension.
    parameter M = 3,
    parameter COLUMNS = 24,
    parameter ROWS = 18,
    parameter CHANNELS = 1,
    parameter BITS = 8,
    // Pixels in one transfer.
    parameter PER_CLOCK = 1,
    parameter SLICES = 1,
    // a' of each slice, 16 bits each, slice 0 in the lowest.
    parameter [16*SLICES-1:0] SHIFTS = 0,
    parameter FRAMES = SLICES + 1
) (
    input  wire                               clk,
    input  wire                               reset,
    output reg                                in_valid,
    input  wire                               in_ready,
    output reg  [PER_CLOCK*CHANNELS*BITS-1:0] in_data,
    output reg                                in_first,
    output reg                                in_last,
    // In the second half of a frame: the time to choose the next one's slice.
    output reg                                late,
    input  wire                               out_valid,
    output reg                                out_ready,
    input  wire [PER_CLOCK*CHANNELS*BITS-1:0] out_data,
    input  wire                               out_first,
    input  wire [7:0]                         out_slice,
    input  wire                               out_last,
    input  wire [4:0]                         error_flags,
    output reg                                done
);

`include "definition.vh"

  localparam WORD = CHANNELS * BITS;

  integer seed = 1;
  integer fed = 0;
  integer found = 0;
  integer clocks = 0;

  initial begin
    in_valid = 1'b0;
    in_data = 0;
    in_first = 1'b0;
    in_last = 1'b0;
    late = 1'b0;
    out_ready = 1'b0;
    done = 1'b0;
  end

  // The source: a word is held until it is taken. Behind a line's end its pixels are random, too.
  always @(posedge clk) begin
    if (!reset && (!in_valid || in_ready)) begin
      in_valid <= 1'b0;
      if (fed < FRAMES * PIXELS && $random(seed) % 8 != 0) begin : offer
        integer lane, left;
        reg [WORD-1:0] word;
        left = COLUMNS - fed % COLUMNS;
        in_valid <= 1'b1;
        in_first <= fed % PIXELS == 0;
        in_last <= left <= PER_CLOCK;
        for (lane = 0; lane < PER_CLOCK; lane = lane + 1) begin
          word = {$random(seed), $random(seed)};
          in_data[WORD*lane+:WORD] <= word;
          if (lane < left) sent[fed+lane] = word;
        end
        fed = fed + (left < PER_CLOCK ? left : PER_CLOCK);
      end
    end
    late <= fed % PIXELS > PIXELS / 2;
  end

  // The sink, with the comparison; what comes behind a line's end is zero.
  always @(posedge clk) begin : sink
    integer frame, row, column, lane, channel, want, slice;
    reg [BITS-1:0] got;
    out_ready <= $random(seed) % 8 != 0;
    if (out_valid && out_ready) begin
      frame = found / PIXELS;
      row = found % PIXELS / COLUMNS;
      column = found % COLUMNS;
      slice = frame % SLICES;
      if (out_slice !== slice || out_first !== (found % PIXELS == 0) || out_last !== (column >= COLUMNS - PER_CLOCK))
        fail(frame, row, column);
      for (lane = 0; lane < PER_CLOCK; lane = lane + 1)
      for (channel = 0; channel < CHANNELS; channel = channel + 1) begin
        got = out_data >> lane * WORD + channel * BITS;
        want = column + lane < COLUMNS ? refocused(frame, row, column + lane, channel, slice) : 0;
        if (got !== want[BITS-1:0]) fail(frame, row, column + lane);
      end
      found = found + (COLUMNS - column < PER_CLOCK ? COLUMNS - column : PER_CLOCK);
      if (found == FRAMES * PIXELS) begin
        if (error_flags !== 5'd0) fail(frame, row, column);
        $display("PASS: %0d frames of %0d x %0d pixels, %0d slices", FRAMES, COLUMNS, ROWS, SLICES);
        done <= 1'b1;
      end
    end
    clocks = clocks + 1;
    if (!done && clocks > 4 * FRAMES * PIXELS + 10000) begin
      $display("FAIL: only %0d pixels came out", found);
      $finish(0);
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

endmodule

`default_nettype wire
