# SPDX-License-Identifier: Apache-2.0
"""A scene's camera whose frames already are the raster: its lanes, and its sensor's registers."""

import re
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from plenofir.fpga.sensors import PAUSE, Entry, WideEntry
from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file


class SceneLanes(BaseModel):
    """Lanes of MIPI CSI-2 with micro images of exactly M x M pixels; the frame is `Scene.frame`."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    number: Literal[1, 2, 4]
    mbits: Annotated[float, Field(gt=0, allow_inf_nan=False)]  # of a lane, Mb/s
    # File (relative to the scene file) of registers that the board writes into the sensor, if any.
    registers: Annotated[str, Field(min_length=1)] | None = None
    address: Annotated[int, Field(ge=0, le=0x7F)] = 0x10  # of the sensor on I2C

    def pixels_mhz(self, bits: int) -> float:
        """Million pixels a second during a line, for pixels of a number of bits."""
        return self.number * self.mbits / bits


_MOST = 4095  # that `sensor_setup` takes
_REGISTER = re.compile(r"0x([0-9a-f]{1,4})\s+(?:0x([0-9a-f]{1,2}|[0-9a-f]{4})|(\d{1,3}))", re.I)
_PAUSE = re.compile(r"pause\s+(\d{1,5})", re.IGNORECASE)
_LONGEST = 0xFF  # pause of an entry, in ms


def _entries(text: str) -> list[Entry]:
    """Entries of a line; none if it is neither a register nor a pause.

    The digits of a value say how wide it is: one or two 8 bits, four 16.
    """
    if pause := _PAUSE.fullmatch(text):
        whole, rest = divmod(int(pause[1]), _LONGEST)
        return [(PAUSE, _LONGEST)] * whole + ([(PAUSE, rest)] if rest or not whole else [])
    match = _REGISTER.fullmatch(text)
    if match is None:
        return []
    address, digits = int(match[1], 16), match[2] or f"{int(match[3]):02x}"
    value = int(digits, 16)
    if address == PAUSE or (match[3] and value > 0xFF):
        return []
    return [WideEntry(address, value) if len(digits) == 4 else (address, value)]


def load_registers(path: Path, *, where: str) -> tuple[Entry, ...]:
    """Read a list of registers: lines ``0x0100 0x01``, ``0x302a 0x0005`` or ``pause 7`` (ms).

    A value has one byte or, with four digits, two. ``#`` begins a comment. InputError names the
    line that cannot be read.
    """
    try:
        lines = input_file(path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read ({error})", where=where) from None
    entries: list[Entry] = []
    for number, line in enumerate(lines, 1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        of_line = _entries(text)
        if not of_line:
            raise InputError(
                f"{path}, line {number}: {text!r} is no register; write an address below 0xffff "
                "and a value of two digits (one byte) or four (two bytes), such as 0x0100 0x01 or "
                "0x302a 0x0005, or pause and milliseconds",
                where=where,
            )
        entries += of_line
    if not 0 < len(entries) <= _MOST:
        raise InputError(f"{path} has {len(entries)} registers, not 1 to {_MOST}", where=where)
    return tuple(entries)
