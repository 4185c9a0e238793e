# SPDX-License-Identifier: Apache-2.0
"""Lens prescriptions: surfaces, glasses and the aperture stop, read from CSV files.

Lengths in mm, wavelengths in nm. Surfaces are counted from the object side; a radius is positive
when its centre lies behind the surface, seen from the object. Curvature (1 / radius) is what is
stored, so a plane is curvature 0.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from plenofir.camera.optics.dispersion import D_LINE_NM, Constant, FloatArray
from plenofir.camera.optics.glass import AIR, LENS_DATA, Glass, glass_catalogue, glass_from_abbe
from plenofir.camera.optics.tables import parse_number, read_text
from plenofir.ground.errors import InputError

_INDEX_TOLERANCE = 2e-3

# Column name in a file: field here.
_COLUMNS = {
    "radius": "radius",
    "thickness": "thickness",
    "material": "material",
    "index": "index",
    "v-no": "Abbe number",
    "sa": "semi aperture",
    "semi_aperture": "semi aperture",
    "surface": "surface",
}
_REQUIRED = ("radius", "thickness", "material", "semi aperture")


class Surface(BaseModel):
    """One surface and the medium behind it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    curvature_per_mm: FiniteFloat  # 1 / radius in 1/mm, 0 for a plane
    # Distance to the next surface in mm; of the last surface, to the image plane.
    thickness_mm: Annotated[FiniteFloat, Field(ge=0)]
    glass: Glass  # medium behind the surface
    semi_aperture_mm: Annotated[FiniteFloat, Field(gt=0)]  # half of the clear diameter in mm
    stop: bool = False  # whether the surface is the aperture stop


@dataclass(frozen=True, eq=False)
class LensSystem:
    """A lens at one wavelength, as numbers: what the paraxial and the real ray tracing work on."""

    name: str
    wavelength_nm: float
    curvatures: FloatArray  # shape (surfaces,), 1/mm
    gaps: FloatArray  # distances between neighbouring surfaces in mm, shape (surfaces - 1,)
    # Refractive indices, shape (surfaces + 1,): before the first surface, between them, behind the
    # last.
    indices: FloatArray
    semi_apertures: FloatArray  # shape (surfaces,), mm
    stop: int | None  # number of the surface (from 0) that is the aperture stop, or None
    # From the last vertex to the image plane that the prescription states, mm.
    image_distance_mm: float

    @property
    def vertices(self) -> FloatArray:
        """Vertices on the axis in mm from the first one, shape (surfaces,)."""
        return np.concatenate(([0.0], np.cumsum(self.gaps)))

    @property
    def length_mm(self) -> float:
        """From the first to the last vertex in mm."""
        return math.fsum(self.gaps)

    @property
    def stop_surface(self) -> int:
        """Number of the stop surface, from 0.

        Raises `InputError` if the prescription has no stop.
        """
        if self.stop is None:
            raise InputError(
                "the prescription has no aperture stop; add a plane with air on both sides",
                where=self.name,
            )
        return self.stop

    def reversed(self) -> "LensSystem":
        """The lens seen from the sensor: surface order and signs of curvature turned round.

        Result: with its first vertex at what was the last. It has no stated image distance (0).
        """
        return LensSystem(
            name=self.name,
            wavelength_nm=self.wavelength_nm,
            curvatures=-self.curvatures[::-1],
            gaps=self.gaps[::-1],
            indices=self.indices[::-1],
            semi_apertures=self.semi_apertures[::-1],
            stop=None if self.stop is None else len(self.curvatures) - 1 - self.stop,
            # The image plane lies on the other side of a reversed lens.
            image_distance_mm=0.0,
        )

    def section(self, first: int, last: int) -> "LensSystem":
        """A run of surfaces.

        `first`, `last`: numbers of the first and the last surface, from 0, both included.
        """
        count = len(self.curvatures)
        if not 0 <= first <= last < count:
            raise ValueError(f"section {first}..{last} of {count} surfaces")
        # A part without the stop has none; the image distance is that behind the last surface.
        inside = self.stop is not None and first <= self.stop <= last
        return LensSystem(
            name=self.name,
            wavelength_nm=self.wavelength_nm,
            curvatures=self.curvatures[first : last + 1],
            gaps=self.gaps[first:last],
            indices=self.indices[first : last + 2],
            semi_apertures=self.semi_apertures[first : last + 1],
            stop=self.stop - first if self.stop is not None and inside else None,
            image_distance_mm=self.image_distance_mm if last == count - 1 else 0.0,
        )


