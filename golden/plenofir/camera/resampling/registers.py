# SPDX-License-Identifier: Apache-2.0
"""A calibration as fixed-point registers, from which the FPGA computes the positions of pixels.

The top left pixel of lens (t, s) lies at

    origin + down(0) + ... + down(t - 1) + s right,    down(t) = down[t mod 2]

in units of 2**-fraction_bits pixels: sums of registers, so no multiplier is needed. Two steps from
row to row take up hexagonal grids, in which every second row begins half a pitch farther to the
right. Inside a micro image steps are one pixel along the sensor's own axes, so the weights of the
bilinear interpolation, `weight_bits` of the position's fraction, are the same for all its pixels.
The registers hold the rounding of the weights, too: the chip cuts bits off.

`plenofir.camera.calibration.decode` steps along the grid's axes instead. A pixel that is d from the
middle of its micro image is d times the rotation (in radians) away from where `decode` takes it.

The raster of a focused camera is skewed, as that of `plenofir.camera.focused.FocusedRaster`: rows
and columns of lenses are 60 degrees apart in a hexagonal grid, and M steps along these axes lead
from a lens to the next, so that the square operator is exact. From line to line of a micro image
the step is `line`, from pixel to pixel `pixel`, which follows the sensor's lines. The raster holds
all lenses whose whole micro images lie in the raw frame; the others in it have no gain.
"""

from typing import Annotated, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field

from plenofir.camera.calibration.axes import along_axes, extent_along, lenses_along, reach_of
from plenofir.camera.calibration.grid import Floats
from plenofir.camera.calibration.record import Calibration
from plenofir.camera.calibration.resample import (
    check_micro_image_size,
    raster_window,
)
from plenofir.ground.errors import InputError

Integers = npt.NDArray[np.int64]
ChipLayout = Literal["rectangular", "hexagonal-rows", "skewed"]
Flags = npt.NDArray[np.bool_]
Vector = tuple[int, int]

LARGEST_SIDE = 8192


class Precision(BaseModel):
    """How exactly the chip computes."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    # Fraction bits of positions: how exactly the centres lie.
    fraction_bits: Annotated[int, Field(ge=8, le=17)] = 16
    weight_bits: Annotated[int, Field(ge=2, le=8)] = 8  # weights of interpolations
    # Fraction bits that a sample keeps until it is rounded to a pixel.
    guard_bits: Annotated[int, Field(ge=1, le=3)] = 3
    # Fraction bits of the gains of lenses and of the profile.
    gain_bits: Annotated[int, Field(ge=4, le=14)] = 12


class GridRegisters(BaseModel):
    """The registers of the chip's resampler."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    image_shape: tuple[int, int]  # rows and columns of the raw frame
    lenses: tuple[int, int]  # rows of lenses, and lenses that are sampled in each
    layout: ChipLayout  # arrangement of the lenses
    micro_image_size: int
    precision: Precision  # bits of the numbers below
    origin: Vector  # (y, x) of the top left pixel of the first lens, in 2**-fraction_bits pixels
    right: Vector  # (y, x) from a lens to the next one in its row
    # Steps (y, x) from rows of even number to the next, and from rows of odd number.
    down: tuple[Vector, Vector]
    outputs: int  # micro images in a row of the raster: as `lenses` says, but in hexagonal grids
    # Hexagonal: place of a row's first micro image, in 2**-fraction_bits lenses, for rows of even
    # and of odd number.
    place: Vector = (0, 0)
    step: int = 0  # hexagonal: from a micro image of the raster to the next
    # Skewed: (y, x) from a line of a micro image to the next, in 2**-fraction_bits pixels.
    line: Vector = (0, 0)
    pixel: int = 0  # skewed: from a pixel of a line to the next, along x

    @property
    def raster_shape(self) -> tuple[int, int]:
        """Rows and columns of the raster of micro images."""
        m = self.micro_image_size
        return self.lenses[0] * m, self.outputs * m

    def positions(self) -> Integers:
        """(y, x) of the top left pixels of all lenses, shape (rows, lenses, 2)."""
        rows, columns = self.lenses
        steps = np.array([self.down[t % 2] for t in range(rows - 1)], np.int64).reshape(-1, 2)
        first = np.concatenate([np.zeros((1, 2), np.int64), np.cumsum(steps, axis=0)])
        along = np.arange(columns)[:, np.newaxis] * np.array(self.right)
        return np.asarray(first[:, np.newaxis] + along + np.array(self.origin))

    def samples(self) -> Integers:
        """(y, x) of the pixels of a micro image from the top left one, shape (M, M, 2)."""
        one = 1 << self.precision.fraction_bits
        line, pixel = (self.line, self.pixel) if self.layout == "skewed" else ((one, 0), one)
        along = np.arange(self.micro_image_size)[:, np.newaxis]
        return np.asarray((along * np.array(line))[:, np.newaxis] + along * np.array((0, pixel)))

    def middle(self) -> Floats:
        """(y, x) of the middle of a micro image from its top left pixel."""
        return np.asarray(self.samples()[-1, -1] / 2)

    def check_mirrored(self, *, where: str) -> None:
        """Refuse an image in which a pixel of a micro image needs to be mirrored at both ends."""
        fraction_bits, samples = self.precision.fraction_bits, self.samples().reshape(-1, 2)
        low = self.positions() + samples.min(axis=0) >> fraction_bits
        high = (self.positions() + samples.max(axis=0) >> fraction_bits) + 1
        ends = np.array(self.image_shape) - 1
        # 3 more pixels for moved lenses and for the interpolation.
        if (low < 3 - ends).any() or (high + 3 > 2 * ends).any():
            tilted = ", or too high for the skewed raster of a focused camera"
            raise InputError(
                f"the image of {ends[1] + 1} x {ends[0] + 1} pixels is too small for "
                f"M = {self.micro_image_size}" + (tilted if self.layout == "skewed" else ""),
                where=where,
            )


