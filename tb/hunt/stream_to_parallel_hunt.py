# SPDX-License-Identifier: Apache-2.0
"""Hunt of `stream_to_parallel`: whole and broken frames, silence, stalls, resets."""

import random
from typing import Any

from hunt.references.parallel import frames
from hunt.streams import Beat, FaultError, Source, damage, frame_beats, stalls

ENTITY = "stream_to_parallel"
FAULTS = [
    ("stream_to_parallel.vhd", "columns_in = MAX_COLUMNS - 1)", "false)"),
    ("stream_to_parallel.vhd", "elsif word_out(WIDTH) = '1' and rows_left /= ROWS then",
     "elsif false then"),
]  # fmt: skip
# Longer than any line of a hunt with stalls.
LONGEST_LINE = 1500


def draw(rng: random.Random) -> dict[str, Any]:
    generics = {
        "WIDTH": rng.randint(1, 16),
        "MAX_COLUMNS": rng.choice([2, 3, 4, 5, 8, rng.randint(2, 24)]),
        "ROWS": rng.randint(1, 6),
        "GAP": rng.choice([2, 3, 4, 9]),
        "STALL": rng.randint(LONGEST_LINE, LONGEST_LINE + 500),
    }
    return {"generics": generics}


class Screen:
    """Receives parallel video; checks that lines are in frames, at least GAP clocks apart."""

    def __init__(self, dut: Any, gap: int) -> None:
        self.ports = (dut.frame_valid, dut.line_valid, dut.data)
        self.gap = gap
        self.restart()

    def restart(self) -> None:
        self.frames: list[list[list[int]]] = []
        self.before = (0, 0)
        self.pause = self.gap

    def step(self, clock: int) -> None:
        values = [str(port.value) for port in self.ports]
        if (
            values[0] not in "01"
            or values[1] not in "01"
            or (values[1] == "1" and "U" in values[2])
        ):
            raise FaultError(f"undefined: {values}")
        frame, line = int(values[0]), int(values[1])
        if line and not frame:
            raise FaultError("a pixel outside of a frame")
        if frame and not self.before[0]:
            self.frames.append([])
        if line and not self.before[1]:
            if self.pause < self.gap:
                raise FaultError(f"{self.pause} clocks between two lines")
            self.frames[-1].append([])
        if line:
            self.frames[-1][-1].append(int(values[2], 2))
        self.pause = 0 if line else self.pause + 1
        self.before = (frame, line)


async def stream(bench: Any, rng: random.Random) -> None:
    g = bench.design["generics"]
    if not bench.ports:
        await bench.clocks(2)
        bench.add(Source(bench.dut, "s_axis"))
        bench.add(Screen(bench.dut, g["GAP"]))
    source, screen = bench.ports
    source.stalls = stalls(rng)
    columns, rows = g["MAX_COLUMNS"], g["ROWS"]
    await bench.reset(rng.choice([1, 1, 3]))
    items: list[Beat | None] = []
    broken = rng.choice([0, 0.3, 1])
    for _ in range(rng.randint(1, 7)):
        width = rng.choice([columns, columns, rng.randint(1, columns), columns + rng.randint(1, 9)])
        count = rng.choice([rows, rows, rng.randint(1, rows + 2)])
        beats = frame_beats(
            [[rng.getrandbits(g["WIDTH"]) for _ in range(width)] for _ in range(count)]
        )
        if rng.random() < broken:
            name, beats = damage(beats, width, rng)
            bench.counts[f"damage: {name}"] += 1
        else:
            whole = count == rows and width <= columns
            bench.counts["frames: well-formed" if whole else "frames: another size"] += 1
        silent = rng.random() < 0.15
        at = rng.randrange(len(beats) + 1) if silent else len(beats)
        source.send(beats[:at])
        items += beats[:at]
        if silent:
            bench.counts["silence inside"] += 1
            await _silence(bench, source, g)
            items.append(None)
            source.send(beats[at:])
            items += beats[at:]
        elif rng.random() < 0.2:
            source.send([rng.randint(1, 60)])
        if rng.random() < 0.5:
            await bench.until(lambda: source.idle, 400 * len(beats) + 3000, "the stream is refused")
    if rng.random() < 0.2:
        bench.counts["reset inside"] += 1
        await bench.clocks(rng.randint(1, 5 * columns))
        want = frames(items, columns, rows)
        _compare(screen.frames, want, part=True)
        return
    await _silence(bench, source, g)
    _compare(screen.frames, frames(items, columns, rows), part=False)


async def _silence(bench: Any, source: Source, g: dict[str, Any]) -> None:
    """Wait until all is sent, then until an open frame must have ended."""
    await bench.until(lambda: source.idle, 400 * len(source.queue) + 9000, "the stream is refused")
    # Pixels still inside may be lines of one pixel.
    await bench.clocks(g["STALL"] + 4 * g["MAX_COLUMNS"] * (g["GAP"] + 3) + 40)
    if bench.number("frame_valid"):
        raise FaultError("frame_valid in silence")


def _compare(got: list[list[list[int]]], want: list[list[list[int]]], *, part: bool) -> None:
    for n, (one, other) in enumerate(zip(got, want, strict=False)):
        last = part and n == len(got) - 1
        if one != other and not (last and _begins(one, other)):
            raise FaultError(f"frame {n}: got {one}, want {other}")
    if len(got) > len(want) or (len(got) < len(want) and not part):
        raise FaultError(f"{len(got)} frames came, {len(want)} were expected")


def _begins(one: list[list[int]], other: list[list[int]]) -> bool:
    """Whether a frame is the beginning of another."""
    flat = [(y, pixel) for y, line in enumerate(one) for pixel in line]
    return flat == [(y, pixel) for y, line in enumerate(other) for pixel in line][: len(flat)]
