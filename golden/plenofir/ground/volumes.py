# SPDX-License-Identifier: Apache-2.0
"""Volumes of slices over time as one TIFF file, with micrometres where they are known.

NAME.ome.tif is OME-TIFF (of any size), NAME.tif a hyperstack as ImageJ has it (below 4 GB). Both
have the axes T, Z, C, Y, X and are written plane by plane.
"""

from collections.abc import Iterable, Iterator
from itertools import chain
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.ground.files import Results, cannot_write
from plenofir.ground.images import Image

OME = (".ome.tif", ".ome.tiff")

# Classic TIFF has offsets of 32 bits; each plane needs some room beside its pixels.
_CLASSIC_BYTES, _BESIDE = (1 << 32) - (1 << 20), 512


class Voxel(NamedTuple):
    """Sizes of a voxel."""

    across: float  # in x and y; 0 where it changes from slice to slice
    along: float  # from slice to slice; 0 for a single one
    first: float  # place of the first slice along z
    unit: str = "um"


def write_volume(
    path: Path,
    frames: Iterable[Iterable[Image]],
    count: int,
    slices: int,
    *,
    voxel: Voxel | None = None,
    about: str = "",
) -> tuple[int, ...]:
    """Write slices of frames, all or nothing, holding one slice in memory.

    `path`: the file; its ending says the format. `frames`: of each frame its slices, (rows,
    columns[, 3]), uint8 or uint16. `count`, `slices`: numbers of frames, and of slices of each.
    `voxel`: sizes, if they are known. `about`: description (OME-TIFF). Result: shape in the order
    T, Z, C, Y, X. Raises `InputError` for what the format cannot hold, and where slices differ in
    size or type.
    """
    from tifffile import TiffWriter

    images = (image for frame in frames for image in frame)
    first = next(images)
    channels = first.shape[2] if first.ndim > 2 else 1
    shape = (count, slices, channels, *first.shape[:2])
    ome = path.name.lower().endswith(OME)
    size = count * slices * (first.nbytes + channels * _BESIDE)
    if not ome and size > _CLASSIC_BYTES:
        raise InputError(
            f"would have {size / 1e9:.1f} GB, more than a hyperstack of ImageJ can hold; write "
            f"{path.name.rpartition('.')[0]}.ome.tif",
            where=str(path),
        )

    def planes() -> Iterator[Image]:
        number = 0
        for number, image in enumerate(chain([first], images), 1):
            if image.shape != first.shape or image.dtype != first.dtype:
                raise InputError(
                    f"frame {(number - 1) // slices + 1} has another size or type than the first",
                    where=str(path),
                )
            for channel in range(channels):
                plane = image if image.ndim < 3 else image[..., channel]
                yield np.ascontiguousarray(plane)
        if number != count * slices:
            raise InputError(f"{number} slices came, not {count * slices}", where=str(path))

    options: dict[str, Any] = {"metadata": _metadata(ome, voxel, about, channels)}
    if voxel is not None and voxel.across:
        # Pixels for each um; OME-TIFF's readers that know TIFF alone take pixels for each cm.
        unit, each = ("CENTIMETER", 1e4) if ome else ("NONE", 1.0)
        options |= {"resolution": (each / voxel.across, each / voxel.across)}
        options |= {"resolutionunit": unit}
    with Results(path.parent) as results:
        try:
            with TiffWriter(
                results.path(path.name),
                bigtiff=ome and size > _CLASSIC_BYTES,
                ome=ome,
                imagej=not ome,
            ) as file:
                file.write(
                    planes(), shape=shape, dtype=first.dtype, photometric="minisblack", **options
                )
        except OSError as error:
            raise cannot_write(path, error) from None
    return shape


def _metadata(ome: bool, voxel: Voxel | None, about: str, channels: int) -> dict[str, Any]:
    """What each of the two formats says of axes and sizes."""
    metadata: dict[str, Any] = {"axes": "TZCYX"}
    if not ome:
        if channels > 1:
            metadata["mode"] = "composite"
        if voxel is not None:
            # A unit of z alone leaves x and y in pixels.
            metadata["unit" if voxel.across else "zunit"] = voxel.unit
            if voxel.along:
                # The origin counts slices.
                metadata |= {"spacing": voxel.along, "zorigin": -voxel.first / voxel.along}
        return metadata
    if about:
        metadata["Description"] = about
    if channels > 1:
        metadata["Channel"] = {"Name": ["red", "green", "blue"]}
    if voxel is not None:
        sizes = {"X": voxel.across, "Y": voxel.across, "Z": voxel.along}
        unit = voxel.unit.replace("um", "µm")
        for axis, size in filter(itemgetter(1), sizes.items()):
            metadata |= {f"PhysicalSize{axis}": size, f"PhysicalSize{axis}Unit": unit}
    return metadata
