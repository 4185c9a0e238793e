# SPDX-License-Identifier: Apache-2.0
"""Frames of a sensor and calibrations for it, for `resampler` and `sensor_raster`."""

import random
from collections import deque
from collections.abc import Iterator

import numpy as np

from hunt.bench import Bench
from hunt.cores import draw_frame, pack, unpack
from hunt.grids import Grid, draw_frame_size, grid_for, limits
from hunt.references.colour_mosaic import colours
from hunt.references.frames import Frames
from hunt.references.resampler import raster, words
from hunt.streams import Beat, FaultError, Sink, Source, damage, difference, frame_beats, stalls

Word = tuple[int, int, int]
COMMIT: Word = (3, 0, 0)
GRID_FLAG = 32
MORE = "more"


class Loader:
    """The load port: words at any time, with idle clocks between them.

    Written words outlive resets and streams. `commits` are (clock, grid) of the loads that took
    effect.
    """

    def __init__(self, bench: Bench, source: Source) -> None:
        self.bench, self.source = bench, source
        generics = bench.design["generics"]
        self.needed = 15 if generics["HEXAGONAL"] or generics["SKEWED"] else 12
        self.queue: deque[Word | int] = deque()
        self.shown: Word | None = None
        self.written: dict[int, int] = {}
        self.grids: dict[tuple[int, ...], Grid] = {}
        self.commits: list[tuple[int, Grid]] = []
        self.incomplete = 0
        # Clocks at which words were taken.
        self.taken: list[int] = []
        self.silence = 0
        self.connect()

    def connect(self) -> None:
        """Offer nothing at the port."""
        self.bench.set(load_write=0, load_kind=0, load_address=0, load_data=0)

    def restart(self) -> None:
        """A reset changes nothing, but beats are counted from 0."""
        self.taken = []

    def step(self, clock: int) -> None:
        self.taken += [clock] * (self.source.taken - len(self.taken))
        if self.shown:
            self.took(self.shown, clock)
            self.shown = None
            self.bench.set(load_write=0)
        if self.silence:
            self.silence -= 1
        elif self.queue:
            item = self.queue.popleft()
            if isinstance(item, int):
                self.silence = item
                return
            kind, address, word = self.shown = item
            self.bench.set(load_write=1, load_kind=kind, load_address=address, load_data=word)

    def took(self, word: Word, clock: int) -> None:
        """A word was written in a clock."""
        if word[0] == 0:
            self.written[word[1]] = word[2]
        elif word[0] == 3 and self.written:
            if any(n not in self.written for n in range(self.needed)):
                self.incomplete += 1
                return
            registers = tuple(self.written[n] for n in range(self.needed))
            self.commits.append((clock, self.grids[registers]))
            self.written = {}

    def words(self, grid: Grid) -> list[Word]:
        """Words of the registers of a grid; those of the tables come before."""
        tables, registers = words(grid, self.bench.design["generics"])
        self.grids[tuple(word[2] for word in registers[: self.needed])] = grid
        return tables + registers

    @property
    def idle(self) -> bool:
        return not (self.queue or self.shown or self.silence)


