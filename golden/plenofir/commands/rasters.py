# SPDX-License-Identifier: Apache-2.0
"""Light fields that commands take, whatever they are stored as, and the camera given."""

from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from plenofir.commands import options
from plenofir.commands.console import note
from plenofir.ground.errors import InputError
from plenofir.ground.shell import command

if TYPE_CHECKING:
    from collections.abc import Callable

    from plenofir.camera.depth_picture import Unit
    from plenofir.camera.rays import Camera, MicroscopeModel, RayModel
    from plenofir.camera.recognise import Field, Finding, Hints, LightFieldSource


# Pitches in the wrong unit make an M of thousands: refused before memory is asked for by it.
_LARGEST_M = 10_000
MAPS = {"a": "disparity", "mm": "distance_mm", "um": "height_um"}
"""Names of maps of depth, by what they count in."""
# Least share of the picture whose depth is known in a result that is taken for good.
_SURE = 0.5


def recognised(path: str | Path, hints: "Hints") -> "LightFieldSource":
    """Recognise a path, and print warnings."""
    from plenofir.camera.recognise import recognise

    source = recognise(Path(path), hints)
    for text in source.warnings:
        typer.echo(f"warning: {path}: {text}", err=True)
    return source


def check_aligned(frame: Path, hints: "Hints") -> None:
    """Refuse frames that are no aligned raw images of M, as the first of them shows."""
    from plenofir.ground.images import read_picture

    try:
        read_picture(frame)
    except InputError:
        # One that cannot be read is a failed frame.
        return
    source = recognised(frame, hints)
    if source.raster is None:
        raise source.refusal()
    tell(*(one for one in source.findings if one.heading != "axes"))
    turned = [one for one in source.findings if one.heading == "axes" and one.notable]
    if turned or hints.order or hints.flip not in (None, "none"):
        reason = turned[0].text.partition(":")[0] if turned else "frames are refocused as they lie"
        go_on = command("compose", frame, "-M", hints.micro_image or 1, "--out", "aligned.png")
        raise InputError(f"{reason}; {go_on} puts one right", where=str(frame))


def read_field(
    path: str | Path,
    hints: "Hints",
    progress: "Callable[[int, int], None] | None" = None,
    *,
    notes: bool = True,
    rectangles: bool = False,
) -> "Field":
    """The light field of a path as an aligned raw image, or a refusal that says what helps.

    `rectangles`: views (v, u, t, s[, 3]) that are no square are taken as they are.
    What was put right or cannot be known is in its lines, and told if `notes`.
    """
    from plenofir.camera.recognise.request import as_asked
    from plenofir.camera.recognise.source import quiet

    source = recognised(path, hints)
    field = source.field(progress or quiet, rectangles=rectangles)
    # The gains of a capture were those of its sensor's pixels.
    remaining = hints._replace(white_balance="auto") if source.kind == "raw capture" else hints
    picture = as_asked(field.picture, field.micro_image_size, remaining, str(path))
    field = field._replace(picture=picture)
    if notes:
        tell(*source.findings, *field.lines)
    return field._replace(lines=(*source.findings, *field.lines))


def doubt_of_depth(share: float, field: "Field") -> str:
    """Likely reason for a depth known of a small share of the picture; else empty."""
    if share >= _SURE:
        return ""
    lost = any(one.heading == "axes" and one.confidence == "unknown" for one in field.lines)
    reason = (
        "neighbouring views do not show one scene that moves: wrong -M, a capture that is not "
        "decoded, or no texture"
        if lost
        else "little texture, much noise, a colour mosaic (--bayer), or a calibration that does "
        "not fit"
    )
    return f"warning: depth is known of {100 * share:.0f} % only, which is no good result: {reason}"


def tell(*findings: "Finding") -> None:
    """Note what changes the result."""
    for finding in findings:
        if finding.notable:
            note(f"{finding.heading}: {finding.text}")


def model_of(
    camera: str | None, focus: float, micro_image: int
) -> "RayModel | MicroscopeModel | None":
    """Model of the camera or microscope that was named, if one was; a focus needs a camera."""
    from plenofir.camera.rays import Microscope, MicroscopeModel, RayModel, load_instrument

    options.require("focus", "camera", focus != inf and camera is None)
    if camera is None:
        return None
    instrument = load_instrument(camera)
    if not isinstance(instrument, Microscope):
        return RayModel.focused(instrument, focus, micro_image)
    if focus != inf:
        raise InputError("is for cameras; a microscope is focused by its stage", where="focus")
    return MicroscopeModel(instrument, micro_image)


def unit_of(model: "RayModel | MicroscopeModel | None") -> "Unit":
    """Unit of depth."""
    from plenofir.camera.rays import MicroscopeModel

    if model is None:
        return "a"
    return "um" if isinstance(model, MicroscopeModel) else "mm"


def focused(
    camera: "Camera", focus: float, micro_image: int | None, box: int | None = None
) -> "RayModel":
    """Ray model of a camera; M is the camera's if it was not given."""
    from plenofir.camera.rays import RayModel

    m = micro_image or max(2, camera.micro_image_size)
    if m > _LARGEST_M:
        raise InputError(
            f"M is more than {_LARGEST_M} pixels; check the pitches, or give a smaller "
            f"{options.typed('micro_image')}",
            where=camera.name,
        )
    return RayModel.focused(camera, focus, m, box)


def warn_of_camera(model: "RayModel | MicroscopeModel | None") -> None:
    """Warn of a camera whose micro images do not have M pixels."""
    note = "" if model is None else model.micro_image_note()
    if note:
        typer.echo(f"warning: {note}", err=True)
