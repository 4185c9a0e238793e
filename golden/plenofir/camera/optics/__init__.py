# SPDX-License-Identifier: Apache-2.0
"""Optics below the ray model: glass, lens prescriptions, paraxial rays.

Lengths in mm, wavelengths in nm, angles as slopes. `load_prescription` reads a lens,
`Prescription.at` makes it a `LensSystem` at one wavelength, and the functions of `paraxial` work on
that. Real rays through it are in `plenofir_studies.tracing`.
"""

from plenofir.camera.optics.dispersion import (
    C_LINE_NM,
    D_LINE_NM,
    F_LINE_NM,
    Cauchy,
    Constant,
    Dispersion,
    FloatArray,
    Schott,
    Sellmeier,
)
from plenofir.camera.optics.glass import (
    AIR,
    Glass,
    glass_catalogue,
    glass_from_abbe,
    read_glass_table,
)
from plenofir.camera.optics.paraxial import (
    CardinalPoints,
    Pupil,
    cardinal_points,
    entrance_pupil,
    exit_pupil,
    is_afocal,
    paraxial_properties,
)
from plenofir.camera.optics.prescription import (
    LensSystem,
    Prescription,
    Surface,
    load_prescription,
    read_prescription,
    shipped_lenses,
)

__all__ = [
    "AIR",
    "C_LINE_NM",
    "D_LINE_NM",
    "F_LINE_NM",
    "CardinalPoints",
    "Cauchy",
    "Constant",
    "Dispersion",
    "FloatArray",
    "Glass",
    "LensSystem",
    "Prescription",
    "Pupil",
    "Schott",
    "Sellmeier",
    "Surface",
    "cardinal_points",
    "entrance_pupil",
    "exit_pupil",
    "glass_catalogue",
    "glass_from_abbe",
    "is_afocal",
    "load_prescription",
    "paraxial_properties",
    "read_glass_table",
    "read_prescription",
    "shipped_lenses",
]
