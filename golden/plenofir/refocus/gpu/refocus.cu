// SPDX-License-Identifier: Apache-2.0
//
// The refocusing operator (plenofir.refocus.operator) for a GPU, exact: a tile of one slice.
//
// A block makes a tile of the picture in three steps with barriers between:
//
// 1. A thread runs down a column of samples and keeps moving sums; they go to shared memory.
// 2. A thread runs along a segment of a line of these sums and divides; quotients go to shared memory.
// 3. Threads copy the tile to the picture, neighbours side by side. For the depth index of a stack they add the pixels of
//    each lens instead, or copy only lenses that are sharpest in this slice.
//
// Words of 32 bits hold several samples or sums, as far as these are short: step 1 takes four samples a thread (PACKED)
// and puts its sums for two rows side by side, which step 2 takes together (PAIRED).
//
// This text stands once for each slice of a stack, in a namespace of its own; stack.cu has the kernel.
// Both runs are `run_of_sums`: a moving sum over the re-ordered line, one more for each order of interpolation, and taps
// a lens apart. The constants in front of this text (plenofir.refocus.gpu.constants) are those of one kind of picture:
//
//   M, SHIFT, BOX, OFFSET             the operator in pixels: M, a', B, and the index of S that output 0 takes
//   UNIT_OFFSET, ORDER                the same offset for a' = 1, and the moving sums of the interpolation
//   STEP                              outputs are STEP pixels apart: 1, or M for one pixel of each lens
//   SIDE, CENTRE, SCALE               taps of the sharpening in whole numbers, and their gain; SIDE 0: none
//   FULL, NORMALISED                  the weight of a dimension where all views have a pixel; whether borders are divided
//                                     by what reached them
//   CHANNELS, WHITE                   samples of a pixel, and the largest one
//   TILE_ROWS, TILE_COLUMNS, SEGMENT  outputs of a tile, and of a thread of step 2
//   LOW, HIGH                         columns that a tile needs before its first output, and behind its last one
//   WHOLE_LENSES                      tiles and segments begin at whole lenses, so that places in a lens are constants
//   PADDED                            shared memory holds zeros for the columns outside of the picture
//   UNROLLED                          runs are unrolled, their rings are registers
//   GROUPS, VIEWS_APART               views that meet at a place: gcd(a', M), and the distance between them
//   FIRST_VIEW[M]                     the first view that meets at p modulo M, -1 if there is none
//   HELD_COLUMNS                      columns of sums in shared memory
//   PACKED                            samples of 8 bits whose sums of a column have 16 bits; TILE_ROWS is even
//   PAIRED                            with PACKED: sums of both dimensions, with half of their divisor, have 16 bits
//   Pixel, Offset                     types of samples, and of places in a picture
//   RunningColumn, ColumnSum, LineSum types of sums of a column, as they run and as they are kept, and of both dimensions

constexpr int LENS = SIDE ? M : 0;
constexpr int RING = BOX / STEP;
constexpr int WARM_STEPS = (ORDER + 1) * (RING - 1);
constexpr int ROW_STEPS = TILE_ROWS + 2 * LENS + WARM_STEPS;
constexpr int NO_ROW = -2147483647 - 1;

__device__ constexpr int bits_of(LineSum number) { return number > 0 ? 1 + bits_of(number / 2) : 0; }

constexpr Offset NO_LINE = Offset(-1);
constexpr int ENTERING_BYTES = (ROW_STEPS * int(sizeof(Offset)) + 15) / 16 * 16;

__device__ inline int rest_of(int place)
{
    const int rest = place % M;
    return rest < 0 ? rest + M : rest;
}

// The first place of S that a run for outputs from `first` on takes in.
__device__ inline int first_place(int first)
{
    return STEP * (first - LENS - WARM_STEPS + ORDER * UNIT_OFFSET) + OFFSET;
}

