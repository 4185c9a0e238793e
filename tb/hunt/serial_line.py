# SPDX-License-Identifier: Apache-2.0
"""A serial line in hunts: what is sent to `line_in`, characters that come from `line_out`."""

from collections import deque
from typing import Any

from hunt.references.serial import levels
from hunt.streams import FaultError


class SerialLine:
    """Both ends of a line of so many clocks a bit."""

    def __init__(self, bench: Any) -> None:
        self.bench, self.bit = bench, bench.design["generics"]["BIT_CLOCKS"]
        self.restart()

    def restart(self) -> None:
        """The line rests; what came is forgotten."""
        # Levels, and for how many clocks.
        self.todo: deque[tuple[int, int]] = deque()
        self.left = 0
        self.text = b""
        # Levels of the character that is coming.
        self.seen: list[int] = []
        self.bench.set(line_in=1)

    @property
    def sent(self) -> bool:
        """Whether all was sent."""
        return not self.todo and not self.left

    def hold(self, level: int, clocks: int) -> None:
        """Queue a level."""
        if clocks:
            self.todo.append((level, clocks))

    def send(self, byte: int, *, factor: float = 1.0, stop: int = 1) -> None:
        """Queue a character, slower than it should be by a factor."""
        passed = 0
        for number, level in enumerate(levels(byte, stop=stop), 1):
            end = round(number * self.bit * factor)
            self.hold(level, end - passed)
            passed = end

    def step(self, clock: int) -> None:
        """A clock."""
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
