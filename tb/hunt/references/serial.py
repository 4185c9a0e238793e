# SPDX-License-Identifier: Apache-2.0
"""The serial port, from docs/boards/controls.md and the header of `command_line`: 8N1."""

from collections.abc import Sequence
from dataclasses import dataclass, field


@dataclass
class Settings:
    """Settings by commands; limits are numbers of slices, outputs, positions of the text."""

    slices: int
    outputs: int
    places: int
    first_slice: int
    values: dict[str, int] = field(default_factory=dict)
    clears: int = 0

    def reset(self) -> None:
        self.values = {"s": self.first_slice, "w": 0, "p": 0, "t": 0, "o": 0, "h": 1, "i": 8}

    def answer(self, line: Sequence[int], status: str) -> str | None:
        """Execute a line without its end; result: its answer, None if there is none."""
        characters = [chr(code) for code in line if code not in (0x20, 0x00)]
        if not characters:
            return None
        letter, digits = characters[0], "".join(characters[1:])
        limits = {"s": self.slices, "w": 256, "p": 2, "t": 2, "o": self.outputs, "h": self.places}
        limits["i"] = 9
        if letter in limits and digits.isascii() and digits.isdigit():
            if int(digits) < limits[letter]:
                self.values[letter] = int(digits)
                return "ok"
        elif letter == "?" and not digits:
            return status
        elif letter == "c" and not digits:
            self.clears += 1
            return "ok"
        return "error"

    def outputs_now(self, *, with_text: bool) -> dict[str, int]:
        """Values of the ports while no switch is on."""
        v = self.values
        return {
            **{"slice": v["s"], "sweep": int(v["w"] > 0), "sweep_frames": v["w"]},
            **{"pass_through": v["p"], "pattern": v["t"], "shown": v["o"]},
            "text_place": v["h"] if with_text else 0,
            "polarity": v["i"],
        }


def status_text(text: str, numbers: Sequence[int]) -> str:
    """The status: each # becomes the next number."""
    parts = text.split("#")
    return parts[0] + "".join(f"{n}{part}" for n, part in zip(numbers, parts[1:], strict=True))


def levels(byte: int, *, stop: int = 1) -> list[int]:
    """Bits of a character on the line."""
    return [0, *(byte >> i & 1 for i in range(8)), stop]
