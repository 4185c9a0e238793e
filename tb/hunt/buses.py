# SPDX-License-Identifier: Apache-2.0
"""A master of AXI4-Lite for hunts, written from the standard (Arm IHI 0022).

It does what the standard allows: addresses of bytes, any strobes, address and data in any order and
far apart, several requests ahead of their answers, answers that wait for any time.
"""

import random
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from hunt.streams import FaultError, stalls

OKAY, SLVERR = 0, 2


class Channel:
    """A channel that the master drives: requests stay on offer until they are taken."""

    def __init__(self, dut: Any, name: str, fields: tuple[str, ...]) -> None:
        self.valid, self.ready = (getattr(dut, f"{name}{s}") for s in ("valid", "ready"))
        self.name = name
        self.fields = [getattr(dut, field) for field in fields]
        self.stalls: Iterator[bool] = iter(())
        self.restart()

    def restart(self) -> None:
        """Offer nothing, and drop queued requests."""
        self.queue: deque[tuple[int, ...]] = deque()
        self.offered = False
        self.valid.value = 0
        for field in self.fields:
            field.value = 0

    def step(self) -> None:
        ready = str(self.ready.value)
        if ready not in ("0", "1"):
            raise FaultError(f"{self.name}ready is {ready}")
        if self.offered:
            if ready == "0":
                return
            self.offered = False
        if self.queue and not next(self.stalls, False):
            for field, value in zip(self.fields, self.queue.popleft(), strict=True):
                field.value = value
            self.offered = True
        self.valid.value = int(self.offered)


class Answers:
    """A channel of answers: each is told when it is new, and has to stay until it is taken."""

    def __init__(self, dut: Any, name: str, fields: tuple[str, ...]) -> None:
        self.valid, self.ready = (getattr(dut, f"{name}{s}") for s in ("valid", "ready"))
        self.name = name
        self.fields = [getattr(dut, field) for field in fields]
        self.stalls: Iterator[bool] = iter(())
        self.restart()

    def restart(self) -> None:
        self.refused: tuple[int, ...] | None = None
        self.shown = 0
        self.ready.value = 0

    def step(self) -> tuple[int, ...] | None:
        """The answer that is new in this clock."""
        valid, new = str(self.valid.value), None
        if valid not in ("0", "1"):
            raise FaultError(f"{self.name}valid is {valid}")
        if valid == "1":
            texts = [str(field.value) for field in self.fields]
            if any(text.strip("01") for text in texts):
                raise FaultError(f"{self.name} is valid and undefined: {texts}")
            offer = tuple(int(text, 2) for text in texts)
            if self.refused is None:
                new = offer
            elif self.refused != offer:
                raise FaultError(f"{self.name}: {self.refused} became {offer}")
            self.refused = None if self.shown else offer
        elif self.refused is not None:
            raise FaultError(f"{self.name}: {self.refused} was withdrawn")
        self.shown = int(not next(self.stalls, False))
        self.ready.value = self.shown
        return new


@dataclass(frozen=True)
class Write:
    """A write: address of a byte, word, strobes."""

    address: int
    word: int
    strobes: int = 15


class LiteMaster:
    """AXI4-Lite: writes and reads that are under way, and their answers in order.

    `wrote(write, answer)` and `read(address, word, answer)` are called with a new answer.
    """

    def __init__(self, dut: Any, prefix: str = "s_axi_ctrl_") -> None:
        name = prefix
        self.address = Channel(dut, f"{name}aw", (f"{name}awaddr", f"{name}awprot"))
        self.data = Channel(dut, f"{name}w", (f"{name}wdata", f"{name}wstrb"))
        self.reads = Channel(dut, f"{name}ar", (f"{name}araddr", f"{name}arprot"))
        self.written = Answers(dut, f"{name}b", (f"{name}bresp",))
        self.answers = Answers(dut, f"{name}r", (f"{name}rdata", f"{name}rresp"))
        self.channels = (self.address, self.data, self.reads, self.written, self.answers)
        self.wrote: Callable[[Write, int], None] = lambda write, answer: None
        self.read: Callable[[int, int, int], None] = lambda address, word, answer: None
        self.restart()

    def restart(self) -> None:
        for channel in self.channels:
            channel.restart()
        self.answered = 0
        self.writing: deque[Write] = deque()
        self.reading: deque[int] = deque()

    def draw_stalls(self, rng: random.Random) -> None:
        for channel in self.channels:
            channel.stalls = stalls(rng)

    def write(self, write: Write, prot: int = 0) -> None:
        self.writing.append(write)
        self.address.queue.append((write.address, prot))
        self.data.queue.append((write.word, write.strobes))

    def ask(self, address: int, prot: int = 0) -> None:
        self.reading.append(address)
        self.reads.queue.append((address, prot))

    @property
    def idle(self) -> bool:
        return not (self.writing or self.reading)

    def step_reads(self) -> None:
        """Step the channels of reads: they saw the clock before this one's writes."""
        found = self.answers.step()
        if found:
            if not self.reading:
                raise FaultError(f"an answer {found} to no read")
            self.read(self.reading.popleft(), *found)
        self.reads.step()

    def step_writes(self) -> None:
        found = self.written.step()
        if found:
            if not self.writing:
                raise FaultError("an answer to no write")
            self.answered += 1
            self.wrote(self.writing.popleft(), *found)
        self.address.step()
        self.data.step()
