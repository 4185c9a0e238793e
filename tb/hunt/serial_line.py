# SPDX-License-Identifier: Apache-2.0
"""A serial line for hunts: levels for `line_in`, characters from `line_out`."""

from collections import deque
from typing import Any

from hunt.references.serial import levels
from hunt.streams import FaultError


class SerialLine:
    """Both ends of a line with a number of clocks per bit."""

    def __init__(self, bench: Any) -> None:
        self.bench, self.bit = bench, bench.design["generics"]["BIT_CLOCKS"]
        self.restart()

    def restart(self) -> None:
        """Idle line; received characters are dropped."""
        # Levels and their clocks.
        self.todo: deque[tuple[int, int]] = deque()
        self.left = 0
        self.text = b""
        # Levels of the character being received.
        self.seen: list[int] = []
        self.bench.set(line_in=1)

    @property
    def sent(self) -> bool:
        return not self.todo and not self.left

    def hold(self, level: int, clocks: int) -> None:
        if clocks:
            self.todo.append((level, clocks))

    def send(self, byte: int, *, factor: float = 1.0, stop: int = 1) -> None:
        """Queue a character, slower by a factor."""
        passed = 0
        for number, level in enumerate(levels(byte, stop=stop), 1):
            end = round(number * self.bit * factor)
            self.hold(level, end - passed)
            passed = end

    def step(self, clock: int) -> None:
        if self.left:
            self.left -= 1
        if not self.left and self.todo:
            level, self.left = self.todo.popleft()
            self.bench.set(line_in=level)
        out = self.bench.number("line_out")
        if self.seen or out == 0:
            self.seen.append(out)
            if len(self.seen) == 10 * self.bit:
                self._character()

    def _character(self) -> None:
        bits = [self.seen[i * self.bit : (i + 1) * self.bit] for i in range(10)]
        if any(min(bit) != max(bit) for bit in bits) or bits[9][0] != 1:
            raise FaultError(f"no character: {bits}")
        self.text += bytes([sum(bit[0] << i for i, bit in enumerate(bits[1:9]))])
        self.seen = []
