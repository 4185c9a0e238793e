# SPDX-License-Identifier: Apache-2.0
"""Centroids of micro images in a smooth window around where they are expected.

The window (a raised cosine, a little wider than the pitch) weighs the dark gaps on both sides of a
micro image equally, so the centroid of a window centred on a micro image is in its middle whatever
the brightness of background and neighbours; no threshold and no labelling is needed. The centroid's
offset is proportional to that of the micro image. The factor, one for all micro images, is measured
by moving the windows a little.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plenofir.camera.calibration.grid import Floats

Image32 = npt.NDArray[np.float32]

HALF_WIDTH = 0.6
"""Half width of the window in pitches."""
CORE_HALF_WIDTH = 0.35
"""Half width of the window over the middle of a micro image, in pitches."""
# Patches of so many pixels, 8 MB of floats, are matched in one go, however many lenses there are.
_BLOCK_PIXELS = 1 << 21
# Window for matching micro images, in pitches: 1 up to the first radius, 0 beyond the second.
_EVEN_TO, _NOTHING_FROM = 0.42, 0.58
# Micro images of more pixels are sampled in larger steps, of an image that is smoothed accordingly:
# time would grow with the square of the pitch.
_MATCHED_SAMPLES = 28
_TEMPLATE_LENSES = 1000
# A brightness slope and a shift of a small round spot are hard to tell apart; if they correlate by
# more than this, only shifts are fitted.
_ALIKE = 0.85
# The windows are moved by this share of a pitch to both sides, so that the response is exact to
# the second order of it.
_TRIAL = 0.05
# Windows of small micro images are evaluated between pixels, at so many places a pitch: at whole
# pixels alone the sum would depend on where in a pixel the centre lies.
_PLACES_A_PITCH = 24
_TRIAL_LENSES = 1000


@dataclass(frozen=True)
class Moments:
    """Weighted moments of windows."""

    sums: Floats  # mean of the window, shape (n,)
    offsets: Floats  # centroid from the window's middle, (y, x) in pixels, shape (n, 2)
    variances: Floats  # second moments along y and x in square pixels, shape (n, 2)


def reach(pitch: float) -> float:
    """Pixels around a centre that its window needs, the trial moves of `response` included."""
    return float(np.ceil((HALF_WIDTH + _TRIAL) * pitch)) + 3


def raised_cosine(distance: Floats, half_width: float) -> Floats:
    """Weights of the window along one axis."""
    inside = np.abs(distance) < half_width
    return np.where(inside, 0.5 + 0.5 * np.cos(np.pi / half_width * distance), 0.0)


def _between(pitch: float) -> Floats:
    """Weights of the pixels from 2 before to 2 after for places between pixels."""
    # A window of a few pixels that is evaluated at pixel centres only biases the centroid towards
    # them, so it is evaluated between pixels too, on the interpolated image (Keys's cubic).
    count = max(1, int(np.ceil(_PLACES_A_PITCH / pitch)))
    places = (np.arange(count) + 0.5) / count - 0.5
    away = np.abs(places[:, np.newaxis] - np.arange(-2, 3))
    near = (1.5 * away - 2.5) * away**2 + 1
    far = ((-0.5 * away + 2.5) * away - 4) * away + 2
    return np.where(away < 1, near, np.where(away < 2, far, 0.0)) / count


def _window_sums(
    image: Image32,
    positions: Floats,
    pitch: tuple[float, float],
    half_width: float,
    *,
    moved: bool,
) -> Floats:
    """See `plenofir.camera.calibration.moments.add_windows`."""
    from plenofir.camera.calibration.moments import add_windows

    halves = half_width * np.array(pitch)
    # Two pixels more for the interpolation.
    sides = np.ceil(halves).astype(np.int64) + 2
    corners = np.rint(positions).astype(np.int64)
    if ((corners < sides) | (corners + sides >= image.shape)).any():
        raise ValueError("windows reach beyond the image")
    sums = np.empty((len(positions), 6 if moved else 2))
    between = _between(pitch[0]), _between(pitch[1])
    add_windows(image, positions, halves, sides, between[0], between[1], moved, sums)
    return sums


def _mass(sums: Floats) -> Floats:
    return np.where(np.abs(sums[:, 1]) > 1e-9, sums[:, 1], 1e-9)


def windowed_moments(
    image: Image32, positions: Floats, pitch: tuple[float, float], half_width: float = HALF_WIDTH
) -> Moments:
    """Moments of an image in windows."""
    sums = _window_sums(image, positions, pitch, half_width, moved=True)
    mass = _mass(sums)
    return Moments(
        sums=mass / sums[:, 0],
        offsets=sums[:, 2:4] / mass[:, np.newaxis],
        variances=sums[:, 4:6] / mass[:, np.newaxis],
    )


def core_brightness(
    image: Image32,
    positions: Floats,
    pitch: tuple[float, float],
    half_width: float = CORE_HALF_WIDTH,
) -> Floats:
    """Mean brightness of the middle of micro images."""
    sums = _window_sums(image, positions, pitch, half_width, moved=False)
    return np.asarray(_mass(sums) / sums[:, 0])


def response(
    image: Image32,
    positions: Floats,
    pitch: tuple[float, float],
    half_width: float = HALF_WIDTH,
) -> Floats:
    """How far a window's centroid moves when the window moves by one pixel."""
    step = max(1, len(positions) // _TRIAL_LENSES)
    chosen = positions[::step]
    factors = np.empty(2)
    for axis in (0, 1):
        move = np.zeros(2)
        move[axis] = _TRIAL * pitch[axis]
        ahead = windowed_moments(image, chosen + move, pitch, half_width).offsets[:, axis]
        behind = windowed_moments(image, chosen - move, pitch, half_width).offsets[:, axis]
        factors[axis] = np.median(behind - ahead) / (2 * move[axis])
    return factors


def matching_scale(pitch: tuple[float, float]) -> float:
    """Standard deviation in pixels by which `matched_offsets` wants its image smoothed."""
    # In steps, so that an image smoothed once serves grids that differ by little.
    return 0.4 * max(1.0, round(min(pitch) / _MATCHED_SAMPLES, 1))


def smoothed(image: Image32, scale: float) -> Image32:
    """An image smoothed by a Gaussian of this standard deviation in pixels."""
    from plenofir.camera.calibration.moments import smooth_into

    reach = int(4 * scale + 0.5)
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / scale) ** 2)
    result = np.zeros(image.shape, np.float32)
    smooth_into(np.asarray(image, np.float32), (taps / taps.sum()).astype(np.float32), result)
    return result


