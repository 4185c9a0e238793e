# SPDX-License-Identifier: Apache-2.0
"""The model of the chip's resampler, against `decode` and against its formulas, pixel by pixel."""

import secrets
from fractions import Fraction
from math import floor

import numpy as np
import pytest
from scipy import ndimage

from plenofir.camera.calibration import Calibration, calibration_of_grid, decode
from plenofir.camera.calibration.types_of_lenses import LensTypes
from plenofir.camera.resampling import (
    GridRegisters,
    Precision,
    Tables,
    grid_registers,
    resample,
    tables_of,
)
from plenofir.ground.errors import InputError
from plenofir_studies.synthetic import regular_grid

LAYOUTS = "rectangular", "hexagonal-rows"


def camera(
    shape: tuple[int, int], pitch: float, rotation: float, layout: str, **changes
) -> Calibration:
    grid = regular_grid(shape, pitch, rotation_degrees=rotation, layout=layout, offset=(0.3, -0.2))
    return calibration_of_grid(grid, shape).model_copy(update=changes)


def vignetting(rng: np.random.Generator) -> dict:
    profile = rng.uniform(0.05, 1, (5, 5))
    return {
        "shading": (-0.3, 0.2, -0.1),
        "profile": tuple(tuple(line) for line in profile.tolist()),
        "dark_level": 3.4,
    }


