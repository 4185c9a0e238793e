// Pumps whole frames from a file through the raster refocuser into a file, clock by clock as
// refocus_pump.vhd does: the same files, the same stalls, the same counts.
//
// Arguments: CHANNELS PIXEL_BITS COLUMNS ROWS FRAMES SWEEP_FRAMES STALL_PERCENT SEED

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <vector>

#include "Vraster_refocuser.h"
#include "verilated.h"

namespace {

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

std::vector<int32_t> read_words(const char* path) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
    std::vector<int32_t> words(bytes.size() / 4);
    std::copy(bytes.begin(), bytes.begin() + words.size() * 4, reinterpret_cast<char*>(words.data()));
    return words;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 9) {
        std::fprintf(stderr, "refocus_pump: wants 8 arguments\n");
        return 1;
    }
    const auto argument = [&](int place) { return std::strtoull(argv[place], nullptr, 10); };
    const uint64_t channels = argument(1), pixel_bits = argument(2);
    const uint64_t columns = argument(3), rows = argument(4), frames = argument(5);
    const uint64_t sweep_frames = argument(6);
    Stalls stalls(argument(8), argument(7));
    const uint64_t pixels = columns * rows * frames;
    const uint64_t pixel_mask = (uint64_t{1} << pixel_bits) - 1;

    const std::vector<int32_t> input = read_words("input.bin");
    if (input.size() != pixels * channels) {
        std::fprintf(stderr, "refocus_pump: input.bin has %zu words\n", input.size());
        return 1;
    }
    std::ofstream output("output.bin", std::ios::binary);
    std::ofstream counts("clocks.txt");

    VerilatedContext context;
    Vraster_refocuser core{&context};
    core.columns = columns;
    core.rows = rows;
    core.slice = 0;
    core.sweep = sweep_frames > 0;
    core.sweep_frames = sweep_frames;
    core.error_clear = 0;
    core.s_axis_tvalid = 0;
    core.m_axis_tready = 0;
    core.reset = 1;
    const auto tick = [&] {
        core.clk = 1;
        core.eval();
    };
    const auto settle = [&] {
        core.clk = 0;
        core.eval();
    };
    settle();
    for (int i = 0; i < reset_clocks; i++) {
        tick();
        settle();
    }
    core.reset = 0;
    settle();

    uint64_t clock = 0, idle = 0, offered = 0, accepted = 0, received = 0;
    uint64_t first_in = 0, first_out = 0, last_in = 0, last_out = 0;
    uint64_t framing_errors = 0, frame_slice = 0;
    bool running = true;
    while (running) {
        clock++;
        idle++;
        const bool taken = core.s_axis_tvalid && core.s_axis_tready;
        const bool given = core.m_axis_tvalid && core.m_axis_tready;
        if (given) {
            const uint64_t data = core.m_axis_tdata;
            if (received == 0) first_out = clock;
            for (uint64_t c = 0; c < channels; c++) {
                const int32_t word = data >> (c * pixel_bits) & pixel_mask;
                output.write(reinterpret_cast<const char*>(&word), sizeof word);
            }
            const uint64_t column = received % columns, row = received / columns % rows;
            if (core.m_axis_tlast != (column == columns - 1) ||
                core.m_axis_tuser != (column == 0 && row == 0))
                framing_errors++;
            if (column == 0 && row == 0) {
                frame_slice = core.m_axis_tid;
                counts << "slice " << frame_slice << '\n';
            } else if (frame_slice != core.m_axis_tid) {
                framing_errors++;
            }
            received++;
            last_out = clock;
            idle = 0;
        }
        // The registers take what is there before the edge; inputs change after it.
        tick();
        if (taken) {
            if (accepted == 0) first_in = clock;
            accepted++;
            last_in = clock;
            idle = 0;
            core.s_axis_tvalid = 0;
        }
        bool stall = stalls.draw();
        if (offered == accepted && offered < pixels && !stall) {
            uint64_t data = 0;
            for (uint64_t c = 0; c < channels; c++)
                data |= (input[offered * channels + c] & pixel_mask) << (c * pixel_bits);
            core.s_axis_tdata = data;
            core.s_axis_tvalid = 1;
            core.s_axis_tlast = offered % columns == columns - 1;
            core.s_axis_tuser = offered % (columns * rows) == 0;
            offered++;
        }
        stall = stalls.draw();
        core.m_axis_tready = !stall;
        settle();
        running = !((received >= pixels && idle >= silence) || idle >= idle_limit);
    }
    counts << "accepted " << accepted << "\nreceived " << received << "\nclocks "
           << last_out - first_in + 1 << "\nlatency " << first_out - first_in << "\ninput_clocks "
           << last_in - first_in + 1 << "\nframing_errors " << framing_errors << "\nerror_flags "
           << int(core.error_flags) << '\n';
    core.final();
    return 0;
}