def matched_offsets(
    smooth: Image32, positions: Floats, pitch: tuple[float, float], share: float = 1.0
) -> Floats:
    """Offsets of micro images from positions, by matching each to the mean of all.

    `smooth` is the image smoothed by `matching_scale`; `share` of the usual window is looked at.

    The borders of large micro images locate them with less noise than a centroid does.
    The mean is made symmetric about its middle, so that it is centred like a centroid.
    """
    step = max(1.0, min(pitch) / _MATCHED_SAMPLES)
    from plenofir.camera.calibration.moments import sample

    sides = [int(share * _NOTHING_FROM * p / step) for p in pitch]
    places = [np.asarray(np.arange(-n, n + 1) * step, np.float64) for n in sides]
    away = [np.abs(line) / (share * p) for line, p in zip(places, pitch, strict=True)]
    taper = [
        np.clip((_NOTHING_FROM - line) / (_NOTHING_FROM - _EVEN_TO), 0.0, 1.0) for line in away
    ]
    window = np.sqrt(np.outer(*taper)).ravel()
    y, x = (part.ravel() for part in np.meshgrid(*places, indexing="ij"))

    def patches(part: Floats) -> Image32:
        values = np.empty((len(part), len(y)), np.float32)
        sample(smooth, part, places[0], places[1], values)
        return values

    few = np.random.default_rng(4).permutation(len(positions))[:_TEMPLATE_LENSES]
    # Sorting runs in vectors, and takes a third of the time of numpy.median.
    ordered = np.sort(patches(positions[few]), axis=0)
    mean = ((ordered[(len(few) - 1) // 2] + ordered[len(few) // 2]) / 2).astype(np.float64)
    shape = len(places[0]), len(places[1])
    template = ((mean + mean[::-1]) / 2).reshape(shape)
    slopes = [part.ravel() for part in np.gradient(template, step)]
    flat = template.ravel()
    columns = [flat, *slopes]
    for slope, distance in zip(slopes, (y, x), strict=True):
        moving, other = slope * window, flat * distance * window
        if abs(moving @ other) < _ALIKE * np.sqrt((moving @ moving) * (other @ other)):
            columns.append(flat * distance)
    basis = np.stack(columns, axis=-1) * window[:, np.newaxis]
    solve = np.linalg.pinv(basis)[:3] * window
    offsets = np.empty((len(positions), 2))
    block = max(1, _BLOCK_PIXELS // len(flat))
    for start in range(0, len(positions), block):
        part = slice(start, start + block)
        level, *moves = solve @ patches(positions[part]).T.astype(np.float64)
        level = np.where(np.abs(level) > 1e-3, level, 1e-3)
        offsets[part] = -np.stack(moves, axis=-1) / level[:, np.newaxis]
    largest = np.array(pitch) / 4
    return np.clip(offsets, -largest, largest)
