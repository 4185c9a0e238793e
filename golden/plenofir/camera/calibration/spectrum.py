"""First guess of the grid: the peaks that a lattice of micro images has in the Fourier plane.

Two reciprocal vectors and the phases at them give pitch, rotation, layout and offset of the grid in
the middle of the image, whether single micro images are missing, dim or merged, or not.
"""

from math import hypot

import numpy as np
from scipy import fft

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.grid import Flags, Floats, Grid, Layout
from plenofir.errors import InputError

GRID_EXPECTED = "a white image: a regular grid of micro images, evenly lit, at least 5 x 5 of them"

_CROP = 1024
_PADDING = 2
# Micro images of less than 2.5 pixels cannot be told from noise and colour filters.
_HIGHEST_FREQUENCY = 0.4
# Cycles in the window below which vignetting hides everything.
_LOWEST_CYCLES = 3.0
# A harmonic of sharp-edged micro images is weaker than the fundamental, but not by more than this.
_WEAKEST_PEAK = 0.25
_PEAK_OVER_NOISE = 8.0


def _central(image: Image32, size: int) -> tuple[Image32, Floats]:
    """Middle of an image, and where its top left pixel is."""
    starts = [max(0, (n - size) // 2) for n in image.shape]
    return image[tuple(slice(b, b + size) for b in starts)], np.array(starts, dtype=np.float64)


def _refined(magnitude: Image32, row: int, column: int) -> Floats:
    """Peak between samples: parabola through the logarithms of three neighbours."""
    place = []
    for line, k in ((magnitude[:, column], row), (magnitude[row], column)):
        n = len(line)
        low, mid, high = np.log(line[[(k - 1) % n, k, (k + 1) % n]].astype(np.float64) + 1e-30)
        bend = low - 2 * mid + high
        place.append(k + (0.5 * (low - high) / bend if bend < 0 else 0.0))
    return np.array(place)


def reciprocal_vectors(image: Image32) -> Floats:
    """Two shortest reciprocal vectors of the grid in the middle of an image."""
    crop, _ = _central(image, _CROP)
    rows, columns = crop.shape
    window = np.outer(np.hanning(rows + 2)[1:-1], np.hanning(columns + 2)[1:-1]).astype(np.float32)
    # Without the smooth part, which would leak into low frequencies.
    level = float((crop * window).sum() / window.sum())
    shape = [fft.next_fast_len(_PADDING * n) for n in crop.shape]
    magnitude = np.abs(fft.fft2((crop - level) * window, s=shape, workers=-1))
    y, x = (fft.fftfreq(n) for n in shape)
    cycles = np.hypot.outer(y * rows, x * columns)
    hidden = (cycles < _LOWEST_CYCLES) | (np.hypot.outer(y, x) > _HIGHEST_FREQUENCY)
    # Half of the plane repeats the other.
    hidden[:, shape[1] // 2 :] = True
    hidden[shape[0] // 2 :, 0] = True
    shown = magnitude[~hidden]
    if shown.size == 0 or not shown.any():
        raise InputError("no grid of micro images", where="white image", expected=GRID_EXPECTED)
    first = _strongest(magnitude, hidden)
    # Not a multiple of the first: at least 20 degrees off its direction.
    across = np.abs(np.subtract.outer(y * first[1], x * first[0]))
    collinear = across < np.sin(np.radians(20)) * np.hypot(*first) * np.hypot.outer(y, x)
    second = _strongest(magnitude, hidden | collinear)
    if magnitude_at(magnitude, second) < _PEAK_OVER_NOISE * float(np.median(shown)):
        raise InputError("no grid of micro images", where="white image", expected=GRID_EXPECTED)
    return _without_multiples(magnitude, *_reduced(first, second))


def _strongest(magnitude: Image32, hidden: Flags) -> Floats:
    """Frequency of the strongest peak that is not hidden."""
    row, column = np.unravel_index(np.argmax(np.where(hidden, 0, magnitude)), magnitude.shape)
    place = _refined(magnitude, int(row), int(column))
    shape = np.array(magnitude.shape)
    turns = place / shape
    return np.asarray(np.where(turns > 0.5, turns - 1, turns))


def magnitude_at(magnitude: Image32, frequency: Floats, samples: int = 1) -> float:
    """Largest magnitude within a sample of a frequency."""
    row, column = np.round(frequency * magnitude.shape).astype(np.int64)
    near = np.arange(-samples, samples + 1)
    part = np.ix_((row + near) % magnitude.shape[0], (column + near) % magnitude.shape[1])
    return float(magnitude[part].max())


def _without_multiples(magnitude: Image32, first: Floats, second: Floats) -> Floats:
    """Reciprocal vectors of the whole lattice from those of two harmonics."""
    # Small or sharp-edged micro images have harmonics as strong as the fundamental. If there is a
    # peak at a half or a third of a combination of the two, it belongs to the lattice too.
    strength = min(magnitude_at(magnitude, first), magnitude_at(magnitude, second))
    for _ in range(4):
        found = None
        for divisor in (2, 3):
            for m in range(divisor):
                for n in range(-(divisor // 2), divisor // 2 + 1):
                    candidate = (m * first + n * second) / divisor
                    level = magnitude_at(magnitude, candidate)
                    # A peak of its own, not the flank of another.
                    own = level == magnitude_at(magnitude, candidate, 2 * _PADDING)
                    if (m, n) != (0, 0) and own and level > _WEAKEST_PEAK * strength:
                        found = found or (divisor, m, n, candidate)
        if found is None:
            break
        divisor, m, _, candidate = found
        first, second = _reduced(candidate, second if m else first)
    return np.array([first, second])


def _reduced(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Shortest two vectors of the lattice of a and b (Gauss)."""
    for _ in range(100):
        if a @ a > b @ b:
            a, b = b, a
        times = np.round((a @ b) / (a @ a))
        if times == 0:
            break
        b = b - times * a
    return a, b


def _classified(a: Floats, b: Floats, layout: Layout | None) -> tuple[Layout, Floats, Floats]:
    """Layout, and the vectors of a row step and a column step."""
    if a @ b < 0:
        b = -b
    cosine = (a @ b) / (hypot(*a) * hypot(*b))
    ratio = hypot(*b) / hypot(*a)
    hexagonal = layout != "rectangular" if layout else cosine > 0.3 and ratio < 1.2
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
        # Across the rows: to the next lens minus half a step, whichever side it leans to.
        down = other - right * (0.5 if other @ right > 0 else -0.5)
        return "hexagonal-rows", down, right
    down = _positive(steep, 0)
    other = _positive(next(v for v in ring if v is not steep), 1)
    right = other - down * (0.5 if other @ down > 0 else -0.5)
    return "hexagonal-columns", down, right


def _positive(vector: Floats, axis: int) -> Floats:
    return vector if vector[axis] > 0 else -vector


def first_guess(image: Image32, layout: Layout | None = None) -> Grid:
    """Grid in the middle of an image."""
    reciprocal = reciprocal_vectors(image)
    # Columns of the inverse are the lattice vectors: k_m . a_n = 1 if m = n, otherwise 0.
    inverse = np.linalg.inv(reciprocal)
    a, b = _reduced(*inverse.T.astype(np.float64))
    kind, down, right = _classified(a, b, layout)
    # Phases near the middle, where errors of the vectors do not count yet.
    size = int(np.ceil(8 * max(hypot(*a), hypot(*b))))
    crop, start = _central(image, size)
    middle = start + (np.array(crop.shape) - 1) / 2
    y = np.arange(crop.shape[0]) + start[0] - middle[0]
    x = np.arange(crop.shape[1]) + start[1] - middle[1]
    window = np.hanning(len(y) + 2)[1:-1], np.hanning(len(x) + 2)[1:-1]
    weighted = crop * np.outer(*window)
    weighted -= np.outer(*window) * (weighted.sum() / np.outer(*window).sum())
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
