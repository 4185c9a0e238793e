# SPDX-License-Identifier: Apache-2.0
"""Refocusing in the frequency domain (Eq. 2.17), the method to compare shift and integration with.

The spectrum of the refocused picture is a slice of the light field's 4-D spectrum: frequency k of
the micro lenses (cycles a lens) together with frequency a k of the pixels (cycles a pixel). Slices
lie between the samples of a discrete spectrum; a Kaiser-Bessel window interpolates, and its own
shape is divided out beforehand.
"""

from fractions import Fraction

import numpy as np
import numpy.typing as npt
from scipy import fft
from scipy.special import i0

from plenofir.camera.lightfield.indexing import light_field
from plenofir.camera.rays.model import RayModel
from plenofir.ground.errors import InputError
from plenofir.refocus import check_raw
from plenofir.refocus.operator import Image
from plenofir.refocus.shifts import parse_focus

Floats = npt.NDArray[np.float64]
FocusSetting = float | str | Fraction


def kaiser_bessel(x: Floats, width: float, beta: float) -> Floats:
    """Kaiser-Bessel window."""
    inside = np.abs(x) <= width / 2
    root = np.sqrt(np.maximum(0.0, 1 - (2 * x / width) ** 2))
    return np.asarray(np.where(inside, i0(beta * root) / width, 0.0))


def kaiser_bessel_transform(n: Floats, width: float, beta: float) -> Floats:
    """Fourier transform of the window."""
    root = np.sqrt((beta**2 - (np.pi * width * n) ** 2).astype(np.complex128))
    return np.asarray((np.sinh(root) / root).real)


def _slicing(
    frequencies: Floats, m: int, a: float, width: float, oversampling: float
) -> npt.NDArray[np.complex128]:
    """Weights that take the slice along one dimension, shape (frequencies, samples)."""
    # The window must fit into a period.
    samples = max(round(oversampling * m), int(np.ceil(width)) + 1)
    # Beatty's choice of the window's shape for this oversampling.
    ratio = samples / m
    spread = (width / ratio) ** 2 * (ratio - 0.5) ** 2 - 0.8
    beta = np.pi * np.sqrt(max(spread, 0.1))
    place = a * frequencies * samples
    distance = place[:, np.newaxis] - np.arange(samples)
    periods = np.round(distance / samples)
    weights = kaiser_bessel(distance - samples * periods, width, beta)
    if m % 2 == 0:
        # Pixels are half-integers from the centre: their spectrum changes sign each period.
        weights *= (-1.0) ** periods
    # Divide by the window's transform at the pixels, which are counted from the centre.
    offset = np.arange(m) - (m - 1) / 2
    undone = 1 / kaiser_bessel_transform(offset / samples, width, beta)
    turns = np.exp(-2j * np.pi * np.outer(np.arange(samples), offset) / samples)
    return np.asarray(weights @ (turns * undone))


def fourier_slice(
    raw: Image,
    micro_image_size: int,
    a: FocusSetting,
    *,
    width: float = 3.5,
    oversampling: float = 2.0,
) -> Floats:
    """Refocus by slicing the 4-D spectrum (Eq. 2.17).

    `a`: focus setting, any number, or text such as "3/9". `width`: width of the Kaiser-Bessel
    window in samples; the thesis takes 3.5. `oversampling`: samples of the spectrum for each of the
    pixels of a micro image, 1 or more. Result: mean of the shifted views, a sample for each micro
    lens, shape (t, s[, 3]). Raises `InputError` if the oversampling is below 1.
    """
    if not oversampling >= 1:
        raise InputError(f"oversampling of {oversampling} is too small; use 1 or more")
    return _in_frequency(raw, micro_image_size, _number(a), (width, oversampling))


def shifted_views(
    raw: Image, micro_image_size: int, a: FocusSetting, weights: Floats | None = None
) -> Floats:
    """Refocus by shifting each view by a (u - c) micro lenses (Eq. 3.50), band-limited.

    `a`: focus setting, any number, or text such as "3/9". `weights`: of the views (v, u), shape
    (M, M), such as those of `aperture_weights` (Eq. 2.9); all alike if None. Result: the views'
    weighted mean, shape (t, s[, 3]); without weights what `fourier_slice` approximates. Raises
    `InputError` if the weights have another shape, one is negative, or all are zero.
    """
    return _in_frequency(raw, micro_image_size, _number(a), None, weights)


def aperture_weights(model: RayModel, diameter_mm: float | None = None) -> Floats:
    """Weights of the views in the integral of a conventional camera (Eq. 2.9): A cos^4.

    `diameter_mm`: of a round aperture, seen from the object; the camera's entrance pupil if None,
    and all views where that is not known. Result: shape (M, M), (v, u): cos^4 of the angle at which
    a view's rays meet the sensor, 0 for views that lie outside the aperture. Raises `InputError` if
    no view lies inside.
    """
    offset = np.arange(model.micro_image_size) - (model.micro_image_size - 1) / 2
    off_axis = offset[:, np.newaxis] ** 2 + offset**2
    diameter = model.camera.main_lens.entrance_pupil_diameter_mm
    diameter = diameter if diameter_mm is None else diameter_mm
    inside = np.ones_like(off_axis, dtype=bool)
    if diameter is not None:
        inside = off_axis * float(model.baseline(1)) ** 2 <= (diameter / 2) ** 2
    if not inside.any():
        raise InputError(f"no view lies in an aperture of {diameter:g} mm; use a wider one")
    cosine_squared = 1 / (1 + off_axis * model.pixel_slope**2)
    return np.where(inside, cosine_squared**2, 0.0)


def _number(a: FocusSetting) -> float:
    """A focus setting as a number."""
    return float(parse_focus(a)) if isinstance(a, str) else float(a)


def _in_frequency(
    raw: Image,
    m: int,
    a: float,
    window: tuple[float, float] | None,
    weights: Floats | None = None,
) -> Floats:
    check_raw(raw, m)
    shares = np.ones((m, m)) if weights is None else np.asarray(weights, dtype=np.float64)
    if shares.shape != (m, m) or not (shares >= 0).all() or not 0 < shares.sum() < np.inf:
        raise InputError(f"the weights must be {m} x {m} numbers, none negative, not all zero")
    if not np.isfinite(a):
        raise InputError(f"a = {a} is not a finite number")
    field = light_field(raw, m).astype(np.float64)
    if field.ndim == 4:
        field = field[..., np.newaxis]
    if weights is not None:
        field *= (shares * (m**2 / shares.sum()))[..., np.newaxis]
    t, s = field.shape[:2]
    # Outside the image the light field is zero.
    margin = int(np.ceil(abs(a) * (m - 1) / 2)) + 1
    shape = [fft.next_fast_len(n + 2 * margin) for n in (t, s)]
    rows, columns = (fft.fftfreq(n) for n in shape)
    result = np.empty((t, s, field.shape[4]))
    for channel in range(field.shape[4]):
        spectrum = fft.fft2(field[..., channel], s=shape, axes=(0, 1), workers=-1)
        if window is None:
            offset = np.arange(m) - (m - 1) / 2
            down = np.exp(-2j * np.pi * a * np.outer(rows, offset))
            right = np.exp(-2j * np.pi * a * np.outer(columns, offset))
        else:
            down = _slicing(rows, m, a, *window)
            right = _slicing(columns, m, a, *window)
        slice_spectrum = np.einsum("tv,tsvu,su->ts", down, spectrum, right, optimize=True)
        result[:, :, channel] = fft.ifft2(slice_spectrum).real[:t, :s] / m**2
    return result[:, :, 0] if raw.ndim == 2 else result
