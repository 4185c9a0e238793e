// SPDX-License-Identifier: Apache-2.0
//
// The kernel of a stack: blocks beside each other make the same tile of one slice after the other, so that a frame is
// read once from memory, and from the cache for each further slice. In front of this text stands refocus.cu for each
// slice, and of the whole stack (plenofir.refocus.gpu.constants):
//
//   Pixel    type of samples
//   SLICES   slices of the stack
//   THREADS  threads of a block
//   CASES    a case for each slice that calls its tile with ARGUMENTS

extern __shared__ __align__(16) unsigned char block_memory[];

#define ARGUMENTS                                                                                                      \
    first_slice, blockIdx.x / SLICES, block_memory, x, out, reached_rows, reached_columns, lens_sums, sharpest, rows,    \
        columns, row_start, row_stop, column_start, column_stop

// x: samples of the raw picture. out: the region of each slice from row_start to before row_stop, and alike for columns.
// reached_rows, reached_columns: weights of all outputs of a dimension, for each slice, if NORMALISED.
// lens_sums: if not null, luma of each lens is added here, for each slice, and no picture is made.
// sharpest: if not null, a slice for each lens; there is one picture, in which lenses come from their slice.
// first_slice: number of the first slice, where a stack takes several kernels.
extern "C" __global__ void __launch_bounds__(THREADS)
refocus_tiles(const Pixel* __restrict__ x, Pixel* __restrict__ out, const long long* __restrict__ reached_rows,
              const long long* __restrict__ reached_columns, unsigned long long* lens_sums,
              const unsigned char* __restrict__ sharpest, int rows, int columns, int row_start, int row_stop,
              int column_start, int column_stop, int first_slice)
{
    switch (blockIdx.x % SLICES) {
        CASES
    }
}
