# SPDX-License-Identifier: Apache-2.0
"""A calibration over the serial port, into a resampler behind ``hdl/link/load_port.vhd``.

Each word of the load port is a line, answered by "ok": the letter l, kind (1 hexadecimal digit),
address (5), word (10). The answer to the line "l ?" describes the resampler and, if its raster is
shown on a screen, the screen's limits.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Protocol

from pydantic import ValidationError

from plenofir.camera.calibration import Calibration
from plenofir.camera.resampling import Precision, grid_registers, tables_of
from plenofir.ground.errors import InputError
from plenofir.plan.sensor.chip import check_frame, loads, shown_lines
from plenofir.plan.sensor.resampler import Load, ResamplerConfiguration

QUESTION = "l ?"
_DESCRIPTION = re.compile(r"resampler((?: [a-z_]+=\d+)+)")


class Port(Protocol):
    """What is used of a serial port (pyserial)."""

    def write(self, data: bytes, /) -> object:
        """Send bytes."""

    def readline(self) -> bytes:
        """Bytes up to a line's end, or what came until the port's time-out."""


@dataclass(frozen=True)
class Shown:
    """Limits of a raster that is shown in the middle of frames as large as the sensor's."""

    rows: int  # of the raw frames
    raster: int  # longest line of the raster
    mosaic: int  # 1 if the sensor has a colour filter mosaic, else 0


@dataclass(frozen=True)
class BoardResampler:
    """Description of a board's resampler, as the board sends it."""

    core: ResamplerConfiguration
    shown: Shown | None = None  # limits by its screen; None if there is none


def description(core: ResamplerConfiguration, limits: Shown | None = None) -> str:
    """A board's answer to "l ?": generic DESCRIPTION of load_port."""
    values = core.model_dump() | ({} if limits is None else vars(limits))
    return "resampler " + " ".join(f"{k}={int(v)}" for k, v in values.items())


def described(line: str, *, where: str) -> BoardResampler:
    """Resampler from a board's answer; `where` is the port, for messages."""
    found = _DESCRIPTION.fullmatch(line)
    try:
        if found is None:
            raise ValueError
        pairs = dict(part.split("=") for part in found[1].split())
        values = {
            name: bool(int(text))
            if name in ("hexagonal", "skewed", "moves", "gains")
            else int(text)
            for name, text in pairs.items()
        }
        names = [field.name for field in fields(Shown)]
        shown = Shown(**{n: values.pop(n) for n in names}) if names[0] in values else None
        if len(values) != len(ResamplerConfiguration.model_fields):
            raise ValueError
        return BoardResampler(ResamplerConfiguration.model_validate(values), shown)
    except (KeyError, ValueError, ValidationError):
        raise InputError(
            (f"answers {line[:60]!r}" if line else "does not answer")
            + "; is it a board with a resampler that takes calibrations?",
            where=where,
        ) from None


def calibration_loads(board: BoardResampler, calibration: Calibration, *, where: str) -> list[Load]:
    """Words (kind, address, word) of a calibration for an existing resampler, in order.

    Vignetting is corrected if the resampler has gains. InputError if it is a calibration of
    another camera: size, layout, rotation.
    """
    core, shown, names = board.core, board.shown, Precision.model_fields
    precision = Precision(**{name: getattr(core, name) for name in names})
    registers, _ = grid_registers(calibration, core.micro_image_size, precision, where=where)
    tables = tables_of(calibration, registers, devignette=core.gains, where=where)
    words = loads(core, registers, tables, where=where)
    if shown is None:
        return words
    check_frame(calibration, shown.rows, core.max_columns, where=where)
    lines = shown_lines(registers, tables, mosaic=bool(shown.mosaic), where=where)
    limits = {"lines": (lines, core.lines), "raster": (registers.raster_shape[1], shown.raster)}
    for name, (value, limit) in limits.items():
        if value > limit:
            amount = "lines of the ring" if name == "lines" else "pixels in a line of the raster"
            raise InputError(f"needs {value} {amount}; the board has {limit}", where=where)
    return words


def load_lines(words: Sequence[Load]) -> list[str]:
    """Line for each word, without its end."""
    return [f"l {kind:X}{address:05X}{word:010X}" for kind, address, word in words]


def _ask(port: Port, line: str) -> str:
    port.write(f"{line}\r".encode())
    return port.readline().decode("ascii", "replace").strip()


def load_board(
    port: Port,
    calibration: Calibration,
    *,
    name: str,
    where: str = "calibration",
    progress: Callable[[int, int], None] | None = None,
) -> ResamplerConfiguration:
    """Load a calibration into a board; it takes effect with the next frame.

    The serial port has a time-out; `name` and `where` are port and calibration in messages;
    `progress` is called with the number of words loaded, and of all. After an InputError (no
    answer, no resampler, or one that cannot take the calibration) nothing has been written.
    """
    # An empty line ends an unfinished line in the board; a board that answers it would miss the
    # question, so its answer is awaited.
    port.write(b"\r")
    answer = _ask(port, QUESTION)
    if answer and not _DESCRIPTION.fullmatch(answer):
        answer = _ask(port, QUESTION)
    board = described(answer, where=name)
    lines = load_lines(calibration_loads(board, calibration, where=where))
    for number, line in enumerate(lines):
        # The commit is the last word: a transfer that is cut off before it does not change the
        # grid.
        if (answer := _ask(port, line)) != "ok":
            raise InputError(
                (f"answers {answer!r}" if answer else "does not answer")
                + f" to word {number + 1} of {len(lines)}; load the calibration once more",
                where=name,
            )
        if progress is not None:
            progress(number + 1, len(lines))
    return board.core