// Sums for OUTPUTS neighbouring outputs from `first` on, of a line of `length` outputs.
// entering(i) is the sum of the pixels at the i-th place; inside(k) says whether all views reach output k;
// store(i, sum) takes the i-th result.
template <class Sum, int OUTPUTS, class Entering, class Inside, class Store>
__device__ inline void run_of_sums(int first, int length, Entering entering, Inside inside, Store store)
{
    constexpr int STEPS = OUTPUTS + 2 * LENS + WARM_STEPS;
    Sum ring[ORDER + 1][RING], total[ORDER + 1], waiting[SIDE ? 2 * LENS : 1];
#pragma unroll
    for (int stage = 0; stage <= ORDER; stage++) {
        total[stage] = 0;
#pragma unroll (UNROLLED ? RING : 1)
        for (int i = 0; i < RING; i++) ring[stage][i] = 0;
    }
#pragma unroll (UNROLLED ? STEPS : 1)
    for (int i = 0; i < STEPS; i++) {
        Sum value = entering(i);
#pragma unroll
        for (int stage = 0; stage <= ORDER; stage++) {
            // The first sums of a stage lack pixels, so the next one begins later.
            const int step = i - stage * (RING - 1);
            if (step < 0) continue;
            if (stage > 0) {
                const int k = first - LENS - WARM_STEPS + (ORDER - stage + 1) * UNIT_OFFSET + i;
                if (k < 0 || k >= length) value = 0;
            }
            total[stage] += value - ring[stage][step % RING];
            ring[stage][step % RING] = value;
            value = total[stage];
        }
        const int made = i - WARM_STEPS;
        if (made < 0) continue;
        if constexpr (SIDE == 0) {
            store(made, value);
        } else {
            const int k = first + made - 2 * LENS;
            if (made >= 2 * LENS) {
                const Sum middle = waiting[(made + LENS) % (2 * LENS)];
                const bool here = inside(k);
                const Sum before = here && inside(k - LENS) ? waiting[made % (2 * LENS)] : middle;
                const Sum behind = here && inside(k + LENS) ? value : middle;
                store(made - 2 * LENS, CENTRE * middle - SIDE * (before + behind));
            }
            waiting[made % (2 * LENS)] = value;
        }
    }
}

// The weight of a pixel that all views reach, and the power of two that is not below it.
constexpr LineSum WHOLE = LineSum(FULL) * FULL * SCALE * SCALE;
constexpr int WHOLE_BITS = bits_of(WHOLE - 1);

// A sum over its weight, rounded, halves up, and limited to 0 .. WHITE.
__device__ inline Pixel quotient(LineSum sum, LineSum weight)
{
    if ((SIDE && sum < 0) || (NORMALISED && weight == 0)) return 0;
    LineSum result;
    if (NORMALISED && weight != WHOLE) {
        result = (sum + weight / 2) / weight;
    } else if constexpr (sizeof(LineSum) == 8 || WHOLE == 1) {
        result = (sum + WHOLE / 2) / WHOLE;
    } else {
        // Exact for numbers of 31 bits (Granlund and Montgomery, 1994): the compiler, which does not know that there is
        // no sign, takes two instructions more.
        // Compilers check this branch for wide sums too, where a shift by 64 bits would be an error.
        constexpr int bits = sizeof(LineSum) == 8 ? 0 : WHOLE_BITS;
        constexpr unsigned inverse = ((1ull << (31 + bits)) + WHOLE - 1) / WHOLE;
        result = unsigned(unsigned(sum + WHOLE / 2) * (unsigned long long)inverse >> 32) >> (WHOLE_BITS - 1);
    }
    // Only sharpened sums exceed what pixels have.
    return Pixel(SIDE && result > LineSum(WHITE) ? LineSum(WHITE) : result);
}

// Copies a line of bytes from `place` of the block's memory by a warp, in words that are aligned where they go.
__device__ inline void copy_line(const unsigned char* memory, unsigned place, unsigned char* to, unsigned bytes,
                                 unsigned lane)
{
    const unsigned ahead = -unsigned((unsigned long long)to) & 3, lead = ahead < bytes ? ahead : bytes;
    const unsigned words = (bytes - lead) / 4, whole = lead + 4 * words;
    const unsigned* from = (const unsigned*)memory + (place + lead) / 4 + lane;
    unsigned* target = (unsigned*)(to + lead) + lane;
#pragma unroll 4
    for (unsigned i = lane; i < words; i += 32, from += 32, target += 32)
        *target = __funnelshift_r(from[0], from[1], 8 * int(place + lead));
    // Bytes in front of the words, and behind them.
    const unsigned i = lane < lead ? lane : whole + lane - lead;
    if (i < bytes && lane < 8) to[i] = memory[place + i];
}

template <bool FIRST, class First, class Second>
struct Chosen {
    typedef Second Type;
};
template <class First, class Second>
struct Chosen<true, First, Second> {
    typedef First Type;
};

__device__ inline unsigned highest_bytes(const unsigned* four)
{
    return __byte_perm(__byte_perm(four[0], four[1], 0x73), __byte_perm(four[2], four[3], 0x73), 0x5410);
}

