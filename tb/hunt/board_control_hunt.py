# SPDX-License-Identifier: Apache-2.0
"""Hunt of the serial port (`uart_receiver`, `command_line`, `uart_transmitter`) in its place.

Commands, garbage bytes, characters without a stop bit, glitches, breaks, noise, resets.
"""

import random
from typing import Any

from hunt.references.serial import Settings, status_text
from hunt.serial_line import SerialLine
from hunt.streams import FaultError

ENTITY = "board_control"
FAULTS = [
    ("command_line.vhd", "if letter = x\"00\" or wide > 255 then", "if wide > 255 then"),
    ("uart_receiver.vhd", "BIT_CLOCKS / 2 - 1;", "BIT_CLOCKS / 2;"),
    ("uart_receiver.vhd", "valid <= not arrived(0);", "valid <= '1';"),
]  # fmt: skip


def draw(rng: random.Random) -> dict[str, Any]:
    fields = rng.randint(1, 4)
    words = ["a=", " rows=", ".", " / ", "x"]
    status = "".join(rng.choice(words) + "#" for _ in range(fields)) + rng.choice(["", " end"])
    slices = rng.choice([1, 2, 3, 10, 255, 256])
    generics = {
        "SLICES": slices,
        "OUTPUTS": rng.randint(1, 3),
        "WITH_TEXT": rng.random() < 0.5,
        "FIRST_SLICE": rng.randrange(slices),
        "STATUS": status,
        "FIELDS": fields,
        "BIT_CLOCKS": rng.choice([4, 5, 8, 8, 13]),
        "STABLE": 3,
    }
    return {"generics": generics}


class Line(SerialLine):
    """The serial line, and the pulses of `clear_errors`."""

    def restart(self) -> None:
        super().restart()
        self.clears = 0

    @property
    def idle(self) -> bool:
        """Whether all was sent, and no character is coming."""
        return self.sent and not self.seen

    def step(self, clock: int) -> None:
        super().step(clock)
        self.clears += self.bench.number("clear_errors")


def command(rng: random.Random) -> list[int]:
    """A line without its end, mostly close to a command."""
    kind = rng.choice(["good", "good", "good", "near", "garbage"])
    number = rng.choice([0, 1, 2, 3, rng.randrange(256), rng.randrange(300), rng.randrange(10**4)])
    text = rng.choice(["s#", "w#", "p#", "t#", "o#", "h#", "i#", "c", "?"])
    if kind == "good":
        text = text.replace("#", str(number) if rng.random() < 0.3 else str(number % 3))
    elif kind == "near":
        digits = rng.choice(["", str(number), f"00{number % 256}", f"{number}x", "-1", " 1 2"])
        text = rng.choice(["", "x", "5", " ", "s"]) + rng.choice([text, "#"]).replace("#", digits)
    else:
        codes = [rng.randrange(256) for _ in range(rng.randint(1, 12))]
        return [code for code in codes if code not in b"\r\n"]
    if rng.random() < 0.3:
        at = rng.randrange(len(text) + 1)
        text = text[:at] + " " * rng.randint(1, 3) + text[at:]
    return list(text.encode())


