// SPDX-License-Identifier: Apache-2.0
//
// The refocusing operator (plenofir.refocus.operator) for a GPU, exact: a tile of one slice.
//
// A block makes a tile of the picture in three steps with barriers between:
//
// 1. A thread runs down a column of samples and keeps moving sums; they go to shared memory.
// 2. A thread runs along a segment of a line of these sums and divides; quotients go to shared memory.
// 3. Threads copy the tile to the picture, neighbours side by side. For the depth index of a stack they add the pixels of
//    each lens instead.
//
// For the picture in focus step 2 makes only lines of lenses that are sharpest in this slice, straight to the picture.
//
// Words of 32 bits hold several samples or sums, as far as these are short: step 1 takes four samples a thread (PACKED)
// and puts its sums for two rows side by side, which step 2 takes together (PAIRED). Sharpened sums have a word each.
//
// This text stands once for each slice of a stack, in a namespace of its own, behind sums.cu and words.cu; stack.cu has
// the kernel. Both runs are `run_of_sums`: a moving sum over the re-ordered line, one more for each order of interpolation, and taps
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
//   PACKED                            samples of 8 bits whose sums of a column have 16 bits, 14 where they are sharpened;
//                                     TILE_ROWS is even
//   PAIRED                            with PACKED: sums of both dimensions, with half of their divisor, have 16 bits
//   Pixel, Offset                     types of samples, and of places in a picture
//   RunningColumn, ColumnSum, LineSum types of sums of a column, as they run and as they are kept, and of both dimensions

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
    // Lenses of the tile in a line of lenses, and lines of lenses that it may cut where it belongs to a whole picture.
    constexpr int LENSES = STEP == 1 ? TILE_COLUMNS / M : 0;
    constexpr int LENS_ROWS = TILE_ROWS % M == 0 ? TILE_ROWS / M : (TILE_ROWS + M - 2) / M + 1;
    const int lens_columns = (columns + M - 1) / M, first_lens = column0 / M;
    // Behind the sums the tile's picture, or in its place numbers of the lenses that come from this slice.
    ColumnSum* const sums = (ColumnSum*)(memory + ENTERING_BYTES);
    Pixel* const picture = (Pixel*)(sums + TILE_ROWS * HELD_COLUMNS * CHANNELS);
    int* const chosen = (int*)picture + 1;
    int& chosen_lenses = chosen[-1];
    if (sharpest) {
        const auto is_chosen = [&](int part) {
            const int t = row0 / M + part / LENSES, s = first_lens + part % LENSES;
            return t * M < rows && s < lens_columns && sharpest[t * lens_columns + s] == first_slice + number;
        };
        bool here = false;
        for (int part = thread; part < LENS_ROWS * LENSES; part += THREADS) here |= is_chosen(part);
        if (thread == 0) chosen_lenses = 0;
        if (!__syncthreads_or(here)) return;
        for (int part = thread; here && part < LENS_ROWS * LENSES; part += THREADS)
            if (is_chosen(part)) chosen[atomicAdd(&chosen_lenses, 1)] = part;
    }
    // By step the line that enters the sums of columns, with PACKED as Words has its place; where several do, the row of
    // the first one.
    Offset* const entering = (Offset*)memory;
    // Columns of sums that the tile holds.
    int origin = STEP * column0 - LOW, end = STEP * (column0 + TILE_COLUMNS - 1) + HIGH + 1;
    if (!PADDED) {
        origin = origin > 0 ? origin : 0;
        end = end < columns ? end : columns;
    }
    if (PACKED) origin &= ~3;
    const int width = end > origin ? (end - origin) * CHANNELS : 0;
    Words words;
    words.ahead = unsigned((unsigned long long)x & 3);
    words.first = (const unsigned*)((const unsigned char*)x - words.ahead);
    words.end = words.first + ((long long)rows * pitch + words.ahead + 3) / 4;
    for (int i = thread; i < ROW_STEPS; i += THREADS) {
        const int place = first_place(row0) + STEP * i, view = FIRST_VIEW[rest_of(place)];
        const int row = view < 0 ? NO_ROW : place - view * (SHIFT - 1);
        const bool here = row >= 0 && row < rows;
        if (PACKED && GROUPS == 1)
            ((uint2*)entering)[i] = here ? words.place(unsigned(row) * unsigned(pitch)) : uint2{0, NO_BITS};
        else
            entering[i] = GROUPS > 1 ? row : here ? row * pitch : NO_LINE;
    }
    // Whether all rows that enter are in the picture, and the run is inner: then nothing is asked below.
    const int first_row = first_place(row0) - (SHIFT > 1 ? (M - 1) * (SHIFT - 1) : 0);
    const int last_row = first_place(row0) + STEP * (ROW_STEPS - 1) + (SHIFT < 1 ? (M - 1) * (1 - SHIFT) : 0);
    const bool all_lines = first_row >= 0 && last_row < rows - PACKED &&
                           (ORDER + SIDE == 0 || inner(row0, TILE_ROWS, row_outputs));
    // Samples between the rows of views that meet.
    const long long apart = VIEWS_APART * (SHIFT - 1) * (long long)pitch;
    const auto inside_rows = [&](int k) {
        return k >= 0 && k < row_outputs && (!NORMALISED || reached_rows[k] == FULL);
    };
    __syncthreads();

    if constexpr (PACKED) {
        const auto sum_columns = [&](auto of_inner_lines) {
            constexpr bool ALL_LINES = decltype(of_inner_lines)::value;
            for (int more = thread; 4 * more < width; more += THREADS) {
                const int first_sample = origin * CHANNELS + 4 * more, here = columns * CHANNELS - first_sample;
                unsigned* const four = (unsigned*)sums + 4 * more;
                if (first_sample >= 0 && here > 0) {
                    const Words below{words.first + first_sample / 4, words.end, words.ahead};
                    sums_of_words<ALL_LINES>(below, entering, apart, four, row0, rows, pitch, inside_rows);
                    if (here >= 4) continue;
                }
                for (int i = first_sample < 0 || here < 0 ? 0 : here; i < 4; i++)
                    for (int r = 0; r < TILE_ROWS / ROWS_A_WORD; r++) four[r * HELD_COLUMNS * CHANNELS + i] = 0;
            }
        };
        if (all_lines)
            sum_columns(Constant<true>());
        else
            sum_columns(Constant<false>());
    }
    for (int sample = thread; !PACKED && sample < width; sample += THREADS) {
        const int first_sample = origin * CHANNELS + sample;
        ColumnSum* const column = sums + sample;
        if (first_sample < 0 || first_sample >= columns * CHANNELS) {
            for (int r = 0; r < TILE_ROWS; r++) column[r * HELD_COLUMNS * CHANNELS] = 0;
            continue;
        }
        const auto keep = [&](int r, RunningColumn sum) { column[r * HELD_COLUMNS * CHANNELS] = ColumnSum(sum); };
        if (GROUPS == 1 && all_lines)
            run_of_sums<RunningColumn, TILE_ROWS, true>(
                row0, row_outputs, [&](int i) { return RunningColumn(x[entering[i] + first_sample]); }, inside_rows,
                keep);
        else
            run_of_sums<RunningColumn, TILE_ROWS, false>(
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
                inside_rows, keep);
    }
    __syncthreads();

    // Sums for some neighbouring outputs of a line, or of two, from a whole lens on.
    constexpr int TOGETHER = PAIRED ? 2 : 1;
    typedef Chosen<PAIRED, unsigned, LineSum>::Type Sum;
    typedef Chosen<PAIRED, unsigned, ColumnSum>::Type Held;
    const auto sum_line = [&](auto outputs, int r, int first, int channel, auto store) {
        constexpr int OUTPUTS = decltype(outputs)::value;
        // In constant places the compiler sees that first is a whole number of lenses.
        const int place0 = first_place(WHOLE_LENSES ? 0 : first);
        const int lens0 = (WHOLE_LENSES ? STEP * first : 0) - origin;
        constexpr int HELD_BESIDE = ROWS_A_WORD / TOGETHER;
        const Held* const line = (const Held*)(sums + r % ROWS_A_WORD) +
                                 ((r / ROWS_A_WORD * HELD_COLUMNS + lens0) * CHANNELS + channel) * HELD_BESIDE;
        const auto entering_column = [&](int i) {
            Sum sum = 0;
            const int place = place0 + STEP * i, first_view = FIRST_VIEW[rest_of(place)];
            if (first_view < 0) return sum;
#pragma unroll (UNROLLED ? GROUPS : 1)
            for (int view = 0; view < GROUPS; view++) {
                const int column = place - (first_view + view * VIEWS_APART) * (SHIFT - 1), held = lens0 + column;
                if (PADDED || (held >= 0 && held < end - origin)) sum += line[column * CHANNELS * HELD_BESIDE];
            }
            return sum;
        };
        const auto inside_columns = [&](int k) {
            return k >= 0 && k < column_outputs && (!NORMALISED || reached_columns[k] == FULL);
        };
        constexpr Sum start = PAIRED ? 0 : START;
        if (ORDER + SIDE == 0 || inner(first, OUTPUTS, column_outputs))
            run_of_sums<Sum, OUTPUTS, true>(first, column_outputs, entering_column, inside_columns, store, start);
        else
            run_of_sums<Sum, OUTPUTS, false>(first, column_outputs, entering_column, inside_columns, store, start);
    };
    // Quotients of a pair of sums, in the highest bytes. Exact: numbers have 16 bits, and what the inverse has too much is
    // below its divisor, of 8 bits.
    constexpr unsigned PAIR_INVERSE = PAIRED ? unsigned(((1 << 24) + WHOLE - 1) / WHOLE) : 0;
    constexpr unsigned PAIR_HALF = PAIRED ? unsigned(WHOLE / 2) * PAIR_INVERSE : 0;
    const auto upper_of = [](unsigned sum) { return (sum & 0xffff) * PAIR_INVERSE + PAIR_HALF; };
    const auto lower_of = [](unsigned sum) { return (sum >> 16) * PAIR_INVERSE + PAIR_HALF; };
    const auto pixel_of = [&](LineSum sum, int row, int k) {
        LineSum weight = 1;
        if (NORMALISED && k < column_outputs)
            weight = LineSum(reached_rows[row]) * SCALE * SCALE * LineSum(reached_columns[k]);
        return quotient(sum, weight);
    };

    if (sharpest) {
        // A thread makes a line of a lens, or two.
        constexpr int LENS_LINES = PAIRED ? M / 2 + 1 : M;
        constexpr int LINES = TILE_ROWS / TOGETHER < LENS_LINES ? TILE_ROWS / TOGETHER : LENS_LINES;
        const int parts = chosen_lenses * LINES * CHANNELS;
        for (int part = thread; part < parts; part += THREADS) {
            const int channel = part % CHANNELS, lens = chosen[part / CHANNELS / LINES];
            const int top = (row0 / M + lens / LENSES) * M - row0, left = column0 + lens % LENSES * M;
            const int r = (top > 0 ? top / TOGETHER * TOGETHER : 0) + part / CHANNELS % LINES * TOGETHER;
            const int bottom = top + M < rows - row0 ? top + M : rows - row0;
            if (r >= TILE_ROWS || r >= bottom) continue;
            const int right = left + M < columns ? M : columns - left;
            Pixel* const to = out + (Offset(row0 + r) * columns + left) * CHANNELS + channel;
            const bool has_upper = r >= top, has_lower = r + 1 < bottom;
            sum_line(Number<M>(), r, left, channel, [&](int i, Sum sum) {
                if (i >= right) return;
                if constexpr (PAIRED) {
                    if (has_upper) to[i * CHANNELS] = upper_of(sum) >> 24;
                    if (has_lower) to[pitch + i * CHANNELS] = lower_of(sum) >> 24;
                } else {
                    to[i * CHANNELS] = pixel_of(sum, row0 + r, left + i);
                }
            });
        }
        return;
    }

    constexpr int SEGMENTS = TILE_COLUMNS / SEGMENT;
    for (int part = thread; part < TILE_ROWS / TOGETHER * SEGMENTS * CHANNELS; part += THREADS) {
        // Neighbours take the same segment, so that few warps have a border and places inside.
        constexpr int LINES = TILE_ROWS / TOGETHER;
        const int channel = part % CHANNELS, segment = part / CHANNELS / LINES;
        const int r = part / CHANNELS % LINES * TOGETHER, first = column0 + segment * SEGMENT, row = row0 + r;
        if (row >= row_stop || first >= column_stop) continue;
        Pixel* const target = picture + (r * TILE_COLUMNS + segment * SEGMENT) * CHANNELS + channel;
        unsigned upper[4], lower[4];
        sum_line(Number<SEGMENT>(), r, first, channel, [&](int i, Sum sum) {
            if constexpr (PAIRED) {
                upper[i % 4] = upper_of(sum);
                lower[i % 4] = lower_of(sum);
                if constexpr (CHANNELS == 1) {
                    if (i % 4 < 3) return;
                    *(unsigned*)(target + i - 3) = highest_bytes(upper);
                    *(unsigned*)(target + TILE_COLUMNS + i - 3) = highest_bytes(lower);
                } else {
                    target[i * CHANNELS] = upper[i % 4] >> 24;
                    target[(TILE_COLUMNS + i) * CHANNELS] = lower[i % 4] >> 24;
                }
            } else {
                target[i * CHANNELS] = pixel_of(sum, row, first + i);
            }
        });
    }
    __syncthreads();

    if (lens_sums) {
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
            const unsigned long long sum = luma(from, bottom - top, right * CHANNELS);
            atomicAdd(lens_sums + (long long)number * ((rows + M - 1) / M) * lens_columns + place, sum);
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
