# SPDX-License-Identifier: Apache-2.0
"""White images drawn through a lens that distorts, with their true centres.

Drawing shares no code with the calibration that it tests. As a script it tries many images and
prints a table by class: ``python distorted_white.py --seeds 0 1000``. For every tenth it determines
the true standard error: root mean square of the errors of all centres, over ``--repeats`` more
draws of noise, dust and gaps.
"""

import argparse
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import erf

from plenofir.camera.calibration import calibrate
from plenofir.ground.errors import InputError

# Negligible error in pixels, which is added to the true and the claimed ones.
_NOTHING = 0.001
# One image of this many is drawn again.
_REPEATED = 10
_SUB_PIXELS = (np.arange(4) + 0.5) / 4 - 0.5


@dataclass(frozen=True)
class DistortedWhite:
    """A white image, all true centres in and around it, and how it was drawn."""

    image: np.ndarray
    centres: np.ndarray  # (y, x), lit or not
    usable: int  # lenses that are whole in the image, lit and without dust
    lenses: tuple[int, int]  # rows and columns
    bend: float  # k of r' = r (1 + k r^2), r in half diagonals
    pitch: float
    kind: str
    name: str

    @property
    def enough(self) -> bool:
        """Whether it has enough lenses: 6 x 6, three quarters of them undamaged."""
        return min(self.lenses) >= 6 and self.usable >= 0.75 * self._whole

    @property
    def _whole(self) -> int:
        """Lenses without those that the image's border may cut."""
        rows, columns = self.lenses
        return (rows - 1) * (columns - 1)

    def errors(self, centres: np.ndarray) -> np.ndarray:
        """Distances from the centres found to the nearest true ones."""
        found = centres.reshape(-1, 2)
        return cKDTree(self.centres).query(found[~np.isnan(found[:, 0])])[0]


