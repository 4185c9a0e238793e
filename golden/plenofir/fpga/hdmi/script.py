# SPDX-License-Identifier: Apache-2.0
"""Scripts for ``tb/file_bench/hdmi_bench.vhd``: TMDS words and commands in a file."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

import numpy as np

from plenofir.fpga.hdmi.link import Packed
from plenofir.fpga.hdmi.modes import VideoMode

_PERIOD_UNIT_FS = 64


class Code(IntEnum):
    """Commands of the bench."""

    PERIOD = 1
    SKEW_0 = 2
    SKEW_1 = 3
    SKEW_2 = 4
    JITTER = 5
    CLOCK = 6
    CABLE = 7
    CLOCK_SKEW = 8
    WAIT = 9
    DELAY_FAULTS = 10
    OPEN_CLOCK = 11
    SERIAL = 12
    SLOW_LOCK = 13


@dataclass(frozen=True)
class Command:
    """A command: what, and how much (units: see ``hdmi_bench.vhd``)."""

    code: Code
    value: int


def pixel_period(mode: VideoMode) -> Command:
    """Command that sets the pixel clock."""
    return Command(Code.PERIOD, round(1e12 / mode.pixel_clock / _PERIOD_UNIT_FS))


def typed(text: str) -> list[Command]:
    """Commands that send an ASCII text, with the ends of its lines, to the serial port."""
    return [Command(Code.SERIAL, ord(letter)) for letter in text]


def write_script(path: Path, script: Sequence[Command | Packed]) -> None:
    """Write a script of commands and arrays of words (see `plenofir.fpga.hdmi.link`)."""
    with path.open("wb") as file:
        for item in script:
            if isinstance(item, Command):
                if not 0 <= item.value < 1 << 24:
                    raise ValueError(f"{item} exceeds 24 bits")
                item = np.array([1 << 31 | item.code << 24 | item.value], np.uint32)
            item.astype("<u4").tofile(file)
