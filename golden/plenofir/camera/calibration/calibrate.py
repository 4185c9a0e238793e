# SPDX-License-Identifier: Apache-2.0
"""From a white image to a calibration."""

import numpy as np
from scipy import ndimage
from threadpoolctl import threadpool_limits

from plenofir.camera.calibration.centroids import Image32
from plenofir.camera.calibration.fit import Fit, fit_grid
from plenofir.camera.calibration.frames import clipped_level, clipped_share, median_of, white_signal
from plenofir.camera.calibration.grid import Floats, Grid, Layout
from plenofir.camera.calibration.record import PROFILE_REACH, Calibration
from plenofir.camera.calibration.shading import lens_indices, shading_at, within
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

# Odd, so that one sample lies in the middle, where the profile is 1; the median of so many lenses
# has a twentieth of the noise of one.
_PROFILE_SAMPLES, _PROFILE_LENSES = 31, 600
# Brightness beside the smooth light from which a lens is told as uneven; with noise so many robust
# standard deviations, which one even lens in 16,000 exceeds by chance.
_UNEVEN, _UNUSUAL = 0.02, 4.0


def calibrate(
    white: Image,
    dark: Image | None = None,
    *,
    layout: Layout | None = None,
    order: int | None = None,
    full_scale: int | None = None,
    where: str = "white image",
    dark_where: str = "dark frame",
) -> Calibration:
    """Calibrate a camera from its white image.

    Result: the calibration; `Calibration.evidence` tells what speaks for it. Raises `InputError` if
    the white image is too dark, too bright, of another size than the dark frame, or too little
    speaks for a grid of micro images.

    Parameters
    ----------
    white
        White image: an evenly lit, diffuse surface; grey or RGB, uint8 or uint16.
    dark
        Frame of the same size taken without light, or None.
    layout
        Arrangement of the micro lenses, None to find out.
    order
        Order of the grid's polynomial: 1 without distortion, 2 with tilt, 3 with distortion. None
        for what the lenses bear out.
    full_scale
        Grey level at which the white image's pixels clip, as the image's file has it. None if it is
        not known: 255, 65535, or that of 10, 12 or 14 bits if no pixel is brighter.
    """
    signal = white_signal(white, dark, where=where, dark_where=dark_where, full_scale=full_scale)
    try:
        clipped = clipped_level(white, signal, full_scale)
        # No matrix here is large enough for a second thread to help, and threads that wait spin.
        with threadpool_limits(limits=1, user_api="blas"):
            fit = fit_grid(signal, layout=layout, order=order, clipped=clipped)
    except InputError as error:
        raise InputError(error.problem, where=where) from None
    t, s = np.indices(fit.shape)
    centres = fit.grid.centres(t, s)
    shape = white.shape[0], white.shape[1]
    smooth = shading_at(fit.shading, centres, shape)
    top = float(smooth[fit.present].max())
    shading = fit.shading.copy()
    shading[0] -= np.log(top)
    share = fit.brightness / smooth
    inside = ~np.isnan(fit.brightness)
    difference = np.where(fit.present, np.abs(share - 1), 0.0)
    usual = 1.4826 * float(np.median(difference[fit.present]))
    uneven = difference > max(_UNEVEN, _UNUSUAL * usual)
    dark_level = 0.0 if dark is None else median_of(dark)
    return Calibration(
        image_shape=shape,
        lenses=fit.shape,
        grid=fit.grid,
        missing=tuple((int(y), int(x)) for y, x in np.argwhere(inside & ~fit.present)),
        uneven=tuple(
            (int(y), int(x), round(float(share[y, x]), 4)) for y, x in np.argwhere(uneven)
        ),
        dark_level=dark_level,
        shading=tuple(float(c) for c in shading),
        profile=tuple(tuple(line) for line in _profile(signal, fit, smooth).round(4).tolist()),
        residual_px=fit.residual_px,
        used=fit.used,
        clipped_share=clipped_share(white, full_scale),
        evidence=fit.evidence,
    )


def calibration_of_grid(grid: Grid, image_shape: tuple[int, int]) -> Calibration:
    """Calibration of a camera whose grid is known from elsewhere, without a white image.

    `grid`: the grid, whichever lens it counts from. `image_shape`: rows and columns of the raw
    image. Result: all lenses whose centres lie in the image; no vignetting. Raises `InputError` if
    none does.
    """
    t, s = lens_indices(grid, image_shape)
    inside = within(grid.centres(t, s), image_shape)
    if not inside.any():
        raise InputError("the image holds no micro lens of the grid")
    rows, columns = np.nonzero(inside.any(axis=1))[0], np.nonzero(inside.any(axis=0))[0]
    return Calibration(
        image_shape=image_shape,
        lenses=(int(rows[-1] - rows[0] + 1), int(columns[-1] - columns[0] + 1)),
        grid=grid.moved(int(t[rows[0], 0]), int(s[0, columns[0]])),
        shading=(0.0,),
        profile=((1.0, 1.0), (1.0, 1.0)),
        residual_px=0.0,
        used=int(inside.sum()),
    )


def _profile(signal: Image32, fit: Fit, smooth: Floats) -> Floats:
    """Typical brightness across a micro image, 1 in its middle."""
    pitch = max(fit.grid.pitch)
    shape = np.array(signal.shape)
    t, s = np.nonzero(fit.present)
    centres = fit.grid.centres(t, s)
    margin = PROFILE_REACH * 1.5 * pitch
    whole = ((centres > margin) & (centres < shape - 1 - margin)).all(axis=1)
    t, s, centres = t[whole], s[whole], centres[whole]
    few = slice(None, None, max(1, len(t) // _PROFILE_LENSES))
    t, s, centres = t[few], s[few], centres[few]
    steps = np.linspace(-PROFILE_REACH, PROFILE_REACH, _PROFILE_SAMPLES) * pitch
    down, right = unit_vectors(fit.grid.vectors)
    offsets = steps[:, np.newaxis, np.newaxis] * down + steps[:, np.newaxis] * right
    places = centres[:, np.newaxis, np.newaxis] + offsets
    values = ndimage.map_coordinates(signal, np.moveaxis(places, -1, 0), order=1, mode="nearest")
    level = smooth[t, s][:, np.newaxis, np.newaxis]
    profile = np.median(values / level, axis=0)
    return np.asarray(profile / profile.max())


def unit_vectors(vectors: Floats) -> tuple[Floats, Floats]:
    """Directions of a row step and a column step."""
    unit = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit[..., 0, :], unit[..., 1, :]
