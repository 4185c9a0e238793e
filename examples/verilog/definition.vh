// SPDX-License-Identifier: Apache-2.0
// The definition of refocusing, for test benches: included inside a module that has as parameters the sizes M,
// COLUMNS, ROWS, CHANNELS, BITS, SLICES, FRAMES, and SHIFTS with a' of each slice, 16 bits each, slice 0 in the lowest.
//
// In one dimension (S of rows, then of columns; x = 0 outside the frame; M pixels a micro image, a' the shift):
//   S[k] = sum over u = 0..M-1 of x[M * floor((k - u * a') / M) + u],  out[k] = S[k + floor((M - 1) * a' / 2)] / M
// and one division by M * M at the end, halves up. It is summed up pixel by pixel, as slow as it is plain.

  localparam PIXELS = COLUMNS * ROWS;

  // The frames as they went in, FRAMES of them.
  reg [CHANNELS*BITS-1:0] sent[0:FRAMES*PIXELS-1];

  // Division that rounds down, also below zero.
  function integer floor_divide;
    input integer a;
    input integer b;
    floor_divide = a >= 0 ? a / b : -((b - 1 - a) / b);
  endfunction

  function integer pixel;
    input integer frame;
    input integer row;
    input integer column;
    input integer channel;
    if (row < 0 || row >= ROWS || column < 0 || column >= COLUMNS) pixel = 0;
    else begin : taken
      reg [CHANNELS*BITS-1:0] word;
      word = sent[frame*PIXELS+row*COLUMNS+column] >> channel * BITS;
      pixel = word[BITS-1:0];
    end
  endfunction

  function integer refocused;
    input integer frame;
    input integer row;
    input integer column;
    input integer channel;
    input integer slice;
    integer v, u, y, x, sum, offset, shift;
    begin
      shift = $signed(SHIFTS[16*slice+:16]);
      offset = floor_divide((M - 1) * shift, 2);
      sum = 0;
      for (v = 0; v < M; v = v + 1)
      for (u = 0; u < M; u = u + 1) begin
        y = M * floor_divide(row + offset - v * shift, M) + v;
        x = M * floor_divide(column + offset - u * shift, M) + u;
        sum = sum + pixel(frame, y, x, channel);
      end
      refocused = (2 * sum + M * M) / (2 * M * M);
    end
  endfunction
