# SPDX-License-Identifier: Apache-2.0
"""Bit-true model of the FPGA's resampler: raw frame in, raster of micro images out.

Pixel (v, u) of lens (t, s) is interpolated between four pixels of the raw frame with weights of
F = `weight_bits` bits, and rounded to G = `guard_bits` fraction bits:

    sum    = (2^F - fy) ((2^F - fx) p00 + fx p01) + fy ((2^F - fx) p10 + fx p11)
    sample = floor(sum / 2^(2F - G) + 1/2)

A table of lenses moves each to where it is in a grid with distortion, by up to 2 pixels, in units
of 2^-F pixels. The black level is subtracted, nothing is below 0. Then come the gains of the lens
and of the pixel in its micro image:

    gain   = min(floor(lens profile / 2^B + 1/2), 10 2^B),    B = `gain_bits`
    value  = floor(sample gain / 2^B + 1/2)

The result is the value without its fraction bits, rounded, at most full scale. In hexagonal grids
it is interpolated between the same pixel of two lenses of a row first:

    value  = (2^F - w) value_j + w value_(j+1)

Outside the raw frame its pixels are mirrored at those of its border, as `decode` has it.
"""

from dataclasses import dataclass

import numpy as np

from plenofir.camera.calibration.frames import check_same_size
from plenofir.camera.calibration.grid import Floats
from plenofir.camera.calibration.record import Calibration
from plenofir.camera.calibration.resample import DARKEST, profile_at, raster_window
from plenofir.camera.resampling.registers import GridRegisters, Integers, Precision
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

GAIN_INTEGER_BITS = 4
_LARGEST_GAIN = round(1 / DARKEST)


@dataclass(frozen=True)
class Tables:
    """What the chip knows of lenses and pixels besides where the grid is.

    Attributes
    ----------
    black
        Level without light, in 2**-guard_bits grey tables.
    moves
        (y, x) from the grid in the registers to each lens in 2**-weight_bits pixels, shape (rows,
        lenses, 2); None for a grid without distortion.
    lenses
        Gain of each lens in 2**-gain_bits, shape (rows, lenses); None for no correction of
        vignetting.
    profile
        Gain of each pixel of a micro image in 2**-gain_bits, shape (M, M); None as `lenses`.
    """

    black: int = 0
    moves: Integers | None = None
    lenses: Integers | None = None
    profile: Integers | None = None


def tables_of(
    calibration: Calibration,
    registers: GridRegisters,
    *,
    devignette: bool = True,
    distortion: bool | None = None,
    where: str = "calibration",
) -> Tables:
    """Black level, gains and moves of a calibration.

    `devignette`: whether vignetting is corrected. `distortion`: whether each lens is moved to its
    own place; where the grid has distortion if None. Result: for the lenses of the registers.
    Raises `InputError` if a lens is more than 2 pixels from the grid in the registers.
    """
    bits, m = registers.precision, registers.micro_image_size
    window = raster_window(calibration)
    black = round(calibration.dark_level * (1 << bits.guard_bits))
    moves = lenses = profile = None
    if distortion if distortion is not None else calibration.grid.order > 1:
        corners = calibration.model_centres[window] - (m - 1) / 2
        exact = np.rint(corners * (1 << bits.weight_bits)).astype(np.int64)
        moves = exact - (registers.positions() >> (bits.fraction_bits - bits.weight_bits))
        largest = int(np.abs(moves).max())
        if largest >= 1 << (bits.weight_bits + 1):
            raise InputError(
                f"lenses lie up to {largest / (1 << bits.weight_bits):.2f} pixels off an "
                "even grid; the resampler corrects less than 2",
                where=where,
            )
    if devignette:
        lenses = _gain(calibration.lens_brightness[window], bits)
        profile = _gain(profile_at(calibration, m, "native"), bits)
    return Tables(black, moves, lenses, profile)


