// Pumps a frame from a file through the focal stack and the depth index into files, clock by clock
// as stack_pump.vhd does: the same files, the same stalls, the same counts.
//
// Arguments: MICRO_IMAGE_SIZE SLICES CHANNELS PIXEL_BITS COLUMNS ROWS STALL_PERCENT SEED

#include "Vstack_and_index.h"
#include "pump.h"

int main(int argc, char** argv) {
    if (argc != 9) {
        std::fprintf(stderr, "stack_pump: wants 8 arguments\n");
        return 1;
    }
    const auto argument = [&](int place) { return std::strtoull(argv[place], nullptr, 10); };
    const uint64_t micro_image_size = argument(1), slices = argument(2);
    const uint64_t channels = argument(3), pixel_bits = argument(4);
    const uint64_t columns = argument(5), rows = argument(6);
    Stalls stalls(argument(8), argument(7));
    Source source(channels, pixel_bits, columns, rows, 1);
    // Lines wait in the cores.
    const uint64_t patience = idle_limit + 100 * micro_image_size * columns;

    std::ofstream slices_file("slices.bin", std::ios::binary);
    std::ofstream found_file("found.bin", std::ios::binary);
    std::ofstream counts("clocks.txt");

    VerilatedContext context;
    Vstack_and_index core{&context};
    core.columns = columns;
    core.rows = rows;
    restart(core);

    uint64_t clock = 0, idle = 0, stacked = 0, received = 0, last_out = 0, framing_errors = 0;
    const auto check_framing = [&](uint64_t number, bool user, bool last) {
        if (last != (number % columns == columns - 1) || user != (number % source.pixels == 0))
            framing_errors++;
    };
    bool running = true;
    while (running) {
        clock++;
        idle++;
        const bool taken = core.s_axis_tvalid && core.s_axis_tready;
        if (core.stack_tvalid && core.stack_tready) {
            write_fields(slices_file, core.stack_tdata, slices * channels, pixel_bits);
            check_framing(stacked, core.stack_tuser, core.stack_tlast);
            stacked++;
            idle = 0;
        }
        if (core.m_axis_tvalid && core.m_axis_tready) {
            const int32_t index = field(core.m_axis_tdata, channels * pixel_bits, 8);
            write_fields(found_file, core.m_axis_tdata, channels, pixel_bits);
            found_file.write(reinterpret_cast<const char*>(&index), sizeof index);
            check_framing(received, core.m_axis_tuser, core.m_axis_tlast);
            received++;
            last_out = clock;
            idle = 0;
        }
        tick(core);
        source.take(core, taken, clock);
        if (taken) idle = 0;
        source.offer(core, stalls.draw());
        core.m_axis_tready = !stalls.draw();
        settle(core);
        running = !((received >= source.pixels && idle >= silence) || idle >= patience);
    }
    counts << "accepted " << source.accepted << "\nstacked " << stacked << "\nreceived " << received
           << "\nclocks " << last_out - source.first + 1 << "\ninput_clocks "
           << source.last - source.first + 1 << "\nframing_errors " << framing_errors
           << "\nerror_flags " << int(core.error_flags) << '\n';
    core.final();
    return 0;
}
