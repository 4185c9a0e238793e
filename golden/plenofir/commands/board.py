# SPDX-License-Identifier: Apache-2.0
"""Commands for a board on a serial port."""

import importlib
from typing import Annotated, Any

import typer

from plenofir.commands.console import print_line, steps_bar
from plenofir.ground.errors import InputError

app = typer.Typer(no_args_is_help=True, help="A board on a serial port.")

_TIMEOUT_S = 2.0


@app.callback()
def _board() -> None:
    """A board on a serial port."""


@app.command()
def load(
    calib: Annotated[str, typer.Argument(help="Calibration file of the camera.")],
    port: Annotated[str, typer.Option(help="Serial port, such as /dev/ttyUSB1.")],
    baud: Annotated[
        int, typer.Option(help="Bits a second of the serial port.", min=300, max=4_000_000)
    ] = 115200,
) -> None:
    """Load a calibration into the board's resampler; the next frame uses it."""
    from plenofir.camera.calibration import load_calibration
    from plenofir.plan.sensor.board_load import load_board

    calibration = load_calibration(calib)
    try:
        serial: Any = importlib.import_module("serial")
    except ImportError:
        raise InputError(
            "pyserial is not installed; pip install pyserial", where="plenofir board"
        ) from None
    try:
        with serial.Serial(port, baud, timeout=_TIMEOUT_S) as line, steps_bar("words") as show:
            core = load_board(
                line,
                calibration,
                name=port,
                where=calib,
                progress=lambda done, count: show(calib, done, count),
            )
    except (serial.SerialException, OSError) as error:
        raise InputError(
            f"cannot be used ({error}); name the board's serial port", where=port
        ) from None
    print_line("board", f"{port}: M = {core.micro_image_size}, {core.lines} lines")
    print_line("loaded", f"{calib}; the next frame uses it")
