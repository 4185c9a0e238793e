# SPDX-License-Identifier: Apache-2.0
"""cocotb tests of ``raster_refocuser``, ``focal_stack`` and ``depth_index``.

Every pixel of every frame, of a stack every pixel of every slice, against the bit-true model.
"""

import logging
import random
from pathlib import Path
from typing import Any

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge

from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.core.depth_index import DepthIndexConfiguration
from plenofir_tb.axi_video import (
    AxiVideoSink,
    AxiVideoSource,
    Beat,
    Frame,
    frame_beats,
    stall_pattern,
)
from plenofir_tb.case import read_case
from plenofir_tb.frames import KINDS, damaged, make_frame, repaired_frames
from plenofir_tb.levels import levels
from plenofir_tb.scoreboard import FrameScoreboard
from plenofir_tb.slices import SliceModel

ERROR_NAMES = ("line early", "line late", "frame early", "frame late", "size")
CORES = {
    "raster_refocuser": CoreConfiguration,
    "focal_stack": CoreConfiguration,
    "depth_index": DepthIndexConfiguration,
}
KIND = read_case().get("kind", "raster_refocuser")


class Bench:
    """Source, core, sink and scoreboard."""

    def __init__(self, dut: Any) -> None:
        self.dut = dut
        self.case = read_case()
        self.core: Any = CORES[KIND].model_validate(self.case["core"])
        # For a depth index, the slices of the stack in front of it.
        self.channels = self.core.channels
        if KIND == "depth_index":
            self.channels *= self.core.pictures
        self.pixels = self.core.pixels_per_clock
        self.rng = random.Random(cocotb.RANDOM_SEED)
        Clock(dut.clk, 10, "ns").start()
        logging.getLogger(f"cocotb.{dut._name}.m_axis").setLevel(logging.WARNING)
        self.source = AxiVideoSource(dut, "s_axis", dut.clk)
        self.sink = AxiVideoSink(dut, "m_axis", dut.clk, reset=dut.reset)
        bits = 8 if KIND == "depth_index" else self.core.pixel_bits
        pictures = Path(self.case["pictures"])
        self.scoreboard = FrameScoreboard(self.sink, bits, pictures, self.pixels)

    async def reset(self, columns: int, rows: int, clocks: int = 3) -> None:
        """Reset the core for some clocks and set the frame size."""
        self.dut.reset.value = 1
        self.dut.error_clear.value = 0
        if KIND != "focal_stack":
            self.dut.slice.value = 0
            self.dut.sweep.value = 0
            self.dut.sweep_frames.value = 0
        self.set_size(columns, rows)
        await ClockCycles(self.dut.clk, clocks)
        self.dut.reset.value = 0
        # Nothing may come from before the reset.
        await FallingEdge(self.dut.clk)
        self.scoreboard.listening = True
        await ClockCycles(self.dut.clk, 3)

    def set_size(self, columns: int, rows: int) -> None:
        """Set the size of the next frames."""
        self.dut.columns.value = columns
        self.dut.rows.value = rows
        if KIND == "depth_index":
            self.dut.picture_rows.value = rows
        # Clocks without any output after which frames count as lost: stalls triple the latency.
        latency = self.core.latency_clocks(min(columns, self.core.max_columns), rows, frames=2)
        self.patience = 2000 + 10 * latency

    def stall(self, source: str, sink: str) -> None:
        """Choose the stall patterns of both sides."""
        self.source.stalls = stall_pattern(source, random.Random(self.rng.random()))
        self.sink.stalls = stall_pattern(sink, random.Random(self.rng.random()))

    def frame(self, kind: str, columns: int, rows: int) -> Frame:
        """Make a frame for the core."""
        return make_frame(kind, rows, columns, self.channels, self.core.pixel_bits, self.rng)

    def beats(self, frame: Frame) -> list[Beat]:
        """Transfers of a frame, with random lanes after a line's last pixel."""
        beats = frame_beats(frame, self.core.pixel_bits, self.pixels)
        width = self.channels * self.core.pixel_bits
        used = ((frame.shape[1] - 1) % self.pixels + 1) * width
        return [
            b._replace(data=b.data | self.rng.getrandbits(self.pixels * width) >> used << used)
            if b.end_of_line
            else b
            for b in beats
        ]

    def tokens(self, columns: int) -> int:
        return -(-columns // self.pixels)

    def golden(self, frame: Frame, slice_: int = 0) -> Frame:
        """Expected output for a frame: images and indices one after another in the channels."""
        core = self.core
        if KIND == "focal_stack":
            return np.dstack(list(core.golden(frame)))
        if KIND == "depth_index":
            rows, columns = frame.shape[:2]
            shape = (rows, columns, core.pictures)
            shape += (-1,) if core.channels == 3 else ()
            found = core.golden(np.moveaxis(frame.reshape(shape), 2, 0))
            m = core.micro_image_size
            index = found.index.repeat(m, 0).repeat(m, 1)[:rows, :columns]
            image = np.ascontiguousarray(found.image).view(np.uint8).reshape(rows, columns, -1)
            between = [
                part.repeat(m, 0).repeat(m, 1)[:rows, :columns]
                for part in (found.fraction, found.confidence)
                if part is not None
            ]
            return np.dstack([*[image] * core.picture, index, *between])
        return core.golden_slice(frame, slice_)

    def send_frame(self, frame: Frame) -> None:
        """Queue a frame and expect its refocused image."""
        self.scoreboard.expect(self.golden(frame))
        self.source.append(self.beats(frame))

    async def drain(self) -> None:
        """Wait until all expected frames are out, and some more clocks for unexpected output."""
        quiet = 0
        while self.scoreboard.waiting and quiet < self.patience:
            before = len(self.scoreboard.received)
            done = self.scoreboard.frames_done
            await ClockCycles(self.dut.clk, 10)
            same = (before, done) == (len(self.scoreboard.received), self.scoreboard.frames_done)
            quiet = quiet + 10 if same else 0
        await ClockCycles(self.dut.clk, 50)
        self.scoreboard.result  # noqa: B018  (raises)

    async def record(self, clocks: list[tuple[str, ...]]) -> None:
        """Record the core's outputs clock by clock."""
        dut = self.dut
        offers = levels(dut.m_axis_tvalid)
        ports = [levels(dut.s_axis_tready), levels(dut.error_flags), offers]
        offer = [levels(dut.m_axis_tdata), levels(dut.m_axis_tuser), levels(dut.m_axis_tlast)]
        edge = RisingEdge(dut.clk)
        while True:
            await edge
            shown = [*ports, *offer] if offers() == "1" else ports
            clocks.append(tuple([read() for read in shown]))

    async def disturb(self, columns: int, rows: int, begin: int = 0) -> None:
        """Send frames, most of them broken, up to a random point, or `begin` clocks into a line."""
        self.stall("some", "some")
        if KIND == "raster_refocuser":
            self.dut.sweep_frames.value = self.rng.randrange(4)
        for _ in range(self.rng.randint(1, 2)):
            share = self.rng.choice([0, 0, 0.02, 0.2])
            beats = [
                Beat(b.data, b.start_of_frame != hit(), b.end_of_line != hit())
                for hit in [lambda share=share: self.rng.random() < share]
                for b in self.beats(self.frame("random", columns, rows))
            ]
            tokens = self.tokens(columns)
            sent, clocks = (
                self.rng.randint(1, len(beats)),
                self.rng.choice([1, tokens, 4 * tokens]),
            )
            if begin or self.rng.random() < 0.5:
                # The beginning of a line, which is inside the core when the reset comes.
                sent = tokens * self.rng.randrange(rows) + 1
                clocks = begin or self.rng.randint(1, 12)
            elif self.rng.random() < 0.5:
                # Lines that are being output.
                sent = len(beats)
                clocks = self.rng.randint(1, self.core.latency_clocks(columns, rows, frames=1))
            await self.source.send(beats[:sent])
            await ClockCycles(self.dut.clk, clocks)

    def errors(self) -> set[str]:
        """Names of the error flags that are set."""
        flags = int(self.dut.error_flags.value)
        return {name for i, name in enumerate(ERROR_NAMES) if flags >> i & 1}

    def random_size(self, *, full_rate: bool = False, columns: int = 0) -> tuple[int, int]:
        """Columns (unless given) and rows of a small frame, at least one micro image.

        A size for full rate, if the core has one.
        """
        m = self.core.micro_image_size
        core = self.core
        least = max(m, core.frame_lines(1)) if full_rate else m
        sizes = [
            (size, core.frame_lines(rows) if full_rate else rows)
            for size in ([columns] if columns else range(m, core.max_columns + 1))
            for rows in range(least, least + m + 5)
        ]
        if full_rate:
            sizes = [size for size in sizes if core.full_rate(*size)] or sizes
        return self.rng.choice(sizes)


@cocotb.test()
async def frames_without_stalls(dut: Any) -> None:
    """The longest lines, back to back at full rate: no stalls, and the latency of the formula."""
    bench = Bench(dut)
    columns, rows = bench.random_size(full_rate=True, columns=bench.core.max_columns)
    await bench.reset(columns, rows)
    bench.stall("none", "none")
    clocks: list[int] = []

    async def watch() -> None:
        clock = 0
        while True:
            await RisingEdge(dut.clk)
            clock += 1
            if not clocks and int(dut.s_axis_tvalid.value) and int(dut.s_axis_tready.value):
                clocks.append(clock)
            if clocks and int(dut.m_axis_tvalid.value):
                clocks.append(clock)

    watcher = cocotb.start_soon(watch())
    for kind in ("white", "gradient"):
        bench.send_frame(bench.frame(kind, columns, rows))
    await bench.drain()
    watcher.cancel()
    assert bench.source.refused_clocks == 0, f"refused for {bench.source.refused_clocks} clocks"
    latency = clocks[1] - clocks[0]
    want = bench.core.latency_clocks(columns, rows, frames=2)
    assert latency == want, f"latency {latency} clocks, the formula says {want}"
    # Flush lines come as soon as those of a further frame would.
    gaps = clocks[-1] - clocks[1] + 1 - 2 * bench.tokens(columns) * rows
    assert not gaps or bench.core.parallel_rows > 1, f"{gaps} clocks without a pixel"
    assert not bench.errors()


@cocotb.test(skip=not read_case()["core"].get("any_rows"))
async def frames_of_any_rows(dut: Any) -> None:
    """Frames whose rows are no multiple of M, two back to back of each: no stalls."""
    bench = Bench(dut)
    core = bench.core
    columns, _ = bench.random_size(full_rate=True)
    least = core.frame_lines(1)
    sizes = [rows for rows in range(least, least + core.micro_image_size)]
    await bench.reset(columns, least)
    bench.stall("none", "none")
    for rows in bench.rng.sample(sizes, len(sizes)):
        assert core.full_rate(columns, rows)
        slice_ = bench.rng.randrange(len(core.shifts))
        dut.slice.value = slice_
        bench.set_size(columns, rows)
        for _ in range(2):
            frame = bench.frame("random", columns, rows)
            bench.scoreboard.expect(bench.golden(frame, slice_), slice_)
            bench.source.append(bench.beats(frame))
        await bench.drain()
    assert bench.source.refused_clocks == 0, f"refused for {bench.source.refused_clocks} clocks"
    assert not bench.errors()


@cocotb.test()
async def frames_with_stalls(dut: Any) -> None:
    """Frames of all remaining kinds, back to back, with stalls on both sides."""
    bench = Bench(dut)
    columns, rows = bench.random_size()
    await bench.reset(columns, rows)
    bench.stall("some", "some")
    for kind in ("impulse", "black", "random"):
        bench.send_frame(bench.frame(kind, columns, rows))
    await bench.drain()
    assert not bench.errors()


ONE_SLICE = len(read_case()["core"].get("shifts", ())) == 1


@cocotb.test(skip=KIND != "raster_refocuser" or ONE_SLICE or read_case().get("enclosed", False))
async def slices_change_while_video_runs(dut: Any) -> None:
    """Slices and sweeps at random clocks: a frame has that in which its first pixel is taken."""
    bench = Bench(dut)
    rng = bench.rng
    await bench.reset(*bench.random_size(full_rate=rng.random() < 0.5))
    columns, rows = int(dut.columns.value), int(dut.rows.value)
    frames = [bench.frame("random", columns, rows) for _ in range(10)]
    model = SliceModel(len(bench.core.shifts))
    started = 0

    async def watch_starts() -> None:
        nonlocal started
        while started < len(frames):
            await RisingEdge(dut.clk)
            if all(int(dut[f"s_axis_{s}"].value) for s in ("tvalid", "tready", "tuser")):
                slice_ = model.next_frame(
                    int(dut.slice.value), int(dut.sweep.value), int(dut.sweep_frames.value)
                )
                bench.scoreboard.expect(bench.golden(frames[started], slice_), slice_)
                started += 1

    async def turn_knobs() -> None:
        while True:
            await ClockCycles(dut.clk, rng.choice([1, rng.randint(1, columns * rows)]))
            dut.slice.value = rng.choice([*range(len(bench.core.shifts)), rng.randrange(256)])
            dut.sweep.value = int(rng.random() < 0.5)
            dut.sweep_frames.value = rng.randrange(4)

    watcher = cocotb.start_soon(watch_starts())
    cocotb.start_soon(turn_knobs())
    bench.stall(*rng.choice([("none", "none"), ("some", "some"), ("none", "bursts")]))
    for frame in frames:
        bench.source.append(bench.beats(frame))
    await watcher
    await bench.drain()
    assert not bench.errors()


@cocotb.test(skip=KIND != "depth_index")
async def black_and_white_micro_images(dut: Any) -> None:
    """The largest possible differences, and many equally sharp slices."""
    bench = Bench(dut)
    m, core = bench.core.micro_image_size, bench.core
    columns, rows = core.max_columns, 4 * m
    await bench.reset(columns, rows)
    bench.stall("none", "some")
    lenses = (-(-rows // m), -(-columns // m))
    largest = (1 << core.pixel_bits) - 1
    for kind in ("board", "random", "sparse", "sparse"):
        draw = np.random.default_rng(bench.rng.randrange(1 << 32))
        levels = draw.integers(0, 2, (*lenses, core.pictures))
        if kind == "sparse":
            # Few micro images differ between the slices; the others have no texture.
            same = draw.random(lenses) < 0.8
            levels[same, :: core.boxes] = levels[same][:, :1]
        if kind == "board":
            # A chessboard and its negative are equally sharp.
            levels[..., -core.boxes] = np.add.outer(*(np.arange(n) for n in lenses)) % 2
            levels[..., 0] = 1 - levels[..., -core.boxes]
        white = levels.repeat(m, 0).repeat(m, 1)[:rows, :columns].repeat(core.channels, 2)
        frame = (white * largest).astype(np.uint8 if core.pixel_bits <= 8 else np.uint16)
        bench.send_frame(frame[:, :, 0] if bench.channels == 1 else frame)
    await bench.drain()
    assert not bench.errors()


@cocotb.test(skip=not read_case()["thorough"])
async def any_stalls_any_gaps(dut: Any) -> None:
    """Several sizes, all stall patterns, with gaps between frames that cut flush lines short."""
    bench = Bench(dut)
    await bench.reset(*bench.random_size())
    for stalls in (("none", "bursts"), ("bursts", "none"), ("many", "some"), ("some", "many")):
        columns, rows = bench.random_size()
        bench.set_size(columns, rows)
        bench.stall(*stalls)
        for _ in range(4):
            bench.send_frame(bench.frame(bench.rng.choice(KINDS), columns, rows))
            gap = bench.rng.choice([0, 1, 5, columns, 3 * columns])
            await ClockCycles(dut.clk, bench.rng.randint(1, columns * rows) + gap)
        await bench.drain()
    assert not bench.errors()


@cocotb.test(skip=not read_case()["thorough"] or KIND == "depth_index")
async def gaps_never_refuse_the_source(dut: Any) -> None:
    """A source with gaps is never stalled, neither in the long run nor by flush lines."""
    bench = Bench(dut)
    columns, rows = bench.random_size(full_rate=True)
    await bench.reset(columns, rows)
    bench.stall("none", "none")
    for gap in (*[0] * 8, 1, 2, 3, columns // 2, columns, columns + 1, 3 * columns):
        frame = bench.frame("random", columns, rows)
        bench.scoreboard.expect(bench.golden(frame))
        await bench.source.send(bench.beats(frame), sync=False)
        if gap:
            await ClockCycles(dut.clk, gap)
    await bench.drain()
    assert bench.source.refused_clocks == 0 or not bench.core.full_rate(columns, rows)


@cocotb.test(skip=not read_case()["thorough"])
async def broken_frames(dut: Any) -> None:
    """Lines and frames that end early or late raise flags, and the next good frame is right."""
    bench = Bench(dut)
    rng = bench.rng
    core = bench.core
    for _ in range(6):
        columns, rows = bench.random_size()
        await bench.reset(columns, rows)
        bench.stall(rng.choice(["none", "some"]), rng.choice(["none", "some"]))
        tokens = bench.tokens(columns)
        good = bench.frame("random", columns, rows)
        beats = bench.beats(good)
        for _ in range(3):
            beats += damaged(bench.beats(bench.frame("random", columns, rows)), tokens, rng)
        beats += bench.beats(good)
        frames, faults = repaired_frames(beats, tokens, rows)
        mask = (1 << core.pixel_bits) - 1
        for lines in frames:
            packed = np.array(lines, dtype=object)
            lanes = bench.pixels * bench.channels
            planes = [(packed >> (lane * core.pixel_bits)) & mask for lane in range(lanes)]
            shape = (len(lines), tokens * bench.pixels, bench.channels)
            frame = np.stack(planes, axis=-1).reshape(shape)[:, :columns].astype(good.dtype)
            bench.scoreboard.expect(bench.golden(frame[:, :, 0] if bench.channels == 1 else frame))
        assert np.array_equal(bench.scoreboard.frames[-1], bench.golden(good))
        bench.source.append(beats)
        await bench.drain()
        assert bench.errors() == faults, f"flags {bench.errors()}, faults {faults}"
        dut.error_clear.value = 1
        await ClockCycles(dut.clk, 2)
        dut.error_clear.value = 0
        await RisingEdge(dut.clk)
        assert not bench.errors()


@cocotb.test(skip=not read_case()["thorough"])
async def complete_frames_come_out(dut: Any) -> None:
    """A frame without its last mark, or before endless stray pixels, comes out whole."""
    bench = Bench(dut)
    columns, rows = bench.random_size()
    await bench.reset(columns, rows)
    bench.stall("none", "none")
    for behind in ("silence", "stray pixels"):
        frame = bench.frame("random", columns, rows)
        beats = bench.beats(frame)
        if behind == "silence":
            beats[-1] = beats[-1]._replace(end_of_line=False)
        else:
            beats += [Beat(1, False, True)] * 3 * bench.patience
        bench.scoreboard.expect(bench.golden(frame))
        bench.source.append(beats)
        await bench.drain()
    assert bench.errors() == {"line late", "frame late"}


@cocotb.test(skip=not (read_case()["thorough"] or "resets" in read_case()))
async def reset_begins_anew(dut: Any) -> None:
    """After a reset of one clock at any time the core equals a new one, clock for clock."""
    bench = Bench(dut)
    resets = read_case().get("resets", 2)
    longest = bench.core.max_columns if resets > 2 else 0
    columns, rows = bench.random_size(full_rate=True, columns=longest)
    frames = [bench.frame("random", columns, rows) for _ in range(2)]
    new: list[tuple[str, ...]] = []
    for number in range(resets + 1):
        await bench.reset(columns, rows, 1 if number else 20)
        bench.stall("none", "none")
        model = SliceModel(len(bench.core.shifts) if KIND == "raster_refocuser" else 1)
        if KIND == "raster_refocuser":
            dut.sweep.value = 1
            dut.sweep_frames.value = 2
        # Pixels before the very first frame belong to none, and are no fault.
        bench.source.append([Beat(0, False, last) for last in (False, True)])
        clocks: list[tuple[str, ...]] = []
        watcher = cocotb.start_soon(bench.record(clocks))
        for frame in frames:
            slice_ = model.next_frame(0, 1, 2)
            bench.scoreboard.expect(bench.golden(frame, slice_), slice_)
            bench.source.append(bench.beats(frame))
        await bench.drain()
        watcher.cancel()
        assert not bench.errors()
        assert clocks == (new or clocks)
        new = clocks
        bench.scoreboard.listening = False
        await bench.disturb(columns, rows, number // 2 if number % 2 and resets > 2 else 0)


@cocotb.test(skip=not read_case()["thorough"])
async def unsupported_size(dut: Any) -> None:
    """A frame of a size that the core was not built for is dropped and flagged."""
    bench = Bench(dut)
    columns, rows = bench.random_size()
    frame = bench.frame("random", columns, rows)
    for size in ((bench.core.max_columns + 1, rows), (0, rows), (columns, 0)):
        await bench.reset(columns, rows)
        dut.columns.value, dut.rows.value = size
        await bench.source.send(bench.beats(frame))
        await ClockCycles(dut.clk, 50)
        assert bench.errors() == {"size"}
    bench.set_size(columns, rows)
    bench.send_frame(frame)
    await bench.drain()
