# SPDX-License-Identifier: Apache-2.0
"""Streams of video through a core, for `raster_refocuser`, `focal_stack` and `depth_index`."""

import random
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from hunt.bench import Bench
from hunt.references.frames import Frames
from hunt.references.raster_refocuser import Slices
from hunt.streams import Beat, FaultError, Sink, Source, damage, difference, frame_beats, stalls

Words = list[list[int]]
Picture = Callable[[np.ndarray, dict[str, Any], int], Words]


def pack(picture: np.ndarray, bits: int, pixels: int = 1) -> Words:
    """Words of a picture (rows, columns, channels): neighbouring pixels together, zeros after."""
    rows, columns, channels = picture.shape
    tokens = -(-columns // pixels)
    whole = np.zeros((rows, tokens * pixels, channels), dtype=object)
    whole[:, :columns] = picture
    lanes = whole.reshape(rows, tokens, pixels * channels)
    words = sum(lanes[:, :, n] << (n * bits) for n in range(pixels * channels))
    return [[int(word) for word in line] for line in words]


def unpack(words: Words, columns: int, channels: int, bits: int, pixels: int = 1) -> np.ndarray:
    """The picture (rows, columns, channels) of words."""
    packed = np.array(words, dtype=object)
    lanes = [(packed >> (n * bits)) & ((1 << bits) - 1) for n in range(pixels * channels)]
    whole = np.stack(lanes, axis=-1).reshape(len(words), -1, channels)
    return whole[:, :columns].astype(np.int64)


def draw_frame(rng: random.Random, rows: int, columns: int, channels: int, bits: int) -> np.ndarray:
    """A picture: noise, black, white, few pixels, or a ramp."""
    kind = rng.choice(["noise", "noise", "noise", "black", "white", "few", "ramp"])
    draw = np.random.default_rng(rng.getrandbits(32))
    white, shape = (1 << bits) - 1, (rows, columns, channels)
    if kind == "ramp":
        ramp = np.add.outer(np.arange(rows) * draw.integers(9), np.arange(columns))
        return np.repeat(ramp[:, :, None], channels, axis=2) % (white + 1)
    noise = draw.integers(0, white, shape, endpoint=True)
    dots = noise * (draw.random(shape) < 0.05)
    return {"noise": noise, "black": 0 * noise, "white": 0 * noise + white, "few": dots}[kind]


def draw_slice(rng: random.Random, count: int) -> int:
    """A slice to select: an existing one, the first invalid one, or any number."""
    return rng.choice([rng.randrange(count), min(count, 255), rng.randrange(256)])


class CoreHunt:
    """Random segments of frames through a core; each segment has its own size of frame.

    `picture` returns the expected words of a frame, `size` draws columns and rows, `slices` is the
    number of slices to select from (0: none), `limit` bounds the clocks in which the lines of a
    frame must come out without stalls, `held` the lines that an unfinished frame holds back;
    without `flush` every frame does.
    """

    def __init__(
        self,
        bench: Bench,
        rng: random.Random,
        picture: Picture,
        *,
        size: Callable[[random.Random], tuple[int, int]],
        channels: int,
        bits: int,
        pixels: int,
        slices: int,
        limit: Callable[[int, int], int],
        held: int,
        stable: tuple[str, ...] = (),
        flush: bool = True,
    ) -> None:
        self.bench, self.rng, self.g = bench, rng, bench.design["generics"]
        self.picture, self.size, self.limit = picture, size, limit
        self.channels, self.bits, self.pixels = channels, bits, pixels
        self.stable, self.held, self.flush = stable, held, flush
        if not bench.ports:
            bench.add(Source(bench.dut, "s_axis"))
            bench.add(Sink(bench.dut, "m_axis"))
        self.source, self.sink = bench.ports[:2]
        self.source.on_taken = self.taken
        self.count = slices
        self.slices = Slices(max(slices, 1))
        self.frames = Frames()
        self.checked = 0
        self.columns = self.rows = 1
        # Slice, sweep and frames of a slice at the ports; the slice of each start that was taken.
        self.order: tuple[int, int, int] = (0, 0, 0)
        self.begun: list[int] = []
        self.lasting = False

    @property
    def tokens(self) -> int:
        return -(-self.columns // self.pixels)

    def words(self) -> list[Beat]:
        """Beats of a random frame, with random lanes after a line's last pixel."""
        frame = draw_frame(self.rng, self.rows, self.columns, self.channels, self.bits)
        lines = pack(frame, self.bits, self.pixels)
        used = ((self.columns - 1) % self.pixels + 1) * self.channels * self.bits
        spare = self.pixels * self.channels * self.bits - used
        for line in lines:
            line[-1] |= self.rng.getrandbits(spare) << used if spare else 0
        return frame_beats(lines)

    def turn(self) -> None:
        rng = self.rng
        self.bench.ports[2:] = []
        if not self.count:
            return
        kind = rng.choice(["fixed", "sweep", "any moment"])
        self.ask(draw_slice(rng, self.count), int(kind == "sweep"), rng.randrange(4))
        self.bench.counts[f"slices: {kind}"] += 1
        if kind == "any moment":
            self.bench.add(_Turner(self, rng.choice([1, 3, 40, 400])))

    def ask(self, slice_: int, sweep: int, sweep_frames: int) -> None:
        """Set the ports of the slice."""
        self.order = (slice_, sweep, sweep_frames)
        self.bench.set(slice=slice_, sweep=sweep, sweep_frames=sweep_frames)

    def taken(self, beat: Beat) -> None:
        """A beat was taken: a start has the slice of this clock.

        In a sweep a mark of start that lasts several beats of a line counts once.
        """
        if beat.start:
            again = self.lasting
            self.begun.append(self.begun[-1] if again else self.slices.next(*self.order))
        self.lasting = beat.start and not beat.last

    def expected(self, number: int) -> list[Beat]:
        """Expected beats of a frame."""
        columns = self.widths[number]
        lines = self.frames.frames[number]
        raw = unpack(lines, columns, self.channels, self.bits, self.pixels)
        slice_ = self.begun[self.frames.begins[number]] if self.count else 0
        beats = frame_beats(self.picture(raw, self.g, slice_))
        return [Beat(b.data, b.start, b.last, slice_) for b in beats]

    def compare(self, *, whole: bool) -> None:
        """Compare the output: all final frames if `whole`, else as far as it has come."""
        got = self.sink.received
        while self.checked < len(self.frames.frames):
            number = self.checked
            final = number < len(self.frames.frames) - 1 or not self.frames.is_open
            if not final or self.at >= len(got):
                break
            want = self.expected(number)
            part = got[self.at : self.at + len(want)]
            if not whole:
                want = want[: len(part)]
            wrong = difference(part, want, -(-self.widths[number] // self.pixels))
            if wrong:
                raise FaultError(f"frame {number}, {self.widths[number]} columns: {wrong}")
            if not whole and len(part) < len(self.frames.frames[number]) * self.tokens:
                return
            self.at += len(want)
            self.checked += 1

    def due_beats(self) -> int:
        """Number of beats that must come: all, less those that an unfinished frame holds back."""
        tokens = [
            size[0]
            for size, f in zip(self.frames.sizes, self.frames.frames, strict=True)
            for _ in f
        ]
        return sum(tokens[: -self.held] if self.frames.is_open or not self.flush else tokens)

    async def come_out(self) -> None:
        """Wait for all final frames, then compare them."""
        limit = 20 * (self.limit(self.columns, self.rows) + 4 * self.source.taken + 400)
        await self.bench.until(lambda: self.source.idle, 2 * limit, "the source is refused")
        for _ in range(limit):
            if len(self.sink.received) >= self.due_beats():
                break
            await self.bench.clocks()
        else:
            self.compare(whole=False)
            came = len(self.sink.received)
            raise FaultError(
                f"{came} of {self.due_beats()} beats came, frame {self.checked} is missing"
            )
        self.compare(whole=self.flush and not self.frames.is_open)

    async def quiet(self) -> None:
        """Check that nothing more comes, and that flags report the faults of the stream."""
        frames = self.frames
        await self.bench.until(
            lambda: self.bench.number("error_flags") == frames.flags,
            self.limit(self.columns, self.rows) + 400,
            f"error flags {frames.flags:05b}",
        )
        await self.bench.clocks(self.rng.choice([30, 30, 300]))
        too_many = len(self.sink.received) - self.due_beats()
        if self.flush and not self.frames.is_open and too_many:
            raise FaultError(f"{too_many} beats too many")
        if self.bench.number("error_flags") != frames.flags:
            raise FaultError(
                f"flags {self.bench.number('error_flags'):05b}, want {frames.flags:05b}"
            )
        # Without a flush, beats under way may still set flags later.
        if self.rng.random() < 0.5 and self.source.idle and self.flush:
            self.bench.set(error_clear=1)
            await self.bench.clocks()
            self.bench.set(error_clear=0)
            frames.flags = 0
            await self.bench.clocks(2)
            if self.bench.number("error_flags"):
                raise FaultError("error_clear leaves flags")

    def start_frames(self) -> Iterator[list[Beat | int]]:
        """Send frames of a segment, well-formed and broken, in chunks, with pauses."""
        rng, counts = self.rng, self.bench.counts
        broken = rng.choice([0, 0, 0.5, 1])
        for _ in range(rng.randint(1, 3)):
            beats = self.words()
            if rng.random() < broken:
                name, beats = damage(beats, self.tokens, rng)
                counts[f"damage: {name}"] += 1
            else:
                counts["frames: well-formed"] += 1
            items: list[Beat | int] = list(beats)
            for _ in range(rng.choice([0, 0, 1, 3])):
                whole = self.limit(self.columns, self.rows) if rng.random() < 0.2 else 2
                longest = rng.choice([2, 2 * self.tokens, whole])
                items.insert(rng.randrange(len(items) + 1), rng.randint(1, longest))
            yield items

    async def run(self) -> None:
        bench, rng = self.bench, self.rng
        self.widths: list[int] = []
        self.at = 0
        bench.set(error_clear=0, columns=rng.getrandbits(16), rows=rng.getrandbits(16))
        if self.count:
            bench.set(slice=0, sweep=0, sweep_frames=0)
        self.source.stalls, self.sink.stalls = stalls(rng), stalls(rng)
        self.sink.shy = rng.random() < 0.1
        await bench.reset(rng.choice([1, 1, 2, 9]))
        torn = rng.random() < 0.25
        segments = rng.choice([1, 2, 2, 3]) if self.flush else 1
        for segment in range(segments):
            if self.flush and rng.random() < 0.06:
                await self.unsupported()
            self.columns, self.rows = self.size(rng)
            bench.set(columns=self.columns, rows=self.rows)
            for name in self.stable:
                bench.set(**{name: self.rows})
            self.turn()
            bench.counts["frames: another size"] += segment > 0
            if torn and segment == segments - 1:
                await self.tear()
                return
            for items in self.start_frames():
                self.send(items)
                if rng.random() < 0.2:
                    bench.counts["silence until all is out"] += 1
                    await self.come_out()
            if self.frames.is_open:
                self.send(list(self.words()))
            await self.come_out()
            if rng.random() < 0.3:
                await self.quiet()
        await self.quiet()

    def send(self, items: list[Beat | int]) -> None:
        """Queue beats, and note their meaning."""
        self.source.send(items)
        beats = [item for item in items if isinstance(item, Beat)]
        self.frames.take(beats, self.tokens, self.rows)
        self.widths += [self.columns] * (len(self.frames.frames) - len(self.widths))

    async def unsupported(self) -> None:
        """Check that a frame of an unsupported size is dropped."""
        bench, rng = self.bench, self.rng
        self.columns, self.rows = self.size(rng)
        beats = self.words()
        most = self.g["MAX_COLUMNS"]
        wrong = rng.choice([(0, self.rows), (most + 1, self.rows), (self.columns, 0)])
        bench.set(columns=wrong[0], rows=wrong[1])
        bench.counts["frames: unsupported size"] += 1
        self.source.send(beats)
        self.frames.take(beats, self.tokens, self.rows, supported=False)
        await self.come_out()
        await self.quiet()

    async def tear(self) -> None:
        """Stop at any point: the next stream begins with a reset."""
        self.bench.counts["reset inside"] += 1
        for items in self.start_frames():
            self.send(items)
        spent = self.rng.choice([5, self.limit(self.columns, self.rows), 3 * len(items)])
        await self.bench.clocks(self.rng.randint(1, spent))
        self.compare(whole=False)


class _Turner:
    """Changes slice and sweep at any time."""

    def __init__(self, hunt: CoreHunt, longest: int) -> None:
        self.hunt, self.longest, self.wait = hunt, longest, 1

    def restart(self) -> None:
        self.wait = 1 << 30

    def step(self, clock: int) -> None:
        self.wait -= 1
        if self.wait == 0:
            rng = self.hunt.rng
            self.wait = rng.randint(1, self.longest)
            _, sweep, every = self.hunt.order
            sweep = rng.choice([sweep, sweep, rng.randrange(2)])
            every = rng.choice([every, every, rng.randrange(4)])
            self.hunt.ask(draw_slice(rng, self.hunt.count), sweep, every)
