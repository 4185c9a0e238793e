# SPDX-License-Identifier: Apache-2.0
"""The raw lines that the ring must hold: no line of the raster reads any other."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from plenofir.camera.calibration import calibration_of_grid
from plenofir.camera.resampling import GridRegisters, Precision, Tables, grid_registers
from plenofir.camera.resampling.grid_resampler import mirrored
from plenofir.camera.resampling.lines import line_needs, ring_needs
from plenofir.ground.errors import InputError
from plenofir.plan.sensor.chip import check_fits, resampling
from plenofir_studies.synthetic import regular_grid


@st.composite
def cameras(draw: st.DrawFn) -> tuple[GridRegisters, Tables]:
    pitch = draw(st.floats(2.5, 30))
    layout = draw(st.sampled_from(["rectangular", "hexagonal-rows"]))
    shape = draw(st.tuples(st.integers(12, 150), st.integers(12, 150)))
    grid = regular_grid(
        shape,
        pitch,
        rotation_degrees=draw(st.floats(-30, 30)),
        layout=layout,
        offset=draw(st.tuples(st.floats(-20, 20), st.floats(-20, 20))),
    )
    precision = Precision(
        fraction_bits=draw(st.integers(8, 17)), weight_bits=draw(st.integers(2, 8))
    )
    m = draw(st.integers(1, int(np.ceil(pitch))))
    try:
        registers, _ = grid_registers(calibration_of_grid(grid, shape), m, precision)
    except InputError:
        assume(False)
        raise
    moves = None
    if draw(st.booleans()):
        most = 1 << precision.weight_bits
        seed = draw(st.integers(0, 1 << 32))
        moves = np.random.default_rng(seed).integers(-most, most, (*registers.lenses, 2))
    return registers, Tables(moves=moves)


def lines_read(registers: GridRegisters, tables: Tables) -> tuple[np.ndarray, np.ndarray]:
    """The first and the last raw line that each line of the raster reads."""
    bits = registers.precision
    places = registers.positions()[..., 0] >> (bits.fraction_bits - bits.weight_bits)
    if tables.moves is not None:
        places = places + tables.moves[..., 0]
    v = np.arange(registers.micro_image_size)[:, np.newaxis, np.newaxis]
    lines = (places >> bits.weight_bits)[:, np.newaxis, np.newaxis] + v + np.array([[0], [1]])
    lines = mirrored(lines, registers.image_shape[0])
    flat = lines.reshape(-1, lines.shape[-1] * 2)
    return flat.min(axis=1), flat.max(axis=1)


@settings(max_examples=150)
@given(cameras())
def test_lines_are_kept_until_they_were_read(camera: tuple[GridRegisters, Tables]) -> None:
    registers, tables = camera
    first, last = lines_read(registers, tables)
    needed, kept = line_needs(registers, tables)
    assert (first >= 0).all()
    assert (last <= needed).all()
    assert (needed < registers.image_shape[0]).all()
    # Lines that are kept for one line of the raster are kept for all later ones.
    assert (kept <= np.minimum.accumulate(first[::-1])[::-1]).all()
    assert ring_needs(registers, tables).least == (needed - kept).max() + 1


def test_rotation_needs_its_drift_and_three_lines() -> None:
    shape = (561, 843)
    for degrees in (0.0, 0.3, 0.7, 1.0):
        grid = regular_grid(shape, 13.889, rotation_degrees=degrees, offset=(2.0, 0.0))
        registers, _ = grid_registers(calibration_of_grid(grid, shape), 12)
        drift = abs(int(registers.right[0] * (registers.lenses[1] - 1))) >> 16
        needs = ring_needs(registers)
        assert needs.full_rate is not None
        # Micro images that are mirrored at the border need up to M lines more.
        assert drift + 2 <= needs.least <= drift + 3 + 12 // 2
        assert needs.least < needs.full_rate <= drift + 3 + 12


def test_calibrations_of_other_resamplers_are_refused() -> None:
    shape = (60, 80)

    def chip(pitch: float, m: int, rotation: float = 0.0, layout: str = "rectangular"):
        grid = regular_grid(shape, pitch, rotation_degrees=rotation, layout=layout)
        return resampling(calibration_of_grid(grid, shape), m, devignette=False)

    core = chip(8.2, 8).core
    for other, message in (
        (chip(8.2, 7), "has micro_image_size 7, the resampler 8"),
        (chip(9.9, 8, layout="hexagonal-rows"), "has hexagonal True, the resampler False"),
        (chip(8.2, 8, rotation=20), f"lines; the resampler has {core.lines}"),
    ):
        with pytest.raises(InputError, match=message):
            check_fits(core, other.registers, other.tables)
    narrow = core.model_copy(update={"max_columns": 79})
    with pytest.raises(InputError, match="needs 80 max_columns; the resampler has 79"):
        check_fits(narrow, chip(8.2, 8).registers, Tables())
