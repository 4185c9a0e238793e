# SPDX-License-Identifier: Apache-2.0
"""Optics below the ray model: glass, micro lenses, lens prescriptions, paraxial and real rays.

Lengths in mm, wavelengths in nm, angles as slopes. `load_prescription` reads a lens,
`Prescription.at` makes it a `LensSystem` at one wavelength, and the functions of `paraxial` and
`tracing` work on that.
"""

from plenofir.camera.optics.chief_rays import (
    ChiefRays,
    MicroImageCentres,
    chief_rays,
    micro_image_centres,
)
from plenofir.camera.optics.dispersion import (
    C_LINE_NM,
    D_LINE_NM,
    F_LINE_NM,
    MICRO_LENS_CAUCHY,
    MICRO_LENS_SCHOTT,
    MICRO_LENS_SELLMEIER,
    Cauchy,
    Constant,
    Dispersion,
    FloatArray,
    Schott,
    Sellmeier,
    naive_sellmeier_index,
)
from plenofir.camera.optics.glass import (
    AIR,
    Glass,
    glass_catalogue,
    glass_from_abbe,
    read_glass_table,
)
from plenofir.camera.optics.micro_lens import ThickLens, plano_convex
from plenofir.camera.optics.paraxial import (
    CardinalPoints,
    Pupil,
    cardinal_points,
    entrance_pupil,
    exit_pupil,
    is_afocal,
    paraxial_properties,
    transfer_matrix,
)
from plenofir.camera.optics.prescription import (
    LensSystem,
    Prescription,
    Surface,
    load_prescription,
    read_prescription,
    shipped_lenses,
)
from plenofir.camera.optics.tracing import (
    Meetings,
    Rays,
    RayState,
    RefocusedPlanes,
    Trace,
    intersect,
    meridional_rays,
    refocused_planes,
    trace,
    trace_to_object,
)

__all__ = [
    "AIR",
    "C_LINE_NM",
    "D_LINE_NM",
    "F_LINE_NM",
    "MICRO_LENS_CAUCHY",
    "MICRO_LENS_SCHOTT",
    "MICRO_LENS_SELLMEIER",
    "CardinalPoints",
    "Cauchy",
    "ChiefRays",
    "Constant",
    "Dispersion",
    "FloatArray",
    "Glass",
    "LensSystem",
    "Meetings",
    "MicroImageCentres",
    "Prescription",
    "Pupil",
    "RayState",
    "Rays",
    "RefocusedPlanes",
    "Schott",
    "Sellmeier",
    "Surface",
    "ThickLens",
    "Trace",
    "cardinal_points",
    "chief_rays",
    "entrance_pupil",
    "exit_pupil",
    "glass_catalogue",
    "glass_from_abbe",
    "intersect",
    "is_afocal",
    "load_prescription",
    "meridional_rays",
    "micro_image_centres",
    "naive_sellmeier_index",
    "paraxial_properties",
    "plano_convex",
    "read_glass_table",
    "read_prescription",
    "refocused_planes",
    "shipped_lenses",
    "trace",
    "trace_to_object",
    "transfer_matrix",
]
