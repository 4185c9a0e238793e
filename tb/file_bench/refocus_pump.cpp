// Pumps whole frames from a file through the raster refocuser into a file, clock by clock as
// refocus_pump.vhd does: the same files, the same stalls, the same counts.
//
// Arguments: CHANNELS PIXEL_BITS COLUMNS ROWS FRAMES SWEEP_FRAMES STALL_PERCENT SEED

#include "Vraster_refocuser.h"
#include "pump.h"

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
    Source source(channels, pixel_bits, columns, rows, frames);
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
    restart(core);

    uint64_t clock = 0, idle = 0, received = 0, first_out = 0, last_out = 0;
    uint64_t framing_errors = 0, frame_slice = 0;
    bool running = true;
    while (running) {
        clock++;
        idle++;
        const bool taken = core.s_axis_tvalid && core.s_axis_tready;
        const bool given = core.m_axis_tvalid && core.m_axis_tready;
        if (given) {
            if (received == 0) first_out = clock;
            write_fields(output, core.m_axis_tdata, channels, pixel_bits);
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
        tick(core);
        source.take(core, taken, clock);
        if (taken) idle = 0;
        source.offer(core, stalls.draw());
        core.m_axis_tready = !stalls.draw();
        settle(core);
        running = !((received >= source.pixels && idle >= silence) || idle >= idle_limit);
    }
    counts << "accepted " << source.accepted << "\nreceived " << received << "\nclocks "
           << last_out - source.first + 1 << "\nlatency " << first_out - source.first << "\ninput_clocks "
           << source.last - source.first + 1 << "\nframing_errors " << framing_errors << "\nerror_flags "
           << int(core.error_flags) << '\n';
    core.final();
    return 0;
}
