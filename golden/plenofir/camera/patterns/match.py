# SPDX-License-Identifier: Apache-2.0
"""How well a known grid fits a capture's pixels, and moving it to where it fits best.

Micro images are brighter in the middle than at the borders, whatever the scene. So the picture has
components at the three lowest frequencies of the lens grid, whose phases give the displacement of
the micro images from the grid. Phases are measured in blocks of a few micro images, and a smooth
displacement is fitted to all blocks, from the middle outwards, weighted by amplitude. The scene
disturbs single blocks, but not all in the same direction. Within a block a bent grid is straight.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.grid import Floats, Grid

Complex = npt.NDArray[np.complex128]

# Side of a block in pitches: a compromise between many blocks and large ones.
_SMALLEST_BLOCK, _LARGEST_BLOCK, _USUAL_BLOCKS = 4.0, 12.0, 6
# Three blocks fit a shift and a matrix exactly, whatever they hold: the fourth can contradict.
_FEWEST_BLOCKS = 4
# Displacements are fitted to blocks within a radius that grows (shares of the largest).
_FIRST_REACH, _GROWTH, _TELL_TILT = 0.1, 1.5, 9
# Phases are known up to whole cycles: a round is right where the one before came within half of
# one.
_ROUNDS = 4
# A grid is scaled and rotated if it then agrees better by the first, which tells in few blocks, or
# if that explains so many times more than chance, which tells in many.
_BETTER, _CLEAR_GAIN = 0.02, 8.0
# Micro images are not found if amplitudes are below this share of the brightness, or if phases
# agree less than this.
_WEAKEST, _LEAST_AGREEMENT = 0.02, 0.5


@dataclass(frozen=True)
class Match:
    """Agreement of a capture's pixels with a grid."""

    grid: Grid  # moved to where the pixels have it
    fits: bool  # micro images were found at its pitch and rotation
    # Agreement of the blocks after the move: 1 if all have the same phase, 0 if phases are random.
    agreement: float
    # 1 if phases of neighbouring blocks change smoothly, which distorted grids' do, too.
    smoothness: float
    strength: float  # amplitude of the waves as a share of the brightness
    moved_px: float  # largest displacement in the picture
    gain: float = 0.0  # how many times more of the phases the move explains than chance does
    # Where pixel positions (y, x) of the grid go: `matrix` times them, plus `shift`.
    matrix: tuple[tuple[float, float], tuple[float, float]] = ((1.0, 0.0), (0.0, 1.0))
    shift: tuple[float, float] = (0.0, 0.0)


def _primitive(grid: Grid) -> Floats:
    """Lattice coordinates of steps to two neighbouring lenses, shape (2, 2)."""
    if grid.layout == "hexagonal-rows":
        return np.array([(1.0, 0.5), (0.0, 1.0)])
    if grid.layout == "hexagonal-columns":
        return np.array([(1.0, 0.0), (0.5, 1.0)])
    return np.eye(2)


def _combined(grid: Grid, waves: Floats) -> Floats:
    """Waves of a lattice's two coordinates along the last axis but one, and in hexagons a third."""
    first, second = waves[..., 0, :], waves[..., 1, :]
    if grid.layout == "rectangular":
        return waves
    # The third is as long as the others; which it is does not change over a grid.
    usual = np.linalg.inv(_primitive(grid) @ grid.vectors).T
    plus = usual[0] + usual[1]
    third = first - second if plus @ plus > 1.5 * (usual[0] @ usual[0]) else first + second
    return np.stack([first, second, third], axis=-2)


def wave_vectors(grid: Grid) -> Floats:
    """Lowest frequencies of the lens grid, cycles per pixel along (y, x), shape (2 or 3, 2)."""
    return _combined(grid, np.asarray(np.linalg.inv(_primitive(grid) @ grid.vectors).T))


