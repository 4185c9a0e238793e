// SPDX-License-Identifier: Apache-2.0
// Moves whole frames from a file through a core of any engine into files, clock by clock as
// file_bench.vhd does: the same files, the same stalls, the same counts.
//
// Arguments: MICRO_IMAGE_SIZE SLICES CHANNELS PIXELS_PER_CLOCK PIXEL_BITS COLUMNS ROWS FRAMES
// SWEEP_FRAMES STALL_PERCENT SEED; SLICES is 0 where the engine is not a stack.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <vector>

#include "Vbench_core.h"
#include "verilated.h"
#if VM_COVERAGE
#include "verilated_cov.h"
#endif

// Clocks without a pixel on either side after which the core counts as hung, and clocks after the
// last pixel in which no other may come.
constexpr uint64_t idle_limit = 100000;
constexpr uint64_t silence = 64;
constexpr int reset_clocks = 4;

class Stalls {
   public:
    Stalls(uint32_t seed, uint32_t percent) : state(seed % 65536), percent(percent) {}

    // The share is that of stall_share in bench_pkg.vhd.
    bool draw(uint64_t clock, bool of_sink) {
        state = (state * 25173 + 13849) % 65536;
        const uint32_t share = (clock / 256 % 2 == 0) == of_sink ? percent : percent / 3;
        return state / 64 * 100 < share * 1024;
    }

   private:
    uint32_t state;
    uint32_t percent;
};

// The words of a file; ends the program if they are not so many.
std::vector<int32_t> read_words(const char* path, uint64_t count) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
    std::vector<int32_t> words(bytes.size() / 4);
    std::copy(bytes.begin(), bytes.begin() + words.size() * 4, reinterpret_cast<char*>(words.data()));
    if (words.size() != count) {
        std::fprintf(stderr, "file_bench: %s has %zu words\n", path, words.size());
        std::exit(1);
    }
    return words;
}

// Bits of a port, which is an integer or, of more than 64 bits, an array of words.
uint64_t field(uint64_t port, uint64_t low, uint64_t bits) {
    return port >> low & ((uint64_t{1} << bits) - 1);
}

template <std::size_t Words>
uint64_t field(const VlWide<Words>& port, uint64_t low, uint64_t bits) {
    const uint64_t word = low / 32;
    const uint64_t next = word + 1 < Words ? port[word + 1] : 0;
    return field(next << 32 | port[word], low % 32, bits);
}

// Sets a field of a port whose bits there are 0.
template <class Port>
void set_field(Port& port, uint64_t low, uint64_t value) {
    port |= Port(value) << low;
}

template <std::size_t Words>
void set_field(VlWide<Words>& port, uint64_t low, uint64_t value) {
    const uint64_t shifted = value << low % 32;
    port[low / 32] |= uint32_t(shifted);
    if (shifted >> 32) port[low / 32 + 1] |= uint32_t(shifted >> 32);
}

template <class Port>
void clear(Port& port) {
    port = 0;
}

template <std::size_t Words>
void clear(VlWide<Words>& port) {
    for (std::size_t i = 0; i < Words; i++) port[i] = 0;
}

// Fields of a port, one after another from the low bits on, as words of a file.
template <class Port>
void write_fields(std::ofstream& file, const Port& port, uint64_t count, uint64_t bits) {
    for (uint64_t i = 0; i < count; i++) {
        const int32_t word = field(port, i * bits, bits);
        file.write(reinterpret_cast<const char*>(&word), sizeof word);
    }
}

