# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of the whole board: serial TMDS bits in, refocused, serial TMDS bits out."""

import random
from typing import Any

import cocotb
import numpy as np
from cocotb.triggers import Timer

from hdmi.panel_bench import (  # noqa: F401
    commands_and_status,
    focus_is_stepped,
    passed_through,
    test_pattern,
)
from plenofir.fpga.hdmi.link import Packed, decode_signals, encode_frames
from plenofir.fpga.hdmi.modes import VideoMode
from plenofir.fpga.hdmi.script import Code, Command
from plenofir_tb import sources, video
from plenofir_tb.board import Board, ask, fast, signal
from plenofir_tb.case import read_case
from plenofir_tb.hdmi.packets import AviInfo, ColourSpace
from plenofir_tb.hdmi.status import parse_status
from plenofir_tb.serial import SKEWS, last_frames
from plenofir_tb.sources import LIMITED_YCBCR, RGB, hdmi_source

CASE = read_case()
MODE_FAST, MODE_HDMI = fast(video.MODE_720), fast(sources.MODE_HDMI)
MODE_SLOW = VideoMode(
    name="slow",
    pixel_clock=CASE["slow_khz"],
    h_active=32,
    h_front=2,
    h_sync=6,
    h_back=3,
    v_active=24,
    v_front=1,
    v_sync=2,
    v_back=3,
    h_positive=False,
    v_positive=False,
)


@cocotb.test()
async def phases_and_skews(dut: Any) -> None:
    """Each channel at all word phases, channels up to several pixels apart."""
    bench = Board(dut)
    await bench.link.reset()
    bit_ps = 1e9 / MODE_FAST.pixel_clock / 10
    for base in CASE["phases"]:
        phases = [(base + 3 * c) % 10 + 10 * bench.random.randrange(4) for c in range(3)]
        skews = [
            Command(SKEWS[c], round((phase + bench.random.random()) * bit_ps))
            for c, phase in enumerate(phases)
        ]
        await bench.relock(MODE_FAST, skews)
        assert bench.led() & 0x1F == 0x1F, f"LEDs {bench.led():08b}"


@cocotb.test()
async def jitter(dut: Any) -> None:
    """Edges with up to a quarter of a bit of jitter, and a clock lane out of phase."""
    bench = Board(dut)
    await bench.link.reset()
    bit_ps = 1e9 / MODE_FAST.pixel_clock / 10
    script = [
        Command(Code.JITTER, round(bit_ps / 4)),
        Command(Code.CLOCK_SKEW, round(bench.random.random() * 10 * bit_ps)),
    ]
    await bench.relock(MODE_FAST, [*script])


@cocotb.test()
async def wrong_words(dut: Any) -> None:
    """Invalid words in a picture: an error, and the picture goes on."""
    bench = Board(dut)
    await bench.link.reset()
    lost = bench.lost_frames(MODE_FAST)
    words = encode_frames(MODE_FAST, bench.pictures(MODE_FAST, lost + 4))
    begin = (lost + 2) * MODE_FAST.h_total * MODE_FAST.v_total
    # Four ones, without the inversion that the coding requires.
    words[begin + 9] = words[begin + 9] & ~np.uint32(0x3FF) | np.uint32(0x00F)
    await bench.link.play([*signal(MODE_FAST), words])
    assert bench.led() & 0x3F == 0x3F, f"LEDs {bench.led():08b}"


@cocotb.test()
async def modes_change(dut: Any) -> None:
    """Alternating slow and fast clocks, in the middle of frames."""
    bench = Board(dut)
    await bench.link.reset()
    for mode in (MODE_SLOW, MODE_FAST, MODE_SLOW):
        await bench.relock(mode, [])
        assert bench.led() & 0x1F == 0x1F
        part = encode_frames(mode, bench.pictures(mode, 1))
        await bench.link.play([part[: bench.random.randrange(len(part))]])


