# SPDX-License-Identifier: Apache-2.0
"""First guess of the grid: shifts under which the white image looks like itself.

The autocorrelation of a white image peaks at every shift by a whole number of lenses. Missing, dim
or merged micro images make these peaks lower but add none, few lenses are enough, and sharp-edged
or tiny micro images peak at the same shifts. The image is looked at in coarser and coarser
versions, so that in one of them the pitch is a few pixels.
"""

from dataclasses import dataclass
from itertools import combinations, pairwise, product
from math import hypot

import numpy as np
import numpy.typing as npt
from scipy import fft, ndimage

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.grid import Floats, Grid, Layout
from plenofir.ground.errors import InputError

GRID_ADVICE = (
    "a white image shows a regular grid of micro images, evenly lit, at least 5 x 5 of them"
)

# The middle of the image is enough to tell the lattice, and distortion is least there.
_CROP = 1024
_LEAST_SIDE = 12
# Largest shift examined in one version of the image, in its pixels.
_SHORTEST, _LONGEST = 2.3, 15.0
_REACH = 34
_SMALL_SCALE, _LARGE_SCALE = 0.5, 6.0
# All pairs of peaks are tried, 91 in each version of the image.
_PEAKS = 14
# The correlation is divided by the overlap, which would multiply noise by more than five.
_LEAST_OVERLAP = 0.2
_WEAKEST = 0.04
# Pitches from here on are seen without the version that is twice as fine.
_COARSE = 6.0
_RINGS = 2
# Lattices whose vectors differ by less than this share are the same.
_SAME = 0.12
# Largest deviation from both layouts, in pitches, of a lattice of micro lenses.
_UNUSUAL_LAYOUT = 0.15
# A finer lattice is preferred if it scores at least this share of its sublattice's score.
_OF_THE_WHOLE = 0.5


def _fractions() -> tuple[Floats, npt.NDArray[np.int64]]:
    """Points of a lattice, and those half and a third of a step off it, where each set ends."""
    steps = range(-_RINGS, _RINGS + 1)
    sets = [[(float(m), float(n)) for m, n in product(steps, steps) if (m, n) != (0, 0)]]
    for divisor in (2, 3):
        for m, n in product(range(divisor), repeat=2):
            if (m, n) != (0, 0):
                around = product((-1, 0), repeat=2)
                sets.append([(j + m / divisor, k + n / divisor) for j, k in around])
    ends = np.cumsum([0, *map(len, sets)])
    return np.array([place for one in sets for place in one]), ends


_FRACTIONS, _SET_ENDS = _fractions()
# Cubic B-splines of the pixels from 2 before to 2 after, a quarter of a pixel behind one.
_QUARTER = (
    0.0,
    0.75**3 / 6,
    2 / 3 - 0.25**2 + 0.25**3 / 2,
    2 / 3 - 0.75**2 + 0.75**3 / 2,
    0.25**3 / 6,
)


@dataclass(frozen=True, eq=False)
class Lattice:
    """Two shortest vectors (y, x) of a lattice in pixels, shape (2, 2), and its evidence."""

    vectors: Floats
    score: float  # how much higher the autocorrelation is on the lattice than between its points


def _even(image: Image32) -> Image32:
    """The image without slow changes of the light, and with the same contrast everywhere."""
    # Gaussian filters of the image mirrored at its borders, by its cosine transform.
    small, large, wide = (
        np.multiply.outer(*(_gaussian_gains(n, scale) for n in image.shape))
        for scale in (_SMALL_SCALE, _LARGE_SCALE, 1.5 * _LARGE_SCALE)
    )
    band = fft.idctn(fft.dctn(image - image.mean()) * (small - large))
    power = np.maximum(fft.idctn(fft.dctn(band**2) * wide), 0)
    contrast = np.sqrt(power)
    return np.asarray(band / (contrast + 0.25 * float(contrast.max()) + 1e-9))