def distorted_centres(
    shape: tuple[int, int],
    pitch: float,
    *,
    kind: str = "rectangular",
    bend: float = 0.0,
    tilt: tuple[float, float] = (0.0, 0.0),
    rotation_degrees: float = 0.0,
    offset: tuple[float, float] = (0.0, 0.0),
    axis: tuple[float, float] = (0.0, 0.0),
) -> np.ndarray:
    """Centres (y, x) of an array that is turned, then tilted, then distorted.

    `tilt` is the share by which the pitch shrinks in half a diagonal along y and x; `axis` is where
    the axis of the distortion is from the middle of the image, in half diagonals.
    """
    middle = (np.array(shape) - 1) / 2
    half = float(np.hypot(*middle))
    reach = int(1.5 * half / pitch) + 3
    t, s = (n.ravel().astype(float) for n in np.mgrid[-reach : reach + 1, -reach : reach + 1])
    steps = np.eye(2) * pitch
    if kind == "hexagonal-rows":
        s = s + (t % 2) / 2
        steps[0] *= np.sqrt(0.75)
    elif kind == "hexagonal-columns":
        t = t + (s % 2) / 2
        steps[1] *= np.sqrt(0.75)
    angle = np.radians(rotation_degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    flat = (np.stack([t, s], axis=1) @ steps @ turn + offset) / half
    away = flat / (1 + flat @ np.array(tilt))[:, np.newaxis] - axis
    away = away * (1 + bend * (away**2).sum(axis=1))[:, np.newaxis] + axis
    centres = away * half + middle
    near = (np.abs(centres - middle) < middle + 2 * pitch).all(axis=1)
    return centres[near & (np.linalg.norm(flat, axis=1) < 1.4)]


def spots(shape: tuple[int, int], centres: np.ndarray, radius: float, soft: float) -> np.ndarray:
    """Discs of light with soft borders: the mean of each pixel's area."""
    side = int(np.ceil(radius + 3 * soft)) + 1
    margin = 2 * side + 8
    light = np.zeros((shape[0] + 2 * margin, shape[1] + 2 * margin))
    places = np.arange(-side, side + 1)
    for centre in centres:
        corner = np.rint(centre).astype(int)
        y, x = ((n[:, np.newaxis] + _SUB_PIXELS).ravel() for n in [places] * 2)
        y, x = y - (centre - corner)[0], x - (centre - corner)[1]
        beyond = np.hypot(y[:, np.newaxis], x) - radius
        disc = 0.5 - 0.5 * erf(beyond / soft)
        part = disc.reshape(len(places), 4, len(places), 4).mean(axis=(1, 3))
        low = corner - side + margin
        if (low < 0).any() or (low + len(places) > light.shape).any():
            continue
        light[low[0] : low[0] + len(places), low[1] : low[1] + len(places)] += part
    return light[margin:-margin, margin:-margin]


def ideal_white(shape: tuple[int, int], pitch: float, **options) -> DistortedWhite:
    """Discs without noise, dust or vignetting; options as of `distorted_centres`."""
    centres = distorted_centres(shape, pitch, **options)
    image = np.clip(spots(shape, centres, 0.42 * pitch, 0.7), 0, 1)
    kind, bend = options.get("kind", "rectangular"), options.get("bend", 0.0)
    rows, columns = (int(n // pitch) for n in shape)
    name = f"{columns} x {rows} {kind} lenses of {pitch} pixels, k = {bend}"
    return DistortedWhite(
        np.rint(50000 * image).astype(np.uint16),
        centres,
        rows * columns,
        (rows, columns),
        bend,
        pitch,
        kind,
        name,
    )


def distorted_white(seed: int, largest_pixels: float = 400_000, repeat: int = 0) -> DistortedWhite:
    """Draw a white image: 6 to 60 lenses a side, bent, tilted, dusty, with gaps, saturated.

    Those of another `repeat` have the same geometry and light, and noise, dust and gaps of their
    own.
    """
    rng = np.random.default_rng([35, seed])
    sides = np.exp(rng.uniform(np.log(6), np.log(60), 2))
    kind = ("rectangular", "hexagonal-rows", "hexagonal-columns")[rng.integers(3)]
    most = min(40.0, np.sqrt(largest_pixels / sides.prod()))
    pitch = float(np.exp(rng.uniform(np.log(6), np.log(max(most, 7)))))
    shape = int(np.ceil(sides[0] * pitch)), int(np.ceil(sides[1] * pitch))
    bend = float(rng.uniform(-0.02, 0.02))
    tilt = rng.uniform(-0.03, 0.03, 2) * (rng.random() < 0.5)
    rotation = float(rng.uniform(-2, 2))
    offset = rng.uniform(-0.5, 0.5, 2) * pitch
    radius, soft = rng.uniform(0.36, 0.46) * pitch, float(rng.uniform(0.5, 1.0))
    noise = float(rng.choice([0.0, 0.002, 0.01, 0.03]))
    vignetting = float(rng.uniform(0, 0.6))
    missing = float(rng.uniform(0, 0.1)) * (rng.random() < 0.5)
    dusty = float(rng.uniform(0, 0.05)) * (rng.random() < 0.5)
    level = float(rng.uniform(0.5, 1.3))
    bits = int(rng.choice([8, 12, 16]))
    centres = distorted_centres(
        shape,
        pitch,
        kind=kind,
        bend=bend,
        tilt=tuple(tilt),
        rotation_degrees=rotation,
        offset=tuple(offset),
    )
    rng = np.random.default_rng([36, seed, repeat])
    lit = rng.random(len(centres)) >= missing
    light = np.clip(spots(shape, centres[lit], radius, soft), 0, 1)
    y, x = np.indices(shape)
    middle = (np.array(shape) - 1) / 2
    light *= 1 - vignetting * np.hypot(y - middle[0], x - middle[1]) ** 2 / np.hypot(*middle) ** 2
    harmed = ~lit
    cell = pitch**2 * (1.0 if kind == "rectangular" else np.sqrt(0.75))
    for _ in range(rng.poisson(dusty * light.size / cell)):
        place, size = rng.uniform(0, 1, 2) * shape, rng.uniform(0.1, 0.8) * pitch
        beyond = np.hypot(y - place[0], x - place[1]) - size
        light *= 1 - rng.uniform(0.3, 1.0) * (0.5 - 0.5 * erf(beyond))
        harmed |= np.linalg.norm(centres - place, axis=1) < radius + size
    full = (1 << bits) - 1
    values = light * level + rng.normal(0, noise, shape) * min(level, 1.0)
    image = np.clip(np.rint(values * full), 0, full)
    whole = ((centres > radius) & (centres < np.array(shape) - 1 - radius)).all(axis=1)
    name = (
        f"seed {seed}: {shape[1]} x {shape[0]} pixels, {kind}, pitch {pitch:.2f}, "
        f"{sides[1]:.1f} x {sides[0]:.1f} lenses, k {bend:.4f}, tilt {tilt.round(3)}, "
        f"rotation {rotation:.2f}, noise {noise}, vignetting {vignetting:.2f}, "
        f"missing {missing:.2f}, dust {dusty:.3f}, level {level:.2f}, {bits} bits"
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


@dataclass(frozen=True)
class Tried:
    """Result for a drawn white image."""

    name: str
    kind: str
    lenses: tuple[int, int]
    bend: float
    enough: bool
    refusal: str | None
    worst: float = np.nan  # error of the worst centre of all accepted draws in pixels
    # Error of all centres over the standard error claimed for them, root mean square: of one draw
    # of noise, dust and gaps, and of several.
    once: float = np.nan
    true: float = np.nan

    @property
    def accepted(self) -> bool:
        """Whether a calibration came out."""
        return self.refusal is None

    @property
    def wrong(self) -> bool:
        """Whether it has a centre more than half a pixel off."""
        return self.accepted and self.worst > 0.5


def tried_distorted(white: DistortedWhite, again: Sequence[DistortedWhite] = ()) -> Tried:
    """Calibrate a white image, and others of the same geometry to know the true standard error."""
    known = white.name, white.kind, white.lenses, white.bend, white.enough
    true, claimed, worst = [], [], []
    for n, other in enumerate((white, *again)):
        try:
            found = calibrate(other.image)
        except InputError as error:
            if n == 0:
                return Tried(*known, error.problem)
            continue
        errors = other.errors(found.centres)
        worst.append(float(errors.max()))
        true.append(float((errors**2).mean()))
        claimed.append(found.evidence.mean_error_px**2)
    ratios = [
        np.sqrt((np.mean(true[:n]) + _NOTHING**2) / (np.mean(claimed[:n]) + _NOTHING**2))
        for n in (1, len(true))
    ]
    once, several = float(ratios[0]), float(ratios[1]) if len(true) > 1 else np.nan
    return Tried(*known, None, max(worst), once, several)


Draw = Callable[[int, float, int], DistortedWhite]
"""Draws a white image from a seed, with this many pixels at most; another `repeat` of it."""


def _tried_seed(draw: Draw, seed: int, largest_pixels: float, repeats: int) -> Tried:
    again = range(1, repeats + 1 if seed % _REPEATED == 0 else 1)
    return tried_distorted(
        draw(seed, largest_pixels, 0), [draw(seed, largest_pixels, n) for n in again]
    )


_CLASSES: dict[str, Callable[[Tried], bool]] = {
    "all": lambda r: True,
    "rectangular": lambda r: r.kind == "rectangular",
    "hexagonal": lambda r: r.kind != "rectangular",
    "6 to 9 lenses on the short side": lambda r: min(r.lenses) < 10,
    "10 to 19": lambda r: 10 <= min(r.lenses) < 20,
    "20 to 60": lambda r: min(r.lenses) >= 20,
    "k below 0.01": lambda r: abs(r.bend) < 0.01,
    "k from 0.01": lambda r: abs(r.bend) >= 0.01,
    "k negative": lambda r: r.bend < 0,
    "k positive": lambda r: r.bend > 0,
}


def within_two(ratios: Sequence[float]) -> tuple[int, int]:
    """How many of the known ratios are within a factor of 2, and how many there are."""
    known = np.array(ratios)[~np.isnan(ratios)]
    return int(((known > 0.5) & (known < 2)).sum()), len(known)


def table(results: Sequence[Tried]) -> list[str]:
    """Lines for each class: number accepted, their errors, and their claimed errors."""
    lines = [f"{'class':34} drawn accepted  of enough    largest error  within 2    true within 2"]
    for name, belongs in _CLASSES.items():
        part = [r for r in results if belongs(r)]
        good, enough = [r for r in part if r.accepted], [r for r in part if r.enough]
        if not good:
            continue
        once, true = within_two([r.once for r in good]), within_two([r.true for r in good])
        lines.append(
            f"{name:34} {len(part):5} {len(good):8}  {sum(r.accepted for r in enough):4} of "
            f"{len(enough):4} {max(r.worst for r in good):10.3f}     "
            f"{once[0]:4} of {once[1]:4} {true[0]:4} of {true[1]:4}"
        )
    return [*lines, *(f"refused: {r.refusal} ({r.name})" for r in results if not r.accepted)]


def tried_many(
    draw: Draw, seeds: range, largest_pixels: float, repeats: int = 0, workers: int = 2
) -> tuple[list[Tried], list[str]]:
    """Try the white images of some seeds; results and a table of them."""
    with ProcessPoolExecutor(workers) as pool:
        count = len(seeds)
        same = [largest_pixels] * count, [repeats] * count
        results = list(pool.map(_tried_seed, [draw] * count, seeds, *same, chunksize=4))
    return results, table(results)


def script(draw: Draw) -> None:
    """Try the white images that the arguments ask for, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs=2, default=(0, 1000))
    parser.add_argument("--pixels", type=float, default=60_000)
    parser.add_argument("--repeats", type=int, default=4)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    seeds = range(*given.seeds)
    print(*tried_many(draw, seeds, given.pixels, given.repeats, given.workers)[1], sep="\n")


if __name__ == "__main__":
    script(distorted_white)
