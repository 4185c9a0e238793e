# SPDX-License-Identifier: Apache-2.0
"""Hunt of `stream_to_video`: broken and late streams under a raster, windows, lost inputs."""

import random
from collections.abc import Iterator
from typing import Any

from hunt.rasters import Mode, draw_mode
from hunt.streams import Beat, FaultError, damage, frame_beats, stalls

ENTITY = "stream_to_video"
FAULTS = [
    ("stream_to_video.vhd", "(s_axis.tvalid = '0' or s_axis.tuser(0) = '1') then",
     "s_axis.tuser(0) = '1' then"),
    ("stream_to_video.vhd", "<= take or (not in_step and not s_axis.tuser(0)) or drop;",
     "<= take or not in_step or drop;"),
]  # fmt: skip


def draw(rng: random.Random) -> dict[str, Any]:
    return {"generics": {"DELAY_PIXELS": rng.randint(0, 12), "WINDOW": rng.random() < 0.5}}


class Screen:
    """The input's raster, a stream, and the expected screen.

    A frame of the stream waits for its position on the screen, and is shown as long as its pixels
    come in time; the rest of its area is black. Pixels of other frames are dropped.
    """

    def __init__(self, dut: Any, design: dict[str, Any]) -> None:
        self.dut = dut
        self.pixels, self.window = design["DELAY_PIXELS"], bool(design["WINDOW"])
        # Clocks from a start to the first pixel of the frame at the ports.
        self.late = 4 + self.window
        self.mode: Mode = Mode((4, 1, 1, 1), (3, 1, 1, 1))
        self.rng = random.Random(0)
        self.stalls: Iterator[bool] = iter(())
        self.restart()

    def restart(self) -> None:
        self.queue: list[Beat] = []
        self.offered: Beat | None = None
        self.following = False
        self.position = 0
        self.lines = 0
        self.size = (0, 0)
        # Clock at which a frame of the raster begins at the ports, and its mode.
        self.begin = -1
        self.coming: list[tuple[int, Mode, tuple[int, int], int]] = []
        self.shown: Mode | None = None
        self.shown_size = (0, 0)
        # Whether a frame of the stream is being shown; the beat of the next clock.
        self.in_step = False
        # The size of the picture applies from the first frame of its segment on.
        self.blind = True
        self.segment = 0
        self.clocks = 0
        self.taken: Beat | None = None
        self.whole = self.underflows = 0
        self.dut.following_running.value = 0
        self.dut.s_axis_tvalid.value = 0

    @property
    def window_of(self) -> tuple[int, int, int, int]:
        assert self.shown is not None
        columns, rows = self.shown_size if self.window else (self.shown.h[0], self.shown.v[0])
        return (self.shown.v[0] - rows) // 2, (self.shown.h[0] - columns) // 2, rows, columns

    def fits(self) -> bool:
        columns, rows = self.size
        return not self.window or (columns <= self.mode.h[0] and 1 <= rows <= self.mode.v[0])

    def step(self, clock: int) -> None:
        names = ("s_axis_tready", "active", "h_sync", "v_sync", "pixel", "running", "underflow")
        texts = [str(getattr(self.dut, name).value) for name in names]
        if "".join(texts).strip("01"):
            raise FaultError(f"{names} are {texts}")
        ready, active, h_sync, v_sync, pixel, running, underflow = (int(t, 2) for t in texts)
        self.underflows += underflow
        while self.coming and self.coming[0][0] <= clock:
            self.begin, self.shown, self.shown_size, segment = self.coming.pop(0)
            self.blind = self.blind and segment != self.segment
        place = clock - self.begin
        want = (0, 0, 0) if self.shown is None else self.shown.at(place)
        # After a reset the syncs keep their levels for a clock; the levels of a new mode come one
        # clock before its first pixel.
        ahead = any(begin == clock + 1 for begin, *_ in self.coming)
        syncs = (h_sync, v_sync) if self.clocks and not ahead else want[1:]
        self.clocks += 1
        if (active, *syncs, running) != (*want, int(self.shown is not None)):
            raise FaultError(f"active, syncs, running {(active, *syncs, running)}, want {want}")
        if not self.blind:
            self._picture(pixel, place)
        # A beat taken now is at the ports in the next clock.
        beat = self.offered if self.offered is not None and ready else None
        self.taken = beat
        if beat is not None:
            self.offered = None
        self._offer()
        self._raster(clock)

    def _inside(self, place: int) -> int:
        """Number of a pixel of the picture; -1 outside."""
        assert self.shown is not None
        y, x = divmod(place % self.shown.total, self.shown.line)
        top, left, rows, columns = self.window_of
        inside = top <= y < top + rows and left <= x < left + columns and self.fits_now
        return (y - top) * columns + x - left if inside else -1

    @property
    def fits_now(self) -> bool:
        assert self.shown is not None
        columns, rows = self.shown_size
        return not self.window or (columns <= self.shown.h[0] and 1 <= rows <= self.shown.v[0])

    def _picture(self, pixel: int, place: int) -> None:
        """Check that the pixel at the ports is the beat for its position, or black."""
        number = -1 if self.shown is None else self._inside(place)
        beat = self.taken
        if number < 0:
            if pixel:
                raise FaultError(f"{pixel:06x} outside of the picture")
            if beat is not None and self.shown is not None and self.in_step and self.fits_now:
                raise FaultError("a pixel is taken outside of the picture")
            if beat is not None and beat.start and self.shown is not None and self.fits_now:
                raise FaultError("a start of frame is dropped")
            return
        if number == 0:
            self.in_step = beat is not None and beat.start
            if beat is not None and not beat.start and pixel:
                raise FaultError("a frame begins without a start")
        elif beat is None or beat.start:
            if beat is not None:
                raise FaultError("a start of frame is taken inside of a picture")
            self.in_step = False
        want = beat.data if self.in_step and beat is not None else 0
        if pixel != want:
            raise FaultError(f"pixel {number} is {pixel:06x}, want {want:06x}")
        rows, columns = self.window_of[2:]
        self.whole += self.in_step and number == rows * columns - 1

    def _offer(self) -> None:
        if self.offered is None and self.queue and not next(self.stalls, False):
            self.offered = self.queue.pop(0)
        beat = self.offered
        self.dut.s_axis_tvalid.value = int(beat is not None)
        if beat is not None:
            self.dut.s_axis_tdata.value, self.dut.s_axis_tuser.value = beat.data, int(beat.start)

    def _raster(self, clock: int) -> None:
        """The position signals of video_to_stream."""
        self.dut.following_running.value = int(self.following)
        if not self.following:
            self.position = 0
            return
        y, x = divmod(self.position % self.mode.total, self.mode.line)
        self.dut.following_row.value, self.dut.following_column.value = y, x
        if (y, x) == (self.lines, self.pixels):
            self.coming.append((clock + self.late, self.mode, self.size, self.segment))
        self.position += 1


