# SPDX-License-Identifier: Apache-2.0
"""Captures and white images of cameras that someone built, by a renderer of its own.

The light comes as a function of the pixels, so the renderer shares nothing with the package: lens
indices and places in the micro image by inverse mapping, textures as sums of waves, a background
and a nearer disc, micro images with soft rims, vignetting, a sensor's colours, noise.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plenofir.camera.calibration.grid import Grid

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class OwnCamera:
    """A camera: its sensor, and where its micro images lie."""

    shape: tuple[int, int] = (420, 560)
    pitch: float = 13.9
    turn_degrees: float = 0.3
    offset: tuple[float, float] = (2.3, -1.7)
    hexagonal: bool = False
    distortion: float = 0.0  # share of the distance at the corners
    fill: float = 0.46  # radius of micro images in pitches
    colours: tuple[float, float, float] = (0.55, 1.0, 0.7)  # of white
    noise: float = 0.004

    def lenses(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Of each pixel its lens (row, column in pitches) and its place in the micro image."""
        rows, columns = self.shape
        y, x = np.mgrid[:rows, :columns].astype(float)
        y, x = y - rows / 2 + self.offset[0], x - columns / 2 + self.offset[1]
        far = (y**2 + x**2) / ((rows / 2) ** 2 + (columns / 2) ** 2)
        y, x = y * (1 + self.distortion * far), x * (1 + self.distortion * far)
        turn = np.radians(self.turn_degrees)
        cos, sin = np.cos(turn), np.sin(turn)
        right, down = (cos * x + sin * y) / self.pitch, (-sin * x + cos * y) / self.pitch
        if not self.hexagonal:
            t, s = np.rint(down), np.rint(right)
        else:
            step = np.sqrt(0.75)
            candidates = []
            for row in (np.floor(down / step), np.floor(down / step) + 1):
                column = np.rint(right - row % 2 / 2) + row % 2 / 2
                away = np.hypot(down - row * step, right - column)
                candidates.append((away, row * step, column))
            near = candidates[0][0] < candidates[1][0]
            t, s = (
                np.where(near, *pair) for pair in zip(*(c[1:] for c in candidates), strict=True)
            )
        return t, s, (down - t) * self.pitch, (right - s) * self.pitch

    def grid(self) -> Grid:
        """Where its micro images are, if they are not distorted."""
        turn = np.radians(self.turn_degrees)
        right = self.pitch * np.array([np.sin(turn), np.cos(turn)])
        down = self.pitch * np.array([np.cos(turn), -np.sin(turn)])
        if self.hexagonal:
            down = down * np.sqrt(0.75)
        origin = np.array(self.shape) / 2 - self.offset
        return Grid(
            layout="hexagonal-rows" if self.hexagonal else "rectangular",
            order=1,
            middle=(0.0, 0.0),
            scale=1.0,
            coefficients=tuple((float(y), float(x)) for y, x in (origin, down, right)),
        )

    def light(self, v: Floats, u: Floats) -> Floats:
        """Light of white on each pixel, before the sensor's colours."""
        rows, columns = self.shape
        radius = self.fill * self.pitch
        away = np.hypot(v, u)
        y, x = np.mgrid[-1 : 1 : rows * 1j, -1 : 1 : columns * 1j]
        rim = np.clip(radius - away + 0.5, 0, 1) * (1 - 0.25 * np.minimum(away / radius, 1) ** 2)
        return np.asarray(rim * (1 - 0.175 * (y**2 + x**2)))

    def take(self, seed: int, texture: float = 1.0, level: float = 0.85) -> tuple[Floats, Floats]:
        """A capture and a white image, RGB from 0 to 1 in linear light."""
        draw = np.random.default_rng(seed)
        t, s, v, u = self.lenses()

        def plane(depth: float, number: int) -> Floats:
            return waves(s + 40 + depth * u, t + 30 + depth * v, number, texture)

        image = plane(-0.6, seed + 1)
        size = min(self.shape) / self.pitch
        away = np.hypot(s + 0.2 * size, t + 0.1 * size)
        disc = np.clip(0.3 * size - away + 0.5, 0, 1)[..., np.newaxis]
        image = image * (1 - disc) + plane(0.0, seed + 2) * disc
        light = self.light(v, u)[..., np.newaxis] * np.array(self.colours)
        found = []
        for picture in (image * light * level, light * 0.8):
            found.append(np.clip(picture + draw.normal(0, self.noise, picture.shape), 0, 1))
        return found[0], found[1]


def waves(x: Floats, y: Floats, seed: int, texture: float = 1.0) -> Floats:
    """A picture of 24 waves in three colours, at places in pitches."""
    draw = np.random.default_rng(seed)
    result = np.zeros((*x.shape, 3))
    base = draw.uniform(0.35, 0.65, 3)
    for _ in range(24):
        pace, angle, phase = draw.uniform((0.05, 0, 0), (0.9, 2 * np.pi, 2 * np.pi))
        wave = np.sin(pace * (x * np.cos(angle) + y * np.sin(angle)) + phase)
        result += draw.uniform(-0.09, 0.09, 3) * wave[..., np.newaxis]
    return np.asarray(np.clip(base + texture * result, 0, 1))


def words(image: Floats, top: int = 65535) -> npt.NDArray[np.uint16]:
    """Words of 16 bits of values from 0 to 1."""
    return np.rint(image * top).astype(np.uint16)


def mosaic(image: npt.NDArray[np.generic], order: str = "rggb") -> npt.NDArray[np.generic]:
    """What a sensor with a colour filter mosaic sees of an RGB picture."""
    result = np.empty_like(image[..., 0])
    for place, colour in enumerate(order):
        part = np.s_[place // 2 :: 2, place % 2 :: 2]
        result[part] = image[..., "rgb".index(colour)][part]
    return result