def _twice_as_fine(image: Image32) -> Image32:
    """The image with two pixels for each, interpolated by cubic splines."""
    fine: Image32 = ndimage.spline_filter(image, output=np.float32)
    for axis in (0, 1):
        shape = list(fine.shape)
        shape[axis] *= 2
        both = np.empty(shape, np.float32)
        for n, weights in enumerate((_QUARTER[::-1], _QUARTER)):
            part = (slice(None),) * axis + (slice(n, None, 2),)
            both[part] = ndimage.correlate1d(fine, weights, axis=axis, mode="mirror")
        fine = both
    return np.asarray(fine)


def _gaussian_gains(count: int, scale: float) -> Image32:
    """What a Gaussian filter over four scales on each side does to a line's cosine transform."""
    reach = int(4 * scale + 0.5)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / scale) ** 2)
    angles = np.outer(np.pi * np.arange(count) / count, np.arange(1, reach + 1))
    gains = weights[reach] + 2 * np.cos(angles) @ weights[reach + 1 :]
    return np.asarray(gains / weights.sum(), dtype=np.float32)


def _autocorrelation(image: Image32) -> tuple[Floats, Floats]:
    """Autocorrelation for shifts of up to `_REACH`, 1 without shift, and the share of overlap."""
    reach = [min(_REACH, n - 1) for n in image.shape]
    shape = [fft.next_fast_len(n + r) for n, r in zip(image.shape, reach, strict=True)]
    power = np.abs(fft.rfft2(image - image.mean(), s=shape)) ** 2
    whole = fft.irfft2(power, s=shape)
    places = [np.arange(-r, r + 1) for r in reach]
    part = whole[np.ix_(*places)]
    overlap = np.multiply.outer(
        *[(n - np.abs(p)) / n for n, p in zip(image.shape, places, strict=True)]
    )
    result = np.where(overlap > _LEAST_OVERLAP, part / np.maximum(overlap, _LEAST_OVERLAP), 0.0)
    return result / max(float(whole[0, 0]), 1e-30), overlap


def _peaks(correlation: Floats) -> Floats:
    """Strongest local maxima (y, x) on one half of the plane, shape (n, 2)."""
    middle = np.array(correlation.shape) // 2
    largest = ndimage.maximum_filter(correlation, 3, mode="nearest")
    y, x = np.nonzero((correlation == largest) & (correlation > _WEAKEST))
    inner = (y > 0) & (x > 0) & (y < 2 * middle[0]) & (x < 2 * middle[1])
    y, x = y[inner], x[inner]
    order = np.argsort(-correlation[y, x])
    shifts = []
    for row, column in zip(y[order], x[order], strict=True):
        place = []
        for line, k in ((correlation[:, column], row), (correlation[row], column)):
            low, mid, high = line[k - 1 : k + 2]
            bend = low - 2 * mid + high
            place.append(k + (0.5 * (low - high) / bend if bend < 0 else 0.0))
        shift = np.array(place) - middle
        half = shift[0] > 0.5 or (abs(shift[0]) <= 0.5 and shift[1] > 0)
        if half and _SHORTEST < hypot(*shift) < _LONGEST:
            shifts.append(shift)
        if len(shifts) == _PEAKS:
            break
    return np.array(shifts).reshape(-1, 2)


