# SPDX-License-Identifier: Apache-2.0
"""What is made of light fields that are squares of views, and of those that are none.

`pixels` are an aligned raw image (rows, columns[, 3]) with micro images of M x M pixels, or views
(v, u, t, s[, 3]): a line or rectangle, whose M is the larger number of views along a side. Pictures
of a raw image have its size, those of a rectangle the size of a view.
"""

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from plenofir.camera.lightfield.disparity import Disparity, Searched, search_disparity, search_views
from plenofir.camera.lightfield.indexing import sub_aperture, views
from plenofir.camera.lightfield.shift_and_add import refocus_views
from plenofir.camera.lightfield.stack import FocalStack, all_in_focus
from plenofir.refocus import best_picture
from plenofir.refocus.operator import Image

Progress = Callable[[int, int], None]


def is_rectangle(pixels: Image) -> bool:
    """Whether pixels are views, which are no square."""
    return pixels.ndim > 3


def all_views(pixels: Image, micro_image_size: int) -> Image:
    """The views, shape (v, u, t, s[, 3]), without a copy."""
    return pixels if is_rectangle(pixels) else views(pixels, micro_image_size)


def view_at(pixels: Image, micro_image_size: int, v: int, u: int) -> Image:
    """One view, shape (t, s[, 3])."""
    if is_rectangle(pixels):
        return np.asarray(pixels[v, u])
    return sub_aperture(pixels, micro_image_size, v, u)


def central_view(pixels: Image, micro_image_size: int) -> Image:
    """The view in the middle, below and right of it for even numbers of views."""
    if is_rectangle(pixels):
        return np.asarray(pixels[pixels.shape[0] // 2, pixels.shape[1] // 2])
    return sub_aperture(pixels, micro_image_size, micro_image_size // 2, micro_image_size // 2)


def search_depth(pixels: Image, micro_image_size: int, **options: Any) -> Searched:
    """Disparity of the central view, see `search_disparity`."""
    if is_rectangle(pixels):
        return search_views(pixels, **options)
    return search_disparity(pixels, micro_image_size, **options)


class PictureStack:
    """Pictures at focus settings, each made when it is needed."""

    def __init__(
        self,
        settings: Sequence[Fraction],
        picture: Callable[[Fraction], Image],
        progress: Progress,
    ) -> None:
        self._settings, self._picture, self._progress = settings, picture, progress

    def __len__(self) -> int:
        """Number of pictures."""
        return len(self._settings)

    def __iter__(self) -> Iterator[Image]:
        """Pictures in the order of the settings."""
        for number, a in enumerate(self._settings, 1):
            yield self._picture(a)
            self._progress(number, len(self))


def _of_views(pixels: Image, settings: Sequence[Fraction], progress: Progress) -> PictureStack:
    return PictureStack(settings, lambda a: refocus_views(pixels, float(a)), progress)


def slices_of(
    pixels: Image,
    micro_image_size: int,
    settings: Sequence[Fraction],
    progress: Progress,
    **how: Any,
) -> FocalStack | PictureStack:
    """Refocused pictures; `how` is for raw images, see `FocalStack`."""
    if is_rectangle(pixels):
        return _of_views(pixels, settings, progress)
    return FocalStack(pixels, micro_image_size, settings, progress, **how)


def pictures_of(
    pixels: Image,
    micro_image_size: int,
    settings: Sequence[Fraction],
    progress: Progress,
    **how: Any,
) -> PictureStack:
    """Refocused pictures to look at; `how` is for raw images, see `best_picture`."""
    if is_rectangle(pixels):
        return _of_views(pixels, settings, progress)
    return PictureStack(
        settings, lambda a: best_picture(pixels, micro_image_size, a, **how), progress
    )


def sharp_everywhere(
    pixels: Image,
    micro_image_size: int,
    disparity: Disparity,
    progress: Progress | None = None,
    box: int | None = None,
) -> Image:
    """The picture that is sharp everywhere, see `all_in_focus`.

    Of a rectangle that is the central view: each of its views is a camera of its own.
    """
    if is_rectangle(pixels):
        return central_view(pixels, micro_image_size)
    settings, confidence = disparity.pixels_per_view, disparity.confidence
    return all_in_focus(
        pixels, micro_image_size, settings, progress, confidence=confidence, box=box
    )
