# SPDX-License-Identifier: Apache-2.0
"""AXI4-Stream for hunts: sources, sinks that check the rules, stalls, damage.

Ports are stepped once after each rising edge, by the one coroutine of a hunt (`hunt.bench`).
"""

import random
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any


@dataclass(frozen=True, slots=True)
class Beat:
    """One transfer: data, tuser (start of frame), tlast (end of line), tid."""

    data: int
    start: bool = False
    last: bool = False
    tid: int = 0


class FaultError(AssertionError):
    """A fault of the entity under test."""


def stalls(rng: random.Random) -> Iterator[bool]:
    """Draw a pattern of stalls: True for each stalled clock."""
    kind = rng.choice(["none", "none", "some", "many", "bursts", "rare"])
    if kind == "bursts":
        longest = rng.choice([3, 25, 150])
        while True:
            for stalled in (True, False):
                for _ in range(rng.randint(1, longest)):
                    yield stalled
    share = {"none": 0.0, "some": 0.2, "many": 0.75, "rare": 0.01}[kind]
    while True:
        yield share > 0 and rng.random() < share


class Source:
    """Offers beats; each stays until it is taken.

    Numbers between beats are idle clocks.
    """

    def __init__(self, dut: Any, name: str) -> None:
        self.name = name
        signals = {s: getattr(dut, f"{name}_{s}", None) for s in ("tvalid", "tdata", "tuser")}
        self.ready = getattr(dut, f"{name}_tready", None)
        self.signals = {**signals, "tlast": getattr(dut, f"{name}_tlast", None)}
        self.shown: dict[str, int] = {}
        self.stalls: Iterator[bool] = iter(())
        # Called with each beat in the clock in which it is taken.
        self.on_taken: Callable[[Beat], None] = lambda beat: None
        self.restart()

    def restart(self) -> None:
        """Offer nothing, and drop queued beats."""
        self.queue: deque[Beat | int] = deque()
        self.offered: Beat | None = None
        self.silence = 0
        self.taken = 0
        self._show(tvalid=0, tdata=0, tuser=0, tlast=0)

    def send(self, items: Iterable[Beat | int]) -> None:
        """Queue beats and idle clocks."""
        self.queue.extend(items)

    @property
    def idle(self) -> bool:
        """Whether all queued beats were taken."""
        return self.offered is None and not self.queue and not self.silence

    def _show(self, **values: int) -> None:
        # Only on changes: a write costs more than a clock of the simulator.
        for name, value in values.items():
            signal = self.signals[name]
            if signal is not None and self.shown.get(name) != value:
                signal.value = value
                self.shown[name] = value

    def step(self, clock: int) -> None:
        ready = str(self.ready.value) if self.ready is not None else "1"
        if ready not in ("0", "1"):
            raise FaultError(f"{self.name}_tready is {ready}")
        if self.offered is not None:
            if ready == "0":
                return
            self.taken += 1
            self.on_taken(self.offered)
            self.offered = None
        if self.silence:
            self.silence -= 1
        elif self.queue and not next(self.stalls, False):
            item = self.queue.popleft()
            if isinstance(item, Beat):
                self.offered = item
                self._show(tvalid=1, tdata=item.data, tuser=int(item.start), tlast=int(item.last))
                return
            self.silence = item
        self._show(tvalid=0)


class Sink:
    """Takes beats, and checks that an offered beat is defined and stays until it is taken.

    A shy sink is ready only after an offer.
    """

    def __init__(self, dut: Any, name: str) -> None:
        self.name = name
        self.valid = getattr(dut, f"{name}_tvalid")
        self.ready = getattr(dut, f"{name}_tready", None)
        payload = ("tdata", "tuser", "tlast", "tid")
        self.payload = [getattr(dut, f"{name}_{s}", None) for s in payload]
        self.stalls: Iterator[bool] = iter(())
        self.shy = False
        self.shown = -1
        self.restart()

    def restart(self) -> None:
        """Drop received and offered beats."""
        self.received: list[Beat] = []
        self.starts: list[int] = []
        self.refused: Beat | None = None
        self._show(0)

    def _show(self, ready: int) -> None:
        if self.ready is not None and ready != self.shown:
            self.ready.value = ready
        self.shown = ready

    def step(self, clock: int) -> None:
        valid = str(self.valid.value)
        if valid == "0":
            if self.refused is not None:
                raise FaultError(f"{self.name}: {self.refused} was withdrawn")
        elif valid != "1":
            raise FaultError(f"{self.name}_tvalid is {valid}")
        else:
            texts = [str(s.value) if s is not None else "0" for s in self.payload]
            if any(text.strip("01") for text in texts):
                raise FaultError(f"{self.name} is valid and undefined: {' '.join(texts)}")
            data, start, last, tid = (int(text, 2) for text in texts)
            offer = Beat(data, bool(start), bool(last), tid)
            if self.refused not in (None, offer):
                raise FaultError(f"{self.name}: {self.refused} became {offer}")
            self.refused = None if self.shown else offer
            if self.shown:
                self.received.append(offer)
                if offer.start:
                    self.starts.append(clock)
        if self.shy:
            # Ready in the clock after an offer was not accepted.
            self._show(int(self.refused is not None))
        else:
            self._show(int(not next(self.stalls, False)))