def reduced(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Shortest two vectors of the lattice of a and b (Gauss)."""
    for _ in range(100):
        if a @ a > b @ b:
            a, b = b, a
        if a @ a < 1e-12:
            break
        times = np.round((a @ b) / (a @ a))
        if times == 0:
            break
        b = b - times * a
    return a, b


def _score(splines: Floats, overlap: Floats, vectors: Floats) -> float:
    """How much higher the autocorrelation is on a lattice than half or a third of a step off it."""
    middle = np.array(splines.shape) // 2
    places = _FRACTIONS @ vectors + middle
    inside = ((places >= 0) & (places <= 2 * middle)).all(axis=1)
    at = places[inside].T
    values = ndimage.map_coordinates(splines, at, order=3, prefilter=False)
    weights = ndimage.map_coordinates(overlap, at, order=1)
    ends = np.concatenate([[0], np.cumsum(inside)])[_SET_ENDS]
    means = []
    for start, end in pairwise(ends):
        part = slice(start, end)
        total = max(weights[part].sum(), 1e-9)
        means.append(float((values * weights)[part].sum() / total) if end > start else -1.0)
    return means[0] - max(0.0, *means[1:])


def lattices(
    image: Image32, layout: Layout | None = None, *, smallest_pitch: float = 0.0
) -> list[Lattice]:
    """Candidate lattices of an image, best score first; of `smallest_pitch` or more."""
    starts = [max(0, (n - _CROP) // 2) for n in image.shape]
    work = image[tuple(slice(b, b + _CROP) for b in starts)].astype(np.float32)
    scored: list[Lattice] = []
    # The first version is twice as fine, for pitches of a few pixels.
    starts = [max(0, (n - _CROP // 2) // 2) for n in work.shape]
    work_fine = work[tuple(slice(b, b + _CROP // 2) for b in starts)]
    versions = []
    if smallest_pitch < _COARSE:
        versions.append((0.5, _twice_as_fine(work_fine)))
    zoom = 1.0
    while min(work.shape) >= _LEAST_SIDE:
        versions.append((zoom, work))
        rows, columns = (n // 2 * 2 for n in work.shape)
        work = work[:rows, :columns].reshape(rows // 2, 2, columns // 2, 2).mean(axis=(1, 3))
        zoom *= 2
    for zoom, work in versions:
        correlation, overlap = _autocorrelation(_even(work))
        splines = ndimage.spline_filter(correlation, 3)
        for a, b in combinations(_peaks(correlation), 2):
            first, second = reduced(a, b)
            area = abs(first[0] * second[1] - first[1] * second[0])
            lengths = hypot(*first), hypot(*second)
            if area < 0.6 * lengths[0] * lengths[1] or lengths[0] < _SHORTEST:
                continue
            if lengths[1] > 2 * lengths[0]:
                continue
            vectors = np.array([first, second])
            if layout is None and min(layout_misfits(vectors)) > _UNUSUAL_LAYOUT:
                continue
            score = _score(splines, overlap, vectors)
            if score > _WEAKEST:
                scored.append(Lattice(zoom * vectors, score))
    scored.sort(key=lambda lattice: -lattice.score)
    different: list[Lattice] = []
    for lattice in scored:
        if not any(_same(lattice.vectors, other.vectors) for other in different):
            different.append(lattice)
    # Every second or third lens forms a lattice too; such sublattices go behind the full one.
    whole = [
        lattice
        for lattice in different
        if not any(
            _part(lattice.vectors, other.vectors) and other.score > _OF_THE_WHOLE * lattice.score
            for other in different
        )
    ]
    return whole + [lattice for lattice in different if lattice not in whole]


def _part(vectors: Floats, others: Floats) -> bool:
    """Whether one lattice is a sublattice of a finer one."""
    steps = vectors @ np.linalg.inv(others)
    whole = np.round(steps)
    return bool(np.abs(steps - whole).max() < 2 * _SAME and abs(np.linalg.det(whole)) > 1.5)


def _same(vectors: Floats, others: Floats) -> bool:
    """Whether two pairs of vectors make the same lattice."""
    steps = vectors @ np.linalg.inv(others)
    whole = np.round(steps)
    near = bool(np.abs(steps - whole).max() < _SAME)
    return near and abs(abs(np.linalg.det(whole)) - 1) < 1e-6


def layout_misfits(vectors: Floats) -> tuple[float, float]:
    """How far reduced vectors are from a square and from a hexagonal lattice, in pitches."""
    a, b = reduced(*vectors)
    if a @ b < 0:
        b = -b
    length = (hypot(*a) + hypot(*b)) / 2
    along = a / hypot(*a)
    across = np.array([-along[1], along[0]])
    # b in a frame along a, mirrored if necessary.
    place = np.array([b @ along, abs(b @ across)]) / length
    ratio = hypot(*a) / length
    square = hypot(place[0], place[1] - 1, ratio - 1)
    hexagonal = hypot(place[0] - 0.5, place[1] - np.sqrt(0.75), ratio - 1)
    return float(square), float(hexagonal)


def classified(vectors: Floats, layout: Layout | None) -> tuple[Layout, Floats, Floats]:
    """Layout, and the vectors of a row step and a column step."""
    a, b = reduced(*vectors)
    if a @ b < 0:
        b = -b
    square, hexagon = layout_misfits(vectors)
    hexagonal = layout != "rectangular" if layout else hexagon < square
    if not hexagonal:
        steps = [a, b]
        # The column step is the one that is nearer to the horizontal.
        right = max(steps, key=lambda v: abs(v[1]) / hypot(*v))
        down = a if right is b else b
        return "rectangular", _positive(down, 0), _positive(right, 1)
    ring = [a, b, b - a]
    flat = max(ring, key=lambda v: abs(v[1]) / hypot(*v))
    steep = max(ring, key=lambda v: abs(v[0]) / hypot(*v))
    rows = abs(flat[1]) / hypot(*flat) >= abs(steep[0]) / hypot(*steep)
    if layout == "hexagonal-rows" or (layout is None and rows):
        right = _positive(flat, 1)
        other = _positive(next(v for v in ring if v is not flat), 0)
        # Perpendicular to the rows: to a lens in the next row, less half a step to either side.
        down = other - right * (0.5 if other @ right > 0 else -0.5)
        return "hexagonal-rows", down, right
    down = _positive(steep, 0)
    other = _positive(next(v for v in ring if v is not steep), 1)
    right = other - down * (0.5 if other @ down > 0 else -0.5)
    return "hexagonal-columns", down, right


def _positive(vector: Floats, axis: int) -> Floats:
    return vector if vector[axis] > 0 else -vector


def guess(image: Image32, vectors: Floats, layout: Layout | None = None) -> Grid:
    """Grid in the middle of an image from the vectors of its lattice."""
    kind, down, right = classified(vectors, layout)
    a, b = reduced(*vectors)
    inverse = np.array([a, b]).T
    reciprocal = np.linalg.inv(inverse)
    # The offset is found near the middle, where errors of the vectors have not added up yet.
    size = int(np.ceil(8 * max(hypot(*a), hypot(*b))))
    starts = [max(0, (n - size) // 2) for n in image.shape]
    crop = image[tuple(slice(start, start + size) for start in starts)]
    middle = np.array(starts) + (np.array(crop.shape) - 1) / 2
    y, x = (np.arange(n) - (n - 1) / 2 for n in crop.shape)
    window = np.outer(np.hanning(len(y) + 2)[1:-1], np.hanning(len(x) + 2)[1:-1])
    weighted = crop * window
    weighted -= window * (weighted.sum() / window.sum())
    turns = np.array(
        [
            -np.angle(np.exp(-2j * np.pi * k[0] * y) @ weighted @ np.exp(-2j * np.pi * k[1] * x))
            for k in reciprocal
        ]
    ) / (2 * np.pi)
    origin = middle + inverse @ turns
    return Grid(
        layout=kind,
        order=1,
        middle=(0.0, 0.0),
        scale=1.0,
        coefficients=(tuple(origin), tuple(down), tuple(right)),
    )


def no_grid(problem: str) -> InputError:
    """Error of a white image without a grid."""
    return InputError(f"{problem}; {GRID_ADVICE}", where="white image")


def reduced_lengths(grid: Grid) -> tuple[float, float]:
    """Distances to the nearest lenses."""
    a, b = reduced(*primitive_vectors(grid))
    return float(np.hypot(*a)), float(np.hypot(*b))


def primitive_vectors(grid: Grid) -> Floats:
    """Vectors to two neighbouring lenses, in the middle of a grid."""
    down, right = grid.vectors
    if grid.layout == "hexagonal-rows":
        down = down + right / 2
    elif grid.layout == "hexagonal-columns":
        right = right + down / 2
    return np.array([down, right])
