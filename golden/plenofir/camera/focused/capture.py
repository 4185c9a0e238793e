# SPDX-License-Identifier: Apache-2.0
"""A capture of a focused camera: light that its pixels get, its lenses, and pictures made of it."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.camera.calibration.axes import DIMMEST, reach_of
from plenofir.camera.calibration.frames import grey
from plenofir.camera.calibration.grid import Floats
from plenofir.camera.calibration.record import Calibration
from plenofir.camera.calibration.resample import profile_around
from plenofir.camera.calibration.shading import lens_indices, pixel_positions
from plenofir.camera.captures.prepare import Prepared
from plenofir.camera.focused.loops import lay_over
from plenofir.ground.errors import InputError
from plenofir.ground.images import Picture
from plenofir.refocus.operator import Image

Floats32 = npt.NDArray[np.float32]

STEP = 2
"""Pixels of the capture for one of a picture: at |v| of 2 or more it shows no more than these."""

# Lines of pixels whose lenses are looked up at once.
_LINES = 256
LEAST, MOST = 1.0, 200.0
"""|v| of the nearest and farthest planes that pictures are made of."""


class Layers(NamedTuple):
    """Micro images laid over each other: see `plenofir.camera.focused.loops.lay_over`."""

    sums: Floats32  # (rows, columns, channels)
    shares: Floats32  # (rows, columns)
    squares: Floats32  # (rows, columns, 2), or empty


@dataclass(frozen=True, eq=False)
class FocusedCapture:
    """Capture of a focused camera with what its pictures are made of."""

    picture: Picture  # the capture as its file has it, after demosaicing; pictures have its meaning
    calibration: Calibration  # where its micro images are
    # Without the dark level, times the white balance, shape (rows, columns, channels).
    pixels: Floats32
    # Share of the light that each pixel gets, 0 for those that do not count, (rows, columns).
    light: Floats32

    @property
    def pitch(self) -> float:
        """Distance of neighbouring micro images in pixels."""
        return self.calibration.grid.lens_pitch

    @property
    def reach(self) -> float:
        """Radius within which pixels of a micro image count, in pixels."""
        return reach_of(self.calibration.grid)

    def shape(self, step: float = STEP) -> tuple[int, int]:
        """Rows and columns of a picture with a pixel for each `step` of the capture."""
        return int(self.light.shape[0] // step), int(self.light.shape[1] // step)

    def lenses(self, *, alike: bool = False) -> Floats:
        """Micro lenses as `lay_over` takes them; `alike`: without their types."""
        grid, types = self.calibration.grid, self.calibration.lens_types
        t, s = lens_indices(grid, self.calibration.image_shape)
        result = np.zeros((t.size, 4))
        result[:, :2] = grid.centres(t, s).reshape(-1, 2)
        if types is None or len(types.pattern) == 1 or alike:
            result[:, 3] = 1
        else:
            result[:, 2] = np.array(types.sharpest)[types.at(grid, t, s)].ravel()
        return result

    def layers(
        self,
        inverse: Floats | float,
        step: float = STEP,
        *,
        matching: Floats32 | None = None,
        lenses: Floats | None = None,
    ) -> Layers:
        """Lay the micro images over each other at 1 / v, one for all places or one for each.

        `inverse`: a number, or shape (rows, columns) of the picture, nan where there is nothing.
        `matching`: one channel instead of the pixels, whose squares are summed up too.
        """
        shape = self.shape(step)
        everywhere = np.broadcast_to(np.asarray(inverse, np.float32), shape)
        slowest = np.nanmin(np.abs(everywhere)) if np.isfinite(everywhere).any() else 1.0
        pixels = self.pixels if matching is None else matching[..., np.newaxis]
        result = Layers(
            np.zeros((*shape, pixels.shape[2]), np.float32),
            np.zeros(shape, np.float32),
            np.zeros((0, 0, 2) if matching is None else (*shape, 2), np.float32),
        )
        lay_over(
            pixels,
            self.light,
            self.lenses() if lenses is None else lenses,
            self.reach,
            self.pitch,
            np.ascontiguousarray(everywhere),
            1 / max(float(slowest), 1 / MOST),
            float(step),
            *result,
        )
        return result

    def refocused(self, inverse: Floats | float, unit: int = 1, step: float = STEP) -> Image:
        """The picture that is refocused to 1 / v, one for all places or one for each.

        `unit`: values of the result, 16 bit words, for one of the capture; 1 for its own type. At
        each place types of micro lenses count by how sharp they are there. Where |v| is so small
        that no micro image shows a place it takes the values beside.
        """
        sums, shares, _ = self.layers(inverse, step)
        values = sums / np.maximum(shares, 1e-12)[..., np.newaxis]
        empty = shares <= 0
        if empty.any() and not empty.all():
            nearest = ndimage.distance_transform_edt(empty, return_indices=True)[1]
            values = values[tuple(nearest)]
        dtype = self.picture.pixels.dtype if unit == 1 else np.dtype(np.uint16)
        top = min(self.picture.full_scale * unit, np.iinfo(dtype).max)
        levels = np.clip(np.floor(values * unit + 0.5), 0, top).astype(dtype)
        return levels if levels.shape[2] > 1 else levels[..., 0]


def focused_capture(ready: Prepared, where: str = "raw capture") -> FocusedCapture:
    """A prepared capture with the light that its pixels get.

    Raises `InputError` if its calibration is that of a standard camera.
    """
    calibration, picture = ready.calibration, ready.picture
    if calibration.lens_types is None:
        raise InputError(
            "its calibration does not say that the camera is a focused one; plenofir calibrate "
            "with --lens-types or --grid does",
            where=where,
        )
    colours = picture.pixels if picture.pixels.ndim > 2 else picture.pixels[..., np.newaxis]
    pixels = colours.astype(np.float32)
    dark = np.float32(calibration.dark_level) if ready.dark is None else grey(ready.dark)[..., None]
    pixels -= dark
    if ready.gains is not None and pixels.shape[2] == len(ready.gains):
        pixels *= np.array(ready.gains, np.float32)
    light = _light(calibration)
    if ready.divisor is not None:
        white = grey(ready.divisor) - np.float32(calibration.dark_level)
        light = np.where(light > 0, white / max(float(np.percentile(white, 99.5)), 1.0), 0)
        light = np.where(light < DIMMEST, 0, light).astype(np.float32)
    return FocusedCapture(picture, calibration, pixels, light)


def _light(calibration: Calibration) -> Floats32:
    """Share of the light that pixels get by the calibration's model of its white image."""
    grid, (rows, columns) = calibration.grid, calibration.image_shape
    brightness = np.pad(calibration.lens_brightness, 1, mode="edge")
    light = np.empty((rows, columns), np.float32)
    for start in range(0, rows, _LINES):
        stop = min(start + _LINES, rows)
        places = pixel_positions(slice(start, stop), columns)
        t, s, away = grid.nearest(places)
        value = profile_around(calibration, away)
        near = (
            np.clip(t + 1, 0, brightness.shape[0] - 1),
            np.clip(s + 1, 0, brightness.shape[1] - 1),
        )
        value *= brightness[near]
        within = (away**2).sum(axis=-1) <= (grid.lens_pitch / 2) ** 2
        light[start:stop] = np.where(within & (value >= DIMMEST), value, 0)
    return light
