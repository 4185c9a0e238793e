# SPDX-License-Identifier: Apache-2.0
"""The FPGA: its pins, its sites, and which primitive takes which site."""

import csv
import re
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

_FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Pin:
    """One ball of the package."""

    ball: str
    name: str  # ``IO_L43P_GCLK5_M1DQ4_1`` or ``GND``

    @property
    def is_io(self) -> bool:
        """Whether a design can use it."""
        return self.name.startswith("IO_")

    @property
    def bank(self) -> int:
        return int(self.name.rsplit("_", 1)[1])

    @property
    def pair(self) -> str:
        """Number of its differential pair, ``L43``."""
        match = re.match(r"IO_(L\d+)[PN]_", self.name)
        assert match, self.name
        return match[1]

    @property
    def is_positive(self) -> bool:
        """Whether it is the P side of its pair."""
        return self.name.startswith(f"IO_{self.pair}P")

    @property
    def is_clock(self) -> bool:
        """Whether it reaches the clock networks (GCLK)."""
        return "_GCLK" in self.name

    @property
    def clock_lines(self) -> frozenset[int]:
        """Lines to the clock multiplexers that the BUFIO2s of a clock input drive."""
        match = re.search(r"_GCLK(\d+)", self.name)
        assert match, self.name
        lines = device().clock_lines
        reached = lines.of_pins[int(match[1]) // 2 % 2]
        return frozenset(lines.first_of_bank[self.bank] + k for k in reached)


@cache
def pins() -> dict[str, Pin]:
    """Pins of the package by their balls."""
    with (_FOLDER / "csg324.csv").open(newline="") as file:
        return {row["ball"]: Pin(row["ball"], row["name"]) for row in csv.DictReader(file)}


class IoRules(BaseModel):
    """What banks can do: BUFPLLs of each, those with TMDS_33 drivers, supply of each standard."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    bufpll_per_bank: int
    tmds_output_banks: tuple[int, ...]
    volts: dict[str, float]


class ClockLines(BaseModel):
    """Lines that end at the clock multiplexers; ``xc6slx45.toml`` explains the fields."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    i0: tuple[int, ...]
    first_of_bank: tuple[int, ...]
    of_pins: tuple[tuple[int, ...], tuple[int, ...]]


class Device(BaseModel):
    """What ``xc6slx45.toml`` holds."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    part: str
    package: str
    sites: dict[str, int]  # number of each kind
    primitives: dict[str, str]  # to the kind of site that each takes
    # Clock primitive to its inputs and, of each, the outputs.
    buffers: dict[str, dict[str, list[str]]]
    synthesizers: dict[str, dict[str, list[str]]]  # likewise
    # Input of a clock primitive to patterns of the outputs that have a way to it.
    routes: dict[str, list[str]]
    clock_lines: ClockLines  # that end at the clock multiplexers
    io: IoRules  # what banks can do


@cache
def device() -> Device:
    content: dict[str, Any] = tomllib.loads((_FOLDER / "xc6slx45.toml").read_text())
    return Device.model_validate(content)
