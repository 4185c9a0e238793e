# SPDX-License-Identifier: Apache-2.0
"""The chip's raster of a focused camera beside that of the software, and pictures put upright."""

import numpy as np
import numpy.typing as npt

from plenofir.camera.calibration import Calibration
from plenofir.camera.captures.prepare import Prepared
from plenofir.camera.focused import focused_capture, focused_raster
from plenofir.camera.focused.capture import STEP
from plenofir.camera.focused.raster import straightened
from plenofir.camera.resampling import GridRegisters, Tables, lit_pixels
from plenofir.ground.images import Picture
from plenofir.refocus import refocus
from plenofir.refocus.operator import Image

# Share of the light below which a pixel is black.
_LEAST = 0.05


def difference_from_software(
    golden: Image, picture: Picture, calibration: Calibration, chip: GridRegisters, tables: Tables
) -> npt.NDArray[np.int64]:
    """Difference of the chip's raster from `focused_raster` where both have light, in grey levels.

    `picture`: the capture, its colours interpolated.
    """
    m, scale = chip.micro_image_size, 1 << chip.precision.fraction_bits
    capture = focused_capture(Prepared(picture, calibration, None, None, None, (), ()))
    raster = focused_raster(capture, m)
    first = np.array(chip.origin) / scale - raster.origin
    # The chip's lenses are some of the software's.
    row, column = np.rint(first @ np.linalg.inv(raster.steps)).astype(int)
    part = slice(row, row + golden.shape[0]), slice(column, column + golden.shape[1])
    both = lit_pixels(tables) & (raster.lenses[part] > 0)
    return golden[both].astype(np.int64) - raster.pixels[part][both]


def upright(
    refocused: Image, shift: int, box: int, chip: GridRegisters, tables: Tables, full_scale: int
) -> Image:
    """A refocused picture of the chip as the capture lies, divided by the light that reached it.

    `shift`, `box`: of the slice; zero borders. Result: a pixel for `STEP` of the capture.
    """
    m, scale = chip.micro_image_size, 1 << chip.precision.fraction_bits
    lit = lit_pixels(tables).astype(np.uint16) * 65535
    shares = refocus(lit, m, f"{shift}/{m}", box=box).astype(np.float64) / 65535
    layers = np.dstack([refocused.astype(np.float64), shares])
    steps = np.array([chip.line, (0, chip.pixel)]) / scale
    rows, columns = (length // STEP for length in chip.image_shape)
    straight = straightened(layers, np.array(chip.origin) / scale, steps, (rows, columns), STEP)
    values = straight[..., :-1] / np.maximum(straight[..., -1:], 1e-6)
    values = np.where(straight[..., -1:] > _LEAST, values, 0)
    levels = np.clip(np.floor(values + 0.5), 0, full_scale).astype(refocused.dtype)
    return levels if refocused.ndim > 2 else levels[..., 0]
