# SPDX-License-Identifier: Apache-2.0
"""A scene's camera whose frames already are the raster: its lanes, and its sensor's registers."""

import re
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from plenofir.fpga.sensors import PAUSE, Entry
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
_ENTRY = re.compile(r"(0x[0-9a-f]{1,4}|pause)\s+(0x[0-9a-f]{1,4}|\d{1,5})", re.IGNORECASE)


def load_registers(path: Path, *, where: str) -> tuple[Entry, ...]:
    """Read a list of registers: lines ``0x0100 0x01`` (address, byte) or ``pause 7`` (ms).

    ``#`` begins a comment. InputError names the line that cannot be read.
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
        found = _ENTRY.fullmatch(text)
        pause = found is not None and found[1].lower() == "pause"
        address = PAUSE if found is None or pause else int(found[1], 16)
        value = -1 if found is None else int(found[2], 0 if "x" in found[2].lower() else 10)
        if not 0 <= value <= 0xFF or (address == PAUSE and not pause):
            raise InputError(
                f"{path}, line {number}: {text!r} is no register; write an address and a byte "
                "such as 0x0100 0x01, or pause and up to 255 ms",
                where=where,
            )
        entries.append((address, value))
    if not 0 < len(entries) <= _MOST:
        raise InputError(f"{path} has {len(entries)} registers, not 1 to {_MOST}", where=where)
    return tuple(entries)
