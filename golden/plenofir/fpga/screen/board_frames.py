# SPDX-License-Identifier: Apache-2.0
"""Frames that a board shows in a simulation through serial bits, and their golden pictures."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict

from plenofir.fpga.compare import compare_frames
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.hdmi.script import Command, typed
from plenofir.fpga.screen.board_screen import SHADES, Screen
from plenofir.fpga.screen.overlay import Shown as Kind
from plenofir.ground.images import write_png
from plenofir.refocus import shift_to_name
from plenofir.refocus.by_place import chosen
from plenofir.refocus.operator import Image
from plenofir.refocus.sharpness import FRACTION_BITS

Place = Literal[0, 1, 2]
"""Place of the text: none, at the top, at the bottom."""
# Characters of "ok" with the end of its line, and the time until it begins.
_BLANKS = 6
_KINDS: dict[str, Kind] = {"r": "refocused", "a": "all-in-focus", "d": "depth"}


@dataclass(frozen=True)
class ShownFrame:
    """Settings of the screen in a frame."""

    output: int  # index into the screen's outputs
    slice_: int
    text: Place  # position of the text


def commands_before(frames: tuple[ShownFrame, ...], screen: Screen) -> list[list[Command]]:
    """Commands before each frame that change the board's settings to the frame's."""
    commands, current = [], dict[str, int]()
    for frame in frames:
        settings = {"s": frame.slice_, "o": frame.output}
        if screen.overlay is not None:
            settings["h"] = frame.text
        lines = [f"{letter} {n}" for letter, n in settings.items() if current.get(letter) != n]
        # Characters that come while the board answers are lost, so blanks, which do nothing,
        # follow.
        commands.append(
            [command for line in lines for command in typed(f"{line}\n{_BLANKS * ' '}")]
        )
        current = settings
    return commands


class ShownReport(BaseModel):
    """What ``report.json`` holds of each picture of a screen; docs/simulation.md explains it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    output: str
    text: Place
    picture: str
    mismatches: int
    first_mismatch: str | None


def shown_frames(core: CoreConfiguration, screen: Screen) -> tuple[ShownFrame, ...]:
    """Frames of a run: all outputs, the refocused one with each slice, without text, then with it.

    There are none if the board sweeps through the slices.
    """
    if screen == Screen():
        return ()
    slices, outputs = range(len(screen.shifts(core))), range(len(screen.outputs))
    bare = [
        ShownFrame(output, slice_, 0)
        for output in outputs
        for slice_ in (slices if screen.outputs[output] == "r" else slices[:1])
    ]
    bare.sort(key=lambda frame: screen.outputs[frame.output] != "r")
    if screen.overlay is None:
        return tuple(bare)
    texts = [ShownFrame(output, slices[-1], 1) for output in outputs]
    return (*bare, *texts, ShownFrame(0, 0, 2))


def golden_frame(
    core: CoreConfiguration, screen: Screen, frame: ShownFrame, slices: Image
) -> npt.NDArray[np.uint8]:
    """Golden picture of a frame, from all golden slices of the core (slices, rows, columns, 3)."""
    kind, m = _KINDS[screen.outputs[frame.output]], core.micro_image_size
    picture: Image = slices[frame.slice_]
    if kind != "refocused" or screen.sharp_box is not None:
        depth = screen.index(core).golden(slices)
        if kind == "all-in-focus":
            picture = depth.image
        elif kind == "refocused":
            whole, sharp = slices[2 * frame.slice_ :][:2]
            picture = chosen(sharp, whole, depth.sharp_in(frame.slice_), m)
        else:
            colour = depth.index.astype(int)
            if depth.fraction is not None:
                fraction = depth.fraction.astype(int)
                colour = SHADES * colour + fraction * SHADES // (1 << FRACTION_BITS)
            index = colour.repeat(m, 0).repeat(m, 1)
            rows, columns = slices.shape[1:3]
            picture = np.array(screen.colours, np.uint8)[index[:rows, :columns]]
    drawn = picture.astype(np.uint8)
    if screen.overlay is None or not frame.text:
        return drawn
    return screen.overlay.draw(drawn, kind, frame.slice_, bottom=frame.text == 2)


def _name(core: CoreConfiguration, screen: Screen, frame: ShownFrame) -> str:
    letter = screen.outputs[frame.output]
    name = _KINDS[letter].replace("-", "_")
    if letter == "r":
        name += f"_{shift_to_name(screen.shifts(core)[frame.slice_], core.micro_image_size)}"
    return f"{name}{('', '_text', '_text_below')[frame.text]}.png"


def shown_names(core: CoreConfiguration, screen: Screen) -> tuple[str, ...]:
    """Files of a run's pictures besides those of the slices."""
    frames = shown_frames(core, screen)
    return tuple(_name(core, screen, frame) for frame in frames if _more(screen, frame))


def _more(screen: Screen, frame: ShownFrame) -> bool:
    """Whether it shows more than a plain slice of one box."""
    plain = screen.outputs[frame.output] == "r" and screen.sharp_box is None
    return bool(frame.text) or not plain


def bare_slices(screen: Screen, frames: tuple[ShownFrame, ...]) -> list[int]:
    """Numbers of the frames that show a plain slice."""
    return [n for n, frame in enumerate(frames) if not _more(screen, frame)]


def write_shown(
    core: CoreConfiguration, screen: Screen, pictures: Image, slices: Image, folder: Path
) -> tuple[ShownReport, ...]:
    """Compare and write the pictures that a board showed besides its slices.

    `pictures` has one of each of the `shown_frames`, `slices` all of the golden model.
    """
    reports = []
    for frame, picture in zip(shown_frames(core, screen), pictures, strict=True):
        if not _more(screen, frame):
            continue
        want = golden_frame(core, screen, frame, slices)
        compared = compare_frames(picture[np.newaxis], want[np.newaxis])
        name = _name(core, screen, frame)
        write_png(folder / name, picture)
        reports.append(
            ShownReport(
                output=_KINDS[screen.outputs[frame.output]],
                text=frame.text,
                picture=name,
                mismatches=compared.mismatches,
                first_mismatch=compared.first,
            )
        )
    return tuple(reports)