// Four neighbouring samples or their sums, of 16 bits each: the first and third one, and the others. A sum that passes
// below zero on its way borrows from the other one, and gives back.
struct Four {
    unsigned even, odd;

    Four() = default;
    __device__ Four(unsigned both) : even(both), odd(both) {}
    __device__ Four(unsigned even, unsigned odd) : even(even), odd(odd) {}
    __device__ Four operator-(Four other) const { return Four(even - other.even, odd - other.odd); }
    __device__ void operator+=(Four other) { even += other.even, odd += other.odd; }
};

// The frame as aligned words.
struct Words {
    const unsigned* first;
    const unsigned* end;
    unsigned ahead;  // bytes of the first word in front of the frame

    // Four samples from a place on. `place`: bits behind the first word.
    template <bool INSIDE>
    __device__ Four at(unsigned place) const
    {
        const unsigned* const word = (const unsigned*)((const char*)first + (place >> 3 & ~3u));
        // The word behind the last sample is not the frame's.
        const unsigned next = INSIDE || word + 1 < end ? word[1] : 0;
        const unsigned four = __funnelshift_r(word[0], next, int(place));
        return Four(__byte_perm(four, 0, 0x4240), __byte_perm(four, 0, 0x4341));
    }
};

// Sums of four columns for all rows of a tile: pairs of rows, a word for a column. words: from the columns' first line on.
// ALL_LINES: whether all rows that enter, and one more, are in the picture. apart: samples between views that meet.
template <bool ALL_LINES>
__device__ inline void sums_of_words(Words words, const Offset* entering, long long apart,
                                     unsigned* pairs, int row0, int rows, Offset pitch)
{
    Four above;
    run_of_sums<Four, TILE_ROWS>(
        row0, rows / STEP,
        [&](int i) {
            Four sum(0u);
            if constexpr (GROUPS == 1) {
                if (ALL_LINES || entering[i] != NO_LINE) sum = words.at<ALL_LINES>(unsigned(entering[i]));
                return sum;
            }
            int row = int(entering[i]);
            if (row == NO_ROW) return sum;
            unsigned place = 8 * (unsigned(row) * unsigned(pitch) + words.ahead);
#pragma unroll
            for (int view = 0; view < GROUPS; view++, row -= VIEWS_APART * (SHIFT - 1), place -= unsigned(8 * apart))
                if (ALL_LINES || (row >= 0 && row < rows)) sum += words.at<ALL_LINES>(place);
            return sum;
        },
        [](int) { return true; },
        [&](int r, Four sum) {
            if (r % 2 == 0) {
                above = sum;
                return;
            }
            uint4* const to = (uint4*)(pairs + r / 2 * HELD_COLUMNS * CHANNELS);
            to->x = __byte_perm(above.even, sum.even, 0x5410);
            to->y = __byte_perm(above.odd, sum.odd, 0x5410);
            to->z = __byte_perm(above.even, sum.even, 0x7632);
            to->w = __byte_perm(above.odd, sum.odd, 0x7632);
        });
}

constexpr int LENS_SAMPLES = M * CHANNELS;
constexpr int LENS_WORDS = (LENS_SAMPLES + 6) / 4;

// Weights of the luma for four samples of a lens from 4 `word` on; 0 outside of the lens.
__device__ constexpr unsigned luma_weights(int word)
{
    unsigned weights = 0;
    for (int i = 4 * word; i < 4 * word + 4; i++)
        if (i >= 0 && i < LENS_SAMPLES) weights |= (CHANNELS > 1 && i % CHANNELS == 1 ? 2u : 1u) << i % 4 * 8;
    return weights;
}

// Luma of some lines of a lens in the tile's picture; `samples` of a line are in the whole picture.
__device__ inline unsigned long long luma(const Pixel* from, int lines, int samples)
{
    // A whole lens lies in some words, at the same bytes in all lines.
    if constexpr (sizeof(Pixel) == 1 && UNROLLED && TILE_COLUMNS * CHANNELS % 4 == 0) {
        if (samples == LENS_SAMPLES) {
            const int ahead = int((unsigned long long)from & 3);
            unsigned weights[LENS_WORDS], sum = 0;
#pragma unroll
            for (int w = 0; w < LENS_WORDS; w++)
                weights[w] = __funnelshift_l(luma_weights(w - 1), luma_weights(w), 8 * ahead);
            const unsigned* line = (const unsigned*)(from - ahead);
            for (int r = 0; r < lines; r++, line += TILE_COLUMNS * CHANNELS / 4)
#pragma unroll
                for (int w = 0; w < LENS_WORDS; w++) sum = __dp4a(line[w], weights[w], sum);
            return sum;
        }
    }
    unsigned long long sum = 0;
    for (int r = 0; r < lines; r++, from += TILE_COLUMNS * CHANNELS) {
        unsigned of_line = 0;
        for (int i = 0; i < samples; i++) of_line += CHANNELS > 1 && i % CHANNELS == 1 ? 2 * from[i] : from[i];
        sum += of_line;
    }
    return sum;
}

