# SPDX-License-Identifier: Apache-2.0
"""Pages of a TIFF file (plain, ImageJ's, OME's) as pictures, one at a time."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file
from plenofir.ground.images import Image, Picture, page_pixels
from plenofir.ground.levels import levels
from plenofir.ground.orientation import page_orientation

_TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")


def has_pages(path: Path) -> bool:
    """Whether a path is a TIFF file with several images that can be frames or views."""
    try:
        with path.open("rb") as file:
            if file.read(4) not in _TIFF:
                return False
        return len(Pages(path)) > 1
    except (OSError, InputError):
        return False


class Pages:
    """Pictures of the largest series of a TIFF file, in their order.

    A series is what has one size and type: a thumbnail beside it is left alone, and counted in
    `left_out`. Raises `InputError` for a damaged file.
    """

    def __init__(self, path: Path) -> None:
        from tifffile import TiffFile

        self._path = input_file(path)
        try:
            with TiffFile(path) as file:
                series: Any = max(file.series, key=lambda one: one.size)
                axes, shape = series.axes, series.shape
                self.left_out = sum(len(one.pages) for one in file.series if one is not series)
        except (OSError, ValueError, KeyError, IndexError, TypeError, struct.error) as error:
            raise self._damaged(error) from None
        size = dict(zip(axes, shape, strict=True))
        # Channels beside each other, or in pages of their own; others are pictures of their own.
        channels = "S" if "S" in size else "C" if size.get("C") in (1, 3) else ""
        outer = [n for axis, n in size.items() if axis not in ("Y", "X", channels)]
        is_picture = axes.replace(channels or " ", "").endswith("YX")
        at_end = channels in ("", axes[-1]) or axes.find(channels) == len(axes) - 3
        self._count = int(np.prod(outer, dtype=np.int64)) if is_picture and at_end else 1

    @property
    def left_out_text(self) -> str:
        """Note on pages of other sizes."""
        return f"{self.left_out} pages of other sizes are left out"

    def __len__(self) -> int:
        """Number of pictures."""
        return self._count

    def __getitem__(self, number: int) -> Picture:
        """A picture by its number from 0, as stored."""
        return next(self._from(number))

    def __iter__(self) -> Iterator[Picture]:
        """All pictures, each read when it is needed."""
        return self._from(0)

    def _from(self, first: int) -> Iterator[Picture]:
        from tifffile import TiffFile

        try:
            with TiffFile(self._path) as file:
                series: Any = max(file.series, key=lambda one: one.size)
                each = len(series.pages) // self._count
                bits = int(series.keyframe.bitspersample)
                for number in range(first, self._count):
                    pages = [series.pages[number * each + k] for k in range(each)]
                    parts = [page_pixels(page.aspage(), str(self._path)) for page in pages]
                    picture = self._picture(parts, bits, number)
                    orientation = page_orientation(pages[0].aspage())
                    yield picture._replace(orientation=orientation)
        except InputError:
            raise
        except Exception as error:  # Decoders raise whatever a damaged file leads them to.
            raise self._damaged(error) from None

    def _picture(self, parts: list[Image], bits: int, number: int) -> Picture:
        image = parts[0] if len(parts) == 1 else np.stack(parts, axis=-1)
        if image.ndim == 3:
            image = image[..., 0] if image.shape[2] == 1 else image[..., :3]
        as_levels = levels(image, f"{self._path}, page {number + 1}")
        white = (
            (1 << bits) - 1 if image.dtype.kind == "u" and 8 <= bits <= 16 else as_levels.full_scale
        )
        return Picture(np.ascontiguousarray(as_levels.values), white)

    def _damaged(self, error: Exception) -> InputError:
        reason = " ".join(str(error).split()) or type(error).__name__
        return InputError(
            f"is damaged ({reason[:200]}); copy or convert the file again", where=str(self._path)
        )