@cocotb.test()
async def hdmi_and_dvi(dut: Any) -> None:
    """A source switches from HDMI to DVI and to HDMI in other colours, and no frame is lost."""
    bench = Board(dut)
    await bench.link.reset()
    frames = bench.pictures(MODE_HDMI, bench.lost_frames(MODE_HDMI) + 8)
    first, second = len(frames) - 6, len(frames) - 4
    words = [
        hdmi_source(AviInfo(format_code=1))(MODE_HDMI, frames[:first]),
        encode_frames(MODE_HDMI, frames[first:second]),
        hdmi_source(LIMITED_YCBCR)(MODE_HDMI, frames[second:]),
    ]
    taken = await bench.link.play([*signal(MODE_HDMI), *words])
    got = last_frames(taken, MODE_HDMI.h_total)
    # All except the last frame, which is incomplete at the output.
    assert len(got) >= 7
    for number, frame in zip(range(len(frames) - 2, -1, -1), got[::-1], strict=False):
        info = LIMITED_YCBCR if number >= second else RGB
        # The first lines in other colours come before the packet that announces them.
        if number != second:
            assert np.array_equal(frame.pixels, bench.golden(frames[number], info=info)), number
        assert frame.mode == MODE_HDMI.as_measured()


@cocotb.test(skip=not CASE["thorough"])
async def hdmi_modes_change(dut: Any) -> None:
    """DVI and HDMI with slow and fast clocks, in the middle of frames."""
    bench = Board(dut)
    await bench.link.reset()
    slow = MODE_HDMI.model_copy(update={"pixel_clock": CASE["slow_khz"], "h_positive": False})
    sources: list[tuple[VideoMode, AviInfo | None]] = [
        (MODE_HDMI, AviInfo(format_code=4)),
        (MODE_SLOW, None),
        (MODE_HDMI, LIMITED_YCBCR),
        (slow, AviInfo(ColourSpace.YCBCR_444, format_code=1, ycc_range=1)),
        (MODE_FAST, None),
        (slow, AviInfo(ColourSpace.YCBCR_422, format_code=1)),
    ]
    for mode, info in sources:
        await bench.relock(mode, [], info)
        assert bench.led() & 0x1F == 0x1F
        source = hdmi_source(info) if info else encode_frames
        part = source(mode, bench.pictures(mode, 1))
        await bench.link.play([part[: bench.random.randrange(len(part))]])


@cocotb.test(skip=not CASE["thorough"])
async def hdmi_bit_errors(dut: Any) -> None:
    """Random bit errors with islands: pictures without errors are right, the raster stays."""
    await spoilt_frames(Board(dut), MODE_HDMI, LIMITED_YCBCR)


@cocotb.test()
async def clock_lost_and_back(dut: Any) -> None:
    """The clock lane stops for a while: the LED goes off, then the picture comes back."""
    bench = Board(dut)
    await bench.link.reset()
    await bench.relock(MODE_FAST, [])
    part = encode_frames(MODE_FAST, bench.pictures(MODE_FAST, 1))[: bench.random.randrange(1300)]
    await bench.link.play([part, Command(Code.CLOCK, 0), Command(Code.WAIT, 100_000)])
    assert bench.led() & 0x1F == 0, f"LEDs {bench.led():08b}"
    await bench.relock(MODE_FAST, [])


@cocotb.test()
async def cable_pulled(dut: Any) -> None:
    """The cable is pulled in the middle of a frame, and plugged in somewhere in another one."""
    bench = Board(dut)
    await bench.link.reset()
    await bench.relock(MODE_FAST, [])
    part = encode_frames(MODE_FAST, bench.pictures(MODE_FAST, 1))[: bench.random.randrange(1300)]
    open_part = encode_frames(MODE_FAST, bench.pictures(MODE_FAST, 4))
    await bench.link.play([part, Command(Code.CABLE, 0), open_part])
    assert bench.led() & 0x1F == 0
    rest = encode_frames(MODE_FAST, bench.pictures(MODE_FAST, 1))[bench.random.randrange(1300) :]
    await bench.relock(MODE_FAST, [Command(Code.CABLE, 1), rest])


@cocotb.test()
async def data_lost_while_the_clock_runs(dut: Any) -> None:
    """Data lanes stop while the clock runs: channels are lost, the monitor gets black frames."""
    bench = Board(dut)
    await bench.link.reset()
    await bench.relock(MODE_FAST, [])
    # Long enough for the alignment to be given up.
    quiet = np.zeros(9 * MODE_FAST.h_total * MODE_FAST.v_total, np.uint32)
    black = last_frames(await bench.link.play([quiet]), MODE_FAST.h_total)
    assert black, "the monitor lost its signal"
    assert all(frame.mode == MODE_FAST.as_measured() for frame in black)
    assert bench.led() & 0x1F == 0x01, f"LEDs {bench.led():08b}"
    await bench.relock(MODE_FAST, [])


