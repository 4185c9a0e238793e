// SPDX-License-Identifier: Apache-2.0
//
// Moving sums along a line, their sharpening, and what divides them: the first part of a slice's text, behind its
// constants, which refocus.cu explains.

constexpr int LENS = SIDE ? M : 0;
constexpr int RING = BOX / STEP;
constexpr int WARM_STEPS = (ORDER + 1) * (RING - 1);
constexpr int ROW_STEPS = TILE_ROWS + 2 * LENS + WARM_STEPS;
// Places beyond a run's outputs that its stages and its taps see.
constexpr int BESIDE = WARM_STEPS + LENS + ORDER * (UNIT_OFFSET < 0 ? -UNIT_OFFSET : UNIT_OFFSET);
constexpr int NO_ROW = -2147483647 - 1;

__device__ constexpr int bits_of(LineSum number) { return number > 0 ? 1 + bits_of(number / 2) : 0; }

// Rows whose sums lie side by side.
constexpr int ROWS_A_WORD = PACKED && !SIDE ? 2 : 1;
constexpr Offset NO_LINE = Offset(-1);
constexpr unsigned NO_BITS = 32;
constexpr int ENTERING_BYTES = (ROW_STEPS * int(PACKED ? sizeof(uint2) : sizeof(Offset)) + 15) / 16 * 16;

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

// Whether a run sees nothing outside of its line, so that it needs no tests. Weights of borders may reach further in.
__device__ inline bool inner(int first, int outputs, int length)
{
    return !(NORMALISED && SIDE) && first >= BESIDE && first + outputs + BESIDE <= length;
}

// The sharpened sum, from one and from the two that are a lens away.
template <class Sum>
__device__ inline Sum sharpened(Sum middle, Sum beside)
{
    return CENTRE * middle - SIDE * beside;
}

// Sums for OUTPUTS neighbouring outputs from `first` on, of a line of `length` outputs.
// entering(i) is the sum of the pixels at the i-th place; inside(k) says whether all views reach output k, unless the run
// is INNER; store(i, sum) takes the i-th result, which has `start` more for each of its weights.
template <class Sum, int OUTPUTS, bool INNER, class Entering, class Inside, class Store>
__device__ inline void run_of_sums(int first, int length, Entering entering, Inside inside, Store store, Sum start = 0u)
{
    constexpr int STEPS = OUTPUTS + 2 * LENS + WARM_STEPS;
    Sum ring[ORDER + 1][RING], total[ORDER + 1], waiting[SIDE ? 2 * LENS : 1];
#pragma unroll
    for (int stage = 0; stage <= ORDER; stage++) {
        total[stage] = stage == ORDER ? start : Sum(0u);
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
            if (!INNER && stage > 0) {
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
                Sum beside = waiting[made % (2 * LENS)];
                if constexpr (INNER) {
                    beside += value;
                } else {
                    const bool here = inside(k);
                    if (!here || !inside(k - LENS)) beside = middle;
                    beside += here && inside(k + LENS) ? value : middle;
                }
                store(made - 2 * LENS, sharpened(middle, beside));
            }
            waiting[made % (2 * LENS)] = value;
        }
    }
}

// The weight of a pixel that all views reach, and the power of two that is not below it.
constexpr LineSum WHOLE = LineSum(FULL) * FULL * SCALE * SCALE;
constexpr int WHOLE_BITS = bits_of(WHOLE - 1);

__device__ inline bool weight_is_whole(LineSum weight) { return !NORMALISED || weight == WHOLE; }

__device__ inline int limited(int number, int most) { return __vimin_s32_relu(number, most); }
__device__ inline long long limited(long long number, long long most)
{
    return number < 0 ? 0 : number > most ? most : number;
}

// What sums of a line begin with, so that they have half of their divisor; those with a weight of their own get it later.
constexpr LineSum START = NORMALISED ? 0 : WHOLE / 2 / SCALE;

// A sum from START on over its weight, rounded, halves up, and limited to 0 .. WHITE.
__device__ inline Pixel quotient(LineSum sum, LineSum weight)
{
    if (NORMALISED && weight == 0) return 0;
    const bool whole = weight_is_whole(weight);
    const LineSum divisor = whole ? WHOLE : weight, half = divisor / 2;
    if (NORMALISED) sum += half;
    // Only sharpened sums exceed what pixels have.
    if (SIDE) sum = limited(sum, WHITE * divisor + half);
    LineSum result;
    if (!whole || sizeof(LineSum) == 8 || WHOLE == 1) {
        result = sum / divisor;
    } else {
        // Exact for numbers of 31 bits (Granlund and Montgomery, 1994): the compiler, which does not know that there is
        // no sign, takes two instructions more.
        // Compilers check this branch for wide sums too, where a shift by 64 bits would be an error.
        constexpr int bits = sizeof(LineSum) == 8 ? 0 : WHOLE_BITS;
        constexpr unsigned inverse = ((1ull << (31 + bits)) + WHOLE - 1) / WHOLE;
        result = unsigned(unsigned(sum) * (unsigned long long)inverse >> 32) >> (WHOLE_BITS - 1);
    }
    return Pixel(result);
}
