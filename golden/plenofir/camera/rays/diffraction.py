"""Diffraction limits."""

import numpy as np
import numpy.typing as npt

from plenofir.camera.rays.precise import Values


def airy_radius(
    wavelength_mm: npt.ArrayLike, focal_length_mm: npt.ArrayLike, aperture_mm: npt.ArrayLike
) -> Values:
    """Radius of the central disc of an Airy pattern (Eq. 3.35), the Rayleigh limit.

    Parameters
    ----------
    wavelength_mm
        Wavelength.
    focal_length_mm
        Focal length f.
    aperture_mm
        Diameter A of the aperture.

    Returns
    -------
    Values
        1.22 f lambda / A in mm.
    """
    wavelength, f = np.asarray(wavelength_mm, float), np.asarray(focal_length_mm, float)
    return np.asarray(1.22 * f * wavelength / np.asarray(aperture_mm, float))


def abbe_limit(wavelength_mm: npt.ArrayLike, numerical_aperture: npt.ArrayLike) -> Values:
    """Smallest resolvable image point (Eq. 2.8).

    Parameters
    ----------
    wavelength_mm
        Wavelength.
    numerical_aperture
        n sin(theta_max).

    Returns
    -------
    Values
        lambda / (2 NA) in mm.
    """
    return np.asarray(
        np.asarray(wavelength_mm, float) / (2 * np.asarray(numerical_aperture, float))
    )
