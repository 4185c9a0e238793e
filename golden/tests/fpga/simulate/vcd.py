# SPDX-License-Identifier: Apache-2.0
"""A small VCD writer, and files that tests compare."""

from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path


@dataclass
class Vcd:
    """A VCD file: signals with their width (0: a real number), and values by cycle.

    The clock rises at 5, 15, 25 ... ns. Values change at 5, 15 ... too (a register), so value n
    is the one before edge n: the first is there from time 0 on.
    """

    signals: dict[str, tuple[int, list[str]]] = field(default_factory=dict)
    top: str = ""
    clock: str = "clk"
    unit: str = "1ns"
    ticks_per_ns: Fraction = Fraction(1)
    cycles: int = 8
    period: int = 10

    def write(self, path: Path) -> Path:
        """Write the file and return its path."""
        names = [*([self.clock] if self.clock else []), *self.signals]
        widths = [*([1] if self.clock else []), *(width for width, _ in self.signals.values())]
        lines = [f"$timescale {self.unit} $end"]
        for number, (name, width) in enumerate(zip(names, widths, strict=True)):
            path_parts = [*([self.top] if self.top else []), *name.split(".")]
            lines += [f"$scope module {scope} $end" for scope in path_parts[:-1]]
            kind = "wire" if width else "real"
            lines += [f"$var {kind} {width or 64} s{number} {path_parts[-1]} $end"]
            lines += ["$upscope $end" for _ in path_parts[:-1]]
        lines += ["$enddefinitions $end"]
        half = self.period // 2
        events: dict[int, list[str]] = {0: []}
        first = 1 if self.clock else 0
        for cycle in range(self.cycles if self.clock else 0):
            events.setdefault(self.period * cycle, []).append("0s0")
            events.setdefault(self.period * cycle + half, []).append("1s0")
        for number, (_, values) in enumerate(self.signals.values()):
            for cycle, value in enumerate(values):
                time = 0 if cycle == 0 else self.period * cycle - half
                if not value:
                    continue
                text = value if value[0] == "r" or len(value) == 1 else f"b{value}"
                space = " " if len(text) > 1 else ""
                events.setdefault(time, []).append(f"{text}{space}s{first + number}")
        for time in sorted(events):
            lines += [f"#{int(time * self.ticks_per_ns)}", *events[time]]
        path.write_text("\n".join([*lines, ""]))
        return path


COUNT = ["000", "001", "010", "011", "100", "101", "110", "111"]


def counter(**changed) -> Vcd:
    signals = {"core.count[2:0]": (3, list(COUNT)), "core.odd": (1, list("01010101"))}
    return Vcd(**{"signals": signals, **changed})


def bits(*values: str) -> Vcd:
    """One signal with a value for each cycle; the last one stays."""
    return Vcd({"x": (len(values[0]), [*values])})
