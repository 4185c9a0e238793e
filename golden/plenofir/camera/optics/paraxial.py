# SPDX-License-Identifier: Apache-2.0
"""Paraxial optics of a lens in air: ray transfer matrices, cardinal points, pupils.

Lengths in mm. A ray is (height, reduced angle n * slope). A position is positive towards the image,
counted from the first vertex V_1U on the object side and from the last vertex V_2U on the image
side.
"""

from dataclasses import asdict, dataclass, fields
from math import inf, isfinite

import numpy as np

from plenofir.camera.optics.dispersion import FloatArray
from plenofir.camera.optics.prescription import LensSystem, Prescription
from plenofir.ground.errors import InputError


@dataclass(frozen=True)
class CardinalPoints:
    """Focal points and principal planes of a lens in air."""

    focal_length_mm: float  # f_U, negative for a diverging lens
    front_focal_point_mm: float  # from the first vertex V_1U to the object-side focal point
    back_focal_distance_mm: float  # from the last vertex V_2U to the image-side focal point
    front_principal_plane_mm: float  # from V_1U to H_1U
    back_principal_plane_mm: float  # from V_2U to H_2U; negative inside the lens
    # From H_1U to H_2U (thesis Eq. 5.15); negative when they are crossed.
    principal_plane_separation_mm: float


@dataclass(frozen=True)
class Pupil:
    """An image of the aperture stop.

    `position_mm`: entrance pupil: from the first vertex. Exit pupil: from the last vertex.
    `magnification`: height in the pupil for each unit of height in the stop; negative if inverted.
    `semi_diameter_mm`: radius of the pupil.
    """

    position_mm: float
    magnification: float
    semi_diameter_mm: float


def _departure_from_identity(system: LensSystem) -> FloatArray:
    """Ray transfer matrix less the identity."""
    # Where a lens is thin against its focal length the diagonal of the matrix is close to 1 and
    # the principal planes follow from the difference. Multiplying (1 + E)(1 + F) = 1 + (E + F +
    # EF) keeps the difference's own digits.
    powers = np.diff(system.indices) * system.curvatures
    reduced = system.gaps / system.indices[1:-1]
    departure = np.zeros((2, 2))
    for number, power in enumerate(powers):
        if number > 0:
            step = np.array([[0.0, reduced[number - 1]], [0.0, 0.0]])
            departure = departure + step + step @ departure
        step = np.array([[0.0, 0.0], [-power, 0.0]])
        departure = departure + step + step @ departure
    return departure


def is_afocal(system: LensSystem) -> bool:
    """Whether the lens has no power, up to the rounding errors of its surfaces' powers.

    Result: True for plane plates and telescopes in infinity adjustment.
    """
    departure = _departure_from_identity(system)
    powers = np.diff(system.indices) * system.curvatures
    rounding = 16 * float(np.finfo(np.float64).eps) * float(np.sum(np.abs(powers)))
    return abs(float(departure[1, 0])) <= rounding


def cardinal_points(system: LensSystem) -> CardinalPoints:
    """Focal length, focal points and principal planes.

    `system`: the lens at a wavelength, in air (equal media in front and behind). Result: lengths in
    mm. Raises `InputError` if the lens is afocal.
    """
    if is_afocal(system):
        raise InputError(
            f"is afocal at {system.wavelength_nm:g} nm; use a lens with a focal length",
            where=system.name,
        )
    (da, _), (c, dd) = (tuple(map(float, row)) for row in _departure_from_identity(system))
    medium = float(system.indices[-1])
    front_principal, back_principal = medium * dd / c, -medium * da / c
    return CardinalPoints(
        focal_length_mm=-medium / c,
        front_focal_point_mm=medium * (1 + dd) / c,
        back_focal_distance_mm=-medium * (1 + da) / c,
        front_principal_plane_mm=front_principal,
        back_principal_plane_mm=back_principal,
        principal_plane_separation_mm=system.length_mm + back_principal - front_principal,
    )


