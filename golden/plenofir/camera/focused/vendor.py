# SPDX-License-Identifier: Apache-2.0
"""Grids of makers: Raytrix' calibration file, `RayCalibData`.

Its lengths are pixels or lens diameters, x to the right and y upwards from the middle of the
picture: `offset` of one lens, `diameter` (the distance of neighbouring lenses), `rotation`
(counter-clockwise), `lens_base_x` and `lens_base_y` (steps to two neighbours), `lens_border` (rim
that does not count), and for each `lens_type` the `offset` of one of its lenses and its
`depth_range` in virtual depth. Public readers, and one capture with its file, agree on that.
"""

from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from plenofir.camera.calibration.calibrate import calibration_of_grid
from plenofir.camera.calibration.grid import Floats, Grid
from plenofir.camera.calibration.record import PROFILE_REACH, Calibration
from plenofir.camera.calibration.types_of_lenses import LensTypes, usual_order
from plenofir.ground.errors import InputError
from plenofir.ground.files import input_file

_LARGEST = 1 << 20
_SAMPLES = 61
# Share of a lens by which bases of a hexagon, and places of types, may be off.
_OFF = 0.05


@dataclass(frozen=True)
class VendorGrid:
    """A maker's grid."""

    offset: Floats  # (y, x) of a lens from the middle of the picture in pixels, y downwards
    steps: Floats  # pixel vectors (y, x) to two neighbours, shape (2, 2)
    border: float  # rim of a micro image that does not count, in pixels
    # (y, x) of a lens of each type from the one at `offset`, in pixels, shape (types, 2).
    places: Floats
    ranges: tuple[tuple[float, float], ...]  # virtual depths of each type, from - to
    where: str  # name of the file

    def calibration(self, image_shape: tuple[int, int]) -> Calibration:
        """Calibration of captures with so many rows and columns.

        Raises `InputError` if it does not fit together.
        """
        pitch = float(np.linalg.norm(self.steps, axis=1).mean())
        grid = self._grid((np.array(image_shape) - 1) / 2 + self.offset)
        calibration = calibration_of_grid(grid, image_shape)
        types = self._types(grid, pitch)
        types = types.carried(grid, calibration.grid, np.eye(2), np.zeros(2))
        reach = np.linspace(-PROFILE_REACH, PROFILE_REACH, _SAMPLES)
        away = np.hypot(reach[:, np.newaxis], reach) * max(calibration.grid.pitch)
        profile = (away <= pitch / 2 - self.border).astype(float).tolist()
        return calibration.model_copy(
            update={"lens_types": types, "profile": tuple(map(tuple, profile))}
        )

    def _grid(self, place: Floats) -> Grid:
        """The grid, counted from the lens at a place."""
        first, second = self.steps
        third = second - first if first @ second > 0 else first + second
        steps = [sign * step for step in (first, second, third) for sign in (1, -1)]
        right = max(steps, key=lambda step: float(step[1]))
        down = max(steps, key=lambda step: float(step[0]))
        across = abs(right[1]) >= abs(down[0])
        if across:
            # Two rows straight down are two steps less one along the row.
            down = np.array([right[1], -right[0]]) * np.sqrt(0.75)
        else:
            right = np.array([-down[1], down[0]]) * np.sqrt(0.75)
        return Grid(
            layout="hexagonal-rows" if across else "hexagonal-columns",
            order=1,
            middle=(0.0, 0.0),
            scale=1.0,
            coefficients=tuple((float(y), float(x)) for y, x in (place, down, right)),
        )

    def _types(self, grid: Grid, pitch: float) -> LensTypes:
        t, s, off = grid.nearest(self.places + grid.centres(0, 0))
        kinds = usual_order(grid, t, s, len(self.places))
        if np.hypot(*off.T).max() > _OFF * pitch or len(set(kinds.tolist())) < len(kinds):
            raise InputError(
                "the offsets of its lens types are not those of three", where=self.where
            )
        sharpest = tuple((1 / near + 1 / far) / 2 for near, far in self.ranges)
        return LensTypes(pattern=tuple(int(k) for k in np.argsort(kinds)), sharpest=sharpest)