def smooth(shape: tuple[int, ...], seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(size=shape)
    noise = ndimage.gaussian_filter(noise, (2, 2, 0)[: len(shape)])
    return np.clip(128 + 60 * noise / noise.std(), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize(
    ("pitch", "m", "rotation"),
    [(5.0, 4, -1.0), (9.3, 9, 0.0), (13.889, 13, 0.7), (15.4, 13, -0.3), (80.0, 79, 1.0)],
)
def test_difference_from_decode_is_within_its_bound(pitch, m, rotation, layout) -> None:
    shape = (int(6.3 * pitch) + 40, int(7.2 * pitch) + 50)
    calibration = camera(shape, pitch, rotation, layout)
    raw = smooth(shape, 5)
    registers, accuracy = grid_registers(calibration, m)
    got, want = resample(raw, registers), decode(raw, calibration, m)
    assert got.shape == want.shape == registers.raster_shape
    assert accuracy.distortion_px < 1e-9
    assert accuracy.rounding_px < 2.0**-9
    # An error of the position along each axis, times the steepest slope; of a place between
    # lenses, times the largest difference; and the rounding.
    slope = max(int(np.abs(np.diff(raw.astype(int), axis=k)).max()) for k in (0, 1))
    away = 2 * (2.0**-9 + accuracy.rounding_px) + np.sqrt(2) * accuracy.turn_px
    between = 255 * 2.0**-9 if layout == "hexagonal-rows" else 0
    largest = int(np.abs(got.astype(int) - want).max())
    assert largest <= slope * away + between + 1


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_whole_positions_are_copied(dtype) -> None:
    raw = np.random.default_rng(1).integers(0, np.iinfo(dtype).max, (40, 55, 3), dtype)
    grid = regular_grid((40, 55), 5.0, offset=(0.5, 0.0))
    calibration = calibration_of_grid(grid, (40, 55))
    registers, _ = grid_registers(calibration, 5)
    assert (resample(raw, registers) == decode(raw, calibration, 5)).all()


def fixed(value: Fraction) -> int:
    """Rounded, halves up."""
    return floor(value + Fraction(1, 2))


def by_formula(
    raw: np.ndarray, registers: GridRegisters, tables: Tables, t: int, v: int, n: int, u: int
) -> int:
    """One pixel of the raster, by the formulas of the module's text, in exact numbers."""
    bits, (rows, columns) = registers.precision, raw.shape
    f, g, b = bits.weight_bits, bits.guard_bits, bits.gain_bits

    def pixel(y: int, x: int) -> int:
        y, x = (abs(k) for k in (y, x))
        y, x = (k if k < size else 2 * (size - 1) - k for k, size in ((y, rows), (x, columns)))
        return int(raw[y, x])

    steps, (v_now, u_now) = (0, 0), (v, u)
    if registers.layout == "skewed":
        steps = v * registers.line[0], v * registers.line[1] + u * registers.pixel
        v_now = u_now = 0

    def value(s: int) -> int:
        place = [registers.origin[k] + s * registers.right[k] for k in (0, 1)]
        place = [p + sum(registers.down[i % 2][k] for i in range(t)) for k, p in enumerate(place)]
        place = [p + step for p, step in zip(place, steps, strict=True)]
        place = [floor(Fraction(p, 1 << (bits.fraction_bits - f))) for p in place]
        if tables.moves is not None:
            place = [p + int(tables.moves[t, s, k]) for k, p in enumerate(place)]
        (y, fy), (x, fx) = (divmod(p, 1 << f) for p in place)
        y, x = y + v_now, x + u_now
        one = 1 << f
        total = (one - fy) * ((one - fx) * pixel(y, x) + fx * pixel(y, x + 1))
        total += fy * ((one - fx) * pixel(y + 1, x) + fx * pixel(y + 1, x + 1))
        sample = max(fixed(Fraction(total, 1 << (2 * f - g))) - tables.black, 0)
        if tables.lenses is None or tables.profile is None:
            return sample
        gain = fixed(Fraction(int(tables.lenses[t, s] * tables.profile[v, u]), 1 << b))
        return fixed(Fraction(sample * min(gain, 10 << b), 1 << b))

    full = int(np.iinfo(raw.dtype).max)
    if registers.layout != "hexagonal-rows":
        return min(fixed(Fraction(value(n), 1 << g)), full)
    place = registers.place[t % 2] + n * registers.step
    lens, w = divmod(place >> (bits.fraction_bits - f), 1 << f)
    mixed = ((1 << f) - w) * value(lens) + w * value(lens + 1)
    return min(fixed(Fraction(mixed, 1 << (f + g))), full)


@pytest.mark.parametrize("focused", [False, True])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_pixels_are_as_the_formulas_say(layout, focused) -> None:
    seed = secrets.randbits(32)
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    pitch, rotation = rng.uniform(5, 9), rng.uniform(-1, 1)
    shape = int(rng.integers(40, 70)), int(rng.integers(40, 70))
    calibration = camera(shape, pitch, rotation, layout, **vignetting(rng))
    if focused:
        types = LensTypes(pattern=(0,), sharpest=(0.4,))
        calibration = calibration.model_copy(update={"lens_types": types})
    m = int(rng.integers(1, int(pitch) + 1))
    precision = Precision(
        weight_bits=int(rng.integers(2, 9)),
        guard_bits=int(rng.integers(1, 4)),
        gain_bits=int(rng.integers(4, 15)),
    )
    registers, _ = grid_registers(calibration, m, precision)
    tables = tables_of(calibration, registers, distortion=bool(rng.integers(2)))
    raw = rng.integers(0, 256, shape).astype(np.uint8)
    got = resample(raw, registers, tables)
    for _ in range(300):
        t, n = (int(rng.integers(k)) for k in (registers.lenses[0], registers.outputs))
        v, u = (int(rng.integers(m)) for _ in range(2))
        want = by_formula(raw, registers, tables, t, v, n, u)
        assert got[t * m + v, n * m + u] == want, (t, v, n, u)


def test_gains_and_black_level_are_those_of_decode() -> None:
    rng = np.random.default_rng(3)
    calibration = camera((90, 120), 10.3, 0.2, "rectangular", **vignetting(rng))
    raw = (smooth((90, 120), 4).astype(np.uint16) // 4 + 20).astype(np.uint8)
    registers, _ = grid_registers(calibration, 9)
    for devignette in (True, False):
        got = resample(raw, registers, tables_of(calibration, registers, devignette=devignette))
        want = decode(raw, calibration, 9, devignette=devignette).astype(int)
        assert np.abs(got.astype(int) - want).max() <= (6 if devignette else 2)
        assert np.abs(got.astype(int) - want).mean() < 0.4


def test_lenses_move_where_distortion_has_them() -> None:
    shape = (150, 160)
    even = regular_grid(shape, 10.2, rotation_degrees=0.2)
    bent = [*even.coefficients, (0.0, 0.01), (0.004, 0.0), (0.01, 0.002)]
    grid = even.model_copy(update={"order": 2, "coefficients": tuple(bent)})
    calibration = calibration_of_grid(grid, shape)
    registers, accuracy = grid_registers(calibration, 9)
    assert 0.1 < accuracy.distortion_px < 1
    raw = smooth(shape, 6)
    want = decode(raw, calibration, 9).astype(int)

    def rms(tables: Tables) -> float:
        return float(np.sqrt(((resample(raw, registers, tables) - want) ** 2).mean()))

    moved = rms(tables_of(calibration, registers))
    assert moved < 0.8
    assert rms(tables_of(calibration, registers, distortion=False)) > 3 * moved


def test_lenses_on_a_line_do_not_turn_the_grid() -> None:
    """In a narrow frame the whole micro images of a focused camera stand one below the other."""
    shape, pitch = (114, 32), 22.94
    types = LensTypes(pattern=(0,), sharpest=(0.4,))
    followed = 0
    for offset in [(float(y), float(x)) for y in range(0, 20, 5) for x in range(0, 20, 5)]:
        grid = regular_grid(shape, pitch, layout="hexagonal-rows", offset=offset)
        calibration = calibration_of_grid(grid, shape).model_copy(update={"lens_types": types})
        try:
            registers, _ = grid_registers(calibration, 9)
        except InputError:
            # Too high a frame for its width.
            continue
        down = np.array(registers.down) / 2**registers.precision.fraction_bits
        assert down[:, 0] == pytest.approx(pitch * 3**0.5 / 2, abs=1e-3)
        followed += 1
    assert followed > 4


def test_grids_that_the_chip_cannot_follow_are_refused() -> None:
    with pytest.raises(InputError, match="stand in rows"):
        grid_registers(camera((60, 60), 6.0, 0.0, "hexagonal-columns"), 3)
    with pytest.raises(InputError, match="at most 6"):
        grid_registers(camera((60, 60), 6.0, 0.0, "rectangular"), 7)
    focused = {"lens_types": LensTypes(pattern=(0,), sharpest=(0.4,))}
    with pytest.raises(InputError, match="no whole micro image lies in the image"):
        grid_registers(camera((4, 60), 8.0, 0.0, "hexagonal-rows", **focused), 3)
    with pytest.raises(InputError, match="too high for the skewed raster"):
        grid_registers(camera((300, 60), 8.0, 0.0, "hexagonal-rows", **focused), 8)
    with pytest.raises(InputError, match="stand in rows"):
        grid_registers(camera((60, 60), 6.0, 0.0, "hexagonal-columns", **focused), 3)
    even = regular_grid((100, 100), 8.0)
    bent = [*even.coefficients, (0.0, 0.3), (0.0, 0.0), (0.0, 0.0)]
    grid = even.model_copy(update={"order": 2, "coefficients": tuple(bent)})
    calibration = calibration_of_grid(grid, (100, 100))
    registers, _ = grid_registers(calibration, 3)
    with pytest.raises(InputError, match="even grid; the resampler corrects less than 2"):
        tables_of(calibration, registers)


def test_a_frame_of_another_size_is_refused() -> None:
    registers, _ = grid_registers(camera((60, 60), 6.0, 0.0, "rectangular"), 5)
    with pytest.raises(InputError, match="has 60 x 60"):
        resample(np.zeros((60, 61), np.uint8), registers)
