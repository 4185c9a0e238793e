# SPDX-License-Identifier: Apache-2.0
"""White images harsher than those of `distorted_white`, with their true centres.

As a script (``python harsh_white.py --seeds 0 1000``) it prints the same table.
"""

import numpy as np
from distorted_white import DistortedWhite, distorted_centres, script
from scipy.special import erf

_SUB_PIXELS = (np.arange(3) + 0.5) / 3 - 0.5


def micro_images(
    shape: tuple[int, int],
    centres: np.ndarray,
    gains: np.ndarray,
    form: str,
    size: float,
    soft: float,
) -> np.ndarray:
    """Discs, squares or spots of light: the mean of each pixel's area."""
    side = int(np.ceil(3.5 * size if form == "spot" else 1.5 * size + 3 * soft)) + 1
    margin = 2 * side + 8
    light = np.zeros((shape[0] + 2 * margin, shape[1] + 2 * margin))
    places = (np.arange(-side, side + 1)[:, np.newaxis] + _SUB_PIXELS).ravel()
    width = 2 * side + 1

    def step(beyond: np.ndarray) -> np.ndarray:
        return 0.5 - 0.5 * erf(beyond / soft)

    for centre, gain in zip(centres, gains, strict=True):
        corner = np.rint(centre).astype(int)
        low = corner - side + margin
        if gain == 0 or (low < 0).any() or (low + width > light.shape).any():
            continue
        y, x = (places - away for away in centre - corner)
        if form == "disc":
            part = step(np.hypot(y[:, np.newaxis], x) - size)
        elif form == "square":
            part = np.outer(step(np.abs(y) - size), step(np.abs(x) - size))
        else:
            part = np.outer(*(np.exp(-0.5 * (n / size) ** 2) for n in (y, x)))
        part = part.reshape(width, 3, width, 3).mean(axis=(1, 3))
        light[low[0] : low[0] + width, low[1] : low[1] + width] += gain * part
    return light[margin:-margin, margin:-margin]


def harsh_white(seed: int, largest_pixels: float = 60_000, repeat: int = 0) -> DistortedWhite:
    """Draw a white image: 3 to 40 lenses a side of 3 to 26 pixels, distorted about any centre.

    Discs, spots or squares with gains of their own, vignetting to 90 %, a dark offset, dust, gaps,
    noise to 10 %, saturation, colour filters, 8 to 16 bits. Those of another `repeat` have the same
    geometry and light, and noise, dust, gaps and gains of their own.
    """
    rng = np.random.default_rng([37, seed])
    sides = np.exp(rng.uniform(np.log(3), np.log(40), 2))
    kind = ("rectangular", "hexagonal-rows", "hexagonal-columns")[rng.integers(3)]
    form = ("disc", "disc", "spot", "square")[rng.integers(4 if kind == "rectangular" else 3)]
    most = min(26.0, np.sqrt(largest_pixels / sides.prod()))
    pitch = float(np.exp(rng.uniform(np.log(3), np.log(max(most, 3.5)))))
    shape = max(12, int(np.ceil(sides[0] * pitch))), max(12, int(np.ceil(sides[1] * pitch)))
    bend = float(rng.uniform(-0.02, 0.02))
    axis = rng.uniform(-0.3, 0.3, 2)
    tilt = rng.uniform(-0.03, 0.03, 2) * (rng.random() < 0.5)
    rotation = float(rng.uniform(-3, 3))
    offset = rng.uniform(-0.5, 0.5, 2) * pitch
    size = {"disc": rng.uniform(0.36, 0.5), "spot": rng.uniform(0.13, 0.25)}.get(
        form, rng.uniform(0.36, 0.48)
    )
    size, soft = float(size * pitch), float(rng.uniform(0.3, 1.0))
    noise = float(rng.choice([0.0, 0.002, 0.01, 0.03, 0.1]))
    vignetting, light_axis = float(rng.uniform(0, 0.9)), rng.uniform(-0.3, 0.3, 2)
    missing = float(rng.uniform(0, 0.15)) * (rng.random() < 0.5)
    dusty = float(rng.uniform(0, 0.03)) * (rng.random() < 0.5)
    uneven = float(rng.uniform(0, 0.3)) * (rng.random() < 0.5)
    dark = float(rng.uniform(0, 0.25)) * (rng.random() < 0.5)
    level = float(rng.uniform(0.4, 1.4))
    mosaic = rng.uniform(0.4, 1, 4) if rng.random() < 0.25 else np.ones(4)
    bits = int(rng.choice([8, 10, 12, 14, 16]))
    centres = distorted_centres(
        shape,
        pitch,
        kind=kind,
        bend=bend,
        tilt=tuple(tilt),
        rotation_degrees=rotation,
        offset=tuple(offset),
        axis=tuple(axis),
    )
    rng = np.random.default_rng([38, seed, repeat])
    lit = rng.random(len(centres)) >= missing
    gains = lit * (1 + rng.uniform(-uneven, uneven, len(centres)))
    light = micro_images(shape, centres, gains, form, size, soft)
    y, x = np.indices(shape)
    middle = (np.array(shape) - 1) / 2
    half = float(np.hypot(*middle))
    far = np.hypot(y - middle[0] - light_axis[0] * half, x - middle[1] - light_axis[1] * half)
    light *= 1 - vignetting * (far / far.max()) ** 2
    harmed = ~lit
    cell = pitch**2 * (1.0 if kind == "rectangular" else np.sqrt(0.75))
    for _ in range(rng.poisson(dusty * light.size / cell)):
        place, radius = rng.uniform(0, 1, 2) * shape, rng.uniform(0.1, 2.0) * pitch
        beyond = np.hypot(y - place[0], x - place[1]) - radius
        light *= 1 - rng.uniform(0.3, 1.0) * (0.5 - 0.5 * erf(beyond))
        harmed |= np.linalg.norm(centres - place, axis=1) < size + radius
    light *= mosaic.reshape(2, 2)[y % 2, x % 2] / mosaic.max()
    full = (1 << bits) - 1
    values = (dark + light) * level + rng.normal(0, noise, shape) * min(level, 1.0)
    image = np.clip(np.rint(values * full), 0, full)
    whole = ((centres > size) & (centres < np.array(shape) - 1 - size)).all(axis=1)
    name = (
        f"seed {seed}: {shape[1]} x {shape[0]} pixels, {kind}, {form}, pitch {pitch:.2f}, "
        f"{sides[1]:.1f} x {sides[0]:.1f} lenses, k {bend:.4f}, axis {axis.round(2)}, "
        f"tilt {tilt.round(3)}, rotation {rotation:.2f}, noise {noise}, "
        f"vignetting {vignetting:.2f}, missing {missing:.2f}, dust {dusty:.3f}, "
        f"gains {uneven:.2f}, offset {dark:.2f}, level {level:.2f}, "
        f"{'mosaic, ' if mosaic.min() < 1 else ''}{bits} bits"
    )
    return DistortedWhite(
        image.astype(np.uint8 if bits == 8 else np.uint16),
        centres,
        int((whole & ~harmed).sum()),
        (int(shape[0] / pitch), int(shape[1] / pitch)),
        bend,
        pitch,
        kind,
        name,
    )


if __name__ == "__main__":
    script(harsh_white)