class Lenses(NamedTuple):
    """The lenses of the chip's raster, each of shape (rows, lenses)."""

    lattice: Floats  # lattice coordinates, (..., 2)
    brightness: Floats
    used: Flags  # False for lenses beside the raw frame, which are in a skewed raster only


def lenses_of(calibration: Calibration) -> Lenses:
    """The lenses of the raster that the chip makes with a calibration."""
    grid = calibration.grid
    if calibration.lens_types is None:
        rows, columns = raster_window(calibration)
        t, s = np.meshgrid(
            np.arange(rows.start, rows.stop), np.arange(columns.start, columns.stop), indexing="ij"
        )
        brightness = calibration.lens_brightness[rows, columns]
        return Lenses(grid.lattice(t, s), brightness, np.ones(t.shape, bool))
    first, counts = extent_along(grid, calibration.image_shape)
    row, column = np.indices(counts)
    lattice = along_axes(grid, row + first[0], column + first[1])
    centres, rim = grid.positions(lattice), reach_of(grid)
    end = np.array(calibration.image_shape) - 1
    used = np.asarray(((centres >= rim) & (centres <= end - rim)).all(axis=-1))
    if not used.any():
        return Lenses(lattice, np.ones(used.shape), used)
    part = tuple(slice(k.min(), k.max() + 1) for k in np.nonzero(used))
    lattice, used = lattice[part], used[part]
    t, s = lenses_along(grid, lattice)
    brightness = calibration.lens_brightness
    near = (np.clip(k, 0, n - 1) for k, n in zip((t, s), brightness.shape, strict=True))
    return Lenses(lattice, brightness[tuple(near)], used)


class Accuracy(BaseModel):
    """How far the registers are from the calibration, in pixels."""

    model_config = ConfigDict(frozen=True)

    # Largest distance of the calibration's centres from the affine grid next to them; a table of
    # lenses makes up for it (`plenofir.camera.resampling.tables_of`).
    distortion_px: float
    rounding_px: float  # largest distance of that grid from the one in the registers
    # Largest distance of a pixel from where `decode` takes it because steps follow the sensor's
    # axes, at the corners of micro images.
    turn_px: float