def _gain(light: Floats, bits: Precision) -> Integers:
    """Gains that make up for light, in fixed point."""
    largest = (1 << (bits.gain_bits + GAIN_INTEGER_BITS)) - 1
    gains = np.rint((1 << bits.gain_bits) / np.maximum(light, 1e-9))
    return np.minimum(gains, largest).astype(np.int64)


def mirrored(places: Integers, length: int) -> Integers:
    """Indices inside a line for indices outside: mirrored at the first and the last pixel."""
    places = np.abs(places)
    return np.minimum(places, 2 * (length - 1) - places)


def resample(
    raw: Image,
    registers: GridRegisters,
    tables: Tables | None = None,
    *,
    full_scale: int | None = None,
    where: str = "raw capture",
) -> Image:
    """Resample a raw frame as the chip does.

    Result: raster of micro images, type and channels of `raw`. Raises `InputError` if the frame has
    another size than the registers', or a micro image more than half outside.

    Parameters
    ----------
    raw
        Raw frame, grey or RGB, uint8 or uint16.
    registers
        Where the lenses are.
    tables
        Black level, gains and moves; none if None.
    full_scale
        Largest value of the frame, where results saturate; its type's largest if None.
    """
    check_same_size(raw, registers.image_shape, where, "the calibration's white image")
    tables, m, bits = tables or Tables(), registers.micro_image_size, registers.precision
    weight, guard = bits.weight_bits, bits.guard_bits
    places = registers.positions() >> (bits.fraction_bits - weight)
    if tables.moves is not None:
        places = places + tables.moves
    pixels, weights = places >> weight, places & ((1 << weight) - 1)
    limit = full_scale or int(np.iinfo(raw.dtype).max)
    rows, lenses = registers.lenses
    result = np.empty((rows, m, registers.outputs, m, *raw.shape[2:]), raw.dtype)
    steps = np.arange(m + 1)
    around = [pixels[..., k, np.newaxis] + steps for k in (0, 1)]
    inside = [mirrored(a, n) for a, n in zip(around, registers.image_shape, strict=True)]
    if any((a < 0).any() for a in inside):
        raise InputError("a lens lies outside of the raw frame", where=where)
    channel = (1,) * (raw.ndim - 2)
    for t in range(rows):
        # Pixels of a row of micro images and of the line and the column behind them.
        y = np.moveaxis(inside[0][t], 0, 1)[:, :, np.newaxis]
        part = raw[y, inside[1][t]].astype(np.int64)
        fy, fx = (weights[t, :, k].reshape(1, lenses, 1, *channel) for k in (0, 1))
        one = 1 << weight
        part = (one - fx) * part[:, :, :-1] + fx * part[:, :, 1:]
        part = (one - fy) * part[:-1] + fy * part[1:]
        value = _rounded(part, 2 * weight - guard)
        value = np.maximum(value - tables.black, 0)
        if tables.lenses is not None and tables.profile is not None:
            gain = tables.lenses[t][np.newaxis, :, np.newaxis] * tables.profile[:, np.newaxis]
            gain = np.minimum(_rounded(gain, bits.gain_bits), _LARGEST_GAIN << bits.gain_bits)
            value = _rounded(value * gain.reshape(*gain.shape, *channel), bits.gain_bits)
        if registers.layout == "hexagonal-rows":
            place = registers.place[t % 2] + np.arange(registers.outputs) * registers.step
            lens = place >> bits.fraction_bits
            w = place >> (bits.fraction_bits - weight) & ((1 << weight) - 1)
            w = w.reshape(1, -1, 1, *channel)
            value = _rounded((one - w) * value[:, lens] + w * value[:, lens + 1], guard + weight)
        else:
            value = _rounded(value, guard)
        result[t] = np.minimum(value, limit)
    return result.reshape(*registers.raster_shape, *raw.shape[2:])


def _rounded(values: Integers, bits: int) -> Integers:
    """Values without their lowest bits, halves up."""
    return values if bits <= 0 else (values + (1 << (bits - 1))) >> bits