class Hunt:
    """Segments of a mode and a size of the picture."""

    def __init__(self, bench: Any, rng: random.Random) -> None:
        self.bench, self.rng = bench, rng
        self.screen: Screen = bench.ports[0]

    def frame(self) -> list[Beat]:
        columns, rows = self.screen.size
        return frame_beats(
            [[self.rng.randrange(1, 1 << 24) for _ in range(columns)] for _ in range(rows)]
        )

    async def segment(self) -> None:
        bench, rng, screen = self.bench, self.rng, self.screen
        screen.following = False
        await bench.clocks(rng.choice([1, 1, 7, 200]))
        screen.blind = True
        screen.segment += 1
        while True:
            mode = draw_mode(rng, (4, 12))
            if mode.line > screen.pixels:
                break
        screen.mode = mode
        screen.lines = rng.randrange(sum(mode.v))
        screen.size = (mode.h[0], mode.v[0])
        if screen.window:
            columns = rng.choice([mode.h[0], rng.randint(1, mode.h[0]), mode.h[0] + 1])
            rows = rng.choice([mode.v[0], rng.randint(1, mode.v[0]), mode.v[0] + 1])
            screen.size = (columns, rows)
            bench.set(picture_columns=columns, picture_rows=rows)
        bench.set(following_timing=mode.timing(), delay_lines=screen.lines)
        kind = "window" if screen.window else "whole"
        bench.counts[f"pictures: {kind if screen.fits() else 'too large'}"] += 1
        screen.queue = []
        screen.stalls = iter(())
        await bench.clocks(4)
        if screen.window and bench.number("too_large") == screen.fits():
            raise FaultError(f"too_large of {screen.size} in {mode}")
        screen.following = True
        broken = rng.choice([0, 0, 0.4, 1])
        late = rng.random() < 0.2
        screen.stalls = stalls(rng) if late else iter(())
        bench.counts["streams: late"] += late
        for _ in range(rng.randint(1, 4)):
            beats = self.frame()
            if rng.random() < broken:
                name, beats = damage(beats, screen.size[0], rng)
                bench.counts[f"damage: {name}"] += 1
            screen.queue += beats
            await bench.clocks(mode.total if rng.random() < 0.8 else rng.randint(1, 2 * mode.total))
        # At the end whole frames in time are shown whole, as each start waits for its own frame.
        screen.stalls = iter(())
        left = sum(beat.start for beat in screen.queue) + 2
        for _ in range(4):
            screen.queue += self.frame()
        await bench.clocks((left + 1) * mode.total + screen.lines * mode.line)
        screen.queue += [b for _ in range(4) for b in self.frame()]
        await bench.clocks(mode.total)
        whole, underflows = screen.whole, screen.underflows
        await bench.clocks(2 * mode.total)
        if screen.fits() and (screen.whole != whole + 2 or screen.underflows != underflows):
            raise FaultError(f"{screen.whole - whole} of two frames in time are shown whole")


async def stream(bench: Any, rng: random.Random) -> None:
    g = bench.design["generics"]
    if not bench.ports:
        names = (
            "delay_lines",
            "picture_columns",
            "picture_rows",
            "following_timing",
            "following_column",
            "following_row",
        )
        bench.set(**dict.fromkeys(names, 0), s_axis_tdata=0, s_axis_tuser=0)
        bench.set(reset=1, following_running=0, s_axis_tvalid=0)
        await bench.clocks(4)
        bench.add(Screen(bench.dut, g))
    screen = bench.ports[0]
    screen.rng = rng
    await bench.reset(rng.choice([1, 1, 3]))
    hunt = Hunt(bench, rng)
    for _ in range(rng.randint(1, 3)):
        await hunt.segment()
        if rng.random() < 0.2:
            bench.counts["reset inside"] += 1
            await bench.clocks(rng.randrange(screen.mode.total))
            await bench.reset(1)
