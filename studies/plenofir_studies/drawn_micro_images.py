# SPDX-License-Identifier: Apache-2.0
"""White images drawn at random, with truth: what a calibration is tried on."""

from dataclasses import dataclass

import numpy as np

from plenofir.camera.calibration.grid import Floats, Grid, Layout
from plenofir.camera.calibration.shading import pixel_positions
from plenofir.ground.images import Image
from plenofir_studies.synthetic.pattern import Form, aperture, centres_within, regular_grid

_LAYOUTS: tuple[Layout, ...] = ("rectangular", "hexagonal-rows", "hexagonal-columns")
_FORMS: tuple[Form, ...] = ("disc", "disc", "square", "spot")
_PIXEL_PARTS = np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]]) / 4
_PITCHES = (3.0, 150.0)
_LENSES = (3, 150)


@dataclass(frozen=True)
class DrawnWhite:
    """A white image and how it was drawn."""

    image: Image  # uint8 or uint16
    grid: Grid  # the true one
    pitch: float  # of neighbouring micro images in pixels
    damaged: float  # share of the lenses that are missing, dim or merged with a neighbour
    noise: float  # standard deviation as a share of the brightest level
    whole: int  # lenses, damaged ones too, that lie in the image and the image circle as a whole
    sides: tuple[float, float]  # rows and columns of lenses that fit into the lit part of the image
    name: str  # everything that was drawn, for messages

    @property
    def must_be_found(self) -> bool:
        """Whether at least 5 x 5 lenses are in the picture, at most 20 % of them damaged."""
        return self.whole >= 25 and min(self.sides) >= 5 and self.damaged <= 0.2

    def errors(self, centres: Floats) -> Floats:
        """Distances in pixels between centres found (y, x), nan: none, and the grid's nearest."""
        present = centres.reshape(-1, 2)
        present = present[~np.isnan(present[:, 0])]
        return np.asarray(np.linalg.norm(self.grid.nearest(present)[2], axis=1))

    def missed(self, centres: Floats) -> int:
        """Lenses of the image that have no centre within half a pitch.

        `centres` (n, 2) are all of a grid, (y, x), lit or not.
        """
        truth = centres_within(self.grid, (self.image.shape[0], self.image.shape[1]))
        t, s, _ = self.grid.nearest(centres)
        have = set(zip(t.tolist(), s.tolist(), strict=True))
        rows, columns, _ = self.grid.nearest(truth)
        inner = ((truth > 0) & (truth < np.array(self.image.shape) - 1)).all(axis=1)
        places = zip(rows[inner].tolist(), columns[inner].tolist(), strict=True)
        return sum(place not in have for place in places)


def drawn_white(seed: int, largest_pixels: float = 4e6) -> DrawnWhite:
    """Draw a white image: 3 x 3 to 150 x 150 lenses of 3 to 150 pixels, damaged in many ways.

    Rotations of -45 to 45 degrees, all layouts, up to 30 % of the lenses missing, dim or merged,
    image circles, up to 95 % vignetting, up to 15 % noise, 8 to 16 bits.
    """
    rng = np.random.default_rng(seed)
    most = np.sqrt(largest_pixels)
    pitch = float(np.exp(rng.uniform(np.log(_PITCHES[0]), np.log(min(_PITCHES[1], most / 3)))))
    limits = _LENSES[0], min(_LENSES[1], most / pitch)
    sides = np.exp(rng.uniform(np.log(limits[0]), np.log(limits[1]), 2))
    shape = (max(12, int(sides[0] * pitch)), max(12, int(sides[1] * pitch)))
    layout = _LAYOUTS[rng.integers(3)]
    rotation = float(rng.uniform(-45, 45) if rng.random() < 0.5 else rng.uniform(-3, 3))
    offset = tuple(float(x) for x in rng.uniform(-0.5, 0.5, 2) * pitch)
    grid = regular_grid(
        shape, pitch, rotation_degrees=rotation, layout=layout, offset=(offset[0], offset[1])
    )
    form = "disc" if layout != "rectangular" else _FORMS[rng.integers(len(_FORMS))]
    radius = float(rng.uniform(0.12, 0.25) if form == "spot" else rng.uniform(0.36, 0.47))
    softness = float(rng.uniform(0.5, 1.0))
    damaged = float(rng.uniform(0, 0.3))
    noise = float(rng.uniform(0, 0.15))
    vignetting = float(rng.uniform(0, 0.95))
    bits = int(rng.choice([8, 10, 12, 14, 16]))
    level = float(rng.uniform(0.4, 0.95))
    # Radius of the image circle in half diagonals, 2 for none.
    circle = float(rng.uniform(0.6, 0.95)) if rng.random() < 0.3 else 2.0

    # A gain for each lens; merged ones are joined with their right-hand neighbour.
    reach = int(np.hypot(*shape) / pitch * 1.2) + 4
    size = 2 * reach + 1
    kind = np.where(rng.random((size, size)) < damaged, rng.integers(1, 4, (size, size)), 0)
    gain = np.where(kind == 1, 0.0, np.where(kind == 2, rng.uniform(0.1, 0.6, kind.shape), 1.0))
    joined = kind == 3
    unit = grid.vectors / np.linalg.norm(grid.vectors, axis=1, keepdims=True)
    middle = (np.array(shape) - 1) / 2
    half_diagonal = np.hypot(*middle)
    places = pixel_positions(slice(0, shape[0]), shape[1])
    light = np.zeros(shape)
    for move in _PIXEL_PARTS:
        t, s, away = grid.nearest(places + move)
        t, s = (np.clip(n + reach, 0, size - 1) for n in (t, s))
        part = aperture(away, radius * pitch, form, softness) * gain[t, s]
        across, along = away @ unit[0], away @ unit[1]
        bridge = (np.abs(across) < 0.25 * pitch) & np.where(
            along > 0, joined[t, s], joined[t, s - 1]
        )
        light += np.where(bridge, np.maximum(part, 0.9), part) / len(_PIXEL_PARTS)
    distance = np.hypot(*np.moveaxis(places - middle, -1, 0))
    light *= 1 - vignetting * (distance / half_diagonal) ** 2
    light *= np.clip(circle * half_diagonal - distance + 0.5, 0, 1)
    light += rng.normal(0, noise, shape)
    full = (1 << bits) - 1
    image = np.clip(np.rint(light * level * full), 0, full)

    truth = centres_within(grid, shape)
    inside = ((truth > 0.5 * pitch) & (truth < np.array(shape) - 1 - 0.5 * pitch)).all(axis=1)
    inside &= np.hypot(*(truth - middle).T) < circle * half_diagonal - 0.5 * pitch
    lit = [min(n, 2 * circle * half_diagonal) / pitch for n in shape]
    name = (
        f"seed {seed}: {shape[1]} x {shape[0]} pixels, {layout}, pitch {pitch:.2f}, "
        f"rotation {rotation:.2f}, {form} {radius:.2f}, {100 * damaged:.0f} % damaged, "
        f"{100 * noise:.0f} % noise, vignetting {100 * vignetting:.0f} %, circle {circle:.2f}, "
        f"{bits} bits"
    )
    return DrawnWhite(
        image=image.astype(np.uint8 if bits == 8 else np.uint16),
        grid=grid,
        pitch=pitch,
        damaged=damaged,
        noise=noise,
        whole=int(inside.sum()),
        sides=(lit[0], lit[1]),
        name=name,
    )
