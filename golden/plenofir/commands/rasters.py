# SPDX-License-Identifier: Apache-2.0
"""Aligned raw images that commands take, and what speaks against M or the camera given."""

from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from plenofir.commands import options
from plenofir.ground.errors import InputError

if TYPE_CHECKING:
    from plenofir.camera.rays import Camera, RayModel
    from plenofir.ground.images import Picture


_LARGEST_M = 10_000


def read_raster(path: str, micro_image: int) -> "Picture":
    """Read an aligned raw image; refuse it if its M is certainly another one."""
    from plenofir.ground.images import read_picture
    from plenofir.refocus import check_raw

    raw = read_picture(Path(path))
    check_raw(raw.pixels, micro_image, where=path)
    check_raster(raw, micro_image, path)
    return raw


def check_raster(picture: "Picture", micro_image: int, where: str, *, refuse: bool = True) -> None:
    """Warn of a picture that is no aligned raw image of M, or refuse it where that is certain."""
    from plenofir.camera.recognise.expected import doubt

    is_jpeg = Path(where).suffix.lower() in (".jpg", ".jpeg")
    found = doubt(picture, micro_image, where, is_jpeg=is_jpeg)
    if found is None:
        return
    if found.certain and refuse:
        raise InputError(found.text, where=where)
    typer.echo(f"warning: {where}: {found.text}", err=True)


def model_of(camera: str | None, focus: float, micro_image: int) -> "RayModel | None":
    """Ray model of the camera that was named, if one was; a focus needs one."""
    from plenofir.camera.rays import RayModel, load_camera

    options.require("focus", "camera", focus != inf and camera is None)
    if camera is None:
        return None
    return RayModel.focused(load_camera(camera), focus, micro_image)


def focused(known: "Camera", focus: float, micro_image: int | None) -> "RayModel":
    """Ray model of a camera; M is the camera's if it was not given."""
    from plenofir.camera.rays import RayModel

    m = micro_image or max(2, known.micro_image_size)
    if m > _LARGEST_M:
        raise InputError(
            f"M is more than {_LARGEST_M} pixels; check the pitches, or give a smaller "
            f"{options.typed('micro_image')}",
            where=known.name,
        )
    return RayModel.focused(known, focus, m)


def warn_of_camera(model: "RayModel | None") -> None:
    """Warn of a camera whose micro images do not have M pixels."""
    note = "" if model is None else model.micro_image_note()
    if note:
        typer.echo(f"warning: {note}", err=True)