def exit_pupil(system: LensSystem) -> Pupil:
    """The stop's image by the surfaces behind it: where chief rays to the sensor seem to come from.

    `system`: the lens at a wavelength; with the image plane at a distance b behind the last vertex,
    the exit pupil distance is d_A' = b - `Pupil.position_mm`. Result: position from the last vertex
    in mm; -inf, and an infinite size, where the lens is telecentric on its image side. Raises
    `InputError` if the prescription has no stop.
    """
    stop = system.stop_surface
    behind = system.section(stop, len(system.curvatures) - 1)
    departure = _departure_from_identity(behind)
    b, d = float(departure[0, 1]), 1 + float(departure[1, 1])
    # A ray from the centre of the stop leaves with height B and reduced angle D; the stop
    # is a surface too, and its own refraction has no effect at its centre.
    if _is_telecentric(d, float(departure[1, 1])):
        return Pupil(-inf, inf, inf)
    magnification = 1 / d
    return Pupil(
        position_mm=-float(system.indices[-1]) * b / d,
        magnification=magnification,
        semi_diameter_mm=abs(magnification) * float(system.semi_apertures[stop]),
    )


def entrance_pupil(system: LensSystem) -> Pupil:
    """The stop's image by the surfaces in front of it, seen from the object.

    Result: position from the first vertex in mm, positive behind it. Raises `InputError` if the
    prescription has no stop, or the entrance pupil is at infinity.
    """
    # Up to its vertex only: what the stop surface itself refracts is behind the entrance pupil.
    stop = system.stop_surface
    if stop == 0:
        return Pupil(0.0, 1.0, float(system.semi_apertures[0]))
    departure = _departure_from_identity(system.section(0, stop - 1))
    gap = float(system.gaps[stop - 1]) / float(system.indices[stop])
    a = 1 + (float(departure[0, 0]) + gap * float(departure[1, 0]))
    b = float(departure[0, 1]) + gap * (1 + float(departure[1, 1]))
    if _is_telecentric(a, a - 1):
        raise InputError(
            f"its entrance pupil is at infinity (object-side telecentric) at "
            f"{system.wavelength_nm:g} nm; use a lens with a finite one",
            where=system.name,
        )
    return Pupil(
        position_mm=float(system.indices[0]) * b / a,
        magnification=1 / a,
        semi_diameter_mm=abs(1 / a) * float(system.semi_apertures[stop]),
    )


def paraxial_properties(
    prescription: Prescription, wavelength_nm: float = 550.0
) -> dict[str, float | None]:
    """What the ray model needs to know of a main lens, by name.

    Result: lengths in mm: the fields of `CardinalPoints`; ``entrance_pupil_mm`` from V_1U and
    ``exit_pupil_mm`` from V_2U; ``exit_pupil_distance_mm`` and ``aperture_stop_distance_mm``, d_A'
    and d_A at infinity focus. None where there is no number: for an afocal lens, without a stop, or
    for a pupil at infinity. Raises `InputError` if the wavelength is not positive, or a glass has
    no index there.
    """
    system = prescription.at(wavelength_nm)
    properties: dict[str, float | None] = {field.name: None for field in fields(CardinalPoints)}
    if not is_afocal(system):
        properties |= asdict(cardinal_points(system))
    properties |= {"entrance_pupil_mm": None, "exit_pupil_mm": None}
    for name, pupil in (("entrance_pupil_mm", entrance_pupil), ("exit_pupil_mm", exit_pupil)):
        try:
            position = pupil(system).position_mm
        except InputError:
            continue
        properties[name] = position if isfinite(position) else None
    focus, exit_position = properties["back_focal_distance_mm"], properties["exit_pupil_mm"]
    properties["exit_pupil_distance_mm"] = (
        None if focus is None or exit_position is None else focus - exit_position
    )
    properties["aperture_stop_distance_mm"] = (
        None
        if focus is None or system.stop is None
        else focus + system.length_mm - float(system.vertices[system.stop])
    )
    return properties


def _is_telecentric(element: float, departure: float) -> bool:
    """Whether an element of a ray matrix is zero up to rounding, so its pupil is at infinity."""
    return abs(element) <= 16 * float(np.finfo(np.float64).eps) * max(1.0, abs(departure))
