# SPDX-License-Identifier: Apache-2.0
"""A device on two I2C lines, and the rules of UM10204 (rev. 7, table 10, standard mode)."""

import random
from collections.abc import Callable

# Least times in ns: start to clock low; clock low; clock high; set-up of a repeated start, of data,
# of a stop; from a stop to a start.
HD_STA, LOW, HIGH, SU_STA, SU_DAT, SU_STO, BUF = 4000, 4700, 4000, 4700, 250, 4000, 4700
# Longest times in ns: rise of a line, the device's data behind the clock's fall.
RISE, VD_DAT = 1000, 3450


class RuleError(AssertionError):
    """A time or an order of edges that UM10204 forbids."""


class Lines:
    """The levels of the two lines, which either side may pull low, and the times of their edges.

    `later` calls a function after a time in ns. Times are checked while `strict`.
    """

    def __init__(
        self, rng: random.Random, now: Callable[[], float], later: Callable[..., None]
    ) -> None:
        self.rng, self.now, self.later = rng, now, later
        self.pulls = {"scl": [False, False], "sda": [False, False]}
        self.level = {"scl": 1, "sda": 1}
        self.device: Device | None = None
        self.edge = {"scl": -1e9, "sda": -1e9}
        self.stopped = self.started = -1e9
        self.strict = True
        # When the master last moved each line; times between its moves of different lines.
        self.moved = {"scl": -1e9, "sda": -1e9}
        self.gaps: list[float] = []

    def pull(self, name: str, side: int, low: bool) -> None:
        """A side, 0 the master, pulls a line or lets it go; the level follows a slope later."""
        was, self.pulls[name][side] = self.pulls[name][side], low
        if was == low:
            return
        if side == 0:
            other = "sda" if name == "scl" else "scl"
            self.gaps.append(self.now() - self.moved[other])
            self.moved[name] = self.now()
        level = int(not any(self.pulls[name]))
        if level and not self.level[name]:
            self.later(self.rng.choice([0, 300, RISE]), self._move, name)
        elif not level and self.level[name]:
            self._move(name)

    def _move(self, name: str) -> None:
        level = int(not any(self.pulls[name]))
        if level == self.level[name]:
            return
        self.level[name] = level
        now = self.now()
        self._check(name, level, now)
        self.edge[name] = now
        assert self.device is not None
        self.device.follow(name, level)

    def _least(self, rule: str, since: float, least: float) -> None:
        if self.strict and self.now() - since < least:
            raise RuleError(f"{rule}: {self.now() - since:.0f} ns, at least {least} ns")

    def _check(self, name: str, level: int, now: float) -> None:
        scl, sda = self.edge["scl"], self.edge["sda"]
        if name == "scl" and level:
            self._least("low time of the clock", scl, LOW)
            if not self.pulls["sda"][1]:
                self._least("set-up of data", sda, SU_DAT)
        elif name == "scl":
            self._least("high time of the clock", scl, HIGH)
            self._least("hold of a start", self.started, HD_STA)
        elif self.level["scl"] and self.pulls["sda"][0]:
            self._least("set-up of a repeated start", scl, SU_STA)
            self._least("bus free time", self.stopped, BUF)
            self.started = now
        elif self.level["scl"] and level:
            self._least("set-up of a stop", scl, SU_STO)
            self.stopped = now


class Device:
    """A device that takes bytes and sends bytes, and logs what it understands.

    `answers` says for each byte taken whether it is acknowledged; `sends` are the bytes it sends
    while `sending`. The data line has junk on it until VD_DAT behind the clock's fall, or until
    SU_DAT before a stretched clock is let go; junk follows again at once behind the next fall.
    """

    def __init__(self, lines: Lines, rng: random.Random) -> None:
        self.lines, self.rng = lines, rng
        lines.device = self
        self.log: list[tuple[str, int]] = []
        self.answers: list[bool] = []
        self.sends: list[int] = []
        self.sending = False
        self.stretch = 0.0
        self.bits: list[int] | None = None
        self.present = 0
        # Pulls a one of the master's low at this bit of the next byte.
        self.disturbs: int | None = None

    def follow(self, name: str, level: int) -> None:
        """Follow an edge of a line."""
        if name == "sda":
            if self.lines.level["scl"]:
                self.log.append(("stop" if level else "start", len(self.bits or ())))
                self.bits = None if level else []
                self.sending = False
        elif level:
            if self.bits is not None:
                self.bits.append(self.lines.level["sda"])
                if len(self.bits) == 9:
                    byte = int("".join(map(str, self.bits[:8])), 2)
                    self.log.append((f"byte, {'no ' * self.bits[8]}acknowledge", byte))
        else:
            self._fall()

    def _fall(self) -> None:
        if self.bits is not None and len(self.bits) == 9:
            if self.sending and self.bits[8]:
                self.sending = False
            elif not self.sending and self.log[-1][1] & 1 and self.log[-2][0] == "start":
                self.sending = self.bits[8] == 0
            self.bits = []
        low = self._drives()
        wait = VD_DAT
        if self.stretch and self.rng.random() < 0.3:
            held = self.rng.uniform(VD_DAT + SU_DAT, self.stretch)
            self.lines.pull("scl", 1, True)
            self.lines.later(held, self.lines.pull, "scl", 1, False)
            wait = held - SU_DAT - RISE
        if self.bits is not None:
            self.lines.pull("sda", 1, bool(self.rng.getrandbits(1)))
            self.lines.later(max(wait, 0), self.lines.pull, "sda", 1, low)
        else:
            self.lines.pull("sda", 1, False)

    def _drives(self) -> bool:
        """Whether the device pulls the data line in the bit that comes."""
        if self.bits is None:
            return False
        place = len(self.bits)
        if self.sending:
            if place == 0:
                self.present = self.sends.pop(0) if self.sends else 0xFF
            return place < 8 and not self.present >> (7 - place) & 1
        if place == 8:
            return self.answers.pop(0) if self.answers else True
        if place == self.disturbs:
            self.disturbs = None
            return True
        return False