@cocotb.test()
async def open_clock_input(dut: Any) -> None:
    """An open input that oscillates does not start the link; a source then does."""
    bench = Board(dut)
    await bench.link.reset()
    await bench.link.play([Command(Code.OPEN_CLOCK, 200_000)])
    assert bench.led() & 0x1F == 0
    status = parse_status(await ask(dut, "?"))
    assert status["present"] == status["running"] == status["restarts"] == (0,)
    await bench.relock(MODE_FAST, [])


@cocotb.test()
async def clock_out_of_range(dut: Any) -> None:
    """A clock out of the build's range does not start the link; one in the range does."""
    bench = Board(dut)
    await bench.link.reset()
    mode = MODE_FAST.model_copy(update={"pixel_clock": CASE["refused_khz"]})
    await bench.link.play([*signal(mode), Command(Code.WAIT, 100_000)])
    assert bench.led() & 0x1F == 0, f"LEDs {bench.led():08b}"
    asking = cocotb.start_soon(ask(dut, "?"))
    await bench.link.play([Command(Code.WAIT, 300_000)])
    status = parse_status(await asking)
    assert status["present"] == status["running"] == (0,)
    unit = CASE["meter_window"] / 16000
    assert abs(status["clock"][0] - CASE["refused_khz"] / 100 * unit) <= 1
    await bench.relock(MODE_FAST, [])


@cocotb.test()
async def broken_streams(dut: Any) -> None:
    """Noise, torn lines and frames, endless blanking: right again within the stated time."""
    bench = Board(dut)
    await bench.link.reset()
    total = MODE_FAST.h_total
    for _ in range(3):
        broken: list[Command | Packed] = [*signal(MODE_FAST)]
        for _ in range(6):
            words = encode_frames(MODE_FAST, bench.pictures(MODE_FAST, 2))
            kind = bench.random.randrange(5)
            if kind == 0:
                words = bench.rng.integers(0, 1 << 30, 2 * total, np.uint32)
            elif kind == 1:  # Lines of other lengths.
                cuts = sorted(bench.random.sample(range(1, words.size), 8))
                parts = np.split(words, cuts)
                words = np.concatenate([part[: bench.random.randrange(1, 90)] for part in parts])
            elif kind == 2:  # A frame of too few lines.
                words = words[: bench.random.randrange(words.size)]
            elif kind == 3:  # Blanking, or a picture, that does not end.
                words = np.resize(words[bench.random.choice((3, total - 3)) :][:1], 5 * total)
            else:  # A single channel goes on.
                words = words | np.uint32(0x3FF << 10 * bench.random.randrange(3))
            broken.append(words.astype(np.uint32))
        await bench.relock(MODE_FAST, broken)
        assert bench.led() & 0x1F == 0x1F, f"LEDs {bench.led():08b}"


@cocotb.test()
async def garbage_on_the_serial_port(dut: Any) -> None:
    """Random bytes, lines without an end, breaks: the port recovers, the picture goes on."""
    bench = Board(dut)
    await bench.link.reset()
    await bench.relock(MODE_FAST, [])
    bit_ns = 10 * CASE["bit_clocks"]
    for _ in range(3):
        for _ in range(60):
            code = bench.random.choice((bench.random.randrange(256), 0x20, 0x0D))
            # Without line ends after letters, which could be commands.
            for bit in (0, *(code >> i & 1 for i in range(8)), 1):
                dut.uart_rx.value = bit
                await Timer(round(bit_ns * bench.random.uniform(0.96, 1.04)), "ns")
        dut.uart_rx.value = 0
        await Timer(40 * bit_ns, "ns")
        dut.uart_rx.value = 1
        # Wait until answers to the garbage, maybe the long status, have ended.
        silent = 0
        while silent < 30:
            await Timer(bit_ns, "ns")
            silent = silent + 1 if int(dut.uart_tx.value) else 0
        # This ends the unfinished line, which is answered; an empty line would not be.
        await ask(dut, "x")
        await Timer(100, "us")
        for command in ("s 0", "w 0", "p 0", "t 0"):
            assert await ask(dut, command) == "ok"
        parse_status(await ask(dut, "?"))
    await bench.relock(MODE_FAST, [])


