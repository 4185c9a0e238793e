// SPDX-License-Identifier: Apache-2.0
// Moves raw frames from a file through sensor_raster into a file, clock by clock as sensor_bench.vhd
// does: the same files, the same stalls, the same counts.
//
// Arguments: IN_CHANNELS CHANNELS PIXEL_BITS RED_PLACE LOADS COLUMNS ROWS FRAMES OUT_COLUMNS OUT_ROWS
// STALL_PERCENT SEED.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <vector>

#include "Vsensor_raster.h"
#include "verilated.h"

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
std::vector<uint32_t> read_words(const char* path, uint64_t count) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
    std::vector<uint32_t> words(bytes.size() / 4);
    for (uint64_t i = 0; i < 4 * words.size(); i++)
        words[i / 4] |= uint32_t(uint8_t(bytes[i])) << (8 * (i % 4));
    if (words.size() != count) {
        std::fprintf(stderr, "sensor_bench: %s has %zu words\n", path, words.size());
        std::exit(1);
    }
    return words;
}

int main(int argc, char** argv) {
    if (argc != 13) {
        std::fprintf(stderr, "sensor_bench: expected 12 arguments\n");
        return 1;
    }
    const auto argument = [&](int place) { return std::strtoull(argv[place], nullptr, 10); };
    const uint64_t in_channels = argument(1), channels = argument(2), bits = argument(3);
    const uint64_t loads = argument(5), columns = argument(6), frame = columns * argument(7);
    const uint64_t pixels = frame * argument(8);
    const uint64_t out_columns = argument(9), out_frame = out_columns * argument(10);
    const uint64_t out_pixels = out_frame * argument(8);
    Stalls stalls(argument(12), argument(11));
    const std::vector<uint32_t> words = read_words("input.bin", pixels * in_channels);
    const std::vector<uint32_t> load_words = read_words("loads.bin", 4 * loads);
    std::ofstream output("output.bin", std::ios::binary);
    std::ofstream counts("clocks.txt");

    VerilatedContext context;
    Vsensor_raster core{&context};
    // Registers take what is there before the edge; inputs change between an edge and `settle`.
    const auto tick = [&] { core.clk = 1, core.eval(); };
    const auto settle = [&] { core.clk = 0, core.eval(); };
    core.columns = columns;
    core.rows = argument(7);
    core.red_place = argument(4);
    core.load_write = 0;
    core.error_clear = 0;
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

    uint64_t clock = 0, idle = 0, loaded = 0, offered = 0, accepted = 0, received = 0, refused = 0;
    uint64_t first_in = 0, last_in = 0, first_out = 0, last_out = 0, framing_errors = 0;
    while (!(received >= out_pixels && idle >= silence) && idle < idle_limit) {
        clock++;
        idle++;
        const bool taken = core.s_axis_tvalid && core.s_axis_tready;
        refused += core.s_axis_tvalid && !core.s_axis_tready;
        if (core.m_axis_tvalid && core.m_axis_tready) {
            if (received == 0) first_out = clock;
            for (uint64_t c = 0; c < channels; c++) {
                const uint32_t word = uint64_t(core.m_axis_tdata) >> (c * bits) & ((1u << bits) - 1);
                output.write(reinterpret_cast<const char*>(&word), sizeof word);
            }
            framing_errors += core.m_axis_tlast != (received % out_columns == out_columns - 1) ||
                              core.m_axis_tuser != (received % out_frame == 0);
            received++;
            last_out = clock;
            idle = 0;
        }
        tick();
        core.load_write = 0;
        if (loaded < loads) {
            const uint32_t* word = &load_words[4 * loaded++];
            core.load_kind = word[0];
            core.load_address = word[1];
            core.load_data = uint64_t{word[3]} << 20 | word[2];
            core.load_write = 1;
            idle = 0;
        }
        if (taken) {
            if (accepted == 0) first_in = clock;
            accepted++;
            last_in = clock;
            idle = 0;
            core.s_axis_tvalid = 0;
        }
        if (!stalls.draw(clock, false) && loaded == loads && offered == accepted && offered < pixels) {
            uint64_t data = 0;
            for (uint64_t c = 0; c < in_channels; c++)
                data |= uint64_t{words[offered * in_channels + c]} << (c * bits);
            core.s_axis_tdata = data;
            core.s_axis_tvalid = 1;
            core.s_axis_tlast = offered % columns == columns - 1;
            core.s_axis_tuser = offered % frame == 0;
            offered++;
        }
        core.m_axis_tready = !stalls.draw(clock, true);
        settle();
    }
    counts << "accepted " << accepted << "\nreceived " << received << "\nrefused " << refused
           << "\nclocks " << last_out - first_in + 1 << "\nlatency " << first_out - first_in
           << "\ninput_clocks " << last_in - first_in + 1 << "\nframing_errors " << framing_errors
           << "\nerror_flags " << int(core.error_flags) << '\n';
    core.final();
    return 0;
}