class Prescription(BaseModel):
    """A lens in air, surface by surface.

    `surfaces`: from the object side; one at most is the stop, and behind the last one is air.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    surfaces: Annotated[tuple[Surface, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _checked(self) -> Self:
        if sum(surface.stop for surface in self.surfaces) > 1:
            raise ValueError("there must be one stop at most")
        if self.surfaces[-1].glass.name != AIR.name:
            raise ValueError("behind the last surface must be air")
        return self

    def at(self, wavelength_nm: float) -> LensSystem:
        """The lens as numbers at a wavelength.

        Raises `InputError` if the wavelength is not positive, or a glass has no index there.
        """
        # The last thickness is no gap between surfaces: it leads to the image plane.
        stops = [number for number, surface in enumerate(self.surfaces) if surface.stop]
        glasses = [AIR, *(surface.glass for surface in self.surfaces)]
        return LensSystem(
            name=self.name,
            wavelength_nm=wavelength_nm,
            curvatures=np.array([surface.curvature_per_mm for surface in self.surfaces]),
            gaps=np.array([surface.thickness_mm for surface in self.surfaces[:-1]]),
            indices=np.array([float(glass.index(wavelength_nm)) for glass in glasses]),
            semi_apertures=np.array([surface.semi_aperture_mm for surface in self.surfaces]),
            stop=stops[0] if stops else None,
            image_distance_mm=self.surfaces[-1].thickness_mm,
        )

    def scaled(self, factor: float) -> "Prescription":
        """The lens with every length multiplied.

        Raises `InputError` if the factor is not positive.
        """
        if not 0 < factor < math.inf:
            raise InputError(f"a lens cannot be scaled by {factor:g}; use a positive number")
        return Prescription(
            name=self.name,
            surfaces=tuple(
                Surface(
                    curvature_per_mm=surface.curvature_per_mm / factor,
                    thickness_mm=surface.thickness_mm * factor,
                    glass=surface.glass,
                    semi_aperture_mm=surface.semi_aperture_mm * factor,
                    stop=surface.stop,
                )
                for surface in self.surfaces
            ),
        )


def read_prescription(path: Path) -> Prescription:
    """Read a lens prescription from a CSV file.

    The first line names the columns, separated by commas or semicolons: ``radius`` (mm; empty or 0
    for a plane), ``thickness`` (mm, to the next surface; in the last row to the image plane),
    ``material`` (behind the surface; ``air`` or a glass), ``sa`` or ``semi_aperture`` (mm) and, for
    glasses that the shipped tables lack, ``index`` (n_d) and ``v-no`` (v_d). Lines that start with
    ``#`` are skipped. A plane with air on both sides is the aperture stop.

    A glass is taken from the tables when it is there and the row's index, if any, agrees to 2e-3;
    otherwise the row's own index and Abbe number hold (see `glass_from_abbe`), or the index alone,
    without dispersion, where the Abbe number is left out.

    Result: named after the file, without its ending. Raises `InputError` naming file, line and
    field, and what is allowed.
    """
    lines = [
        (number, line)
        for number, line in enumerate(read_text(path).splitlines(), start=1)
        if line.strip() and not line.startswith("#")
    ]
    if not lines:
        raise InputError("has no header; the first line names the columns", where=str(path))
    (header_number, header), *body = lines
    # Spreadsheets write semicolons where the decimal mark is a comma.
    separator = ";" if ";" in header else ","
    columns = _columns(header.split(separator), where=f"{path}: line {header_number}")
    if not body:
        raise InputError("has no surfaces; each has a row", where=str(path))
    surfaces: list[Surface] = []
    for number, line in body:
        where = f"{path}: line {number}"
        fields = line.split(separator)
        if len(fields) != len(columns):
            raise InputError(
                f"has {len(fields)} fields; the header has {len(columns)}", where=where
            )
        row = {column: field.strip() for column, field in zip(columns, fields, strict=True)}
        before = surfaces[-1].glass if surfaces else AIR
        surfaces.append(_surface(row, before, where=where))
    stops = [number for number, surface in zip(body, surfaces, strict=True) if surface.stop]
    if len(stops) > 1:
        raise InputError(
            "is a second aperture stop; only one plane may have air on both sides",
            where=f"{path}: line {stops[1][0]}, material",
        )
    if surfaces[-1].glass != AIR:
        raise InputError(
            f"{surfaces[-1].glass.name!r} lies behind the last surface; it must be air",
            where=f"{path}: line {body[-1][0]}, material",
        )
    return Prescription(name=path.stem, surfaces=tuple(surfaces))


def _columns(names: list[str], *, where: str) -> list[str]:
    allowed = ", ".join(_COLUMNS)
    columns = []
    for name in (name.strip().lower() for name in names):
        if name not in _COLUMNS:
            raise InputError(f"there is no column {name!r}; use {allowed}", where=where)
        columns.append(_COLUMNS[name])
    if len(set(columns)) != len(columns):
        raise InputError(f"a column appears twice; use each of {allowed} once", where=where)
    missing = [field for field in _REQUIRED if field not in columns]
    if missing:
        raise InputError(
            f"has no column for {', '.join(missing)}; radius, thickness, material and sa "
            "are needed",
            where=where,
        )
    return columns


def _surface(row: dict[str, str], before: Glass, *, where: str) -> Surface:
    radius = parse_number(row["radius"], where=f"{where}, radius") if row["radius"] else 0.0
    glass = _glass(row, where=where)
    plane_in_air = radius == 0 and before == AIR and glass == AIR
    if row["material"].lower() == "air_stop" and not plane_in_air:
        raise InputError(
            "a stop cannot refract; make it a plane with air on both sides",
            where=f"{where}, material",
        )
    curvature = 0.0 if radius == 0 else 1 / radius
    if not math.isfinite(curvature):
        raise InputError(
            f"{row['radius']!r} is too small for a radius in mm", where=f"{where}, radius"
        )
    return Surface(
        curvature_per_mm=curvature,
        thickness_mm=parse_number(row["thickness"], where=f"{where}, thickness", least=0),
        glass=glass,
        semi_aperture_mm=parse_number(
            row["semi aperture"], where=f"{where}, semi aperture", least=0, exclusive=True
        ),
        stop=plane_in_air,
    )


def _glass(row: dict[str, str], *, where: str) -> Glass:
    name = row["material"]
    if name.lower() in ("air", "air_stop"):
        return AIR
    if not name:
        raise InputError("is missing; name air or a glass", where=f"{where}, material")
    index_text, abbe_text = row.get("index", ""), row.get("Abbe number", "")
    tabled = glass_catalogue().get(name)
    if not index_text:
        if tabled is None:
            raise InputError(
                f"the glass {name!r} is not known; give index and v-no, or use one of "
                f"{', '.join(sorted(glass_catalogue()))}",
                where=f"{where}, material",
            )
        return tabled
    index = parse_number(index_text, where=f"{where}, index", least=1, exclusive=True)
    if tabled is not None and abs(float(tabled.index(D_LINE_NM)) - index) <= _INDEX_TOLERANCE:
        return tabled
    if not abbe_text:
        return Glass(name=name, dispersion=Constant(value=index))
    abbe = parse_number(abbe_text, where=f"{where}, Abbe number", least=0, exclusive=True)
    return glass_from_abbe(name, index, abbe)


def shipped_lenses() -> list[str]:
    """Names of the prescriptions that the package ships.

    Result: in alphabetical order.
    """
    return sorted(
        path.stem for path in LENS_DATA.glob("*.csv") if not path.stem.startswith("glasses_")
    )


def load_prescription(name_or_path: str | Path) -> Prescription:
    """A shipped lens by its name, or a prescription file.

    `name_or_path`: one of `shipped_lenses`, or the path of a CSV file. Raises `InputError` if there
    is neither such a lens nor such a file, or the file is wrong.
    """
    if str(name_or_path) in shipped_lenses():
        return read_prescription(LENS_DATA / f"{name_or_path}.csv")
    path = Path(name_or_path)
    if not path.is_file():
        raise InputError(
            f"no such lens; give a prescription file, or one of {', '.join(shipped_lenses())}",
            where=str(name_or_path),
        )
    return read_prescription(path)
