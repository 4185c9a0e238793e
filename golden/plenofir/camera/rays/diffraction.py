# SPDX-License-Identifier: Apache-2.0
"""Diffraction limits."""

import numpy as np
import numpy.typing as npt

from plenofir.camera.rays.camera import Camera
from plenofir.camera.rays.precise import Values

WAVELENGTH_MM = 550e-6
"""Green light."""


def airy_radius(
    wavelength_mm: npt.ArrayLike, focal_length_mm: npt.ArrayLike, aperture_mm: npt.ArrayLike
) -> Values:
    """Radius of the central disc of an Airy pattern (Eq. 3.35), the Rayleigh limit.

    `aperture_mm`: diameter A of the aperture; like the others of any shape. Result: 1.22 f lambda /
    A in mm, arguments broadcast together.
    """
    wavelength, f = np.asarray(wavelength_mm, float), np.asarray(focal_length_mm, float)
    return np.asarray(1.22 * f * wavelength / np.asarray(aperture_mm, float))


def abbe_limit(wavelength_mm: npt.ArrayLike, numerical_aperture: npt.ArrayLike) -> Values:
    """Smallest resolvable image point (Eq. 2.8).

    `numerical_aperture`: n sin(theta_max); like `wavelength_mm` of any shape. Result: lambda /
    (2 NA) in mm, arguments broadcast together.
    """
    return np.asarray(
        np.asarray(wavelength_mm, float) / (2 * np.asarray(numerical_aperture, float))
    )


def rayleigh_limit(camera: Camera, wavelength_mm: float = WAVELENGTH_MM) -> float:
    """Rayleigh limit of a camera's micro lenses on its sensor (Eq. 3.35, section 3.3.2).

    Result: Airy radius of a micro lens in mm with its whole pitch open, on a sensor at b_s. If
    pixels are smaller, diffraction and not the pixel limits the depth of field.
    """
    array = camera.micro_lenses
    return float(airy_radius(wavelength_mm, array.spacing_mm, array.pitch_mm))


def diffraction_note(camera: Camera) -> str:
    """Say if pixels are smaller than the Rayleigh limit.

    Result: a line, empty where they are not.
    """
    pixel, limit = camera.sensor.pixel_pitch_mm, rayleigh_limit(camera)
    if pixel >= limit:
        return ""
    return (
        f"pixels of {1000 * pixel:.3g} um are smaller than the Rayleigh limit of the micro lenses "
        f"({1000 * limit:.3g} um at {1e6 * WAVELENGTH_MM:g} nm): diffraction widens the depths of "
        "field"
    )