// Makes tile `tile_column` of its line of tiles, of slice `number` of the stack; see stack.cu for the others.
__device__ __forceinline__ void tile(int number, int first_slice, int tile_column, unsigned char* memory, const Pixel* __restrict__ x,
                                     Pixel* __restrict__ out, const long long* __restrict__ reached_rows,
                                     const long long* __restrict__ reached_columns, unsigned long long* lens_sums,
                                     const unsigned char* __restrict__ sharpest, int rows, int columns, int row_start,
                                     int row_stop, int column_start, int column_stop)
{
    const int thread = threadIdx.x;
    const Offset pitch = Offset(columns) * CHANNELS;
    const int row0 = row_start + int(blockIdx.y) * TILE_ROWS;
    // Tiles begin at multiples of a segment, whatever the region is.
    const int column0 = (column_start / SEGMENT) * SEGMENT + tile_column * TILE_COLUMNS;
    const int row_outputs = rows / STEP, column_outputs = columns / STEP;
    if (NORMALISED) reached_rows += number * row_outputs, reached_columns += number * column_outputs;
    // Lenses of the tile in a line of lenses, and lines of lenses that it may cut.
    constexpr int LENSES = STEP == 1 ? TILE_COLUMNS / M : 0, LENS_ROWS = (TILE_ROWS + M - 2) / M + 1;
    const int lens_columns = (columns + M - 1) / M, first_lens = column0 / M;
    if (sharpest) {
        int here = 0;
        for (int part = thread; part < LENS_ROWS * LENSES; part += THREADS) {
            const int t = row0 / M + part / LENSES, s = first_lens + part % LENSES;
            if (t * M < rows && s < lens_columns) here |= sharpest[t * lens_columns + s] == first_slice + number;
        }
        if (!__syncthreads_or(here)) return;
    }
    // By step the line that enters the sums of columns; where several do, the row of the first one. Behind them sums of
    // columns, and the tile's picture.
    Offset* const entering = (Offset*)memory;
    // Columns of sums that the tile holds.
    int origin = STEP * column0 - LOW, end = STEP * (column0 + TILE_COLUMNS - 1) + HIGH + 1;
    if (!PADDED) {
        origin = origin > 0 ? origin : 0;
        end = end < columns ? end : columns;
    }
    if (PACKED) origin &= ~3;
    const int width = end > origin ? (end - origin) * CHANNELS : 0;
    ColumnSum* const sums = (ColumnSum*)(memory + ENTERING_BYTES);
    Words words;
    words.ahead = unsigned((unsigned long long)x & 3);
    words.first = (const unsigned*)((const unsigned char*)x - words.ahead);
    words.end = words.first + ((long long)rows * pitch + words.ahead + 3) / 4;
    Pixel* const picture = (Pixel*)(sums + TILE_ROWS * HELD_COLUMNS * CHANNELS);
    for (int i = thread; i < ROW_STEPS; i += THREADS) {
        const int place = first_place(row0) + STEP * i, view = FIRST_VIEW[rest_of(place)];
        const int row = view < 0 ? NO_ROW : place - view * (SHIFT - 1);
        entering[i] = GROUPS > 1                 ? row
                      : row < 0 || row >= rows ? NO_LINE
                      : PACKED                 ? 8 * (row * pitch + words.ahead)
                                               : row * pitch;
    }
    // Whether all rows that enter are in the picture: then nothing is asked below.
    const int first_row = first_place(row0) - (SHIFT > 1 ? (M - 1) * (SHIFT - 1) : 0);
    const int last_row = first_place(row0) + STEP * (ROW_STEPS - 1) + (SHIFT < 1 ? (M - 1) * (1 - SHIFT) : 0);
    const bool all_lines = first_row >= 0 && last_row < rows - PACKED;
    // Samples between the rows of views that meet.
    const long long apart = VIEWS_APART * (SHIFT - 1) * (long long)pitch;
    __syncthreads();

    if constexpr (PACKED)
        for (int more = thread; 4 * more < width; more += THREADS) {
            const int first_sample = origin * CHANNELS + 4 * more, here = columns * CHANNELS - first_sample;
            unsigned* const pairs = (unsigned*)sums + 4 * more;
            if (first_sample >= 0 && here > 0) {
                const Words below{words.first + first_sample / 4, words.end, words.ahead};
                if (all_lines)
                    sums_of_words<true>(below, entering, apart, pairs, row0, rows, pitch);
                else
                    sums_of_words<false>(below, entering, apart, pairs, row0, rows, pitch);
                if (here >= 4) continue;
            }
            for (int i = first_sample < 0 || here < 0 ? 0 : here; i < 4; i++)
                for (int r = 0; r < TILE_ROWS / 2; r++) pairs[r * HELD_COLUMNS * CHANNELS + i] = 0;
        }
    for (int sample = thread; !PACKED && sample < width; sample += THREADS) {
        const int first_sample = origin * CHANNELS + sample;
        ColumnSum* const column = sums + sample;
        if (first_sample < 0 || first_sample >= columns * CHANNELS) {
            for (int r = 0; r < TILE_ROWS; r++) column[r * HELD_COLUMNS * CHANNELS] = 0;
            continue;
        }
        const auto inside = [&](int k) {
            return k >= 0 && k < row_outputs && (!NORMALISED || reached_rows[k] == FULL);
        };
        const auto keep = [&](int r, RunningColumn sum) { column[r * HELD_COLUMNS * CHANNELS] = ColumnSum(sum); };
        if (GROUPS == 1 && all_lines)
            run_of_sums<RunningColumn, TILE_ROWS>(
                row0, row_outputs, [&](int i) { return RunningColumn(x[entering[i] + first_sample]); }, inside, keep);
        else
            run_of_sums<RunningColumn, TILE_ROWS>(
                row0, row_outputs,
                [&](int i) {
                    RunningColumn sum = 0;
                    if constexpr (GROUPS == 1) {
                        if (entering[i] != NO_LINE) sum = x[entering[i] + first_sample];
                        return sum;
                    }
                    int row = int(entering[i]);
                    if (row == NO_ROW) return sum;
                    if (all_lines) {
                        const Pixel* sample = x + (Offset(row) * pitch + first_sample);
#pragma unroll (UNROLLED ? GROUPS : 1)
                        for (int view = 0; view < GROUPS; view++, sample -= apart) sum += *sample;
                        return sum;
                    }
#pragma unroll (UNROLLED ? GROUPS : 1)
                    for (int view = 0; view < GROUPS; view++, row -= VIEWS_APART * (SHIFT - 1))
                        if (row >= 0 && row < rows) sum += x[Offset(row) * pitch + first_sample];
                    return sum;
                },
                inside, keep);
    }
    __syncthreads();

    constexpr int SEGMENTS = TILE_COLUMNS / SEGMENT;
    constexpr int SIDE_BY_SIDE = PACKED ? 2 : 1, TOGETHER = PAIRED ? 2 : 1;
    typedef Chosen<PAIRED, unsigned, LineSum>::Type Sum;
    typedef Chosen<PAIRED, unsigned, ColumnSum>::Type Held;
    for (int part = thread; part < TILE_ROWS / TOGETHER * SEGMENTS * CHANNELS; part += THREADS) {
        const int channel = part % CHANNELS, segment = part / CHANNELS % SEGMENTS;
        const int r = part / CHANNELS / SEGMENTS * TOGETHER, first = column0 + segment * SEGMENT, row = row0 + r;
        if (row >= row_stop || first >= column_stop) continue;
        // In constant places the compiler sees that first is a whole number of lenses.
        const int place0 = first_place(WHOLE_LENSES ? 0 : first);
        const int lens0 = (WHOLE_LENSES ? STEP * first : 0) - origin;
        constexpr int HELD_BESIDE = SIDE_BY_SIDE / TOGETHER;
        const Held* const line = (const Held*)(sums + r % SIDE_BY_SIDE) +
                                 (r / SIDE_BY_SIDE * HELD_COLUMNS * CHANNELS + channel) * HELD_BESIDE;
        Pixel* const target = picture + (r * TILE_COLUMNS + segment * SEGMENT) * CHANNELS + channel;
        const LineSum row_weight = NORMALISED ? LineSum(reached_rows[row]) * SCALE * SCALE : 1;
        unsigned upper[4], lower[4];
        run_of_sums<Sum, SEGMENT>(
            first, column_outputs,
            [&](int i) {
                Sum sum = 0;
                const int place = place0 + STEP * i, first_view = FIRST_VIEW[rest_of(place)];
                if (first_view < 0) return sum;
#pragma unroll (UNROLLED ? GROUPS : 1)
                for (int view = 0; view < GROUPS; view++) {
                    const int held = lens0 + place - (first_view + view * VIEWS_APART) * (SHIFT - 1);
                    if (PADDED || (held >= 0 && held < end - origin)) sum += line[held * CHANNELS * HELD_BESIDE];
                }
                return sum;
            },
            [&](int k) { return k >= 0 && k < column_outputs && (!NORMALISED || reached_columns[k] == FULL); },
            [&](int i, Sum sum) {
                if constexpr (PAIRED) {
                    // Exact: numbers have 16 bits, and what the inverse has too much is below its divisor, of 8 bits.
                    constexpr unsigned inverse = unsigned(((1 << 24) + WHOLE - 1) / WHOLE), half = WHOLE / 2 * inverse;
                    upper[i % 4] = (sum & 0xffff) * inverse + half;
                    lower[i % 4] = (sum >> 16) * inverse + half;
                    if constexpr (CHANNELS == 1) {
                        if (i % 4 < 3) return;
                        *(unsigned*)(target + i - 3) = highest_bytes(upper);
                        *(unsigned*)(target + TILE_COLUMNS + i - 3) = highest_bytes(lower);
                    } else {
                        target[i * CHANNELS] = upper[i % 4] >> 24;
                        target[(TILE_COLUMNS + i) * CHANNELS] = lower[i % 4] >> 24;
                    }
                } else {
                    const int k = first + i;
                    const LineSum weight = NORMALISED && k < column_outputs ? row_weight * LineSum(reached_columns[k]) : 1;
                    target[i * CHANNELS] = quotient(sum, weight);
                }
            });
    }
    __syncthreads();

    if (lens_sums || sharpest) {
        // Each lens, as far as it lies in the tile.
        for (int part = thread; part < LENS_ROWS * LENSES; part += THREADS) {
            const int t = row0 / M + part / LENSES, lens = part % LENSES, left = column0 + lens * M;
            const int top = t * M > row0 ? t * M - row0 : 0;
            const int bottom_lens = t * M + M - row0, bottom_here = rows - row0;
            int bottom = bottom_lens < TILE_ROWS ? bottom_lens : TILE_ROWS;
            if (bottom > bottom_here) bottom = bottom_here;
            const int right = left + M < columns ? M : columns - left;
            if (top >= bottom || right <= 0) continue;
            const int place = t * lens_columns + first_lens + lens;
            const Pixel* from = picture + (top * TILE_COLUMNS + lens * M) * CHANNELS;
            if (lens_sums) {
                const unsigned long long sum = luma(from, bottom - top, right * CHANNELS);
                atomicAdd(lens_sums + (long long)number * ((rows + M - 1) / M) * lens_columns + place, sum);
            } else if (sharpest[place] == first_slice + number) {
                Pixel* to = out + (Offset(row0 + top) * columns + left) * CHANNELS;
                for (int r = top; r < bottom; r++, from += TILE_COLUMNS * CHANNELS, to += columns * CHANNELS) {
                    if (right == M) {
#pragma unroll (UNROLLED ? LENS_SAMPLES : 1)
                        for (int i = 0; i < LENS_SAMPLES; i++) to[i] = from[i];
                    } else {
                        for (int i = 0; i < right * CHANNELS; i++) to[i] = from[i];
                    }
                }
            }
        }
        return;
    }

    // The tile's part of the region.
    const int left = column0 > column_start ? column0 : column_start;
    const int right = column0 + TILE_COLUMNS < column_stop ? column0 + TILE_COLUMNS : column_stop;
    const int samples = (right - left) * CHANNELS, width_out = column_stop - column_start;
    out += (long long)number * (row_stop - row_start) * width_out * CHANNELS;
    for (int r = thread / 32; r < TILE_ROWS && row0 + r < row_stop; r += THREADS / 32) {
        const Pixel* const from = picture + (r * TILE_COLUMNS + left - column0) * CHANNELS;
        Pixel* const to = out + ((long long)(row0 + r - row_start) * width_out + left - column_start) * CHANNELS;
        const unsigned place = unsigned((const unsigned char*)from - memory);
        copy_line(memory, place, (unsigned char*)to, samples * unsigned(sizeof(Pixel)), unsigned(thread) % 32);
    }
}
