# SPDX-License-Identifier: Apache-2.0
"""Light fields that are hard for depth, drawn without the ray model, each at several noises.

A point of a layer that the central view sees at x is at x - a g in the view g places from it. Views
are drawn with several samples a pixel, so layers cover pixels in part. The samples are a Fibonacci
lattice: no two lie in one line or column, so edges along these move evenly from view to view.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from skimage import data

from plenofir.camera.lightfield import compose
from plenofir_studies.depth_scenes import Truth

Floats = npt.NDArray[np.float64]
Inside = npt.NDArray[np.bool_]

M = 9
SIZE = 96
"""Lenses along each side."""
NOISES = {
    "planes": (0.0, 0.01, 0.05),
    "bars": (0.0, 0.02),
    "ramp": (0.005, 0.01, 0.02),
    "twigs": (0.0, 0.02),
    "tiles": (0.0, 0.02, 0.05),
}
"""Scenes, and noises (standard deviations as shares of white) of each."""
NEAR_FOCUS = 0.05
"""Largest |a| that counts as the plane in focus."""
# Samples of a pixel: number, and steps of one along the columns for each along the lines.
_SAMPLES, _ASIDE = 13, 8
TWIGS = (0.2, 0.5, 0.8, 1.1)
_BEHIND = -0.3


@dataclass(frozen=True)
class _Layer:
    """Something at a = `a` + `slope` x: its brightness and where it is, at places (y, x)."""

    a: float
    brightness: Callable[[Floats, Floats], Floats]
    there: Callable[[Floats, Floats], Inside] = lambda y, _: np.isfinite(y)
    slope: float = 0.0  # of a along x, for each lens from the middle


def _photo(name: str, seed: int, scale: float = 2.0) -> Callable[[Floats, Floats], Floats]:
    """A picture of scikit-image; `scale` of its pixels for each lens."""
    values = np.asarray(getattr(data, name)(), np.float64)
    grey = values if values.ndim == 2 else values.mean(axis=2)
    low, high = np.percentile(grey, (1, 99))
    smooth = ndimage.gaussian_filter(np.clip((grey - low) / (high - low), 0, 1), scale / 3)
    off = np.random.default_rng(seed).uniform(60, 200, 2)

    def brightness(y: Floats, x: Floats) -> Floats:
        places = np.stack([off[0] + scale * y, off[1] + scale * x])
        return np.asarray(
            0.1 + 0.75 * ndimage.map_coordinates(smooth, places, order=1, mode="mirror")
        )

    return brightness


def _waves(contrast: float, seed: int) -> Callable[[Floats, Floats], Floats]:
    """Weak waves, 8 to 30 lenses long, over half of white."""
    random = np.random.default_rng(seed)
    parts = [(random.uniform(8, 30), *random.uniform(0, 2 * np.pi, 2)) for _ in range(14)]

    def brightness(y: Floats, x: Floats) -> Floats:
        sums = np.zeros(y.shape)
        for length, turn, phase in parts:
            sums += np.sin(2 * np.pi / length * (x * np.cos(turn) + y * np.sin(turn)) + phase)
        return np.asarray(0.5 + contrast / np.sqrt(len(parts) / 2) * sums)

    return brightness


def _tiles(side: float, seed: int) -> Callable[[Floats, Floats], Floats]:
    """Even squares of random grey."""
    greys = np.random.default_rng(seed).uniform(0.15, 0.85, (64, 64))

    def brightness(y: Floats, x: Floats) -> Floats:
        return np.asarray(greys[tuple(np.floor(p / side).astype(int) % 64 for p in (y, x))])

    return brightness


def _planes(seed: int) -> list[_Layer]:
    """A textured wall, two planes, one of them slanted."""
    return [
        _Layer(-0.4, _photo("gravel", seed)),
        _Layer(0.3, _photo("grass", seed + 1), lambda y, x: (y > 14.5) & (y < 60.5) & (x < 46.5)),
        _Layer(
            0.7,
            _photo("gravel", seed + 2),
            lambda y, x: (y > 34.5) & (y < 84.5) & (x > 52.5) & (x < 88.5),
            0.006,
        ),
    ]


def _bars(seed: int) -> list[_Layer]:
    """Upright bars 3 to 8 lenses wide before a wall."""
    layers = [_Layer(-0.2, _photo("gravel", seed))]
    for k, (left, width) in enumerate(((8, 8), (24, 6), (40, 5), (54, 4), (66, 3), (80, 8))):

        def there(_: Floats, x: Floats, left: int = left, width: int = width) -> Inside:
            return (x > left - 0.5) & (x < left + width - 0.5)

        layers.append(
            _Layer(0.3 + 0.1 * k, _photo(("grass", "gravel")[k % 2], seed + k + 1), there)
        )
    return layers


def _ramp(seed: int) -> list[_Layer]:
    """Weak texture, a from -0.5 to 0.5."""
    return [_Layer(0.0, _waves(0.05, seed), slope=1.0 / SIZE)]


def _twigs(seed: int) -> list[_Layer]:
    """Four twigs three lenses wide before a wall."""
    layers = [_Layer(_BEHIND, _photo("gravel", seed))]
    for k, a in enumerate(TWIGS):
        turn = np.random.default_rng(seed + k).uniform(-0.35, 0.35)

        def there(y: Floats, x: Floats, k: int = k, turn: float = turn) -> Inside:
            away = (x - SIZE * (2 * k + 1) / 8) * np.cos(turn) + (y - SIZE / 2) * np.sin(turn)
            return np.asarray(np.abs(away) < 1.5)

        layers.append(_Layer(a, _photo("grass", seed + k + 1, 1.5), there))
    return layers


def _textureless(seed: int) -> list[_Layer]:
    """Walls of even tiles, 8 lenses on a side, at three depths."""
    return [
        _Layer(-0.3, _tiles(8, seed)),
        _Layer(
            0.2, _tiles(8, seed + 1), lambda y, x: (y > 8.5) & (y < 56.5) & (x > 8.5) & (x < 56.5)
        ),
        _Layer(
            0.6, _tiles(8, seed + 2), lambda y, x: (y > 40.5) & (y < 88.5) & (x > 64.5) & (x < 88.5)
        ),
    ]


_SCENES: dict[str, Callable[[int], list[_Layer]]] = {
    "planes": _planes,
    "bars": _bars,
    "ramp": _ramp,
    "twigs": _twigs,
    "tiles": _textureless,
}


def clean(name: str, size: int = SIZE, m: int = M, seed: int = 0) -> tuple[Floats, Floats]:
    """Views (v, u, t, s) of a scene from 0 to 1 without noise, and a of the middle one."""
    layers = _SCENES[name](seed)
    sample = np.arange(_SAMPLES)[:, np.newaxis, np.newaxis]
    down_pixel, right_pixel = np.mgrid[:size, :size].astype(np.float64)
    y = down_pixel + (sample + 0.5) / _SAMPLES - 0.5
    x = right_pixel + (sample * _ASIDE % _SAMPLES + 0.5) / _SAMPLES - 0.5
    middle = (SIZE - 1) / 2
    views = np.empty((m, m, size, size))
    for v, u in np.ndindex(m, m):
        down, right = v - m // 2, u - m // 2
        image = np.zeros(y.shape)
        for layer in layers:
            # x - (a + slope (X - middle)) right = place, solved for X; a there moves it down, too.
            across = (x + (layer.a - layer.slope * middle) * right) / (1 - layer.slope * right)
            a = layer.a + layer.slope * (across - middle)
            along = y + a * down
            there = layer.there(along, across)
            image[there] = layer.brightness(along[there], across[there])
        views[v, u] = image.mean(0)
    y, x = down_pixel, right_pixel
    truth = np.zeros(y.shape)
    for layer in layers:
        truth = np.where(layer.there(y, x), layer.a + layer.slope * (x - middle), truth)
    return views, truth


def noisy(views: Floats, noise: float, seed: int = 0) -> npt.NDArray[np.uint16]:
    """Views of 16 bit, with noise as a share of white."""
    more = np.random.default_rng(1000 + seed).normal(0, noise, views.shape) if noise else 0.0
    return np.rint(65535 * np.clip(views + more, 0, 1)).astype(np.uint16)


def trial(name: str, noise: float, seed: int = 0, size: int = SIZE, m: int = M) -> Truth:
    """A scene with noise, and its depth."""
    images, a = clean(name, size, m, seed)
    return Truth(f"{name}, {noise:.1%}", compose(noisy(images, noise, seed)), m, a, None)


def trials(seed: int = 0) -> Iterator[tuple[str, float, Truth]]:
    """All scenes at all of their noises."""
    for name, noises in NOISES.items():
        images, a = clean(name, seed=seed)
        for noise in noises:
            raw = compose(noisy(images, noise, seed))
            yield name, noise, Truth(f"{name}, {noise:.1%}", raw, M, a, None)
