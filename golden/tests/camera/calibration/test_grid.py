# SPDX-License-Identifier: Apache-2.0
"""The grid model: indices to pixels and back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plenofir.camera.calibration.grid import Grid, exponents
from plenofir_studies.synthetic import regular_grid

LAYOUTS = ("rectangular", "hexagonal-rows", "hexagonal-columns")
index = st.integers(-40, 40)


@st.composite
def grids(draw) -> Grid:
    layout = draw(st.sampled_from(LAYOUTS))
    pitch = draw(st.floats(3.0, 60.0))
    grid = regular_grid(
        (600, 800),
        pitch,
        rotation_degrees=draw(st.floats(-20, 20)),
        layout=layout,
        offset=(draw(st.floats(-9, 9)), draw(st.floats(-9, 9))),
    )
    order = draw(st.integers(1, 3))
    bend = draw(
        st.lists(
            st.tuples(st.floats(-1, 1), st.floats(-1, 1)),
            min_size=len(exponents(order)) - 3,
            max_size=len(exponents(order)) - 3,
        )
    )
    # Distortion of up to a pixel at 40 lenses from the middle.
    first, *vectors = grid.coefficients
    scaled = tuple((40 * y, 40 * x) for y, x in vectors)
    return Grid(
        layout=layout,
        stagger=draw(st.integers(0, 1)),
        order=order,
        middle=(0.0, 0.0),
        scale=40.0,
        coefficients=(first, *scaled, *bend),
    )


@given(grids(), index, index)
def test_inverse(grid: Grid, t: int, s: int) -> None:
    lattice = grid.lattice(t, s)
    assert grid.inverse(grid.positions(lattice)) == pytest.approx(lattice, abs=1e-7)


@given(grids(), index, index, st.floats(-0.4, 0.4), st.floats(0, 2 * np.pi))
def test_nearest(grid: Grid, t: int, s: int, distance: float, angle: float) -> None:
    offset = distance * min(grid.pitch) * np.array([np.sin(angle), np.cos(angle)])
    found_t, found_s, found = grid.nearest(grid.centres(t, s) + offset)
    assert (found_t, found_s) == (t, s)
    assert found == pytest.approx(offset, abs=1e-6)


@given(grids(), index, index, index, index)
def test_moved(grid: Grid, t: int, s: int, rows: int, columns: int) -> None:
    moved = grid.moved(rows, columns)
    assert moved.centres(t, s) == pytest.approx(grid.centres(t + rows, s + columns), abs=1e-8)


@given(grids(), st.floats(-30, 30), st.floats(-30, 30))
def test_jacobian(grid: Grid, row: float, column: float) -> None:
    lattice, step = np.array([row, column]), 1e-4
    for axis in (0, 1):
        move = step * np.eye(2)[axis]
        slope = (grid.positions(lattice + move) - grid.positions(lattice - move)) / (2 * step)
        assert grid.jacobian(lattice)[axis] == pytest.approx(slope, abs=1e-6)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_pitch_and_rotation(layout) -> None:
    grid = regular_grid((500, 500), 12.5, rotation_degrees=1.5, layout=layout)
    rows, columns = grid.pitch
    assert rows == pytest.approx(12.5 * (np.sqrt(0.75) if layout == "hexagonal-rows" else 1))
    assert columns == pytest.approx(12.5 * (np.sqrt(0.75) if layout == "hexagonal-columns" else 1))
    assert grid.rotation_degrees == pytest.approx(1.5)
    # All neighbours of a hexagonal grid are a pitch away.
    t, s = np.mgrid[-2:3, -2:3]
    away = np.sort(np.linalg.norm(grid.centres(t, s) - grid.centres(0, 0), axis=-1).ravel())
    assert away[1 : 5 if layout == "rectangular" else 7] == pytest.approx(12.5)


@pytest.mark.parametrize("number", [float("nan"), float("inf"), 1e300])
def test_numbers_beyond_all_images(number) -> None:
    grid = regular_grid((500, 500), 12.5)
    with pytest.raises(ValueError, match="finite and within 1e"):
        Grid(**{**grid.model_dump(), "middle": (number, 0.0)})
