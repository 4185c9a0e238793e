# SPDX-License-Identifier: Apache-2.0
"""Commands for a board: a test picture for its input, and its serial port."""

import importlib
import re
from pathlib import Path
from typing import Annotated, Any

import typer

from plenofir.commands import options
from plenofir.commands.console import print_line, steps_bar
from plenofir.ground.errors import InputError

app = typer.Typer(no_args_is_help=True, help="Test picture for a board, and its serial port.")

# A board answers each word at once: silence is a wrong port, rate or cable.
_TIMEOUT_S = 2.0


@app.callback()
def _board() -> None:
    """A board: its first picture, its serial port."""


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{2,4})x(\d{2,4})", text)
    if match is None:
        raise InputError(
            f"{text!r} is not a size; use columns x rows, such as 640x480", where="--size"
        )
    return int(match[1]), int(match[2])


@app.command()
def picture(
    raw: Annotated[
        str | None,
        typer.Argument(
            help="Light field of M x M pixels a micro image; by default that of the scene, or a "
            "flower."
        ),
    ] = None,
    scene: Annotated[
        str | None, typer.Option(help="Scene that the board was built for; it gives size and M.")
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(help="Size of the screen, if there is no scene; by default 640x480."),
    ] = None,
    micro_image: options.MicroImageIfGiven = None,
    out: options.OutFolder = "build/first-light",
) -> None:
    """Make a test picture to show to a board; its marks let the board check every pixel."""
    from plenofir.fpga.screen import first_light
    from plenofir.ground.files import publish
    from plenofir.ground.images import read_image
    from plenofir.plan import load_scene
    from plenofir.plan.scene_light_field import stored_raw

    kept = None
    m, (columns, rows) = first_light.FLOWER_MICRO_IMAGE_SIZE, _size(size or "640x480")
    if scene is not None:
        loaded = load_scene(scene)
        frame_scene = loaded.scene
        m = frame_scene.camera.micro_image_size
        columns, rows = _size(size) if size else (frame_scene.frame.columns, frame_scene.frame.rows)
        if frame_scene.stored is not None:
            kept = stored_raw(frame_scene.stored, m, loaded.path)
    m = micro_image or m
    if raw is not None:
        content = first_light.screen_picture(read_image(Path(raw)), columns, rows, m, where=raw)
    # The light field of a scene has the scene's M.
    elif kept is not None and micro_image is None:
        content = first_light.screen_picture(kept, columns, rows, m, where=str(scene))
    else:
        content = first_light.flower_picture(columns, rows, m)
    png = first_light.marked_png(content)
    page = first_light.full_screen_page(png, columns, rows)
    publish({"picture.png": png, "picture.html": page}, Path(out))
    print_line("picture", f"{columns} x {rows} pixels, micro images of {m} x {m}")
    print_line("files", f"{out}/picture.png, picture.html")
    print_line("show", f"{out}/picture.html on the screen that is the board, whole screen with F")
    print_line(
        "board", "a green bar at the top: it arrives as it was made; a red one: other colours"
    )


@app.command()
def load(
    calib: Annotated[str, typer.Argument(help="Calibration file of the camera.")],
    port: Annotated[str, typer.Option(help="Serial port, such as /dev/ttyUSB1.")],
    baud: Annotated[
        int, typer.Option(help="Bits per second of the serial port.", min=300, max=4_000_000)
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