@cocotb.test()
async def swapped_pairs(dut: Any) -> None:
    """Swapped wires: found with an HDMI source, by command with DVI, whose words cannot tell."""
    bench = Board(dut)
    await bench.link.reset()
    for swapped, info in ((7, RGB), (bench.random.choice((1, 2, 4)), RGB), (7, None)):
        mode = MODE_HDMI if info else MODE_FAST
        stop = [Command(Code.CLOCK, 0), Command(Code.WAIT, 20_000)]
        if not info:
            assert await ask(dut, f"i {swapped}") == "ok"
        await bench.relock(mode, stop, info, swapped=swapped)
        assert bench.led() & 0x1F == 0x1F, f"LEDs {bench.led():08b}"
        # The signal continues during the answer.
        asking = cocotb.start_soon(ask(dut, "?"))
        inverted = np.uint32(sum(0x3FF << 10 * c for c in range(3) if swapped >> c & 1))
        frames = bench.pictures(mode, bench.lost_frames(mode) + 20)
        source = hdmi_source(info) if info else encode_frames
        await bench.link.play([source(mode, frames) ^ inverted])
        status = parse_status(await asking)
        assert status["inverted"] == (swapped,)
        assert status["polarity"] == (8 if info else swapped,)


@cocotb.test()
async def frames_not_alike(dut: Any) -> None:
    """Every second frame has a line more: the input is passed through, which the status tells."""
    bench = Board(dut)
    await bench.link.reset()
    longer = MODE_FAST.model_copy(update={"v_back": MODE_FAST.v_back + 1})
    frames = bench.pictures(MODE_FAST, 2 * (bench.lost_frames(MODE_FAST) // 2 + 12))
    words = [
        encode_frames(longer if number % 2 else MODE_FAST, [frame])
        for number, frame in enumerate(frames)
    ]
    taken = await bench.link.play([*signal(MODE_FAST), *words])
    asking = cocotb.start_soon(ask(dut, "?"))
    await bench.link.play([*words, *words])
    status = parse_status(await asking)
    assert (status["varying"], status["following"], status["unsupported"]) == ((1,), (0,), (0,))
    shown = decode_signals(taken[-5 * MODE_FAST.h_total * MODE_FAST.v_total :])
    got = shown.pixels[shown.active]
    assert len(got) > 4 * frames[0].size // 3
    assert got.tobytes() in np.stack(frames).tobytes()


@cocotb.test()
async def slow_locks(dut: Any) -> None:
    """PLLs that lock just within the time-out work; slower ones are retried and counted."""
    if CASE["board"] != "ulx3s":
        return  # A filter by name also runs skipped tests.
    bench = Board(dut)
    # In the bench's scale of 200 us for 50 ms: the data sheet's 15 ms, just below 50 ms, above it.
    for slow_us, runs in ((60, True), (185, True), (260, False), (60, True)):
        await bench.link.reset()
        blank = [Command(Code.SLOW_LOCK, slow_us), *signal(MODE_FAST), Command(Code.WAIT, 800_000)]
        await bench.link.play(blank)
        asking = cocotb.start_soon(ask(dut, "?"))
        await bench.link.play([Command(Code.WAIT, 100_000)])
        status = parse_status(await asking)
        assert status["running"] == (int(runs),), slow_us
        assert bool(status["lost_locks"][0]) != runs, status["lost_locks"]
        assert status["present"] == (1,)
    await bench.link.play([Command(Code.SLOW_LOCK, 0)])
    await bench.relock(MODE_FAST, [])


@cocotb.test()
async def drifting_delays(dut: Any) -> None:
    """Bits drift by more than their length while frames go on; then the link is right again."""
    if CASE["board"] == "atlys":
        return  # A filter by name also runs skipped tests.
    bench = Board(dut)
    await bench.link.reset()
    bit_ps = 1e9 / MODE_FAST.pixel_clock / 10
    await bench.relock(MODE_FAST, [])
    steps = 24
    drift: list[Command | Packed] = []
    for step in range(1, steps + 1):
        # Channels apart, in both directions.
        for code, far in zip(SKEWS, (1.3, 1.1, 0.9), strict=True):
            drift.append(Command(code, round(far * bit_ps * step / steps)))
        drift.append(encode_frames(MODE_FAST, bench.pictures(MODE_FAST, 1)))
    lost = bench.lost_frames(MODE_FAST)
    frames = bench.pictures(MODE_FAST, lost + 3)
    taken = await bench.link.play([*drift, encode_frames(MODE_FAST, frames)])
    got = last_frames(taken, MODE_FAST.h_total)
    assert len(got) >= 2
    # The last frame is incomplete at the output.
    for frame, picture in zip(got[::-1], frames[-2 : lost - 1 : -1], strict=False):
        assert np.array_equal(frame.pixels, bench.golden(picture))
    status = parse_status(await ask(dut, "?"))
    assert any(status["hung"]), "the drift was noticed"
    assert status["tracking"] == status["aligned"] == (7,)


async def faulty_delay_lines(dut: Any, seed: int, recovery_us: float) -> None:
    """Let delay lines go wrong for some frames; right again within a time after the last fault."""
    bench = Board(dut)
    await bench.link.reset()
    dut._log.info("seed of the faults: %d", seed)
    frame_us = 1000 * MODE_FAST.h_total * MODE_FAST.v_total / MODE_FAST.pixel_clock
    # Faults begin when the delays have been found.
    settled = int(np.ceil(CASE["lock_us"] / frame_us))
    during = encode_frames(MODE_FAST, bench.pictures(MODE_FAST, settled + 8))
    lost = bench.lost_frames(MODE_FAST) + int(np.ceil(recovery_us / frame_us))
    frames = bench.pictures(MODE_FAST, lost + 3)
    taken = await bench.link.play(
        [
            *(Command(Code.DELAY_FAULTS, seed), *signal(MODE_FAST), during),
            *(Command(Code.DELAY_FAULTS, 0), encode_frames(MODE_FAST, frames)),
        ]
    )
    got = last_frames(taken, MODE_FAST.h_total)
    assert len(got) >= 2
    # The last frame is incomplete at the output.
    for frame, picture in zip(got[::-1], frames[-2 : lost - 1 : -1], strict=False):
        assert np.array_equal(frame.pixels, bench.golden(picture))
    assert bench.led() & 0x1F == 0x1F, f"LEDs {bench.led():08b}"
    status = parse_status(await ask(dut, "?"))
    assert any(status["hung"])
    assert status["tracking"] == (7,)
    assert bool(status["restarts"][0]) == bool(seed % 2)


@cocotb.test()
async def delay_lines_hang(dut: Any) -> None:
    """Delay lines hang, ignore and answer late; a reset of the delay brings them back."""
    seed = 2 * random.Random(cocotb.RANDOM_SEED).randrange(1, 1 << 20)
    await faulty_delay_lines(dut, seed, CASE["delay_recovery_us"])


@cocotb.test()
async def delay_lines_hang_until_a_restart(dut: Any) -> None:
    """Only a restart of the receiver's clocks brings them back: the supervisor does it."""
    seed = 2 * random.Random(cocotb.RANDOM_SEED).randrange(1 << 20) + 1
    await faulty_delay_lines(dut, seed, CASE["patience_us"] + CASE["lock_us"])


async def spoilt_frames(bench: Board, mode: VideoMode, info: AviInfo | None) -> None:
    """Send random bit errors in three frames, anywhere, also in the blanking."""
    await bench.link.reset()
    lost = bench.lost_frames(mode)
    frames = bench.pictures(mode, lost + 9)
    words = (hdmi_source(info) if info else encode_frames)(mode, frames)
    total = mode.h_total * mode.v_total
    hit: set[int] = set()
    for _ in range(40):
        at = bench.random.randrange((lost + 2) * total, (lost + 5) * total)
        words[at] ^= np.uint32(1 << bench.random.randrange(30))
        hit.add(at // total)
    got = last_frames(await bench.link.play([*signal(mode), words]), mode.h_total)
    assert got[-1].mode == mode.as_measured()
    # No frame is missing between the last one, which has not come out whole, and the first.
    begin = len(frames) - 2 - len(got) + 1
    assert begin <= lost
    for i, (frame, shown) in enumerate(zip(frames[begin:], got, strict=False)):
        if begin + i not in hit:
            want = bench.golden(frame, info=info or RGB)
            assert np.array_equal(shown.pixels, want), f"frame {begin + i}"
    assert bench.led() & 0x3F == 0x3F, f"LEDs {bench.led():08b}"


@cocotb.test()
async def bit_errors(dut: Any) -> None:
    """Random bit errors: told by the LED, pictures without any are right, the raster stays."""
    bench = Board(dut)
    await spoilt_frames(bench, MODE_FAST, None)
    # That no frame follows is an error too, a little later.
    await Timer(2, "us")
    dut.button_clear.value = 1
    await Timer(2, "us")
    dut.button_clear.value = 0
    await Timer(2, "us")
    assert not bench.led() & 0x20, "the error LED stays lit"
