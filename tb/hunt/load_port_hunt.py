# SPDX-License-Identifier: Apache-2.0
"""Hunt of `load_port` between the serial line and `command_line`."""

import random
from typing import Any

from hunt.references.load_port import Word, answer
from hunt.serial_line import SerialLine

ENTITY = "load_ports"
FAULTS = [
    ("load_port.vhd", "begins <= ends or (begins and blank);", "begins <= ends;"),
    ("load_port.vhd", "if count = DIGITS then", "if false then"),
    ("uart_receiver.vhd", "valid <= not arrived(0);", "valid <= '1';"),
    ("load_port.vhd", "and word(63 downto 62) = \"00\"", "and word(63) = '0'"),
]  # fmt: skip
# All except NUL, which the command line ignores.
BYTES = [chr(code) for code in range(1, 256)]


def draw(rng: random.Random) -> dict[str, Any]:
    """Draw a bit's clocks and a description."""
    text = "".join(rng.choice("resampl_= 0123456789?#") for _ in range(rng.randint(1, 20)))
    return {"generics": {"DESCRIPTION": f"r{text}.", "BIT_CLOCKS": rng.randint(4, 9)}}


class Line(SerialLine):
    """The serial line, and the words that go out."""

    def restart(self) -> None:
        super().restart()
        self.words: list[Word] = []

    def step(self, clock: int) -> None:
        super().step(clock)
        if self.bench.number("load_write"):
            names = ("load_kind", "load_address", "load_data")
            self.words.append(tuple(self.bench.number(name) for name in names))  # type: ignore[arg-type]

    @property
    def heard(self) -> str:
        return self.text.decode("latin-1")


def draw_line(rng: random.Random) -> str:
    """A line without its end: a word, the question, a command, or one with errors."""
    digits = "0123456789abcdefABCDEF"
    word = rng.choice("0123" * 8 + digits) + "".join(rng.choice(digits) for _ in range(15))
    text = rng.choice(
        ["l" + word] * 4 + ["l?", "?", "c", "", rng.choice("swptohx") + str(rng.randrange(300))]
    )
    for _ in range(rng.choice([0, 0, 0, 1, 2])):
        at = rng.randrange(len(text) + 1)
        kind = rng.randrange(4)
        if kind == 0:
            text = text[:at] + rng.choice(BYTES).replace("\r", "\t").replace("\n", "z") + text[at:]
        elif kind == 1:
            text = text[:at] + text[at + 1 :]
        elif kind == 2:
            text = text[:at] + rng.choice(digits) + text[at:]
        else:
            text = text[:at] + text[at : at + 1] + text[at:]
    for _ in range(rng.choice([0, 0, 1, 3])):
        at = rng.randrange(len(text) + 1)
        text = text[:at] + " " + text[at:]
    return text


async def stream(bench: Any, rng: random.Random) -> None:
    if not bench.ports:
        bench.add(Line(bench))
    line: Line = bench.ports[0]
    busy = False
    bench.set(busy=0)
    await bench.reset(rng.choice([1, 1, 2, 9]))
    # The receiver needs an idle line first.
    await bench.clocks(4)
    description = bench.design["generics"]["DESCRIPTION"]
    longest = (len(description) + 12) * 10 * line.bit + 100
    for _ in range(rng.randint(3, 8)):
        if rng.random() < 0.2:
            await noise(bench, line, rng)
        if rng.random() < 0.2:
            busy = not busy
            bench.set(busy=int(busy))
        text = draw_line(rng)
        bench.counts["line of load_port" if text.strip(" ")[:1] == "l" else "other line"] += 1
        line.text, line.words = b"", []
        for character in text:
            if rng.random() < 0.02:
                bench.counts["byte without a stop bit"] += 1
                line.send(rng.randrange(128), stop=0)
                line.hold(1, 2 * line.bit)
            line.send(ord(character))
            line.hold(1, rng.choice([0, 0, 0, 1, 30]))
        if rng.random() < 0.08:
            bench.counts["reset inside a line"] += 1
            await bench.clocks(rng.randint(1, 10 * line.bit * (len(text) + 1)))
            return
        line.send(ord(rng.choice("\r\r\n")))
        await bench.until(lambda: line.sent, 10**5, "the line")
        want, word = answer(text, description, busy=busy)
        wanted = "" if want is None else f"{want}\r\n"
        await bench.clocks(3 * line.bit)
        if wanted:
            await bench.until(lambda: line.heard.endswith("\n"), longest, f"answer to {text!r}")
        await bench.clocks(rng.choice([0, 12 * line.bit]))
        assert line.heard == wanted, f"{text!r}: {line.heard!r}, want {wanted!r}"
        assert line.words == [word] * (word is not None), f"{text!r}: words {line.words}"


async def noise(bench: Any, line: Line, rng: random.Random) -> None:
    """Levels of any length, or spikes too short for a start bit; then the line is idle."""
    if rng.random() < 0.5:
        bench.counts["noise: spikes"] += 1
        for _ in range(rng.randint(1, 5)):
            line.hold(0, rng.randint(1, max(line.bit // 2 - 2, 1)))
            line.hold(1, 2 * line.bit)
        await bench.until(lambda: line.sent, 10**5, "the line")
        return
    bench.counts["noise: levels"] += 1
    for _ in range(rng.randint(1, 60)):
        line.hold(rng.randrange(2), rng.randint(1, 3 * line.bit))
    # Answers to the noise, and to a line that it may have begun.
    for _ in range(2):
        line.hold(1, 40 * 10 * line.bit)
        line.send(13)
    line.hold(1, 40 * 10 * line.bit)
    await bench.until(lambda: line.sent, 10**5, "the line")