int main(int argc, char** argv) {
    if (argc != 12) {
        std::fprintf(stderr, "file_bench: expected 11 arguments\n");
        return 1;
    }
    const auto argument = [&](int place) { return std::strtoull(argv[place], nullptr, 10); };
    const uint64_t slices = argument(2), channels = argument(3), together = argument(4);
    const uint64_t pixel_bits = argument(5), columns = argument(6), rows = argument(7);
    // Of a token, one pixel or several; and tokens.
    const uint64_t values = together * channels;
    const uint64_t line = (columns + together - 1) / together, frame = line * rows;
    const uint64_t tokens = frame * argument(8);
    const bool stack = slices > 0;
    // Lines wait in a stack.
    const uint64_t patience = idle_limit + (stack ? 100 * argument(1) * columns : 0);
    Stalls stalls(argument(11), argument(10));
    const std::vector<int32_t> words = read_words("input.bin", tokens * values);
    std::ofstream output(stack ? "found.bin" : "output.bin", std::ios::binary);
    std::ofstream slices_file;
    if (stack) slices_file.open("slices.bin", std::ios::binary);
    std::ofstream counts("clocks.txt");

    VerilatedContext context;
    Vbench_core core{&context};
    // Registers take what is there before the edge; inputs change between an edge and `settle`.
    const auto tick = [&] { core.clk = 1, core.eval(); };
    const auto settle = [&] { core.clk = 0, core.eval(); };
    core.columns = columns;
    core.rows = rows;
    core.sweep_frames = argument(9);
    core.s_axis_tvalid = 0;
    core.m_axis_tready = 0;
    core.reset = 1;
    settle();
    for (int i = 0; i < reset_clocks; i++) {
        tick();
        settle();
    }
    core.reset = 0;
    settle();

    uint64_t clock = 0, idle = 0, offered = 0, accepted = 0, stacked = 0, received = 0;
    uint64_t first_in = 0, last_in = 0, first_out = 0, last_out = 0;
    uint64_t framing_errors = 0, frame_slice = 0;
    const auto misframed = [&](uint64_t number, bool user, bool last) {
        return last != (number % line == line - 1) || user != (number % frame == 0);
    };
    while (!(received >= tokens && idle >= silence) && idle < patience) {
        clock++;
        idle++;
        const bool taken = core.s_axis_tvalid && core.s_axis_tready;
        if (core.slices_tvalid && core.slices_tready) {
            write_fields(slices_file, core.slices_tdata, slices * values, pixel_bits);
            framing_errors += misframed(stacked, core.slices_tuser, core.slices_tlast);
            stacked++;
            idle = 0;
        }
        if (core.m_axis_tvalid && core.m_axis_tready) {
            if (received == 0) first_out = clock;
            write_fields(output, core.m_axis_tdata, values, pixel_bits);
            if (stack) {
                write_fields(output, core.m_axis_index, together, 8);
                write_fields(output, core.m_axis_depth, together, 16);
            } else if (received % frame == 0) {
                frame_slice = core.m_axis_tid;
                counts << "slice " << frame_slice << '\n';
            }
            framing_errors += misframed(received, core.m_axis_tuser, core.m_axis_tlast) ||
                              (!stack && core.m_axis_tid != frame_slice);
            received++;
            last_out = clock;
            idle = 0;
        }
        tick();
        if (taken) {
            if (accepted == 0) first_in = clock;
            accepted++;
            last_in = clock;
            idle = 0;
            core.s_axis_tvalid = 0;
        }
        if (!stalls.draw(clock, false) && offered == accepted && offered < tokens) {
            clear(core.s_axis_tdata);
            for (uint64_t c = 0; c < values; c++)
                set_field(core.s_axis_tdata, c * pixel_bits,
                          field(words[offered * values + c], 0, pixel_bits));
            core.s_axis_tvalid = 1;
            core.s_axis_tlast = offered % line == line - 1;
            core.s_axis_tuser = offered % frame == 0;
            offered++;
        }
        core.m_axis_tready = !stalls.draw(clock, true);
        settle();
    }
    counts << "accepted " << accepted;
    if (stack) counts << "\nstacked " << stacked;
    counts << "\nreceived " << received << "\nclocks " << last_out - first_in + 1;
    if (!stack) counts << "\nlatency " << first_out - first_in;
    counts << "\ninput_clocks " << last_in - first_in + 1 << "\nframing_errors " << framing_errors
           << "\nerror_flags " << int(core.error_flags) << '\n';
    core.final();
#if VM_COVERAGE
    context.coveragep()->write("toggles.dat");
#endif
    return 0;
}
