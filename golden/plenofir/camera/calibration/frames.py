# SPDX-License-Identifier: Apache-2.0
"""White, dark and raw frames: grey levels, dark level, and what makes a white image usable."""

import numpy as np
from scipy import ndimage

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.grid import Flags, Floats
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

_LUMINANCE = np.array([0.2125, 0.7154, 0.0721], dtype=np.float32)
_BAND = 256  # lines
# Rounding to whole levels is an error of up to 3 % of so many.
_DARKEST_LEVELS = 16
_CLIPPED_SHARE = 0.75
# From this share of clipped pixels on, micro images are flattened; percentile of their signal.
_MANY_CLIPPED, _LOWEST_CLIPPED = 0.002, 5
_SMALLEST = 12
# Weights in which a mosaic cancels; contrasts of its kinds of pixels differ by at least this share.
_AROUND_PIXEL, _LEAST_MOSAIC = (0.25, 0.5, 0.25), 0.05
# Kinds of pixels below this share of the usual contrast see none of the light, or are clipped.
_LEAST_CONTRAST = 0.05
# Cameras store 10, 12 and 14 bits in words of 16.
_FULL_SCALES = {(1 << bits) - 1 for bits in (10, 12, 14)}


def grey(image: Image | Floats) -> Image32:
    """Grey levels of an image (luminance of RGB, Rec. 709)."""
    if image.ndim != 3:
        return image.astype(np.float32)
    levels = np.empty(image.shape[:2], np.float32)
    # In bands: floats of three colours would take twelve bytes for each pixel.
    for first in range(0, len(image), _BAND):
        band = slice(first, first + _BAND)
        np.matmul(image[band].astype(np.float32), _LUMINANCE, out=levels[band])
    return levels


def median_of(image: Image) -> float:
    """Median of the grey levels of an image."""
    return float(np.median(image if image.ndim < 3 else grey(image)))


def equalised(image: Image32) -> Image32:
    """The image without the pattern of a colour filter mosaic of 2 x 2 pixels, if it has one.

    The four kinds of pixels get the contrast and the level of their surroundings, in which all
    kinds have the same weight. Kinds without contrast of their own become their surroundings.
    """
    around = image
    for axis in (0, 1):
        around = ndimage.convolve1d(around, _AROUND_PIXEL, axis=axis, mode="mirror")
    kinds = [np.s_[row::2, column::2] for row in (0, 1) for column in (0, 1)]
    gains, levels = np.ones(len(kinds)), np.zeros(len(kinds))
    for n, kind in enumerate(kinds):
        middle = around[kind].mean(dtype=np.float64), image[kind].mean(dtype=np.float64)
        away, here = around[kind] - np.float32(middle[0]), image[kind] - np.float32(middle[1])
        gains[n] = (away * here).mean(dtype=np.float64) / max(float((away**2).mean()), 1e-9)
        levels[n] = middle[1] - gains[n] * middle[0]
    usual = float(gains.mean())
    if usual <= 0 or np.abs(gains / usual - 1).max() < _LEAST_MOSAIC:
        return image
    result = np.empty_like(image)
    for kind, gain, level in zip(kinds, gains, levels, strict=True):
        if gain < _LEAST_CONTRAST * usual:
            result[kind] = around[kind] * usual + levels.mean()
        else:
            result[kind] = (image[kind] - level) * (usual / gain) + levels.mean()
    return result


def _size(image: Image) -> str:
    return f"{image.shape[1]} x {image.shape[0]} pixels"


def check_same_size(image: Image, shape: tuple[int, ...], where: str, other: str) -> None:
    """Refuse an image whose size differs from that of another."""
    if image.shape[:2] != tuple(shape[:2]):
        raise InputError(f"has {_size(image)}; {other} has {shape[1]} x {shape[0]}", where=where)


def _at_full(image: Image, full_scale: int | None) -> Flags:
    """Pixels at full scale."""
    highest = int(np.iinfo(image.dtype).max)
    if full_scale is None or full_scale == highest:
        # Pixels of 10 to 14 bits in words of 16 clip at a full scale that their file does not tell.
        largest = int(image.max())
        full_scale = largest if largest in _FULL_SCALES else highest
    at_full = image >= full_scale
    return np.asarray(at_full.any(axis=2) if image.ndim == 3 else at_full)


def clipped_share(image: Image, full_scale: int | None = None) -> float:
    """Share of pixels at full scale."""
    return float(_at_full(image, full_scale).mean())


def clipped_level(white: Image, signal: Image32, full_scale: int | None = None) -> float | None:
    """Signal of a white image's pixels at full scale; None if there are few of them."""
    at_full = _at_full(white, full_scale)
    if at_full.mean() < _MANY_CLIPPED:
        return None
    return float(np.percentile(signal[at_full], _LOWEST_CLIPPED))


def white_signal(
    white: Image,
    dark: Image | None,
    *,
    where: str,
    dark_where: str,
    full_scale: int | None = None,
) -> Image32:
    """Grey levels of a white image above its dark frame."""
    if min(white.shape[:2]) < _SMALLEST:
        raise InputError(
            f"has {_size(white)}, too few; a white image needs at least {_SMALLEST} x {_SMALLEST}",
            where=where,
        )
    signal = grey(white)
    if dark is not None:
        check_same_size(dark, white.shape, dark_where, f"the white image {where}")
        signal = signal - grey(dark)
    brightest = float(np.percentile(signal, 99.5))
    if brightest < _DARKEST_LEVELS:
        above = "above the dark frame" if dark is not None else "of the brightest parts"
        raise InputError(
            f"is too dark: {max(brightest, 0):.1f} grey levels {above}, "
            f"{_DARKEST_LEVELS} are needed; expose longer or use more light",
            where=where,
        )
    clipped = clipped_share(white, full_scale)
    if clipped > _CLIPPED_SHARE:
        raise InputError(
            f"is too bright: {100 * clipped:.0f} % of the pixels are at full scale "
            f"({int(white.max())}), {100 * _CLIPPED_SHARE:.0f} % may be; expose shorter "
            "or use less light",
            where=where,
        )
    return signal