class SensorHunt:
    """Segments of frames, each with its own size; loads between and during them."""

    def __init__(self, bench: Bench, rng: random.Random, *, mosaic: bool = False) -> None:
        self.bench, self.rng, self.g, self.mosaic = bench, rng, bench.design["generics"], mosaic
        bench.counts["streams: skewed"] += self.g["SKEWED"]
        if not bench.ports:
            self.connect()
        self.source, self.sink, self.loader = bench.ports[:3]
        self.frames = Frames()
        self.begins: list[int] = []
        self.shapes: list[tuple[int, int]] = []
        # Clocks at which frames had come out.
        self.ends: list[int] = []
        self.sent = 0
        # Numbers of beats with a mark of start.
        self.starts: list[int] = []
        # Flags that may or may not be set.
        self.loose = 0
        # Number of the first frame that is refused because of its size or grid.
        self.refused_from = 1 << 30
        self.rasters: dict[tuple[int, int, int], tuple[int, int, list[Beat]]] = {}
        self.red = rng.randrange(4)
        # Words of the current load, after the last commit.
        self.partial = bool(self.loader.written)

    def connect(self) -> None:
        """Add the ports: the two streams, and the loader."""
        source = self.bench.add(Source(self.bench.dut, "s_axis"))
        self.bench.add(Sink(self.bench.dut, "m_axis"))
        self.bench.add(Loader(self.bench, source))

    # Grids.

    def load(self, grid: Grid, kind: str = "whole") -> None:
        rng, loader = self.rng, self.loader
        every = loader.words(grid)
        if rng.random() < 0.3:
            rng.shuffle(every)
        if kind == "broken off":
            registers = [word for word in every if word[0] == 0]
            items = registers[: rng.randint(1, len(registers))]
        elif kind == "missing register":
            one = rng.randrange(loader.needed)
            at = next(n for n, word in enumerate(every) if word[:2] == (0, one))
            items = [*every[:at], *every[at + 1 :], COMMIT, every[at], COMMIT]
        else:
            items = [*every, COMMIT] * (1 + (kind == "twice"))
            items += [COMMIT] * (kind == "second commit")
        self.partial = kind == "broken off"
        self.bench.counts[f"load: {kind}"] += 1
        longest = rng.choice([0, 0, 3, 30])
        for item in items:
            loader.queue.append(item)
            if longest:
                loader.queue.append(rng.randint(0, longest))

    def some_loads(self) -> None:
        """Queue loads for the frames of this segment, to be taken at any time."""
        rng = self.rng
        tables = self.g["MOVES"] or self.g["GAINS"]
        for _ in range(rng.choice([0, 0, 1, 2, 4])):
            grid = grid_for(rng, self.g, self.rows, self.columns)
            if grid is None:
                return
            self.loader.queue.append(rng.choice([0, 10, rng.randint(0, 600)]))
            # Tables are not double buffered: an aborted load must stop before it writes them.
            kinds = ["broken off"]
            if not tables:
                kinds += ["whole", "whole", "twice", "second commit"]
                kinds += [] if self.partial else ["missing register"]
            self.load(grid, rng.choice(kinds))

    # Frames.

    def send(self, items: list[Beat | int]) -> None:
        """Queue beats, and note their meaning."""
        self.source.send(items)
        for item in items:
            if isinstance(item, Beat):
                self.note(item)

    def note(self, beat: Beat, *, supported: bool = True) -> None:
        """Note the meaning of a beat."""
        before = len(self.frames.frames)
        self.frames.take([beat], self.columns, self.rows, supported=supported)
        if len(self.frames.frames) > before:
            self.begins.append(self.sent)
            self.shapes.append((self.rows, self.columns))
        if beat.start:
            self.starts.append(self.sent)
        self.sent += 1

    def beats(self) -> list[Beat]:
        channels = 1 if self.mosaic else self.g["CHANNELS"]
        bits = self.g["PIXEL_BITS"]
        return frame_beats(
            pack(draw_frame(self.rng, self.rows, self.columns, channels, bits), bits)
        )

    def segment(self) -> Iterator[list[Beat | int]]:
        """Frames, well-formed and broken, with pauses."""
        rng, counts = self.rng, self.bench.counts
        broken = rng.choice([0, 0, 0.5, 1])
        for _ in range(rng.randint(1, 3)):
            beats = self.beats()
            if rng.random() < broken:
                name, beats = damage(beats, self.columns, rng)
                counts[f"damage: {name}"] += 1
            else:
                counts["frames: well-formed"] += 1
            items: list[Beat | int] = list(beats)
            for _ in range(rng.choice([0, 0, 1, 4])):
                items.insert(rng.randrange(len(items) + 1), rng.randint(1, 4 * self.columns + 20))
            yield items

    # Expected output.

    def candidates(self, number: int) -> list[int]:
        """Commits that may apply to a frame: the one before its first pixel.

        Of starts that wait at once, in the resampler's FIFO or in a mosaic, the last one chooses.
        """
        begin, commits = self.begins[number], self.loader.commits
        taken = self.loader.taken
        at = taken[begin] if begin < len(taken) else self.bench.clock
        waiting = 20 + self.mosaic * (80 + 3 * self.shapes[number][1])
        behind = max(n for n in self.starts if begin <= n < begin + waiting)
        until = taken[behind] if behind < len(taken) else self.bench.clock
        until = min([until, *self.ends[number : number + 1]])
        sure = max((n for n, (clock, _) in enumerate(commits) if clock <= at), default=-1)
        return [n for n in range(len(commits)) if n == sure or at < commits[n][0] <= until]

    def expected(self, number: int, commit: int) -> tuple[int, int, list[Beat]]:
        """Least lines of a frame's output, beats of a line, and most beats."""
        lines, (rows, columns) = self.frames.frames[number], self.shapes[number]
        key = (number, commit, len(lines))
        if key not in self.rasters:
            grid, g = self.loader.commits[commit][1], self.g
            channels, bits = (1 if self.mosaic else g["CHANNELS"]), g["PIXEL_BITS"]
            least, most = (
                limits(grid, g, self.rows, len(lines)) if min(rows, columns) > 1 else (0, 0)
            )
            beats: list[Beat] = []
            if most:
                raw = unpack(lines, columns, channels, bits)
                if self.mosaic:
                    raw = colours(raw[:, :, 0], *divmod(self.red, 2))
                whole = np.zeros((rows, columns, raw.shape[2]), np.int64)
                whole[: len(raw)] = raw
                beats = frame_beats(pack(raster(whole, grid, g)[:most], bits))
            width = grid["outputs"] * g["MICRO_IMAGE_SIZE"]
            self.rasters[key] = least, width, beats
        return self.rasters[key]

    def outcome(self, number: int = 0, at: int = 0, floor: int = 0) -> str:
        """Empty: all expected output has come; MORE: not yet; otherwise what is wrong."""
        got = self.sink.received
        frames = self.frames
        final = len(frames.frames) - frames.is_open
        if number == len(frames.frames):
            return "" if at == len(got) else f"{len(got) - at} beats too many"
        results = []
        for commit in self.candidates(number):
            if commit < floor:
                continue
            least, width, want = self.expected(number, commit)
            end = next(
                (n for n in range(at + 1, min(at + len(want), len(got))) if got[n].start),
                min(at + len(want), len(got)),
            )
            part = got[at:end]
            if number == final:
                # The open frame.
                results.append(difference(part, want[: len(part)], width) if at < len(got) else "")
                if at + len(part) < len(got) and not results[-1]:
                    results[-1] = "beats too many of a frame that is open"
                continue
            wrong = difference(part, want[: len(part)], width)
            if not wrong and end == len(got) and self.mosaic and frames.is_open:
                # The mosaic holds lines back until the open frame continues.
                results.append("")
                continue
            if not wrong and (len(part) < least * width or len(part) % width):
                wrong = MORE if end == len(got) else f"cut at beat {len(part)}"
            if wrong:
                results.append(wrong if wrong == MORE else f"frame {number}, {wrong}")
            else:
                results.append(self.outcome(number + 1, end, commit))
        if "" in results:
            return ""
        if MORE in results:
            return MORE
        return results[0] if results else f"frame {number} has no calibration"

    async def come_out(self) -> None:
        limit = 40 * (self.columns + 20) * (self.rows + 20)
        await self.bench.until(lambda: self.source.idle, 5 * limit, "the source is refused")
        seen, quiet = -1, 0
        while quiet < limit:
            if len(self.sink.received) != seen:
                seen, quiet = len(self.sink.received), 0
                result = self.outcome()
                if not result:
                    return
                if result != MORE:
                    raise FaultError(result)
            await self.bench.clocks(16)
            quiet += 16
        raise FaultError(f"{seen} beats came and no more; {len(self.frames.frames)} frames")

    async def quiet(self) -> None:
        """Check that nothing more comes; flags report faults of stream and calibrations."""
        bench, rng, frames = self.bench, self.rng, self.frames
        await bench.until(lambda: self.loader.idle, 10**5, "the load")
        await bench.clocks(rng.choice([150, 400]))
        wrong = self.outcome()
        if wrong:
            raise FaultError(wrong)
        self.judge_grids()
        want = frames.flags
        flags = bench.number("error_flags")
        if (flags ^ want) & ~self.loose:
            raise FaultError(f"flags {flags:06b}, want {want:06b}")
        size = bench.number("raster_rows"), bench.number("raster_columns")
        sizes = self.sizes()
        if sizes and size not in sizes:
            raise FaultError(f"size of the raster {size}, want one of {sizes}")
        if rng.random() < 0.5:
            bench.set(error_clear=1)
            await bench.clocks()
            bench.set(error_clear=0)
            frames.flags = self.loose = self.loader.incomplete = 0
            self.refused_from = len(frames.frames)
            await bench.clocks(2)
            if bench.number("error_flags"):
                raise FaultError("error_clear leaves flags")

    def judge_grids(self) -> None:
        """Flag faults of calibrations."""
        refused = [len(f) for f in self.frames.frames[self.refused_from :]]
        if max(refused, default=0) == self.rows or self.loader.incomplete:
            self.frames.flags |= GRID_FLAG
        elif refused:
            # Cut short, perhaps before the first impossible line.
            self.loose |= GRID_FLAG

    def sizes(self) -> set[tuple[int, int]]:
        """Rows and columns that the last raster may have; empty if it is not over or not there."""
        if not self.frames.frames or self.frames.is_open:
            return set()
        m, last = self.g["MICRO_IMAGE_SIZE"], len(self.frames.frames) - 1
        grids = (self.loader.commits[commit][1] for commit in self.candidates(last))
        return {(grid["lenses"][0] * m, grid["outputs"] * m) for grid in grids}

    # A stream.

    def size(self) -> Grid:
        """Draw the size of a segment's frames; a grid for it."""
        while not (found := draw_frame_size(self.rng, self.g)):
            pass
        self.rows, self.columns, grid = found
        return grid

    async def run(self) -> None:
        bench, rng, loader = self.bench, self.rng, self.loader
        bench.set(error_clear=0)
        if "MOSAIC" in self.g:
            bench.set(red_place=self.red)
        self.source.stalls, self.sink.stalls = stalls(rng), stalls(rng)
        self.sink.shy = rng.random() < 0.1
        loader.queue.clear()
        loader.silence = 0
        await bench.reset(rng.choice([1, 1, 2, 9]))
        loader.incomplete = 0
        torn = rng.random() < 0.25
        segments = rng.randint(1, 3)
        for segment in range(segments):
            grid = self.size()
            kind = rng.choice(["fitting"] * 6 + ["tall", "single"])
            tall = None
            if kind == "tall":
                tall = grid_for(rng, self.g, self.rows, self.columns, tall=True)
            bench.set(columns=self.columns, rows=self.rows)
            bench.counts["frames: another size"] += segment > 0
            self.load(tall or grid)
            await bench.until(lambda: loader.idle, 10**5, "the load")
            await bench.clocks(2)
            if tall:
                bench.counts["frames: more lines than the ring"] += 1
                self.refused_from = len(self.frames.frames)
            elif kind == "single":
                self.single()
                bench.set(columns=self.columns, rows=self.rows)
            else:
                self.some_loads()
            if torn and segment == segments - 1 and kind == "fitting":
                await self.tear()
                return
            for items in self.segment():
                self.send(items)
                if rng.random() < 0.2:
                    bench.counts["silence until all is out"] += 1
                    await self.come_out()
            if self.frames.is_open:
                self.send(list(self.beats()))
            await self.come_out()
            if kind != "fitting" or rng.random() < 0.3 or segment == segments - 1:
                await self.quiet()
            self.refused_from = 1 << 30
            self.ends += [bench.clock] * (len(self.begins) - len(self.ends))
            loader.queue.clear()
            loader.silence = 0
            await bench.until(lambda: loader.idle, 9, "the load")
            self.partial = bool(loader.written)

    def single(self) -> None:
        """Frames of a single line or column."""
        rows, columns = self.rows, self.columns
        self.rows, self.columns = self.rng.choice([(1, columns), (rows, 1), (1, 1)])
        self.bench.counts["frames: a single line or column"] += 1
        self.refused_from = len(self.frames.frames)

    async def tear(self) -> None:
        """Stop at any point: the next stream begins with a reset."""
        self.bench.counts["reset inside"] += 1
        for items in self.segment():
            self.send(items)
        await self.bench.clocks(self.rng.randint(1, 3 * self.columns * self.rows + 60))
        result = self.outcome_so_far()
        if result not in ("", MORE):
            raise FaultError(result)

    def outcome_so_far(self) -> str:
        """As `outcome`, for frames that are not completely sent yet."""
        return self.outcome() if self.source.idle else ""
