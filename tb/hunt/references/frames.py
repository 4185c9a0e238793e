# SPDX-License-Identifier: Apache-2.0
"""Reference for streams with wrong marks: the table of faults in docs/core.md."""

from collections.abc import Iterable

LINE_EARLY, LINE_LATE, FRAME_EARLY, BETWEEN, SIZE = (1 << n for n in range(5))


class Frames:
    """Frames of a stream of beats, as lines of `tokens` words; flags of its faults.

    A frame is final when nothing that follows can change it: it has all of its lines, or the next
    one has begun. A mark of start that lasts several beats of a line is one start. `begins` has
    for each frame which start of the stream it is.
    """

    def __init__(self) -> None:
        self.frames: list[list[list[int]]] = []
        self.sizes: list[tuple[int, int]] = []
        self.begins: list[int] = []
        self.starts = 0
        self.flags = 0
        self.is_open = self.dropping = self.synchronised = self.lasting = False
        self.line: list[int] = []

    def take(self, beats: Iterable, tokens: int, rows: int, *, supported: bool = True) -> None:
        """Take beats, all with the same frame size at the ports."""
        for beat in beats:
            self.starts += beat.start
            again, self.lasting = self.lasting, False
            if beat.start and not again:
                self.dropping, self.synchronised = False, supported
                if self.is_open:
                    self.flags |= FRAME_EARLY
                    if self.line:
                        self._end_line()
                    self.is_open = False
                if not supported:
                    self.flags |= SIZE
                    continue
                self.begins.append(self.starts - 1)
                self.frames.append([])
                self.sizes.append((tokens, rows))
                self.is_open = True
            elif self.dropping:
                self.dropping = not beat.last
                continue
            elif not self.is_open:
                # Neither before the first frame nor in one that is dropped because of its size.
                if self.synchronised:
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
            else:
                self.lasting = beat.start

    def _end_line(self) -> None:
        tokens, rows = self.sizes[-1]
        self.frames[-1].append(self.line + [0] * (tokens - len(self.line)))
        self.line = []
        self.is_open = len(self.frames[-1]) < rows