def grid_registers(
    calibration: Calibration,
    micro_image_size: int,
    precision: Precision | None = None,
    *,
    where: str = "calibration",
) -> tuple[GridRegisters, Accuracy]:
    """Registers of a calibration.

    `precision`: bits; the defaults if None. Result: the registers, and how far they are from the
    calibration. Raises `InputError` if the chip cannot follow the grid: staggered columns, M larger
    than the pitch of a standard camera, an image of more than `LARGEST_SIDE` pixels.
    """
    bits, m, grid = precision or Precision(), micro_image_size, calibration.grid
    focused = calibration.lens_types is not None
    check_micro_image_size(calibration, m, "fit" if focused else "native")
    layout: ChipLayout
    if grid.layout == "hexagonal-columns":
        raise InputError(
            "the lenses stand in columns (hexagonal-columns); turn the camera by 90 "
            "degrees, so that they stand in rows",
            where=where,
        )
    layout = "skewed" if focused else grid.layout
    if max(calibration.image_shape) > LARGEST_SIDE:
        raise InputError(
            f"has {calibration.image_shape[1]} x {calibration.image_shape[0]} pixels; "
            f"the resampler takes at most {LARGEST_SIDE} a side",
            where=where,
        )
    lattice, _, used = lenses_of(calibration)
    if not used.any():
        raise InputError("no whole micro image lies in the image", where=where)
    centres = grid.positions(lattice)
    first, down, right = _affine((lattice - lattice[0, 0])[used], centres[used]) or (
        centres[0, 0],
        *grid.jacobian(lattice[0, 0]),
    )
    # Parity of the rows that begin half a pitch farther to the right.
    moved = [0.0, 0.0]
    if layout == "hexagonal-rows":
        moved[(round(lattice[0, 0, 0]) + grid.stagger + 1) % 2] = 0.5
    scale = 1 << bits.fraction_bits
    steps = [down + (moved[1 - k] - moved[k]) * right for k in (0, 1)]
    line, pixel = np.array((1.0, 0.0)), 1.0
    if focused:
        if grid.layout == "hexagonal-rows":
            steps = [down + right / 2] * 2
        line, pixel = steps[0] / m, right[1] / m
    unplaced = GridRegisters(
        image_shape=calibration.image_shape,
        lenses=used.shape,
        layout=layout,
        micro_image_size=m,
        precision=bits,
        origin=(0, 0),
        right=_rounded(right * scale),
        down=(_rounded(steps[0] * scale), _rounded(steps[1] * scale)),
        outputs=used.shape[1],
        line=_rounded(line * scale) if focused else (0, 0),
        pixel=round(pixel * scale) if focused else 0,
    )
    affine = first + (lattice - lattice[0, 0]) @ np.stack([down, right])
    # Shift the origin so that the rounding errors of the steps are balanced between both ends.
    origin = affine * scale - unplaced.positions()
    origin = (origin.reshape(-1, 2).max(axis=0) + origin.reshape(-1, 2).min(axis=0)) / 2
    half, middle = scale >> (bits.weight_bits + 1), unplaced.middle()
    placed = unplaced.model_copy(update={"origin": _rounded(origin - middle + half)})
    placed.check_mirrored(where=where)
    distortion = float(np.linalg.norm((affine - centres)[used], axis=-1).max())
    if layout == "hexagonal-rows":
        placed = _with_places(placed, grid.pitch[0] / grid.pitch[1], moved)
    away = (placed.positions() + middle - half) / scale - affine
    rounding = float(np.linalg.norm(away[used], axis=-1).max())
    # At the last pixel of a micro image, its steps' own rounding is added.
    exact = (m - 1) / 2 * (line + np.array((0.0, pixel)))
    rounding += float(np.linalg.norm(middle / scale - exact))
    if focused:
        corner = (m - 1) / 2 * abs(right[0]) / m
    else:
        turns = np.stack([down / np.linalg.norm(down), right / np.linalg.norm(right)]) - np.eye(2)
        corner = (m - 1) / 2 * max(np.linalg.norm(turns[0] + sign * turns[1]) for sign in (1, -1))
    return placed, Accuracy(distortion_px=distortion, rounding_px=rounding, turn_px=float(corner))


def _affine(lattice: Floats, centres: Floats) -> tuple[Floats, Floats, Floats] | None:
    """Affine grid next to centres, shape (lenses, 2): position of the first, down and right.

    None if all lie on a line, which says nothing of the direction across.
    """
    terms = np.column_stack([np.ones(len(lattice)), lattice])
    solution, _, rank, _ = np.linalg.lstsq(terms, centres, rcond=None)
    return (solution[0], solution[1], solution[2]) if rank == 3 else None


def _rounded(vector: Floats) -> Vector:
    y, x = np.rint(vector)
    return int(y), int(x)


def _with_places(registers: GridRegisters, step: float, moved: list[float]) -> GridRegisters:
    """Registers of the interpolation along the rows of a hexagonal grid."""
    bits, lenses = registers.precision, registers.lenses[1]
    if lenses < 2:
        raise InputError(
            f"a hexagonal grid needs at least 2 lenses in a row, this one has {lenses}"
        )
    # As in hexagonal_to_rectangular.
    outputs = int(np.floor((lenses - 1.5) / step)) + 1
    scale = 1 << bits.fraction_bits
    rounded = round(step * scale)
    half = scale >> (bits.weight_bits + 1)
    places = [round((0.5 - moved[k]) * scale) + half for k in (0, 1)]
    # No place is the last lens or beyond it: there is none behind it.
    beyond = [p + (outputs - 1) * rounded - ((lenses - 1) * scale - 1) for p in places]
    places = [p - max(over, 0) for p, over in zip(places, beyond, strict=True)]
    return registers.model_copy(
        update={"outputs": outputs, "place": (places[0], places[1]), "step": rounded}
    )
