# SPDX-License-Identifier: Apache-2.0
"""Video for hunts: modes, and the signals of frames, one entry a clock."""

import random
from dataclasses import dataclass


@dataclass(frozen=True)
class Mode:
    """Active, front porch, sync, back porch of lines and frames; levels of the sync pulses."""

    h: tuple[int, int, int, int]
    v: tuple[int, int, int, int]
    h_level: int = 1
    v_level: int = 1

    @property
    def line(self) -> int:
        return sum(self.h)

    @property
    def total(self) -> int:
        return sum(self.h) * sum(self.v)

    def at(self, clock: int) -> tuple[int, int, int]:
        """Active, horizontal and vertical sync, clocks from a frame's first pixel on."""
        y, x = divmod(clock % self.total, self.line)
        active = x < self.h[0] and y < self.v[0]
        begin = self.h[0] + self.h[1]
        in_h = begin <= x < begin + self.h[2]
        # Vertical sync changes with the leading edge of horizontal sync.
        place = y * self.line + x - begin - (self.v[0] + self.v[1]) * self.line
        in_v = 0 <= place < self.v[2] * self.line
        return int(active), int(in_h == self.h_level), int(in_v == self.v_level)

    def timing(self) -> int:
        """The mode packed as in video_pkg: counts of 12 bits, and the two levels."""
        sync, sync_line = self.h[0] + self.h[1], self.v[0] + self.v[1]
        counts = (
            *(self.h[0], self.line, sync, sync + self.h[2]),
            *(self.v[0], sum(self.v), sync_line, sync, sync_line + self.v[2], sync),
        )
        packed = sum(n << 12 * i for i, n in enumerate(counts))
        return packed | self.h_level << 120 | self.v_level << 121


def draw_mode(rng: random.Random, columns: tuple[int, int], *, blank: int = 0) -> Mode:
    """A small mode with the given number of active pixels, and at least `blank` others, a line."""
    h = [rng.randint(*columns), rng.randint(1, 4), rng.randint(1, 6), rng.randint(1, 6)]
    h[3] += max(0, blank - sum(h[1:]))
    v = (rng.randint(3, 8), rng.randint(1, 3), rng.randint(1, 3), rng.randint(1, 4))
    return Mode((h[0], h[1], h[2], h[3]), v, rng.randrange(2), rng.randrange(2))


def frames(mode: Mode, count: int, rng: random.Random) -> list[tuple[int, int, int, int]]:
    """Signals of frames of noise: active, syncs, pixel (0 in the blanking)."""
    found = []
    for clock in range(count * mode.total):
        active, h_sync, v_sync = mode.at(clock)
        found.append((active, h_sync, v_sync, rng.getrandbits(24) if active else 0))
    return found