def _blocks(image: Image32, grid: Grid) -> tuple[Floats, Complex, float]:
    """Middles of blocks (r, c, 2), complex amplitudes about the grid's origin (r, c, waves)."""
    side = min(image.shape) / _USUAL_BLOCKS / grid.lens_pitch
    size = int(np.ceil(min(max(side, _SMALLEST_BLOCK), _LARGEST_BLOCK) * grid.lens_pitch))
    counts = [max(1, n // size) for n in image.shape]
    starts = [max(0, n - c * size) // 2 for n, c in zip(image.shape, counts, strict=True)]
    sides = [min(size, n) for n in image.shape]
    windows = [np.hanning(n + 2)[1:-1] for n in sides]
    window = windows[0][:, np.newaxis] * windows[1]
    places = [
        start + size * np.arange(count) + (n - 1) / 2
        for start, count, n in zip(starts, counts, sides, strict=True)
    ]
    middles = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1)
    lattice = grid.inverse(middles)
    primitive = _primitive(grid)
    waves = _combined(grid, np.swapaxes(np.linalg.inv(primitive @ grid.jacobian(lattice)), -1, -2))
    # Cycles from the first lens to the middles.
    cycles = (lattice - grid.lattice(0, 0)) @ np.linalg.inv(primitive)
    cycles = _combined(grid, cycles[..., np.newaxis])[..., 0]
    amplitudes = np.empty(cycles.shape, dtype=np.complex128)
    y, x = (np.arange(n) - (n - 1) / 2 for n in sides)
    total = 0.0
    for row in range(counts[0]):
        for column in range(counts[1]):
            top, left = starts[0] + row * size, starts[1] + column * size
            part = image[top : top + sides[0], left : left + sides[1]] * window
            level = part.sum()
            part -= window * (level / window.sum())
            k = waves[row, column]
            down = 2 * np.pi * np.outer(k[:, 0], y)
            # Real products: complex ones take four times as long.
            lines = np.cos(down) @ part - 1j * (np.sin(down) @ part)
            right = np.exp(-2j * np.pi * np.outer(k[:, 1], x))
            amplitudes[row, column] = (lines * right).sum(axis=1)
            total += level
    amplitudes *= np.exp(-2j * np.pi * cycles)
    return middles - grid.centres(0, 0), amplitudes, total / (counts[0] * counts[1])


def match_capture(image: Image32, grid: Grid) -> Match:
    """Measure how far a capture's micro images lie from a grid, and move the grid there.

    A mosaic whose colours are about equally bright will do. The grid stays where micro images are
    not seen.
    """
    waves = wave_vectors(grid)
    middles, blocks, level = _blocks(image, grid)
    amplitudes = blocks.reshape(-1, len(waves))
    if len(amplitudes) < _FEWEST_BLOCKS or level <= 0 or not amplitudes.any():
        return Match(grid, False, 0.0, 0.0, 0.0, 0.0)
    pitch = grid.lens_pitch
    flat = middles.reshape(-1, 2)
    terms = np.concatenate([np.ones((len(flat), 1)), flat / (100 * pitch)], axis=1)
    weights = np.abs(amplitudes)
    # Limits the influence of a few bright blocks.
    weights = np.minimum(weights, 3 * float(np.median(weights)) + 1e-12 * float(weights.max()))
    turned = _grown(amplitudes, weights, waves, terms)
    moved = np.zeros_like(turned)
    for _ in range(_ROUNDS):
        moved[:1] += _step(amplitudes, weights, waves, terms, moved, 1)
    agreements = [
        float((weights * np.cos(_phases(amplitudes, waves, terms @ moves))).sum() / weights.sum())
        for moves in (moved, turned)
    ]
    better = (
        agreements[1] > agreements[0] + _BETTER
        or _gain(agreements[0], agreements[1], 4, len(amplitudes)) > _CLEAR_GAIN
    )
    moves, agreement = (turned, agreements[1]) if better else (moved, agreements[0])
    unmoved = float((weights * np.cos(np.angle(amplitudes))).sum() / weights.sum())
    gain = _gain(unmoved, agreement, 6 if better else 2, len(amplitudes))
    residual = (blocks * np.exp(2j * np.pi * (terms @ moves) @ waves.T).reshape(blocks.shape)) / (
        np.abs(blocks) + 1e-30
    )
    pairs = [
        (a * b.conj()).real
        for a, b in ((residual[1:], residual[:-1]), (residual[:, 1:], residual[:, :-1]))
    ]
    smoothness = float(np.mean(np.concatenate([part.ravel() for part in pairs])))
    strength = float(np.median(np.abs(amplitudes).mean(axis=1)) / level)
    if strength < _WEAKEST or max(agreement, smoothness) < _LEAST_AGREEMENT:
        return Match(grid, False, agreement, smoothness, strength, 0.0)
    stretch = moves[1:].T / (100 * pitch)
    matrix = np.eye(2) + stretch
    shift = moves[0] - stretch @ grid.centres(0, 0)
    corners = np.array([(y, x) for y in (0, image.shape[0]) for x in (0, image.shape[1])])
    moved_px = float(np.hypot(*(corners @ stretch.T + shift).T).max())
    return Match(
        grid.mapped(matrix, shift),
        True,
        agreement,
        smoothness,
        strength,
        moved_px,
        gain,
        ((float(matrix[0, 0]), float(matrix[0, 1])), (float(matrix[1, 0]), float(matrix[1, 1]))),
        (float(shift[0]), float(shift[1])),
    )


def _gain(before: float, after: float, terms: int, blocks: int) -> float:
    """How many times more than chance further terms explain of the phases (an F ratio)."""
    free = max(2 * blocks - 6, 1)
    return (after - before) / max(1 - after, 1e-6) * free / terms


def _grown(amplitudes: Complex, weights: Floats, waves: Floats, terms: Floats) -> Floats:
    """Displacement with scale and rotation, fitted to more and more blocks from the middle."""
    radius = np.hypot(*(terms[:, 1:] - terms[:, 1:].mean(axis=0)).T)
    moves = np.zeros((3, 2))
    reach = _FIRST_REACH * float(radius.max())
    end = False
    while not end:
        end = reach >= radius.max()
        near = radius <= max(reach, float(np.sort(radius)[_FEWEST_BLOCKS - 1]))
        # Scale and rotation need some more blocks.
        count = 3 if near.sum() >= _TELL_TILT else 1
        for _ in range(_ROUNDS):
            part = weights[near], waves, terms[near]
            moves[:count] += _step(amplitudes[near], *part, moves, count)
        reach *= _GROWTH
    return moves


def _phases(amplitudes: Complex, waves: Floats, moves: Floats) -> Floats:
    """Phases that are left after displacements, shape (n, waves)."""
    return np.angle(amplitudes * np.exp(2j * np.pi * moves @ waves.T))


def _step(
    amplitudes: Complex, weights: Floats, waves: Floats, terms: Floats, moves: Floats, count: int
) -> Floats:
    """Gauss-Newton step of the displacement's first `count` coefficients."""
    residual = -_phases(amplitudes, waves, terms @ moves) / (2 * np.pi)
    used = terms[:, :count]
    matrix = np.einsum("nw,nc,nd,wi,wj->cidj", weights, used, used, waves, waves)
    right = np.einsum("nw,nw,nc,wi->ci", weights, residual, used, waves)
    size = 2 * count
    return np.linalg.solve(
        matrix.reshape(size, size) + 1e-12 * np.eye(size) * np.trace(matrix.reshape(size, size)),
        right.reshape(size),
    ).reshape(count, 2)
