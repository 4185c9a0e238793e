# SPDX-License-Identifier: Apache-2.0
"""Micro image patterns with known centres: white images and grids to try a calibration on."""

import itertools
from typing import Literal

import numpy as np
from scipy.special import erf

from plenofir.camera.calibration.grid import Floats, Grid, Layout
from plenofir.camera.calibration.shading import pixel_positions
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

Form = Literal["disc", "square", "spot"]

# Each pixel needs the places and light of its neighbours in floats: blocks of rows bound that.
_BLOCK_PIXELS = 1 << 20
# Rows and columns of neighbours whose light may reach a cell.
_MIXED = 1
_PIXEL_PARTS = np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]]) / 4


def regular_grid(
    shape: tuple[int, int],
    pitch: float,
    *,
    rotation_degrees: float = 0.0,
    layout: Layout = "rectangular",
    offset: tuple[float, float] = (0.0, 0.0),
) -> Grid:
    """Grid without distortion, lens (0, 0) in the middle of an image.

    Raises `InputError` if the pitch is not positive.

    Parameters
    ----------
    shape
        Rows and columns of the image.
    pitch
        Distance of neighbouring micro images in pixels.
    rotation_degrees
        Positive where rows fall to the right.
    layout
        Arrangement of the micro lenses.
    offset
        (y, x) of lens (0, 0) from the middle of the image, in pixels.
    """
    if not 0 < pitch < np.inf:
        raise InputError(f"a pitch of {pitch} pixels is not possible; it must be positive")
    angle = np.radians(rotation_degrees)
    down = pitch * np.array([np.cos(angle), -np.sin(angle)])
    right = pitch * np.array([np.sin(angle), np.cos(angle)])
    if layout == "hexagonal-rows":
        down = down * np.sqrt(3) / 2
    elif layout == "hexagonal-columns":
        right = right * np.sqrt(3) / 2
    middle = (np.array(shape) - 1) / 2 + offset
    return Grid(
        layout=layout,
        order=1,
        middle=(0.0, 0.0),
        scale=1.0,
        coefficients=(tuple(middle), tuple(down), tuple(right)),
    )


def aperture(distance: Floats, radius: float, form: Form, softness: float) -> Floats:
    """Brightness across a micro image."""
    if form == "spot":
        return np.asarray(np.exp(-(distance**2).sum(axis=-1) / (2 * radius**2)))
    if form == "disc":
        beyond = np.hypot(distance[..., 0], distance[..., 1]) - radius
        return np.asarray(0.5 - 0.5 * erf(beyond / softness))
    edges = 0.5 - 0.5 * erf((np.abs(distance) - radius) / softness)
    return np.asarray(edges[..., 0] * edges[..., 1])


def white_image(
    shape: tuple[int, int],
    grid: Grid,
    *,
    form: Form = "disc",
    radius: float = 0.45,
    softness: float = 0.8,
    shading: float = 0.4,
    level: float = 0.8,
    noise: float = 0.01,
    bits: int = 16,
    seed: int = 0,
    mixed: bool = False,
) -> Image:
    """White image of a grid.

    Result: uint8 or uint16.

    Parameters
    ----------
    shape
        Rows and columns.
    grid
        Where the micro image centres are.
    form, softness
        See `aperture`.
    radius
        Radius of a micro image in pitches.
    shading
        Share of the light that is lost in the corners (it grows with the square of the distance).
    level
        Brightest level as a share of full scale.
    noise
        Standard deviation of the noise (normal distribution) as a share of the brightest level.
    bits
        8 or 16.
    mixed
        Whether micro images reach beyond their cells and add up there, as they do on a sensor. The
        brightest place has the brightest level then.
    """
    rows, columns = shape
    around = np.arange(-_MIXED, _MIXED + 1) if mixed else np.zeros(1, dtype=np.int64)
    pitch = max(grid.pitch)
    rng = np.random.default_rng(seed)
    full = (1 << bits) - 1
    image = np.empty(shape, dtype=np.uint8 if bits == 8 else np.uint16)
    middle = (np.array(shape) - 1) / 2
    block = max(1, _BLOCK_PIXELS // columns)
    for start in range(0, rows, block):
        stop = min(start + block, rows)
        places = pixel_positions(slice(start, stop), columns)
        light = np.zeros(places.shape[:-1])
        # A pixel sees the mean of its area.
        for move in _PIXEL_PARTS:
            t, s, nearest = grid.nearest(places + move)
            for down, right in itertools.product(around, around):
                near = down == 0 and right == 0
                offset = nearest if near else places + move - grid.centres(t + down, s + right)
                light += aperture(offset, radius * pitch, form, softness) / len(_PIXEL_PARTS)
        if mixed:
            light /= light.max()
        light *= 1 - shading * (((places - middle) / middle) ** 2).sum(axis=-1) / 2
        light += rng.normal(0, noise, light.shape)
        image[start:stop] = np.clip(np.rint(light * level * full), 0, full)
    return image


def centres_within(grid: Grid, shape: tuple[int, int]) -> Floats:
    """True centres of all micro images whose centres lie in an image.

    `shape`: rows and columns of the image. Result: (y, x), shape (n, 2).
    """
    rows, columns = shape
    corners = np.array([[-1, -1], [-1, columns], [rows, -1], [rows, columns]], dtype=np.float64)
    lattice = grid.inverse(corners)
    low = np.floor(lattice.min(axis=0)).astype(int) - 2
    high = np.ceil(lattice.max(axis=0)).astype(int) + 3
    t, s = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]), indexing="ij")
    centres = grid.centres(t, s).reshape(-1, 2)
    inside = ((centres >= -0.5) & (centres <= np.array(shape) - 0.5)).all(axis=-1)
    return centres[inside]
