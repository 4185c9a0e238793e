// SPDX-License-Identifier: Apache-2.0
//
// Sums of four columns at once, from words of the frame: the second part of a slice's text, with PACKED.

template <bool VALUE>
struct Constant {
    static constexpr bool value = VALUE;
};

template <int VALUE>
struct Number {
    static constexpr int value = VALUE;
};

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

    // The word with the first of some samples, as bytes behind the first word, and their bits behind that.
    __device__ uint2 place(unsigned sample) const
    {
        const unsigned bytes = sample + ahead;
        return {bytes & ~3u, 8 * (bytes & 3)};
    }

    // Four samples from a place on.
    template <bool INSIDE>
    __device__ Four at(uint2 place) const
    {
        const unsigned* const word = (const unsigned*)((const char*)first + place.x);
        // The word behind the last sample is not the frame's.
        const unsigned next = INSIDE || word + 1 < end ? word[1] : 0;
        const unsigned four = __funnelshift_r(word[0], next, int(place.y));
        return Four(__byte_perm(four, 0, 0x4240), __byte_perm(four, 0, 0x4341));
    }
};

// Four sharpened sums, of 32 bits each, in the order of their columns.
__device__ inline uint4 sharpened(Four middle, Four beside)
{
    // Each number beside its neighbours', for a product of both with their weights.
    constexpr int weights = (-SIDE & 0xff) << 8 | CENTRE;
    return {unsigned(__dp2a_lo(int(__byte_perm(middle.even, beside.even, 0x5410)), weights, 0)),
            unsigned(__dp2a_lo(int(__byte_perm(middle.odd, beside.odd, 0x5410)), weights, 0)),
            unsigned(__dp2a_lo(int(__byte_perm(middle.even, beside.even, 0x7632)), weights, 0)),
            unsigned(__dp2a_lo(int(__byte_perm(middle.odd, beside.odd, 0x7632)), weights, 0))};
}

// Sums of four columns for all rows of a tile, a word for a column: of pairs of rows, or sharpened. words: from the
// columns' first line on. ALL_LINES: whether all rows that enter, and one more, are in the picture, and the run is inner.
// apart: samples between views that meet.
template <bool ALL_LINES, class Inside>
__device__ inline void sums_of_words(Words words, const Offset* entering, long long apart,
                                     unsigned* sums, int row0, int rows, Offset pitch, Inside inside)
{
    Four above;
    run_of_sums<Four, TILE_ROWS, ALL_LINES>(
        row0, rows / STEP,
        [&](int i) {
            Four sum(0u);
            if constexpr (GROUPS == 1) {
                const uint2 place = ((const uint2*)entering)[i];
                if (ALL_LINES || place.y != NO_BITS) sum = words.at<ALL_LINES>(place);
                return sum;
            }
            int row = int(entering[i]);
            if (row == NO_ROW) return sum;
            unsigned sample = unsigned(row) * unsigned(pitch);
#pragma unroll
            for (int view = 0; view < GROUPS; view++, row -= VIEWS_APART * (SHIFT - 1), sample -= unsigned(apart))
                if (ALL_LINES || (row >= 0 && row < rows)) sum += words.at<ALL_LINES>(words.place(sample));
            return sum;
        },
        inside,
        [&](int r, auto sum) {
            uint4* const to = (uint4*)(sums + r / ROWS_A_WORD * HELD_COLUMNS * CHANNELS);
            if constexpr (SIDE != 0) {
                *to = sum;
            } else {
                if (r % 2 == 0) {
                    above = sum;
                    return;
                }
                to->x = __byte_perm(above.even, sum.even, 0x5410);
                to->y = __byte_perm(above.odd, sum.odd, 0x5410);
                to->z = __byte_perm(above.even, sum.even, 0x7632);
                to->w = __byte_perm(above.odd, sum.odd, 0x7632);
            }
        });
}