class Hunt:
    """Expected and actual settings of the board."""

    def __init__(self, bench: Any, rng: random.Random) -> None:
        self.bench, self.rng, self.g = bench, rng, bench.design["generics"]
        self.line: Line = bench.ports[0]
        text = 3 if self.g["WITH_TEXT"] else 1
        self.settings = Settings(self.g["SLICES"], self.g["OUTPUTS"], text, self.g["FIRST_SLICE"])
        self.settings.reset()
        self.bit = self.g["BIT_CLOCKS"]

    def check(self) -> None:
        want = self.settings.outputs_now(with_text=self.g["WITH_TEXT"])
        got = {name: self.bench.number(name) for name in want}
        if got != want:
            raise FaultError(f"settings {got}, want {want}")
        if self.line.clears != self.settings.clears:
            raise FaultError(f"{self.line.clears} errors cleared, want {self.settings.clears}")

    async def ask(self, line: list[int]) -> None:
        """Send a line, and check its answer and its effect."""
        rng, port, g = self.rng, self.line, self.g
        numbers = [
            rng.choice([0, -1, -32768, 32767, rng.randint(-32768, 32767)])
            for _ in range(g["FIELDS"])
        ]
        packed = sum((n & 0xFFFF) << 16 * i for i, n in enumerate(numbers))
        self.bench.set(status_values=packed)
        port.text = b""
        # As fast or as slow as can be received with samples half a bit, rounded down, after a bit's
        # first clock: the sample of the last bit, or the stop bit, just lies in it.
        bits = 9 * self.bit
        fastest, slowest = bits - (self.bit - self.bit // 2 - 1), bits + self.bit // 2
        factor = rng.choice([fastest / bits, 1, slowest / bits])
        # The line is idle for a whole bit after fast characters.
        rest = self.bit if factor < 1 else 0
        for code in line:
            if rng.random() < 0.1:
                self.glitch()
            if rng.random() < 0.1:
                self.bench.counts["characters without a stop bit"] += 1
                port.send(rng.randrange(256), stop=0)
                port.hold(1, 2 * self.bit)
            port.send(code, factor=factor)
            port.hold(1, rest + rng.choice([0, 0, 1, 7, 30]))
        for end in rng.choice([b"\r", b"\n", b"\r\n"]):
            port.send(end, factor=factor)
            port.hold(1, rest)
        want = self.settings.answer(line, status_text(g["STATUS"], numbers))
        await self.bench.until(lambda: port.sent, 10**6, "never")
        end = b"" if want is None else want.encode() + b"\r\n"
        limit = (len(end) + 4) * 10 * self.bit + 200
        await self.bench.until(lambda: len(port.text) >= len(end) and port.idle, limit, f"{end!r}")
        await self.bench.clocks(rng.choice([2, 25 * self.bit]))
        if port.text != end:
            raise FaultError(f"{bytes(line)!r} is answered by {port.text!r}, want {end!r}")
        self.check()

    def glitch(self) -> None:
        """A pulse shorter than half a bit on the idle line."""
        self.bench.counts["glitches"] += 1
        if self.bit >= 5:
            self.line.hold(0, self.rng.randint(1, self.bit // 2 - 1))
        self.line.hold(1, 2 * self.bit)

    async def noise(self) -> None:
        """Noise on the line; then idle, a line end, and commands for every setting."""
        rng, port = self.rng, self.line
        kind = rng.choice(["noise", "break", "garbage"])
        self.bench.counts[f"line: {kind}"] += 1
        if kind == "garbage":
            for _ in range(rng.randint(1, 40)):
                port.send(rng.randrange(256), stop=rng.randrange(2), factor=rng.choice([0.5, 1, 2]))
        for _ in range(rng.randint(1, 60) if kind == "noise" else 0):
            port.hold(rng.randrange(2), rng.randint(1, 4 * self.bit))
        if kind == "break":
            port.hold(0, rng.randint(1, 60) * self.bit)
        port.hold(1, 12 * self.bit)
        longest = 10 * self.bit * (8 * self.g["FIELDS"] + len(self.g["STATUS"]) + 20)
        await self.settle(longest)
        port.send(0x0D)
        await self.settle(longest)
        self.settings.clears = port.clears
        names = ["s", "w", "p", "t", "o", "h", "i"]
        for letter in rng.sample(names, len(names)):
            await self.ask(list(f"{letter}{rng.randrange(2) if letter == 'w' else 0}".encode()))
        await self.ask(list(b"?"))

    async def settle(self, clocks: int) -> None:
        await self.bench.until(lambda: self.line.idle, 10**6, "never")
        quiet = 0
        for _ in range(2 * clocks):
            quiet = 0 if self.line.seen else quiet + 1
            if quiet > 30 * self.bit:
                return
            await self.bench.clocks()
        raise FaultError("no end of answers")


async def stream(bench: Any, rng: random.Random) -> None:
    if not bench.ports:
        await bench.clocks(2)
        bench.add(Line(bench))
        pins = ("button_up", "button_down", "switch_pattern", "switch_pass", "switch_sweep")
        pins = (*pins, "button_output", "switch_hide", "switch_bottom", "load_busy")
        bench.set(status_values=0, **dict.fromkeys(pins, 0))
        # Start values of the debouncers are no press.
        await bench.reset(40)
    await bench.reset(rng.choice([1, 1, 4]))
    hunt = Hunt(bench, rng)
    await bench.clocks(1)
    hunt.check()
    for _ in range(rng.randint(3, 7)):
        action = rng.choice(["ask", "ask", "ask", "ask", "noise", "reset"])
        if action == "ask":
            bench.counts["commands"] += 1
            await hunt.ask(command(rng))
        elif action == "noise":
            await hunt.noise()
        else:
            bench.counts["reset inside"] += 1
            hunt.line.send(rng.randrange(256))
            for code in b"w99\r":
                hunt.line.send(code)
            await bench.clocks(rng.randint(1, 60 * hunt.bit))
            await bench.reset(1)
            hunt.settings.reset()
            hunt.settings.clears = 0
            # The line is idle before the next command.
            await bench.clocks(2)
