# SPDX-License-Identifier: Apache-2.0
"""Sharpening with taps a lens apart: the best weight, its gain, and where it harms.

Theory and measurement are independent: `best_weight` uses the operator's transfer function and a
spectrum, `measure` compares a refocused textured plane with the object.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import ceil, gcd, log10

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from plenofir.refocus import derived_moment, refocus, refocus_sums
from plenofir.refocus.operator import Image
from plenofir.refocus.sharpening import WEIGHT_UNITS, automatic_units, sharpened_sums, taps

Floats = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]

WEIGHTS = (Fraction(0), Fraction(1, 24), Fraction(1, 16), Fraction(1, 12), Fraction(1, 8))
"""Weights that are compared; those that are no 64ths are computed in floating point."""

_GRID = 60
_RANGE = np.arange(0, 2 * WEIGHT_UNITS // 4 + 1) / (2 * WEIGHT_UNITS)
_LENSES = 48
_WHITE = 255


def transfer(m: int, shift: int, order: int, frequencies: Floats) -> npt.NDArray[np.complex128]:
    """Transfer function of the operator along a dimension, in cycles a lens: shape (M, n).

    For each position of an output pixel in its lens: the amplitude relative to that of a wave at
    the same position.
    """
    common = gcd(shift, m)
    wave = 2j * np.pi * frequencies / m
    # Positions of the M/g samples in output p, relative to its own.
    phases = []
    for p in range(m):
        places = np.arange(m // common) * common + p % common - (m - 1) / 2
        phases.append(np.exp(np.outer(places, wave)).mean(axis=0))
    result = np.array(phases)
    for _ in range(order):
        moves = np.arange(m) - (m - 1) // 2
        result = np.array(
            [
                np.mean([result[(p + d) % m] * np.exp(wave * d) for d in moves], axis=0)
                for p in range(m)
            ]
        )
    return result


def natural_spectrum(frequencies: Floats, band: float) -> Floats:
    """Power (n, n) of natural pictures behind square lenses: 1 / f^2, 0 above a band limit."""
    y, x = np.meshgrid(frequencies, frequencies, indexing="ij")
    squared = y**2 + x**2
    power = (np.sinc(x) * np.sinc(y)) ** 2 / squared
    return np.where(squared <= band**2, power, 0.0)


def best_weight(m: int, shift: int, order: int = 0, *, band: float = 0.5) -> tuple[float, float]:
    """The weight with the least squared error over a natural spectrum, at full resolution.

    b in steps of 1/128 up to 1/4, and what it gains in dB; `band` is the largest frequency in
    cycles a lens.
    """
    frequencies = (np.arange(_GRID) + 0.5) / _GRID * band
    power = natural_spectrum(frequencies, band)
    operator = transfer(m, shift, order, frequencies)
    wave = 1 - np.cos(2 * np.pi * frequencies)
    errors = []
    for b in _RANGE:
        whole = operator * (1 + 2 * b * wave)
        mean, square = whole.mean(axis=0), (np.abs(whole) ** 2).mean(axis=0)
        error = 1 - 2 * np.real(np.outer(mean, mean)) + np.outer(square, square)
        errors.append(float((power * error).sum()))
    least = int(np.argmin(errors))
    return float(_RANGE[least]), 10 * log10(errors[0] / errors[least])


@dataclass(frozen=True)
class Texture:
    """A textured plane, a value for each lens, interpolated by cubic splines."""

    name: str
    make: Callable[[tuple[int, int], int], Floats]


def _blurred(sigma: float) -> Callable[[tuple[int, int], int], Floats]:
    def make(shape: tuple[int, int], seed: int) -> Floats:
        noise = np.random.default_rng(seed).normal(size=shape)
        return np.asarray(ndimage.gaussian_filter(noise, sigma), dtype=np.float64)

    return make


def _natural(shape: tuple[int, int], seed: int) -> Floats:
    noise = np.fft.fft2(np.random.default_rng(seed).normal(size=shape))
    y, x = (np.fft.fftfreq(n) for n in shape)
    distance = np.hypot(y[:, np.newaxis], x)
    distance[0, 0] = np.inf
    # Amplitude 1 / f, attenuated by a lens.
    return np.real(np.fft.ifft2(noise / distance * np.sinc(y)[:, np.newaxis] * np.sinc(x)))


TEXTURES = (
    Texture("smooth", _blurred(1.3)),
    Texture("as in the precision report", _blurred(0.9)),
    Texture("fine", _blurred(0.6)),
    Texture("natural, 1/f", _natural),
)


@dataclass(frozen=True)
class Plane:
    """A rendered plane."""

    m: int
    shift: int  # the a' that is refocused to
    raw: Image  # grey
    lenses: Floats  # the object at the centre of each lens, in grey levels
    pixels: Floats  # at the centre of each pixel
    # The ideal result for each pixel: the mean of the views, moved to a'.
    blurred: Floats
    border: int  # pixels at each border that miss views


@lru_cache(maxsize=32)
def plane(
    m: int,
    shift: int,
    texture: Texture,
    *,
    away: Fraction = Fraction(0),
    noise: float = 0,
    contrast: float = 45,
    seed: int = 0,
) -> Plane:
    """Render a textured plane of 48 x 48 lenses, in focus at a = a' / M + away.

    Noise (of the raw image) and contrast (of the object) are standard deviations in grey levels.
    """
    c = (m - 1) / 2
    here = float(Fraction(shift, m) + away)
    margin = ceil((abs(here) + abs(float(away))) * c) + 5
    size = _LENSES + 2 * margin
    values = texture.make((size, size), seed)
    values = np.clip(128 + contrast * (values - values.mean()) / values.std(), 0, _WHITE)
    spline = ndimage.spline_filter(values, order=3)

    def texture_at(y: Floats, x: Floats) -> Floats:
        places = np.stack(np.meshgrid(y + margin, x + margin, indexing="ij"))
        return np.asarray(ndimage.map_coordinates(spline, places, order=3, prefilter=False))

    lens, pixel = np.arange(_LENSES, dtype=float), (np.arange(_LENSES * m) - c) / m
    raw = np.empty((_LENSES * m, _LENSES * m))
    ideal = np.zeros_like(raw)
    for v in range(m):
        for u in range(m):
            raw[v::m, u::m] = texture_at(lens + here * (v - c), lens + here * (u - c))
            if away:
                ideal += texture_at(pixel + float(away) * (v - c), pixel + float(away) * (u - c))
    raw += np.random.default_rng(seed + 1).normal(0, noise, raw.shape)
    pixels = texture_at(pixel, pixel)
    return Plane(
        m=m,
        shift=shift,
        raw=np.clip(np.rint(raw), 0, _WHITE).astype(np.uint8),
        lenses=texture_at(lens, lens),
        pixels=pixels,
        blurred=ideal / m**2 if away else pixels,
        border=(ceil(abs(shift) / m * c) + 3) * m,
    )


def refocused(field: Plane, b: Fraction, order: int = 0) -> Bytes:
    """The picture with any weight, rounded once as `plenofir.refocus.refocus` does."""
    if (b * WEIGHT_UNITS).denominator == 1:
        a = Fraction(field.shift, field.m)
        image = refocus(field.raw, field.m, a, interpolation=order, sharpen=b, threads=1)
        return np.asarray(image, dtype=np.uint8)
    sums = refocus_sums(field.raw, field.m, shift=field.shift, order=order)
    for axis in (0, 1):
        before, behind = np.roll(sums, field.m, axis), np.roll(sums, -field.m, axis)
        sums = b.denominator * sums + b.numerator * (2 * sums - before - behind)
    divisor = b.denominator**2 * field.m ** (2 + 2 * order)
    rounded = (2 * sums + divisor) // (2 * divisor)
    return np.asarray(np.clip(rounded, 0, _WHITE), dtype=np.uint8)


def decibels(got: npt.NDArray[np.generic], want: Floats) -> float:
    """PSNR of a picture against an object in grey levels."""
    return 20 * log10(_WHITE / float(np.sqrt(np.mean((got.astype(np.float64) - want) ** 2))))


@dataclass(frozen=True)
class Nearness:
    """Similarity of a picture to the object, PSNR in dB."""

    lens: float  # with a value for each lens
    pixel: float  # with each pixel
    ideal: float  # with each pixel, to the ideal refocused picture instead of the object


def measure(field: Plane, b: Fraction, order: int = 0) -> Nearness:
    """Refocus with a weight and compare."""
    m, border = field.m, field.border
    image = refocused(field, b, order)
    inside = slice(border, -border)
    # For even M the pixels on both sides of a lens's centre, each half a pixel from it.
    middles = {(m - 1) // 2, m // 2}
    at_lenses = np.mean(
        [image[v::m, u::m].astype(np.float64) for v in middles for u in middles], axis=0
    )
    lens = slice(border // m, -border // m)
    part = image[inside, inside]
    return Nearness(
        decibels(at_lenses[lens, lens], field.lenses[lens, lens]),
        decibels(part, field.pixels[inside, inside]),
        decibels(part, field.blurred[inside, inside]),
    )


def derived_noise_gain(units: int) -> float:
    """Variance after the filter of one dimension over that before: (1 + 2b)^2 + 2b^2."""
    filter_ = taps(units)
    return float(filter_.centre**2 + 2 * filter_.side**2) / filter_.scale**2


def noise_gain(m: int, shift: int, units: int, seed: int = 0) -> tuple[float, float]:
    """Noise of a sharpened picture (by 64 b) over that of a plain one, as standard deviations.

    Derived, for pixels a lens apart that share no pixel of the raw image, and measured.
    """
    raw = np.random.default_rng(seed).normal(0, 1 << 16, (60 * m, 60 * m)).astype(np.int64)
    sums = refocus_sums(raw, m, shift=shift)
    border = (abs(shift) + 4) * m
    inside = slice(border, -border)
    scale = taps(units).scale ** 2
    sharp = sharpened_sums(sums, m, units)[inside, inside] / scale
    return derived_noise_gain(units), float(sharp.std() / sums[inside, inside].std())


def weight_rows(
    cases: Sequence[tuple[int, int]], order: int
) -> list[tuple[int, int, Fraction, float, float, Fraction]]:
    """M, M/g, b of the second moment, the best b for two bands, and what `auto` takes."""
    rows = []
    for m, shift in cases:
        moment = derived_moment(m, shift, order) / 2
        narrow, wide = (best_weight(m, shift, order, band=band)[0] for band in (0.25, 0.5))
        auto = Fraction(automatic_units(m, shift, order), WEIGHT_UNITS)
        rows.append((m, m // gcd(shift, m), moment, narrow, wide, auto))
    return rows