def frame_beats(words: Sequence[Sequence[int]]) -> list[Beat]:
    """Beats of a well-formed frame: lines of words."""
    return [
        Beat(word, y == 0 and x == 0, x == len(line) - 1)
        for y, line in enumerate(words)
        for x, word in enumerate(line)
    ]


def difference(got: Sequence[Beat], want: Sequence[Beat], tokens: int) -> str:
    """First difference of two streams with lines of `tokens` beats; empty if there is none."""
    for n, (one, other) in enumerate(zip(got, want, strict=False)):
        if one != other:
            return f"beat {n} (line {n // tokens}, {n % tokens}): got {one}, want {other}"
    if len(got) != len(want):
        return f"{len(got)} beats came, {len(want)} were expected"
    return ""


def _cut(beats: list[Beat], at: int, tokens: int, rng: random.Random) -> list[Beat]:
    return beats[: at + 1]


def _lose(beats: list[Beat], at: int, tokens: int, rng: random.Random) -> list[Beat]:
    return beats[:at] + beats[at + rng.choice([1, 2, tokens, rng.randint(1, 3 * tokens)]) :]


def _repeat(beats: list[Beat], at: int, tokens: int, rng: random.Random) -> list[Beat]:
    again = beats[at : at + rng.choice([1, 2, tokens])]
    starts = rng.random() < 0.2
    return beats[:at] + again + [replace(b, start=b.start and starts) for b in beats[at:]]


def _marks(
    beats: list[Beat], share: float, rng: random.Random, change: Callable[[Beat], Beat]
) -> list[Beat]:
    return [change(b) if rng.random() < share else b for b in beats]


def _missing_last(beats: list[Beat], at: int, tokens: int, rng: random.Random) -> list[Beat]:
    return _marks(beats, rng.choice([0.2, 1.0]), rng, lambda b: replace(b, last=False))


def _final_last(beats: list[Beat], at: int, tokens: int, rng: random.Random) -> list[Beat]:
    return [*beats[:-1], replace(beats[-1], last=False)]


def _missing_start(beats: list[Beat], at: int, tokens: int, rng: random.Random) -> list[Beat]:
    return [replace(b, start=False) for b in beats]


def _extra_last(beats: list[Beat], at: int, tokens: int, rng: random.Random) -> list[Beat]:
    return [*beats[:at], replace(beats[at], last=True), *beats[at + 1 :]]


def _extra_start(beats: list[Beat], at: int, tokens: int, rng: random.Random) -> list[Beat]:
    return [*beats[:at], replace(beats[at], start=True), *beats[at + 1 :]]


def _lasting_start(beats: list[Beat], at: int, tokens: int, rng: random.Random) -> list[Beat]:
    count = rng.choice([2, 2, 4, tokens])
    return [*(replace(b, start=True) for b in beats[:count]), *beats[count:]]


def _noise(beats: list[Beat], at: int, tokens: int, rng: random.Random) -> list[Beat]:
    share = rng.choice([0.02, 0.1, 0.3])
    beats = _marks(beats, share, rng, lambda b: replace(b, last=not b.last))
    return _marks(beats, share / 3, rng, lambda b: replace(b, start=not b.start))


def _stray(beats: list[Beat], at: int, tokens: int, rng: random.Random) -> list[Beat]:
    end = rng.choice([0, len(beats)])
    count = rng.choice([1, tokens, rng.randint(1, 5 * tokens)])
    stray = [
        Beat(rng.choice(beats).data, False, rng.random() < rng.choice([0, 0.2]))
        for _ in range(count)
    ]
    return beats[:end] + stray + beats[end:]


DAMAGE: dict[str, Callable[[list[Beat], int, int, random.Random], list[Beat]]] = {
    "cut": _cut,
    "lost beats": _lose,
    "repeated beats": _repeat,
    "missing tlast": _missing_last,
    "missing last tlast": _final_last,
    "missing tuser": _missing_start,
    "extra tlast": _extra_last,
    "extra tuser": _extra_start,
    "lasting tuser": _lasting_start,
    "noise": _noise,
    "stray beats": _stray,
}


def damage(beats: list[Beat], tokens: int, rng: random.Random) -> tuple[str, list[Beat]]:
    """Damage a frame in one of the ways of `DAMAGE`; result: its name and the frame."""
    name = rng.choice(list(DAMAGE))
    return name, DAMAGE[name](beats, rng.randrange(len(beats)), tokens, rng)
