# SPDX-License-Identifier: Apache-2.0
"""Volumes of a focused camera's planes, with mm along z where the planes are equally far apart."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from plenofir.commands import options
from plenofir.commands.console import print_lines, progress_bar
from plenofir.commands.focused import STANDARD, FocusedField
from plenofir.ground.errors import InputError

if TYPE_CHECKING:
    from plenofir.ground.images import Image
    from plenofir.ground.volumes import Voxel

Planes = list[tuple[float, float]]


def write_planes(
    field: FocusedField,
    asked: tuple[list[str] | None, list[str] | None],
    path: Path,
    used: Mapping[str, object],
) -> None:
    """Write the planes of a capture as one file, with the capture's values in 16 bits.

    `asked`: virtual depths, or distances in mm; `used`: options of standard cameras.
    """
    import numpy as np

    from plenofir.ground.volumes import write_volume

    options.refuse_used(used, STANDARD)
    planes = _planes(field, *asked)
    voxel, words = _sizes(field, planes)
    # Full scale of 8 bits becomes that of 16.
    unit = 257 if field.capture.picture.pixels.dtype == np.uint8 else 1
    ends = ", ".join(f"{v:.6g}" for v, _ in planes[:2])
    ends += f", ... {planes[-1][0]:.6g}" if len(planes) > 2 else ""
    about = f"plenofir: virtual depths v = {ends}; {words}"
    with progress_bar("refocusing") as show:

        def slices() -> "Iterator[Image]":
            for number, (_, inverse) in enumerate(planes, 1):
                yield field.upright(inverse, unit)
                show(number, len(planes))

        rows, columns = write_volume(path, [slices()], 1, len(planes), voxel=voxel, about=about)[3:]
    size = f"{len(planes)} slices of {columns} x {rows} pixels, 16 bit"
    print_lines(*field.notes, f"{path}: {size}; {words}")


def _planes(field: FocusedField, depths: list[str] | None, distances: list[str] | None) -> Planes:
    """Virtual depths of -v or of --z, and 1 / v between micro images."""
    if not distances:
        return field.planes(depths)
    if depths:
        options.refuse_both("z", "-v")
    if field.scale.model is None:
        raise InputError(f"{options.typed('z')} requires the focused camera as --camera")
    planes = []
    for place in options.focus_settings(distances, 1, rounded=False, where="z"):
        try:
            v = field.scale.depth_at(float(place))
        except InputError as error:
            raise InputError(f"{float(place):g} mm: {error.problem}", where="z") from None
        planes.append((v, field.scale.inverse(v, "z")))
    return planes


def _sizes(field: FocusedField, planes: Planes) -> "tuple[Voxel | None, str]":
    """What a file says of z, and what people are told.

    Files hold one step for all slices. Pixels of a nearer plane show less of it, so x and y have no
    size.
    """
    import numpy as np

    from plenofir.camera.rays import State
    from plenofir.commands.volumes import rise_in_equal_steps
    from plenofir.ground.volumes import Voxel

    distances = field.scale.distances([inverse for _, inverse in planes])
    if distances is None:
        return None, "without --camera no mm"
    if any(distances.state(n) != State.REAL for n in range(len(planes))):
        return None, "not all planes lie before the camera, so z has no mm"
    first, last = float(distances.mm[0]), float(distances.mm[-1])
    ends = f"z = {first:.6g} to {last:.6g} mm from the micro lenses"
    if not rise_in_equal_steps(distances.mm):
        return None, f"{ends} in steps that differ or fall: the file has none; --z gives equal ones"
    steps = np.diff(distances.mm)
    step = float(steps.mean()) if steps.size else 0.0
    words = f"{ends} in steps of {step:.6g}" if step else f"z = {first:.6g} mm"
    return Voxel(0, step, first, "mm"), words
