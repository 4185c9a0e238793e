// SPDX-License-Identifier: Apache-2.0
//
// The slice in which each lens is sharpest (plenofir.refocus.sharpness.depth_index), to the bit, from the luma of the
// lenses in each slice. A thread does a lens, a block a tile of them. In front of this text stand
// (plenofir.refocus.gpu.constants):
//
//   SLICES                   slices of the stack
//   TILE_ROWS, TILE_COLUMNS  lenses of a tile
//   RADIUS, VOTE_RADIUS      windows of the sharpness and of the vote, in lenses from the middle to the edge
//   LEAST                    difference between the sharpest and the least sharp slice that counts as texture
//   CURVATURE_BITS           bits that the confidence of depth between slices leaves out
//   BETWEEN                  whether depth between slices is asked for
//   WEIGHT[SLICES]           weight of a slice's sharpness, in sixteenths
//   STEPS[SLICES + 1]        distance of a slice from the one before, 1 outside of the stack
//   Sharpness                type of a lens's sharpness, also with its weight

constexpr int THREADS = TILE_ROWS * TILE_COLUMNS;
// Slices whose numbers are read at once, so that few waits for memory follow each other.
constexpr int TOGETHER = 4;
constexpr int HELD_COLUMNS = TILE_COLUMNS + 2 * RADIUS, HELD = (TILE_ROWS + 2 * RADIUS) * HELD_COLUMNS;
// Absolute Laplacians of the tile's lenses and of those around, of some slices.
__shared__ Sharpness laplacians[TOGETHER][HELD];

// Absolute Laplacian between lenses of one slice; lenses beyond the edges are skipped.
__device__ inline Sharpness laplacian(const long long* lens, int y, int x, int rows, int columns)
{
    const Sharpness luma = lens[0];
    Sharpness sum = 0;
    if (y > 0) sum += luma - Sharpness(lens[-columns]);
    if (y < rows - 1) sum += luma - Sharpness(lens[columns]);
    if (x > 0) sum += luma - Sharpness(lens[-1]);
    if (x < columns - 1) sum += luma - Sharpness(lens[1]);
    return sum < 0 ? -sum : sum;
}

// Row and column of a thread's lens.
__device__ inline int lens_row() { return blockIdx.y * TILE_ROWS + threadIdx.x / TILE_COLUMNS; }
__device__ inline int lens_column() { return blockIdx.x * TILE_COLUMNS + threadIdx.x % TILE_COLUMNS; }

// lens_sums: luma, for each slice. index, textured, fraction, confidence: as DepthIndex has them, before any vote.
extern "C" __global__ void __launch_bounds__(THREADS)
find_sharpest(const long long* __restrict__ lens_sums, unsigned char* index, unsigned char* textured,
              unsigned char* fraction, unsigned char* confidence, int rows, int columns)
{
    const int t = lens_row(), s = lens_column(), thread = threadIdx.x;
    Sharpness most = 0, least = 0, before = 0, after = 0, last = 0;
    int best = 0;
    for (int first = 0; first < SLICES; first += TOGETHER) {
        for (int i = thread; i < HELD; i += THREADS) {
            const int y = int(blockIdx.y) * TILE_ROWS - RADIUS + i / HELD_COLUMNS;
            const int x = int(blockIdx.x) * TILE_COLUMNS - RADIUS + i % HELD_COLUMNS;
            const bool inside = y >= 0 && y < rows && x >= 0 && x < columns;
            const long long* lens = lens_sums + ((long long)first * rows + y) * columns + x;
#pragma unroll
            for (int n = 0; n < TOGETHER; n++, lens += (long long)rows * columns)
                laplacians[n][i] = inside && first + n < SLICES ? laplacian(lens, y, x, rows, columns) : 0;
        }
        __syncthreads();
#pragma unroll
        for (int n = first; n < first + TOGETHER; n++) {
            if (n >= SLICES) break;
            const Sharpness* const window =
                laplacians[n - first] + thread / TILE_COLUMNS * HELD_COLUMNS + thread % TILE_COLUMNS;
            Sharpness here = 0;
            for (int y = 0; y <= 2 * RADIUS; y++)
                for (int x = 0; x <= 2 * RADIUS; x++) here += window[y * HELD_COLUMNS + x];
            here = here * WEIGHT[n] >> 4;
            if (n == 0) most = least = before = after = here;
            if (best == n - 1) after = here;
            if (here > most) {
                before = last;
                best = n;
            }
            most = here > most ? here : most;
            least = here < least ? here : least;
            last = here;
        }
        __syncthreads();
    }
    if (t >= rows || s >= columns) return;
    const int lens = t * columns + s;
    index[lens] = best;
    textured[lens] = most - least >= LEAST;
    if (!BETWEEN) return;
    if (best == 0 || best == SLICES - 1 || !(textured[lens] || VOTE_RADIUS == 0)) {
        fraction[lens] = 128;
        confidence[lens] = 0;
        return;
    }
    long long part = (long long)(most - before) * STEPS[best + 1];
    const long long whole = part + (long long)(most - after) * STEPS[best];
    int place = 0;
    for (int bit = 0; bit < 8; bit++) {
        part *= 2;
        place *= 2;
        if (part >= whole) {
            part -= whole;
            place++;
        }
    }
    fraction[lens] = place;
    const long long curvature = (2ll * most - before - after) >> CURVATURE_BITS;
    confidence[lens] = curvature < 1 ? 1 : curvature > 255 ? 255 : curvature;
}

// voted: the slice of a lens with texture, or the most frequent one of those around; -1 where there is none.
extern "C" __global__ void __launch_bounds__(THREADS)
vote(const unsigned char* __restrict__ index, const unsigned char* __restrict__ textured, short* voted, int rows,
     int columns)
{
    const int t = lens_row(), s = lens_column(), lens = t * columns + s;
    if (t >= rows || s >= columns) return;
    if (textured[lens]) {
        voted[lens] = index[lens];
        return;
    }
    unsigned char votes[SLICES] = {};
    for (int y = t - VOTE_RADIUS; y <= t + VOTE_RADIUS; y++)
        for (int x = s - VOTE_RADIUS; x <= s + VOTE_RADIUS; x++)
            if (y >= 0 && y < rows && x >= 0 && x < columns && textured[y * columns + x])
                votes[index[y * columns + x]]++;
    int most = 0, best = -1;
    for (int n = 0; n < SLICES; n++)
        if (votes[n] > most) {
            most = votes[n];
            best = n;
        }
    voted[lens] = best;
}

// filled: lenses without votes take the slice of the lens above, in the first row of that to the left. The first lens
// of all has nobody to ask, and keeps its index.
extern "C" __global__ void __launch_bounds__(THREADS)
fill(const unsigned char* __restrict__ index, const short* __restrict__ voted, unsigned char* filled, int rows,
     int columns)
{
    const int t = lens_row(), s = lens_column(), lens = t * columns + s;
    if (t >= rows || s >= columns) return;
    int from = lens;
    while (from > 0 && voted[from] < 0) from -= from >= columns ? columns : 1;
    filled[lens] = voted[from] < 0 ? index[0] : voted[from];
}
