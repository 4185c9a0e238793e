// What the pumps in C++ share; see pump_pkg.vhd.

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <vector>

#include "verilated.h"

// Clocks without a pixel on either side after which the core counts as hung, and clocks after the
// last pixel in which no other may come.
constexpr uint64_t idle_limit = 100000;
constexpr uint64_t silence = 64;
constexpr int reset_clocks = 4;

class Stalls {
   public:
    Stalls(uint32_t seed, uint32_t percent) : state(seed % 65536), percent(percent) {}

    bool draw() {
        state = (state * 25173 + 13849) % 65536;
        return state / 64 * 100 < percent * 1024;
    }

   private:
    uint32_t state;
    uint32_t percent;
};

// The words of a file; ends the program if they are not so many.
inline std::vector<int32_t> read_words(const char* path, uint64_t count) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
    std::vector<int32_t> words(bytes.size() / 4);
    std::copy(bytes.begin(), bytes.begin() + words.size() * 4, reinterpret_cast<char*>(words.data()));
    if (words.size() != count) {
        std::fprintf(stderr, "pump: %s has %zu words\n", path, words.size());
        std::exit(1);
    }
    return words;
}

// Bits of a port, which is an integer or, of more than 64 bits, an array of words.
inline uint64_t field(uint64_t port, uint64_t low, uint64_t bits) {
    return port >> low & ((uint64_t{1} << bits) - 1);
}

template <std::size_t Words>
uint64_t field(const VlWide<Words>& port, uint64_t low, uint64_t bits) {
    const uint64_t word = low / 32;
    const uint64_t next = word + 1 < Words ? port[word + 1] : 0;
    return field(next << 32 | port[word], low % 32, bits);
}

// Fields of a port, one after another from the low bits on, as words of a file.
template <class Port>
void write_fields(std::ofstream& file, const Port& port, uint64_t count, uint64_t bits) {
    for (uint64_t i = 0; i < count; i++) {
        const int32_t word = field(port, i * bits, bits);
        file.write(reinterpret_cast<const char*>(&word), sizeof word);
    }
}

// Registers take what is there before the edge; inputs change between an edge and `settle`.
template <class Core>
void tick(Core& core) {
    core.clk = 1;
    core.eval();
}

template <class Core>
void settle(Core& core) {
    core.clk = 0;
    core.eval();
}

template <class Core>
void restart(Core& core) {
    core.s_axis_tvalid = 0;
    core.m_axis_tready = 0;
    core.reset = 1;
    settle(core);
    for (int i = 0; i < reset_clocks; i++) {
        tick(core);
        settle(core);
    }
    core.reset = 0;
    settle(core);
}

// Offers pixel after pixel to a core, and counts those that it takes.
class Source {
   public:
    Source(uint64_t channels, uint64_t bits, uint64_t columns, uint64_t rows, uint64_t frames)
        : channels(channels),
          bits(bits),
          columns(columns),
          frame(columns * rows),
          pixels(frame * frames),
          words(read_words("input.bin", pixels * channels)) {}

    // After an edge: whether the core took a pixel with it.
    template <class Core>
    void take(Core& core, bool taken, uint64_t clock) {
        if (!taken) return;
        if (accepted == 0) first = clock;
        accepted++;
        last = clock;
        core.s_axis_tvalid = 0;
    }

    template <class Core>
    void offer(Core& core, bool stall) {
        if (stall || offered != accepted || offered == pixels) return;
        uint64_t data = 0;
        for (uint64_t c = 0; c < channels; c++)
            data |= field(words[offered * channels + c], 0, bits) << (c * bits);
        core.s_axis_tdata = data;
        core.s_axis_tvalid = 1;
        core.s_axis_tlast = offered % columns == columns - 1;
        core.s_axis_tuser = offered % frame == 0;
        offered++;
    }

    const uint64_t channels, bits, columns, frame, pixels;
    uint64_t accepted = 0, first = 0, last = 0;

   private:
    const std::vector<int32_t> words;
    uint64_t offered = 0;
};
