# SPDX-License-Identifier: Apache-2.0
"""A light field as pages show it: its views, its depth, and the picture in focus everywhere."""

from collections.abc import Callable
from math import ceil
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.lightfield.any_field import is_rectangle
from plenofir.camera.lightfield.enlarged import places_in_view
from plenofir.ground.images import Image

if TYPE_CHECKING:
    from plenofir.camera.lightfield.disparity import Disparity

Floats = npt.NDArray[np.float64]

# Most samples to send to a browser.
_LARGEST_BYTES = 1 << 30
# Most micro lenses of a depth map: a finer one takes long and shows no more.
_LENSES = 500_000
LEAST_GPU_TEXTURE, LEAST_GPU_LAYERS = 2048, 256
"""Guaranteed by WebGL 2."""


def _cut(raw: Image, m: int) -> Image:
    """Views of a raw image, shape (v, u, t, s[, 3]); 0 beyond its edges, for cut micro images."""
    rows, columns = (-(-n // m) for n in raw.shape[:2])
    if raw.shape[:2] != (rows * m, columns * m):
        whole = np.zeros((rows * m, columns * m, *raw.shape[2:]), raw.dtype)
        whole[: raw.shape[0], : raw.shape[1]] = raw
        raw = whole
    return np.asarray(np.moveaxis(raw.reshape(rows, m, columns, m, *raw.shape[2:]), (1, 3), (0, 1)))


def reduced(picture: Image, step: int) -> Image:
    """Means of step x step pixels, of fewer at the right and bottom edges."""
    if step == 1:
        return picture
    rows, columns = (-(-n // step) for n in picture.shape[:2])
    sums, counts = np.zeros((rows, columns, *picture.shape[2:])), np.zeros((rows, columns))
    for down, right in np.ndindex(step, step):
        part = picture[down::step, right::step]
        there = slice(part.shape[0]), slice(part.shape[1])
        sums[there] += part
        counts[there] += 1
    means = sums / counts.reshape(*counts.shape, *[1] * (sums.ndim - 2))
    return np.asarray(np.rint(means), picture.dtype)


class LightField:
    """A raw image (rows, columns[, 3]) cut into views, or views that are no square."""

    def __init__(self, pixels: Image, micro_image_size: int) -> None:
        self.pixels, self.micro_image_size = pixels, micro_image_size
        m = micro_image_size
        self.is_rectangle = is_rectangle(pixels)
        self._views = pixels if self.is_rectangle else _cut(pixels, m)
        # Rows and columns of views; first row and column of M x M, those in the middle.
        self.counts = self._views.shape[:2]
        self.first = tuple((m - count) // 2 for count in self.counts)
        self.lens_rows, self.lens_columns = self._views.shape[2:4]
        self.channels = self._views.shape[4] if self._views.ndim == 5 else 1
        # Size of the picture in pixels.
        self.size = pixels.shape[:2]
        if self.is_rectangle:
            self.size = self.lens_rows * m, self.lens_columns * m
        self.dtype, self.nbytes = pixels.dtype, pixels.nbytes

    def least_binning(self) -> int:
        """Least binning of micro lenses, in each direction, that keeps the data below the limit."""
        binning = 1
        while self.nbytes / binning**2 > _LARGEST_BYTES:
            binning += 1
        return binning

    def views(self, binning: int = 1) -> Image:
        """Views of (binned) micro lenses, shape (v, u, t, s[, 3]); 0 beyond the edges."""
        if binning == 1:
            return self._views
        rows, columns = (-(-n // binning) for n in (self.lens_rows, self.lens_columns))
        channels = self._views.shape[4:]
        smaller = np.zeros((*self.counts, rows, columns, *channels), self.dtype)
        # One after the other, to save memory for large images.
        for v, u in np.ndindex(*self.counts):
            view = self._views[v, u]
            whole = np.zeros((rows * binning, columns * binning, *channels), view.dtype)
            whole[: view.shape[0], : view.shape[1]] = view
            sums = np.zeros(smaller.shape[2:], np.uint32)
            for down, right in np.ndindex(binning, binning):
                sums += whole[down::binning, right::binning]
            smaller[v, u] = (sums + binning**2 // 2) // binning**2
        return smaller

    def depth(
        self,
        search: tuple[float, float] | None = None,
        progress: Callable[[int, int], None] | None = None,
        disparity: "Disparity | None" = None,
    ) -> "Depth":
        """Focus setting of what each micro lens sees.

        By disparity, in a range that fits the picture if none is given; or by one that is there
        already. Where it is improbable, that of the surroundings, as in
        `plenofir.camera.lightfield.all_in_focus`.
        """
        from plenofir.camera.lightfield.disparity import LEAST_CONFIDENCE, search_views

        binning = max(1, ceil((self.lens_rows * self.lens_columns / _LENSES) ** 0.5))
        # The map is a texture too, whose size is limited.
        binning = max(binning, -(-max(self.lens_rows, self.lens_columns) // LEAST_GPU_TEXTURE))
        if disparity is None:
            low, high = (None, None) if search is None else (end / binning for end in search)
            searched = search_views(
                self.views(binning), smallest=low, largest=high, progress=progress
            )
            disparity = searched.disparity
            settings = disparity.settled() * binning
            search = searched.search[0] * binning, searched.search[1] * binning
            confidence = disparity.confidence
        else:
            settings = disparity.settled()[::binning, ::binning]
            confidence = disparity.confidence[::binning, ::binning]
        low, high = search or (float(settings.min()), float(settings.max()))
        limited = np.asarray(np.clip(settings, low, high))
        return Depth(limited, confidence >= LEAST_CONFIDENCE, (low, max(high, low + 1e-3)), binning)

    def in_focus(self, depth: "Depth") -> Image:
        """The picture that is sharp everywhere, as the commands make it, (rows, columns[, 3])."""
        from plenofir.camera.lightfield import all_in_focus
        from plenofir.camera.lightfield.any_field import central_view

        if self.is_rectangle:
            return central_view(self.pixels, self.micro_image_size)
        lenses = tuple(n // self.micro_image_size for n in self.size)
        settings = depth.settings.repeat(depth.binning, 0).repeat(depth.binning, 1)
        settings = settings[: lenses[0], : lenses[1]]
        return all_in_focus(self.pixels, self.micro_image_size, settings)


class Depth(NamedTuple):
    """Depth of what micro lenses see through the central view."""

    settings: Floats  # a, shape (t, s) or coarser
    sure: npt.NDArray[np.bool_]  # where it was not taken from the surroundings
    range: tuple[float, float]  # of a
    binning: int  # micro lenses for each setting, in each direction

    def in_pictures(self, micro_image_size: int) -> Floats:
        """The settings where pictures have what is seen."""
        m = micro_image_size
        middles = [m * np.arange(n) + (m - 1) / 2 for n in self.settings.shape]
        settings = self.settings / self.binning
        places = places_in_view(settings, m, *middles)
        return np.asarray(ndimage.map_coordinates(self.settings, places, order=1, mode="nearest"))
