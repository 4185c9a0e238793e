# SPDX-License-Identifier: Apache-2.0
"""Bit-true model of the FPGA's resampler: raw frame in, raster of micro images out.

Pixel (v, u) of lens (t, s) lies at the sum of `GridRegisters.positions` and `GridRegisters.samples`
and is interpolated between four pixels of the raw frame with weights of
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

from plenofir.camera.calibration.axes import DIMMEST, reach_of
from plenofir.camera.calibration.frames import check_same_size
from plenofir.camera.calibration.grid import Floats
from plenofir.camera.calibration.record import Calibration
from plenofir.camera.calibration.resample import DARKEST, profile_around, profile_at
from plenofir.camera.resampling.registers import (
    Flags,
    GridRegisters,
    Integers,
    Precision,
    lenses_of,
)
from plenofir.ground.errors import InputError
from plenofir.refocus.operator import Image

GAIN_INTEGER_BITS = 4
_LARGEST_GAIN = round(1 / DARKEST)


@dataclass(frozen=True)
class Tables:
    """What the chip knows of lenses and pixels besides where the grid is."""

    black: int = 0  # level without light, in 2**-guard_bits grey levels
    # (y, x) from the grid in the registers to each lens in 2**-weight_bits pixels, shape (rows,
    # lenses, 2); None for a grid without distortion.
    moves: Integers | None = None
    # Gain of each lens in 2**-gain_bits, shape (rows, lenses); None for no correction of
    # vignetting.
    lenses: Integers | None = None
    # Gain of each pixel of a micro image in 2**-gain_bits, shape (M, M); None as `lenses`.
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
    lattice, brightness, used = lenses_of(calibration)
    black = round(calibration.dark_level * (1 << bits.guard_bits))
    moves = lenses = profile = None
    if distortion if distortion is not None else calibration.grid.order > 1:
        middle = registers.middle() / (1 << bits.fraction_bits)
        corners = calibration.grid.positions(lattice) - middle
        exact = np.rint(corners * (1 << bits.weight_bits)).astype(np.int64)
        moves = exact - (registers.positions() >> (bits.fraction_bits - bits.weight_bits))
        moves[~used] = 0
        largest = int(np.abs(moves).max())
        if largest >= 1 << (bits.weight_bits + 1):
            raise InputError(
                f"lenses lie up to {largest / (1 << bits.weight_bits):.2f} pixels off an "
                "even grid; the resampler corrects less than 2",
                where=where,
            )
    if registers.layout == "skewed":
        # Lenses beside the frame, and pixels between the micro images, have no gain.
        light, lit = skewed_profile(calibration, registers)
        if not devignette:
            light, brightness = np.ones_like(light), np.ones_like(brightness)
        lenses, profile = _gain(brightness, bits) * used, _gain(light, bits) * lit
    elif devignette:
        lenses = _gain(brightness, bits)
        profile = _gain(profile_at(calibration, m, "native"), bits)
    return Tables(black, moves, lenses, profile)


def skewed_profile(calibration: Calibration, registers: GridRegisters) -> tuple[Floats, Flags]:
    """Brightness of the pixels of a focused camera's micro image, and which count, shape (M, M)."""
    away = (registers.samples() - registers.middle()) / (1 << registers.precision.fraction_bits)
    light = profile_around(calibration, away)
    near = np.hypot(*np.moveaxis(away, -1, 0)) <= reach_of(calibration.grid)
    return light, near & (light >= DIMMEST)


def lit_pixels(tables: Tables) -> Flags:
    """Which pixels of a skewed raster have a gain, shape (rows M, lenses M)."""
    assert tables.lenses is not None
    assert tables.profile is not None
    return np.asarray(np.kron(tables.lenses > 0, tables.profile > 0))


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

    `raw`: raw frame, grey or RGB, uint8 or uint16. `registers`: where the lenses are. `tables`:
    black level, gains and moves; none if None. `full_scale`: largest value of the frame, where
    results saturate; its type's largest if None. Result: raster of micro images, type and channels
    of `raw`. Raises `InputError` if the frame has another size than the registers', or a micro
    image more than half outside.
    """
    check_same_size(raw, registers.image_shape, where, "the calibration's white image")
    tables, m, bits = tables or Tables(), registers.micro_image_size, registers.precision
    weight, guard = bits.weight_bits, bits.guard_bits
    corners, samples = registers.positions(), registers.samples()
    shift, one = bits.fraction_bits - weight, 1 << weight
    limit = full_scale or int(np.iinfo(raw.dtype).max)
    rows, lenses = registers.lenses
    result = np.empty((rows, m, registers.outputs, m, *raw.shape[2:]), raw.dtype)
    channel = (1,) * (raw.ndim - 2)
    for t in range(rows):
        # Shape (line, lens, pixel of the lens, axis); y is that of the line.
        places = corners[t, :, np.newaxis] + samples[:, np.newaxis] >> shift
        if tables.moves is not None:
            places = places + tables.moves[t][:, np.newaxis]
        pixels = places >> weight
        y, x = (
            [mirrored(pixels[..., k] + near, registers.image_shape[k]) for near in (0, 1)]
            for k in (0, 1)
        )
        if any((a < 0).any() for a in (*y, *x)):
            raise InputError("a lens lies outside of the raw frame", where=where)
        fy, fx = ((places[..., k] & (one - 1)).reshape(m, lenses, m, *channel) for k in (0, 1))
        lines = [(one - fx) * raw[near, x[0]].astype(np.int64) + fx * raw[near, x[1]] for near in y]
        part = (one - fy) * lines[0] + fy * lines[1]
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
