# SPDX-License-Identifier: Apache-2.0
"""Reference for streams with wrong marks: the table of faults in docs/core.md."""

from collections.abc import Iterable

LINE_EARLY, LINE_LATE, FRAME_EARLY, BETWEEN, SIZE = (1 << n for n in range(5))


class Frames:
    """Frames of a stream of beats, as lines of `tokens` words; flags of its faults.

    A frame is final when nothing that follows can change it: it has all of its lines, or the next
    one has begun. `loose` are flags that may or may not be set.
    """

    def __init__(self) -> None:
        self.frames: list[list[list[int]]] = []
        self.sizes: list[tuple[int, int]] = []
        self.flags = self.loose = 0
        self.is_open = self.dropping = False
        self.line: list[int] = []

    def take(self, beats: Iterable, tokens: int, rows: int, *, supported: bool = True) -> None:
        """Take beats, all with the same frame size at the ports."""
        for beat in beats:
            if beat.start:
                self.dropping = False
                if self.is_open:
                    self.flags |= FRAME_EARLY
                    if self.line:
                        self._end_line()
                    self.is_open = False
                if not supported:
                    self.flags |= SIZE
                    continue
                self.frames.append([])
                self.sizes.append((tokens, rows))
                self.is_open = True
            elif self.dropping:
                self.dropping = not beat.last
                continue
            elif not self.is_open:
                if self.flags & SIZE:
                    # The rest of a frame that is dropped because of its size.
                    self.loose |= BETWEEN
                elif self.frames:
                    self.flags |= BETWEEN
                continue
            self.line.append(beat.data)
            if len(self.line) == self.sizes[-1][0]:
                if not beat.last:
                    self.flags |= LINE_LATE
                    self.dropping = True
                self._end_line()
            elif beat.last:
                self.flags |= LINE_EARLY
                self._end_line()

    def _end_line(self) -> None:
        tokens, rows = self.sizes[-1]
        self.frames[-1].append(self.line + [0] * (tokens - len(self.line)))
        self.line = []
        self.is_open = len(self.frames[-1]) < rows