def read_vendor_grid(path: Path) -> VendorGrid:
    """Read a Raytrix calibration file.

    Raises `InputError` if there is none, or it has what is not read.
    """
    return _Reader(str(path)).grid(_root(path))


def _root(path: Path) -> ElementTree.Element:
    """The file's element RayCalibData."""
    where = str(path)
    try:
        text = input_file(path).read_bytes()
    except OSError as error:
        reason = "no such file" if isinstance(error, FileNotFoundError) else "cannot be read"
        raise InputError(f"{reason}; give a Raytrix calibration (.xml)", where=where) from None
    # Entities may expand without end.
    if len(text) > _LARGEST or b"<!" in text.replace(b"<!--", b""):
        raise InputError("is no plain XML of a Raytrix calibration", where=where)
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise InputError(f"is no XML ({error})", where=where) from None
    if root.tag != "RayCalibData":
        raise InputError(
            f"is a {root.tag}, not the RayCalibData of a Raytrix calibration", where=where
        )
    return root


@dataclass(frozen=True)
class _Reader:
    """Reads elements; `where` names the file."""

    where: str

    def grid(self, root: ElementTree.Element) -> VendorGrid:
        """The grid that an element RayCalibData describes."""
        distortion = root.findall("distortion/parameter")
        if any((one.text or "0").strip() not in ("", "0") for one in distortion):
            raise self._refusal("has a distortion of the grid, which is not read")
        diameter, turn = self._number(root, "diameter"), self._number(root, "rotation", 0.0)
        border = self._number(root, "lens_border", 0.0)
        if not 0 < diameter < _LARGEST or not 0 <= border < diameter / 2:
            raise self._refusal(
                f"lenses of {diameter:g} pixels with rims of {border:g} are not possible"
            )
        # Counter-clockwise, of (y, x) with y downwards.
        turned = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        steps = np.stack([self._pair(root, "lens_base_x"), self._pair(root, "lens_base_y")])
        lengths, angle = np.linalg.norm(steps, axis=1), abs(float(steps[0] @ steps[1]))
        if np.abs(lengths - 1).max() > _OFF or abs(angle - 0.5) > _OFF:
            raise self._refusal("its lens bases are not those of a hexagonal grid")
        kinds = sorted(root.findall("lens_type"), key=lambda one: one.get("id") or "")
        if len(kinds) not in (1, 3):
            raise self._refusal(f"has {len(kinds)} lens types, 1 or 3 can be read")
        return VendorGrid(
            self._pair(root, "offset"),
            diameter * steps @ turned,
            border,
            diameter * np.stack([self._pair(kind, "offset") for kind in kinds]) @ turned,
            tuple(map(self._range, kinds)),
            self.where,
        )

    def _range(self, kind: ElementTree.Element) -> tuple[float, float]:
        """Virtual depths of a type of lenses."""
        near, far = (self._number(kind, f"depth_range/{name}") for name in ("min", "max"))
        if not 1 <= near < far:
            raise self._refusal(f"has a type with virtual depths from {near:g} to {far:g}")
        return near, far

    def _pair(self, part: ElementTree.Element, name: str) -> Floats:
        """A pair (y, x), y downwards."""
        return np.array([-self._number(part, f"{name}/y"), self._number(part, f"{name}/x")])

    def _number(self, part: ElementTree.Element, name: str, default: float | None = None) -> float:
        text = part.findtext(name)
        if text is None and default is not None:
            return default
        try:
            value = float(text or "")
        except ValueError:
            value = inf
        if not isfinite(value):
            raise self._refusal(f"has no number {name} in {part.tag}")
        return value

    def _refusal(self, problem: str) -> InputError:
        return InputError(problem, where=self.where)
