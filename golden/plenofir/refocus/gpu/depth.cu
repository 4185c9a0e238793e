// SPDX-License-Identifier: Apache-2.0
//
// The slice in which each lens is sharpest (plenofir.refocus.sharpness.depth_index), to the bit, from the luma of the
// lenses in each slice. A thread does a lens. In front of this text stand (plenofir.refocus.gpu.constants):
//
//   SLICES, THREADS      slices of the stack, threads of a block
//   RADIUS, VOTE_RADIUS  windows of the sharpness and of the vote, in lenses from the middle to the edge
//   LEAST                difference between the sharpest and the least sharp slice that counts as texture
//   CURVATURE_BITS       bits that the confidence of depth between slices leaves out
//   BETWEEN              whether depth between slices is asked for
//   WEIGHT[SLICES]       weight of a slice's sharpness, in sixteenths
//   STEPS[SLICES + 1]    distance of a slice from the one before, 1 outside of the stack

// Absolute Laplacian between lenses, summed over the window; lenses beyond the edges are skipped. INNER: there are none,
// so that the compiler reads each number once.
template <bool INNER>
__device__ inline long long sharpness(const long long* luma, int t, int s, int rows, int columns)
{
    long long total = 0;
#pragma unroll (INNER && RADIUS < 3 ? 2 * RADIUS + 1 : 1)
    for (int y = t - RADIUS; y <= t + RADIUS; y++)
#pragma unroll (INNER && RADIUS < 3 ? 2 * RADIUS + 1 : 1)
        for (int x = s - RADIUS; x <= s + RADIUS; x++) {
            if (!INNER && (y < 0 || y >= rows || x < 0 || x >= columns)) continue;
            const long long* const lens = luma + (long long)y * columns + x;
            long long laplacian = 0;
            if (INNER || y > 0) laplacian += lens[0] - lens[-columns];
            if (INNER || y < rows - 1) laplacian += lens[0] - lens[columns];
            if (INNER || x > 0) laplacian += lens[0] - lens[-1];
            if (INNER || x < columns - 1) laplacian += lens[0] - lens[1];
            total += laplacian < 0 ? -laplacian : laplacian;
        }
    return total;
}

// lens_sums: luma, for each slice. index, textured, fraction, confidence: as DepthIndex has them, before any vote.
extern "C" __global__ void __launch_bounds__(THREADS)
find_sharpest(const long long* __restrict__ lens_sums, unsigned char* index, unsigned char* textured,
              unsigned char* fraction, unsigned char* confidence, int rows, int columns)
{
    const int lens = blockIdx.x * THREADS + threadIdx.x;
    if (lens >= rows * columns) return;
    const int t = lens / columns, s = lens % columns;
    const bool inner = t > RADIUS && t < rows - RADIUS - 1 && s > RADIUS && s < columns - RADIUS - 1;
    long long most = 0, least = 0, before = 0, after = 0, last = 0;
    int best = 0;
    for (int n = 0; n < SLICES; n++) {
        const long long* const luma = lens_sums + (long long)n * rows * columns;
        const long long around = inner ? sharpness<true>(luma, t, s, rows, columns)
                                       : sharpness<false>(luma, t, s, rows, columns);
        const long long here = around * WEIGHT[n] >> 4;
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
    index[lens] = best;
    textured[lens] = most - least >= LEAST;
    if (!BETWEEN) return;
    if (best == 0 || best == SLICES - 1 || !(textured[lens] || VOTE_RADIUS == 0)) {
        fraction[lens] = 128;
        confidence[lens] = 0;
        return;
    }
    long long part = (most - before) * STEPS[best + 1];
    const long long whole = part + (most - after) * STEPS[best];
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
    const long long curvature = (2 * most - before - after) >> CURVATURE_BITS;
    confidence[lens] = curvature < 1 ? 1 : curvature > 255 ? 255 : curvature;
}

// voted: the slice of a lens with texture, or the most frequent one of those around; -1 where there is none.
extern "C" __global__ void __launch_bounds__(THREADS)
vote(const unsigned char* __restrict__ index, const unsigned char* __restrict__ textured, short* voted, int rows,
     int columns)
{
    const int lens = blockIdx.x * THREADS + threadIdx.x;
    if (lens >= rows * columns) return;
    if (textured[lens]) {
        voted[lens] = index[lens];
        return;
    }
    unsigned char votes[SLICES] = {};
    const int t = lens / columns, s = lens % columns;
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
    const int lens = blockIdx.x * THREADS + threadIdx.x;
    if (lens >= rows * columns) return;
    int from = lens;
    while (from > 0 && voted[from] < 0) from -= from >= columns ? columns : 1;
    filled[lens] = voted[from] < 0 ? index[0] : voted[from];
}
